"""The general plot of a run, in the manner of the paper's Fig. 4a-c and 5a, b.

Force, voltages, drain current, spike train and instantaneous rate on one time axis;
panels without a recorded signal are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.measurement import MeasuredTrial, Measurement, RecordedSignal
from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.quantity import show
from tactile_lab.report.splice import ClosedTime

FloatArray = NDArray[np.float64]

SHARP = {"V_C2", "V_K"}
"""Signals that jump within a bin: their extremes are the trace, not their mean."""
DRAWN_BINS = 1600
"""More bins than a printed column can show only swell the file."""


def overview(run: Measurement) -> Plot:
    """Describe the whole run, recoveries left out."""
    axis = ClosedTime(run)
    panels = [_force(run, axis)]
    said = ["Force"]
    voltages = [t for name in ("V_C1", "V_C2") if (t := run.trace(name))]
    if voltages:
        panels.append(_voltages(run, voltages, axis))
        said.append(
            "Voltages: mean and, shaded, the extremes within each bin; dotted: the "
            "model driven by the applied current"
        )
    if drain := run.trace("I_DS"):
        panels.append(_drain(run, drain, axis))
        said.append("Drain current")
    if run.searched or run.spike_times.size:
        panels.append(_spikes(run, axis))
        said.append(
            "Spikes as detected (ticks) and the instantaneous rate 1/ISI (dots)"
        )
    marks = (*_holds(run, axis), *(Guide(at=cut) for cut in axis.cuts))
    parts = [f"({'abcd'[i]}) {text}." for i, text in enumerate(said)]
    return Plot(
        name="figure",
        caption=" ".join([*parts, "Grey bands: holds."]),
        x_label="Time, recoveries left out at dotted lines" if axis.cuts else "Time",
        x_unit="s",
        x_prefix="",
        x_limits=(0.0, axis.end),
        letters=True,
        panels=tuple(
            Panel(**{**vars(panel), "guides": (*marks, *panel.guides)})
            for panel in panels
        ),
    )


def _holds(run: Measurement, axis: ClosedTime) -> list[Guide]:
    held = [t.held for t in run.trials if t.held is not None and not t.pause]
    return [Guide(at=axis.at(a), to=axis.at(b), colour="band") for a, b in held]


def overranges(signals: list[RecordedSignal], axis: ClosedTime) -> list[Guide]:
    """Bands where a signal left its channel's range; the first says so."""
    return [
        Guide(
            at=axis.at(start),
            to=axis.at(end),
            colour=signal.signal,
            text="" if number else f"{signal.signal} over range",
        )
        for signal in signals
        for number, (start, end) in enumerate(signal.overrange)
    ]


def _force(run: Measurement, axis: ClosedTime) -> Panel:
    time = axis.closed(np.append(run.force.time, max(run.duration, run.force.end)))
    force = np.append(run.force.value, run.force.value[-1])
    low = high = None
    if run.force_uncertainty is not None:
        # only where there is a force: at rest its zero is a definition
        known = np.where(force == 0, 0.0, run.force_uncertainty.of(force))
        low, high = force - known, force + known
    pushed = [
        (t.level, t.held, t.label)
        for t in run.trials
        if t.level is not None and t.held is not None and not t.pause
    ]
    tops = [
        level + math.copysign(run.uncertain(level) or 0.0, level)
        for level, _, _ in pushed
    ]
    least, most = min(0.0, float(force.min())), max(0.0, float(force.max()))
    span = (most - least) or 1e-3
    return Panel(
        label="Force",
        unit="N",
        prefix="m",
        series=(
            Series(x=time, y=force, mark="filled", colour="force", low=low, high=high),
            Series(
                x=[axis.at(sum(held) / 2) for _, held, _ in pushed],
                y=tops,
                mark="text",
                colour="force",
                texts=tuple(label for _, _, label in pushed),
            ),
        ),
        limits=(least - (0.22 if least < 0 else 0) * span, most + 0.26 * span),
        height=1.15,
    )


def _voltages(
    run: Measurement, signals: list[RecordedSignal], axis: ClosedTime
) -> Panel:
    model, guides = run.trace("V_C1", model=True), []
    if run.circuit is not None and not run.force.value.any():
        # without force, what matters is how far the sensor is from firing
        at = run.circuit.critical_V_C1
        text = f"fires below {show(at, 'V')}"
        guides.append(Guide(at=at, along="x", text=text, colour="V_C1"))
    guides += overranges(signals, axis)
    series = [_series(s, axis, name=s.signal) for s in signals]
    if model is not None:
        time, mean = axis.spliced(model.time, model.mean)
        look: Any = {"mark": "dotted", "colour": "model"}
        series.append(Series(x=time, y=mean, name="V_C1 of the model", **look))
    least = min(float(np.min(s.mean)) for s in signals if s.mean.size)
    floor = 0.0 if len(signals) > 1 and least >= 0 else None
    return Panel(
        label="Voltage",
        unit="V",
        series=tuple(series),
        guides=tuple(guides),
        limits=(floor, None),
        height=1.9,
    )


def _drain(run: Measurement, signal: RecordedSignal, axis: ClosedTime) -> Panel:
    derived = signal.source == "derived"
    seen = run.trace("V_C1") if derived else signal
    return Panel(
        label="I_DS",
        unit="A",
        guides=tuple(overranges([seen] if seen else [], axis)),
        series=(_series(signal, axis),),
        limits=(min(0.0, float(signal.mean.min()) * 1.05), None),
        note="from V_C1, Eq. (16)" if derived else "",
        height=0.95,
    )


def _series(signal: RecordedSignal, axis: ClosedTime, name: str = "") -> Series:
    """A signal with its extremes; gaps stay open."""
    low = signal.mean if signal.low is None else signal.low
    high = signal.mean if signal.high is None else signal.high
    time, mean, low, high = axis.spliced(signal.time, signal.mean, low, high)
    together = -(-time.size // DRAWN_BINS)
    time, mean = _binned(time, together, np.mean), _binned(mean, together, np.mean)
    shaded = signal.low is not None
    return Series(
        x=time,
        y=mean,
        name=name,
        mark="range" if shaded and signal.signal in SHARP else "line",
        colour=signal.signal,
        low=_binned(low, together, np.min) if shaded else None,
        high=_binned(high, together, np.max) if shaded else None,
    )


def _binned(
    values: FloatArray, together: int, how: Callable[..., FloatArray]
) -> FloatArray:
    """Every `together` neighbours as one; the last few on their own."""
    whole = values.size // together * together
    cells = how(values[:whole].reshape(-1, together), axis=1)
    if whole == values.size:
        return cells
    return np.append(cells, how(values[whole:]))


def _spikes(run: Measurement, axis: ClosedTime) -> Panel:
    trials = run.results
    starts = [axis.at(t.start) for t in trials]
    spikes = [t.spike_times + at for t, at in zip(trials, starts, strict=True)]
    at, rates, highest = _rates(spikes)
    fits = [
        _fit(t, start)
        for t, start in zip(trials, starts, strict=True)
        if t.adaptation is not None
    ]
    count = sum(times.size for times in spikes)
    note = f"{count} spikes (ticks), instantaneous rate 1/ISI (dots)"
    if fits:
        note += ", fit α exp(βt) + γ (dashed)"
    return Panel(
        label="Rate",
        unit="Hz",
        prefix="",
        series=(
            Series(x=np.concatenate([*spikes, []]), mark="ticks", colour="V_K"),
            Series(x=at, y=rates, mark="steps"),
            Series(x=at, y=rates, mark="dots"),
            *fits,
        ),
        limits=(0.0, highest / 0.78 if highest else 1.0),
        note=note,
        height=1.75,
    )


def _rates(spikes: list[FloatArray]) -> tuple[FloatArray, FloatArray, float]:
    """Times and instantaneous rates, NaN between trains, and the highest rate."""
    trains = [times for times in spikes if times.size > 1]
    at = np.concatenate(
        [np.append(times[1:], np.nan) for times in trains] or [np.empty(0)]
    )
    rates = np.concatenate(
        [np.append(1 / np.diff(t), np.nan) for t in trains] or [np.empty(0)]
    )
    return at, rates, float(np.nanmax(rates)) if trains else 0.0


def _fit(trial: MeasuredTrial, start: float) -> Series:
    assert trial.adaptation is not None
    held, rate = trial.adaptation.drawn
    return Series(x=held + start, y=rate, mark="dashed", colour="ink")
