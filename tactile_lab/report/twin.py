"""The model beside a run as its report needs it: computed, told, and drawn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal, cast

import numpy as np

from tactile_lab.analysis.belief import Belief
from tactile_lab.analysis.error_budget import ErrorBudget, budget_line
from tactile_lab.analysis.noise import noise
from tactile_lab.analysis.spike_pairs import Matched
from tactile_lab.analysis.suspects import Explanation, explain
from tactile_lab.analysis.twin import Measured, Residual, Twin, twin
from tactile_lab.analysis.twin_budget import V_C1_budget, spike_time_budget
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import Measurement, RecordedSignal
from tactile_lab.model.temperature import temperature
from tactile_lab.plot import Guide, Mark, Panel, Plot, Series
from tactile_lab.quantity import printed, rounded, show
from tactile_lab.report.run_data import RunData
from tactile_lab.report.splice import ClosedTime

HUMS = 0.3
"""Part of V_C1's residual from which hum is told: less explains nothing of it."""
CHANGED = 0.5
"""A temperature that is read to change by less is one temperature, K."""


@dataclass(frozen=True, eq=False)
class BesideModel:
    """The model beside a run, as a report tells of it.

    Attributes:
        twin: the comparison.
        budgets: what each cause of uncertainty contributes, by what of.
        explanation: what the usual suspects make of it where it misses; else None.
    """

    twin: Twin
    budgets: Mapping[str, ErrorBudget]
    explanation: Explanation | None

    @property
    def budget_line(self) -> str:
        """The error budgets as one line; "" where nothing was compared."""
        return budget_line(self.budgets, "Model (95 %, median over the run)")


def with_twin(run: RunData) -> tuple[RunData, BesideModel | None]:
    """The run with the model's V_C1 among its traces, and the model beside it.

    The model is driven by the applied current's force. None where the run has no
    circuit, no applied current, or nothing to compare.

    Raises:
        SolverError: the model cannot follow this force.
    """
    believed = run.belief
    if believed is None or not run.compared:
        return run, None
    voltages = tuple(
        measured(run, believed, trace)
        for name in ("V_C1", "V_C2")
        if (trace := run.trace(name)) and trace.within_range.any()
    )
    if not voltages and not run.searched:
        return run, None
    pauses = [(t.start, t.start + t.duration) for t in run.trials if t.pause]
    # what fires as the force falls after a run was stopped belongs to no trial
    ended = max((t.start + t.duration for t in run.trials), default=run.duration)
    pauses.append((ended, run.duration))
    found = twin(
        believed.circuit,
        believed.force,
        run.duration,
        voltages=voltages,
        spike_times=run.spike_times if run.searched else None,
        pauses=pauses,
        start=run.start,
        displaced=believed.displaced(),
    )
    budgets = {
        "spike times": spike_time_budget(found, believed),
        "V_C1": V_C1_budget(found, believed),
    }
    beside = BesideModel(
        found,
        {what: budget for what, budget in budgets.items() if budget is not None},
        None
        if believed.circuit.saturation
        else explain(
            believed,
            run.duration,
            V_C1=next((v for v in voltages if v.signal == "V_C1"), None),
            spike_times=run.train,
        ),
    )
    node_a = found.residual("V_C1")
    if node_a is None:
        return run, beside
    model = RecordedSignal(
        signal="V_C1", time=node_a.time, mean=node_a.predicted, source="model"
    )
    return replace(run, traces=(*run.traces, model)), beside


def measured(run: RunData, believed: Belief, trace: RecordedSignal) -> Measured:
    """A recorded voltage as compared: within the run, and within its input's range."""
    inside = (trace.time >= 0) & (trace.time <= run.duration) & trace.within_range
    time, mean = trace.time[inside], trace.mean[inside]
    return Measured(
        trace.signal,
        time,
        mean,
        resolution=trace.code or 0.0,
        offset=believed.offset,
        steps=run.step_bias(trace.signal),
        width=float(np.median(np.diff(trace.time))) if trace.time.size > 1 else 0.0,
    )


def to_dict(beside: BesideModel) -> dict[str, Any]:
    """The budgets and the explanation as plain values."""
    explanation = beside.explanation
    named = None if explanation is None else explanation.cause
    return {
        "error_budget_95": {
            what: budget.plain for what, budget in beside.budgets.items()
        },
        "explanation": None
        if explanation is None
        else {
            "cause": None if named is None else named.name,
            "misfit": explanation.misfit,
            "suspects": [
                {"name": s.name, "size": s.size.to_dict(), "misfit": s.misfit}
                for s in explanation.suspects
            ],
        },
    }


def sentences(beside: BesideModel, run: Measurement) -> tuple[str, ...]:
    """What the twin says, for people."""
    found = beside.twin
    said = [beside.budget_line] if beside.budgets else []
    if run.circuit is not None and run.temperature is not None:
        read = run.temperature[:, 1]
        if read.size and np.ptp(read) > CHANGED:
            said.append(
                f"The sensor's temperature was read from {read.min():.2f} K to "
                f"{read.max():.2f} K; the model stays at "
                f"{temperature(run.circuit):.2f} K, so that it goes astray as far as "
                "that matters."
            )
    if beside.explanation is not None:
        said.append(
            "It misses by more than what is stated allows, all data taken together, "
            "though each may lie within its own tolerance. "
            f"{beside.explanation.text}"
        )
    elif run.circuit is not None and run.circuit.saturation:
        said.append("Where T1 saturates no cause is sought if it misses.")
    for residual in found.residuals:
        shifted, known = "", residual.tolerance
        if residual.signal == "V_C2" and found.spikes is not None:
            shifted = (
                "; while it fires, spikes that come early or late make volts of "
                "difference"
            )
            # times as uncertain as an interval leave open all of its swing, no more
            known = np.minimum(known, np.ptp(residual.predicted))
        # adding 0 makes a rounded -0 plain
        offset = printed(f"{round(residual.offset * 1e3, 1) + 0.0:+.1f}")
        said.append(
            f"{residual.signal}: measured less model is {offset} mV on average, "
            f"{residual.rms * 1e3:.1f} mV rms, within {residual.band * 1e3:.1f} mV for "
            f"95 % of the time; {100 * residual.within:.0f} % lie within their "
            f"tolerance, {_ranging(known * 1e3, 'mV')}{shifted}."
        )
    said += _humming(found.residual("V_C1"))
    if found.spikes is not None:
        text = f"Spikes: {found.spikes.sentence}"
        if np.isfinite(found.spikes.within):
            open_ = found.spikes.tolerance * 1e3
            text += (
                f"; {100 * found.spikes.within:.0f} % of the offsets lie within their "
                f"tolerance, {_ranging(open_, 'ms')}"
            )
        said.append(f"{text}.")
    return tuple(said)


def _humming(node_a: Residual | None) -> list[str]:
    """What the mains put into V_C1, where it is a good part of its residual.

    Bins of a longer run than half a minute are too wide to show it.
    """
    if node_a is None or node_a.time.size < 2:
        return []
    steps = np.diff(node_a.time)
    step = float(np.median(steps))
    gaps = np.flatnonzero(np.abs(steps - step) > step / 2) + 1
    longest = max(np.split(node_a.difference, gaps), key=len)
    try:
        found = noise(longest, step)
    except NotIdentifiableError:
        return []
    return [
        f"V_C1 carries {show(math.sqrt(2) * line.rms / np.sinc(at * step), 'V', 2)} of "
        f"hum of the mains, {at:g} Hz (amplitude), none of the causes that are "
        "tried. `tactile-lab run wiring_check` measures it channel by channel."
        for line in found.lines
        if (at := line.frequency) == line.mains and line.rms > HUMS * found.rms
    ]


def _ranging(tolerance: FloatArray, unit: str) -> str:
    """A tolerance that grows where the force does: its median, and 95 % of it."""
    known = tolerance[np.isfinite(tolerance)]
    if not known.size:
        return "which is not known"
    middle, most = (rounded(float(v)) for v in np.percentile(known, (50, 95)))
    return f"{middle} {unit} (median; 95 % below {most} {unit})"


def twin_plot(run: Measurement, twin: Twin) -> Plot | None:
    """Residual of V_C1, offsets of the spikes, error of the rate; None without any."""
    axis, panels, said = ClosedTime(run), [], []
    node_a, matched = twin.residual("V_C1"), twin.spikes
    if node_a is not None:
        panels.append(_voltage(node_a, axis))
        said.append("V_C1")
    if matched is not None and matched.offsets.size:
        panels += _matched(matched, axis)
        said += ["Times of matched spikes", "Rate 1/ISI"][: len(panels) - len(said)]
    if not panels:
        return None
    parts = " ".join(f"({'abc'[i]}) {text}." for i, text in enumerate(said))
    return Plot(
        name="twin",
        title="measured less model",
        caption="Measured less model, the model driven by the applied current. "
        f"{parts} Shaded: the tolerance, what codes, clocks and what the bench "
        "states of followers, lag, force and temperature leave open (95 %). Triangles: "
        "beyond the panel, line or tolerance.",
        x_label=axis.label,
        x_unit="s",
        x_prefix="",
        x_limits=(axis.begin, axis.end),
        letters=True,
        panels=tuple(
            Panel(
                label=label,
                unit=unit,
                series=series,
                limits=(-most, most),
                guides=(
                    Guide(at=0.0, along="x", dashed=False),
                    *(Guide(at=cut) for cut in axis.cuts),
                ),
                height=1.2,
            )
            for label, unit, series, most in panels
        ),
    )


def _voltage(
    residual: Residual, axis: ClosedTime
) -> tuple[str, str, tuple[Series, ...], float]:
    time, difference, tolerance = axis.spliced(
        residual.time, residual.difference, residual.tolerance
    )
    # single bins at an edge of the force would hide everything else
    most = 1.3 * max(
        float(np.nanpercentile(np.abs(difference), 99.5)),
        float(np.nanmedian(tolerance)),
    )
    series = _tolerated(time, difference, tolerance, "line")
    most = most or 1e-3
    return "V_C1", "V", (*series, *_beyond(time, difference, most, "V_C1")), most


def _beyond(
    time: FloatArray, value: FloatArray, most: float, colour: str
) -> Iterator[Series]:
    """Triangles at the edge of the panel where what is drawn goes on beyond it."""
    for mark, outside in (("up", value > most), ("down", value < -most)):
        at = time[outside]
        if at.size:
            edge = np.full(at.size, most if mark == "up" else -most)
            yield Series(x=at, y=0.94 * edge, mark=cast(Mark, mark), colour=colour)


def _matched(
    matched: Matched, axis: ClosedTime
) -> list[tuple[str, str, tuple[Series, ...], float]]:
    panels = []
    for label, unit, time, value, tolerance in (
        ("Spikes", "s", matched.measured, matched.offsets, matched.tolerance),
        ("Rate", "%", matched.rated, 100 * matched.rate_error,
         100 * matched.rate_tolerance),
    ):  # fmt: skip
        if not value.size:  # one spike has no rate
            continue
        # tolerances grow beyond all bounds where a spike only just comes
        known = tolerance[np.isfinite(tolerance)]
        usual = float(np.median(known)) if known.size else 0.0
        most = 1.2 * max(float(np.max(np.abs(value), initial=0.0)), usual)
        at, most = axis.closed(time), most or 1e-3
        series = _tolerated(at, value, tolerance, "dots")
        cut = _beyond(at, tolerance, most, "model")
        panels.append((label, unit, (*series, *cut), most))
    return panels


def _tolerated(
    time: FloatArray,
    value: FloatArray,
    tolerance: FloatArray,
    mark: Literal["line", "dots"],
) -> tuple[Series, ...]:
    """The tolerance either side of 0, and what lies within it or beyond."""
    around: Any = {"low": -tolerance, "high": tolerance}
    if mark == "dots":
        return (Series(x=time, y=value, mark=mark, **around),)
    band = Series(x=time, mark="band", colour="model", **around)
    return band, Series(x=time, y=value, mark=mark, colour="V_C1")
