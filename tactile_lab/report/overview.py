"""The general plot of a run, in the manner of the paper's Fig. 4a-c and 5a, b.

Force, voltages, drain current, spike train and instantaneous rate on one time axis;
panels without a recorded signal are left out.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from tactile_lab.analysis.adaptation import Adaptation
from tactile_lab.arrays import FloatArray
from tactile_lab.measurement import Measurement, RecordedSignal
from tactile_lab.plot import Guide, Panel, Plot, Series, spike_train
from tactile_lab.quantity import show
from tactile_lab.report.splice import ClosedTime
from tactile_lab.spikes.rate import rates_between
from tactile_lab.trace import Trace
from tactile_lab.waveform import Waveform

SHARP = {"V_C2", "V_K"}
"""Signals that jump within a bin: their extremes are the trace, not their mean."""
DRAWN_BINS = 1600
"""More bins, or columns with corners, than can be printed only swell the file."""
AT_ONCE = 1 << 14
"""Points of the force that are looked at at once."""

Told = tuple[Panel, str]
"""A panel, and what its caption says of it."""


def overview(run: Measurement) -> Plot:
    """Describe the whole run, recoveries left out."""
    axis = ClosedTime(run)
    told = [_force(run, axis)]
    voltages = [t for name in ("V_C1", "V_C2") if (t := run.trace(name))]
    if voltages:
        told.append(_voltages(run, voltages, axis))
    if drain := run.trace("I_DS"):
        told.append(_drain(run, drain, axis))
    if spiking := run.trace("V_K"):
        told.append(_potential(spiking, axis))
    if run.searched or run.spike_times.size:
        told += _spikes(run, axis)
    holds = _holds(run, axis)
    marks = (*holds, *(Guide(at=cut) for cut in axis.cuts))
    parts = [f"({'abcdef'[i]}) {text}." for i, (_, text) in enumerate(told)]
    ends = " Grey bands: holds, from when the applied force was there." if holds else ""
    return Plot(
        name="figure",
        caption=" ".join(parts) + ends,
        x_label=axis.label,
        x_unit="s",
        x_prefix="",
        x_limits=(axis.begin, axis.end),
        letters=True,
        panels=tuple(
            Panel(**{**vars(panel), "guides": (*marks, *panel.guides)})
            for panel, _ in told
        ),
    )


def _holds(run: Measurement, axis: ClosedTime) -> list[Guide]:
    """Bands from when the force applied reached a hold's level to when it left it."""
    found = []
    for trial in run.trials:
        if trial.held is not None and not trial.pause:
            begin, over = axis.at(trial.held[0]), axis.at(trial.held[1])
            found.append(Guide(at=begin, to=over, colour="band"))
    return found


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


def _force(run: Measurement, axis: ClosedTime) -> Told:
    time, force = _outline(run.force, axis)
    time = np.append(time, axis.at(max(run.duration, run.force.end)))
    force = np.append(force, run.force.value[-1])
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
    panel = Panel(
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
    text = "Force by the current that flowed, the lags of coil and core included"
    if run.current is not None and len(run.current) > 2:
        steps = "points of the waveform played" if run.listed else "source's set-points"
        text += f"; its steps are the {steps}"
    return panel, text


def _outline(force: Waveform, axis: ClosedTime) -> tuple[FloatArray, FloatArray]:
    """The corners of a line that can be seen, on the closed axis, s and N."""
    corners = []
    for piece in force.pieces(AT_ONCE):
        part = (piece.end - piece.start) / (force.end - force.start or 1.0)
        line = Trace.line(axis.closed(piece.time), piece.value)
        corners.append(line.corners(max(1, round(part * DRAWN_BINS))))
    time, value = zip(*((each.time, each.mean) for each in corners), strict=True)
    return np.concatenate(time), np.concatenate(value)


def _voltages(
    run: Measurement, signals: list[RecordedSignal], axis: ClosedTime
) -> Told:
    model, guides = run.trace("V_C1", model=True), []
    if run.circuit is not None and not run.force.value.any():
        # without force, what matters is how far the sensor is from firing
        at = run.circuit.critical_V_C1
        text = f"fires below {show(at, 'V')}"
        # clear of V_C1 on either side of it
        lies = next((s.mean[-1] for s in signals if s.signal == "V_C1"), at)
        guides.append(
            Guide(at=at, along="x", text=text, colour="V_C1", above=bool(lies < at))
        )
    guides += overranges(signals, axis)
    series = [_series(s, axis, name=s.signal) for s in signals]
    if model is not None:
        time, mean = axis.spliced(model.time, model.mean)
        look: Any = {"mark": "dotted", "colour": "model"}
        series.append(Series(x=time, y=mean, name="V_C1 of the model", **look))
    least = min(float(np.min(s.mean)) for s in signals if s.mean.size)
    floor = 0.0 if len(signals) > 1 and least >= 0 else None
    panel = Panel(
        label="Voltage",
        unit="V",
        series=tuple(series),
        guides=tuple(guides),
        limits=(floor, None),
        height=1.9,
    )
    text = "Voltages: mean and, shaded, the extremes within each bin"
    if model is not None:
        text += "; dotted: the model driven by the applied current"
    return panel, text


def _drain(run: Measurement, signal: RecordedSignal, axis: ClosedTime) -> Told:
    derived = signal.source == "derived"
    seen = run.trace("V_C1") if derived else signal
    panel = Panel(
        label="I_DS",
        unit="A",
        guides=tuple(overranges([seen] if seen else [], axis)),
        series=(_series(signal, axis),),
        limits=(min(0.0, float(signal.mean.min()) * 1.05), None),
        height=0.95,
    )
    return panel, "Drain current" + (", from V_C1 by Eq. (16)" if derived else "")


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


def _potential(signal: RecordedSignal, axis: ClosedTime) -> Told:
    panel = Panel(
        label="V_K",
        unit="V",
        series=(_series(signal, axis),),
        guides=tuple(overranges([signal], axis)),
        limits=(min(0.0, float(np.min(signal.mean))), None),
        height=0.7,
    )
    return panel, "V_K: the extremes within each bin"


def _spikes(run: Measurement, axis: ClosedTime) -> list[Told]:
    """The spike train in a lane of its own, and the rate where there is one."""
    trials = run.results
    starts = [axis.at(t.start) for t in trials]
    spikes = [t.spike_times + at for t, at in zip(trials, starts, strict=True)]
    looked = [(at, at + t.duration) for t, at in zip(trials, starts, strict=True)]
    every = np.concatenate([*spikes, []])
    panel, said = spike_train(every, axis.begin, axis.end, looked)
    if any(t.uncounted for t in trials):
        said += " that were seen, no count of those there were"
    train = panel, said
    at, rates = _rates(
        [times for t, times in zip(trials, spikes, strict=True) if not t.uncounted]
    )
    if not rates.size:
        return [train]
    fits = [
        _fit(t.adaptation, start)
        for t, start in zip(trials, starts, strict=True)
        if t.adaptation is not None
    ]
    text = "Instantaneous rate 1/ISI, each in the middle of its interval"
    if fits:
        text += "; dashed: fit α exp(βt) + γ"
    panel = Panel(
        label="Rate",
        unit="Hz",
        prefix="",
        series=(Series(x=at, y=rates, mark="dots"), *fits),
        limits=(0.0, 1.08 * float(np.nanmax(rates))),
        height=1.5,
    )
    return [train, (panel, text)]


def _rates(spikes: list[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """Middles of all trains' intervals and their rates, one train after another."""
    found = [rates_between(times) for times in (*spikes, np.empty(0))]
    at, rates = zip(*found, strict=True)
    return np.concatenate(at), np.concatenate(rates)


def _fit(fit: Adaptation, start: float) -> Series:
    held, rate = fit.drawn
    return Series(x=held + start, y=rate, mark="dashed", colour="ink")
