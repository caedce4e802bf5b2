"""What the steps so far say together, beside what the model says. No Qt here.

The analysis room computes; this arranges. Fits take tens of milliseconds: call `fit`
away from the window's thread.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from gui.lanes.lane import BAND
from gui.lanes.source import Source
from gui.plots.numbers import number
from tactile_lab.analysis.adaptation import fit_adaptation
from tactile_lab.analysis.rate_force import onset, slopes
from tactile_lab.analysis.spike_pairs import match
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.quantity import printed
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    from tactile_lab.engine.engine import Engine

COLUMNS = 2000
"""Columns in which voltages are compared with the model's, which has finer ones."""

RATES = 12
"""Newest steps whose law is drawn."""

ONSET, SLOPE = "Onset", "Slope of the peak rate"
ADAPTATION, FALL = "Adaptation 1/|β|", "Fall in the hold"
CARDS = (ONSET, SLOPE, ADAPTATION, FALL)

NONE_FIRED = "no step that ended has fired"
SILENT = f"{NONE_FIRED.capitalize()}."
"""Said also beside spikes of one that goes on, or that a fault ended."""

UNENDED = "no step was completed: nothing is concluded"

FULL = 0.1
"""Relative error at which a bar is full."""

FULL_TIME = 20e-3
"""Offset of spikes at which a bar is full, s."""


@dataclass(frozen=True)
class Agreement:
    """How well the model follows: measured V_C1 less the model's, root mean square.

    Attributes:
        error: over the range that was measured (NRMSE).
        rms: V.
    """

    error: float
    rms: float

    @property
    def text(self) -> str:
        """The NRMSE as a percentage."""
        return f"{100 * self.error:.1f} %"

    @property
    def in_step(self) -> bool:
        """Whether the residual stays within its band, by and large."""
        return self.rms <= BAND


@dataclass(frozen=True)
class Card:
    """One fitted number.

    Attributes:
        name: of the quantity.
        value: with its unit; "—" where it cannot be told.
        detail: its uncertainty, or why there is none.
        model: the model's value, "" without one.
    """

    name: str
    value: str
    detail: str
    model: str = ""


@dataclass(frozen=True)
class Bar:
    """How far one signal is from the model.

    Attributes:
        signal: names it and its colour.
        name: for people.
        share: length of the bar, 0 to 1.
        text: the number.
    """

    signal: str
    name: str
    share: float
    text: str


@dataclass(frozen=True, eq=False)
class FittedRate:
    """The exponential law alpha exp(beta t) + gamma as it was fitted to one hold.

    Attributes:
        step: start of its step, s on the run's axis.
        law: Hz, on the run's axis, up to the last spike of the hold.
    """

    step: float
    law: Trace


@dataclass(frozen=True, eq=False)
class FitInput:
    """Measured and modelled signals of the run so far, taken at one instant."""

    spikes: FloatArray
    twin_spikes: FloatArray
    voltages: dict[str, tuple[Trace, Trace]]


@dataclass(frozen=True, eq=False)
class Fit:
    """What the steps say together, and how far the run is from the model.

    Attributes:
        cards: fitted numbers.
        bars: one per signal.
        model: the model's steps as (force N, peak rate Hz).
        agreement: of V_C1; None where it was not measured or not modelled.
        rates: the law of the rate in each of the newest holds that let it be told.
    """

    cards: tuple[Card, ...]
    bars: tuple[Bar, ...]
    model: tuple[tuple[float, float], ...]
    agreement: Agreement | None
    rates: tuple[FittedRate, ...] = ()


def fit_input(source: Source) -> FitInput:
    """What `fit` compares; cheap, and called where the source may be read."""
    reach = source.sampled_until
    twin = source.twin_spikes
    return FitInput(
        source.spikes.copy(),
        twin[twin < reach],
        {
            name: (
                source.trace(name, 0.0, reach, COLUMNS),
                source.twin(name, 0.0, reach, 4 * COLUMNS),
            )
            for name in ("V_C1", "V_C2")
        },
    )


def fit_steps(engine: Engine, steps: tuple[MeasuredTrial, ...], seen: FitInput) -> Fit:
    """Fit steps, and compare what was seen with the model; in the engine."""
    return fit(steps, seen)


def fit(findings: Sequence[MeasuredTrial], seen: FitInput) -> Fit:
    """Fit the steps so far, and compare the run with the model.

    Of a step that was cut short nothing is concluded, as in the report.
    """
    levelled = [f for f in findings if f.level is not None]
    steps = [f for f in levelled if f.complete]
    modelled = levelled if _has_model(seen) else []
    model = [_modelled(f, seen.twin_spikes) for f in modelled]
    cards: tuple[Card, ...] = ()
    missed = next((f.uncounted for f in findings if f.uncounted), "")
    why_not = missed or ("" if steps else UNENDED)
    if why_not:
        cards = tuple(Card(name, "—", _capital(why_not)) for name in CARDS if levelled)
    else:
        theirs = [f for f in model if f.complete]
        cards = (
            _card(ONSET, _onset, steps, theirs),
            _card(SLOPE, _slope, steps, theirs),
            _adaptation(steps, theirs),
            _fall(steps, theirs),
        )
    points = tuple((f.level or 0.0, f.response.rates[0]) for f in model)
    apart = {
        signal: found
        for signal, (measured, model_) in seen.voltages.items()
        if (found := _agreement(measured, model_)) is not None
    }
    bars = [
        Bar(signal, signal, min(found.error / FULL, 1.0), found.text)
        for signal, found in apart.items()
    ]
    if not missed:
        bars += _spikes(seen)
    return Fit(cards, tuple(bars), points, apart.get("V_C1"), tuple(_rates(steps)))


def _rates(steps: Sequence[MeasuredTrial]) -> Iterator[FittedRate]:
    for step in steps[-RATES:]:
        if step.hold is None or step.uncounted:
            continue
        try:
            law = fit_adaptation(step.spike_times, step.hold)
        except NotIdentifiableError:
            continue  # the card says why of the newest
        time, rate = law.drawn
        yield FittedRate(step.start, Trace.line(step.start + time, rate))


def _has_model(seen: FitInput) -> bool:
    return bool(seen.twin_spikes.size) or any(
        not model.empty for _, model in seen.voltages.values()
    )


def _modelled(step: MeasuredTrial, spikes: FloatArray) -> MeasuredTrial:
    end = step.start + step.duration
    inside = spikes[(spikes >= step.start) & (spikes < end)] - step.start
    return replace(step, spike_times=inside, uncounted="")


def _card(
    name: str,
    how: Callable[[Sequence[MeasuredTrial]], tuple[str, str]],
    steps: Sequence[MeasuredTrial],
    model: Sequence[MeasuredTrial],
) -> Card:
    try:
        value, spread = how(steps)
    except NotIdentifiableError as reason:
        return Card(name, "—", _capital(str(reason)))
    beside = ""
    if model:
        try:
            beside = f"model {how(model)[0]}"
        except NotIdentifiableError:
            beside = "model: none"
    return Card(name, value, spread, beside)


def _onset(steps: Sequence[MeasuredTrial]) -> tuple[str, str]:
    spikes = [f.response.spikes for f in steps]
    if not any(spikes):  # one that was cut short may have, and is seen beside it
        raise NotIdentifiableError(NONE_FIRED)
    found = onset([f.level or 0.0 for f in steps], spikes)
    low, high = found.silent * 1e3, found.fires * 1e3
    return f"{number(found.middle * 1e3, 0)} mN", printed(f"{low:.4g} to {high:.4g} mN")


def _slope(steps: Sequence[MeasuredTrial]) -> tuple[str, str]:
    rated = [f for f in steps if f.response.peak_rate is not None]
    found = slopes(
        [f.level or 0.0 for f in rated], [f.response.peak_rate or 0.0 for f in rated]
    )
    low, high = (number(float(v) / 1e3, 3) for v in (found.min(), found.max()))
    middle = number(float(np.median(found)) / 1e3, 3)
    return f"{middle} Hz/mN", f"{low} to {high}"


def _adaptation(steps: Sequence[MeasuredTrial], model: Sequence[MeasuredTrial]) -> Card:
    """Of the newest step that lets it be told."""
    name, why = ADAPTATION, SILENT
    for at in range(len(steps) - 1, -1, -1):
        step = steps[at]
        if step.hold is None or not step.response.spikes:
            continue
        try:
            found = fit_adaptation(step.spike_times, step.hold).time_constant
        except NotIdentifiableError as reason:
            why = _capital(str(reason)) if why == SILENT else why
            continue
        value, _, span = found.text("s").partition(" (")
        span = f"{span.removesuffix(', 95 %)')} {_where(step)}"
        beside = ""
        try:
            own = fit_adaptation(model[at].spike_times, step.hold) if model else None
            if own is not None:
                beside = f"model {own.time_constant.value:.2g} s"
        except NotIdentifiableError:
            beside = "model: none"
        return Card(name, value, span, beside)
    return Card(name, "—", why)


def _fall(steps: Sequence[MeasuredTrial], model: Sequence[MeasuredTrial]) -> Card:
    """Of the largest force that fired."""
    fell = [at for at, step in enumerate(steps) if step.response.fall is not None]
    if not fell:
        return Card(FALL, "—", "No step that ended fired often enough.")
    at = max(fell, key=lambda number_: steps[number_].level or 0.0)
    text = _where(steps[at])
    theirs = model[at].response.fall if model else None
    beside = "" if theirs is None else f"model {100 * theirs:.0f} %"
    value = f"{100 * (steps[at].response.fall or 0.0):.0f} %"
    return Card(FALL, value, text, beside)


def _where(step: MeasuredTrial) -> str:
    """Where a number is of: at 150 mN, but in 8 ms as that stands."""
    amount = step.label.lstrip("−-")[:1].isdigit()
    return f"at {step.label}" if amount else step.label


def _agreement(measured: Trace, model: Trace) -> Agreement | None:
    """How well the model follows one voltage, over the range that was measured."""
    rest, extent = measured.residual(model), measured.extent
    if rest.empty or extent is None or extent[1] <= extent[0]:
        return None
    rms = float(np.sqrt(np.mean(rest.mean**2)))
    return Agreement(rms / (extent[1] - extent[0]), rms)


def _spikes(seen: FitInput) -> list[Bar]:
    if not (seen.spikes.size and seen.twin_spikes.size):
        return []
    found = match(seen.spikes, seen.twin_spikes)
    if not found.offsets.size:
        return [Bar("spikes", "Spikes", 1.0, "none matched")]
    off = float(np.median(np.abs(found.offsets)))
    many = f"{found.offsets.size} of {seen.spikes.size}"
    text = f"{1e3 * off:.1f} ms · {many}"
    return [Bar("spikes", "Spikes", min(off / FULL_TIME, 1.0), text)]


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}.".replace("|beta|", "|β|")
