"""What a run tells: its derived signals, its conclusion, its plots, and why not."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from tactile_lab.analysis.carried_over import Begun, carried_over
from tactile_lab.conclusion import Conclusion
from tactile_lab.errors import ParameterError, TactileLabError
from tactile_lab.measurement import MeasuredTrial, RecordedSignal
from tactile_lab.model.drain_current import drain_currents
from tactile_lab.plot import Plot
from tactile_lab.quantity import show
from tactile_lab.report.drift import drift_plot
from tactile_lab.report.overview import overview
from tactile_lab.report.run_data import RunData
from tactile_lab.report.twin import BesideModel, twin_plot, with_twin
from tactile_lab.stimulus.force import force_at_zero

ARRIVED = 0.01
"""Part of a trial's force to which the force applied has to come to be it."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """A run with what it tells.

    Attributes:
        run: the run, with I_DS and the model's V_C1 among its traces where they are
            known.
        notes: statements on derived quantities, one sentence each.
        missing: what could not be told, and why, one sentence each.
        conclusion: what the protocol was run for.
        answers: the protocol's own plots.
        beside: the model beside the run, or None.
    """

    run: RunData
    notes: tuple[str, ...]
    missing: tuple[str, ...]
    conclusion: Conclusion
    answers: tuple[Plot, ...]
    beside: BesideModel | None

    @property
    def plots(self) -> tuple[Plot, ...]:
        """All plots: the protocol's own, the general one, the model, the drift."""
        general = () if any(p.name == "figure" for p in self.answers) else (
            overview(self.run),
        )  # fmt: skip
        beside = self.beside
        twin = None if beside is None else twin_plot(self.run, beside.twin)
        further = (p for p in (twin, drift_plot(self.run)) if p is not None)
        return (*self.answers, *general, *further)

    @property
    def budget_lines(self) -> tuple[str, ...]:
        """What the numbers rest on: those of the protocol, those of the model."""
        model = "" if self.beside is None else self.beside.budget_line
        return tuple(filter(None, (self.conclusion.budget_line, model)))


def find(run: RunData) -> Findings:
    """What a run tells.

    Too few spikes, uneven traces, a force that the model cannot follow or a protocol
    that fails give a statement, never an error: what can be told is told.
    """
    notes: tuple[str, ...] = ()
    missing: list[str] = []
    beside = None
    if not run.protocol.moves_probes:
        try:
            run, notes = _with_drain_current(run)
        except TactileLabError as reason:
            missing.append(f"No I_DS: {reason}")
        try:
            run, beside = with_twin(run)
        except TactileLabError as reason:
            missing.append(f"No model beside the run: {reason}")
    # a trial that was cut short is told and drawn, but nothing is concluded from it
    complete = replace(run, trials=tuple(t for t in run.trials if t.complete))
    whole, why_not = complete, "completed"
    if complete.results and run.protocol.counts and "spikes" in run.protocol.signals:
        # nor from one whose spikes are not all counted, where it is about them
        counted = tuple(t for t in complete.trials if not t.uncounted)
        whole, why_not = replace(complete, trials=counted), "counted whole"
    conclusion = (
        _conclusion(whole, f"No trial was {why_not}: nothing is concluded.")
        + force_at_zero(complete)
        + _carried_over(complete)
    )
    answers: tuple[Plot, ...] = ()
    try:
        answers = tuple(run.protocol.plots(whole))
        for plot in answers:
            if not isinstance(plot, Plot):
                kind = type(plot).__name__
                raise TypeError(f"plots gave {kind}; yield a Plot")
            plot.to_dict()  # what cannot be described is not drawn either
    except (Exception, SystemExit) as error:  # of the user's own; the rest is kept
        missing.append(f"No plot of the answer: {run.protocol.fault(error)}")
        answers = ()
    return Findings(
        run=run,
        notes=notes,
        missing=(
            *conclusion.missing,
            *_cut_short(run),
            *_fell_short(complete),
            *_uncounted(run),
            *missing,
        ),
        conclusion=conclusion,
        answers=answers,
        beside=beside,
    )


def _conclusion(run: RunData, without: str) -> Conclusion:
    """What the protocol concludes; `without` where there is no trial to do it from."""
    if not run.results:
        return Conclusion(missing=(without,))
    try:
        own = run.protocol.conclude(run)
        if not isinstance(own, Conclusion):
            kind = type(run.protocol).__name__
            raise TypeError(f"{kind}.conclude gave {own!r}; return a Conclusion")
        own.plain  # noqa: B018 - what cannot be stored is no conclusion
    except (Exception, SystemExit) as error:  # of the user's own
        return Conclusion(missing=(f"No conclusion: {run.protocol.fault(error)}",))
    return own


def _carried_over(run: RunData) -> Conclusion:
    """Which trials did not begin from rest, by the force that was applied."""
    if run.circuit is None:
        return Conclusion()
    levels = [Begun(t.label, t.start, t.level) for t in run.results if t.level]
    said = carried_over(run.circuit, run.force, levels)
    return Conclusion() if said is None else Conclusion((said,))


def _cut_short(run: RunData) -> tuple[str, ...]:
    """What the numbers of a trial that did not come to its end are of."""
    cut = [trial.label for trial in run.results if not trial.complete]
    if not cut:
        return ()
    return (
        f"Cut short: {', '.join(cut)}. The protocol concludes and draws nothing from "
        "it; its row, its fits and the model beside it are of the part before the "
        "run ended.",
    )


def _fell_short(run: RunData) -> tuple[str, ...]:
    """Which trials are filed under a force that never was there."""
    came = [(trial, _nearest(run, trial)) for trial in run.results if trial.level]
    told = [
        f"{trial.label} to {show(at, 'N', 3)}"
        for trial, at in came
        if abs(at - (trial.level or 0.0)) > ARRIVED * abs(trial.level or 0.0)
    ]
    if not told:
        return ()
    return (
        f"The force did not get there: {', '.join(told)} at the nearest, while the "
        "source's slew, its set-points and the lags held it back. What stands beside "
        "that force is of less: let it come slower, or hold it longer.",
    )


def _nearest(run: RunData, trial: MeasuredTrial) -> float:
    """The force applied in a trial that was nearest to its level, N."""
    start, end = trial.start, trial.start + trial.duration
    time, level = run.force.time, trial.level or 0.0
    points = run.force.value[(time >= start) & (time <= end)]
    applied = np.append(points, run.force.at([start, end]))
    return float(applied[np.argmin(np.abs(applied - level))])


def _uncounted(run: RunData) -> tuple[str, ...]:
    """Which trials have no numbers from spikes but how many were seen, and why."""
    found: dict[str, list[str]] = {}
    for trial in run.results:
        if trial.uncounted:
            found.setdefault(trial.uncounted, []).append(trial.label)
    return tuple(
        f"No latency, rate or fit of {', '.join(labels)}: {why}."
        for why, labels in found.items()
    )


def _with_drain_current(run: RunData) -> tuple[RunData, tuple[str, ...]]:
    """The run with I_DS derived from V_C1, stretch by stretch, and what to say."""
    measured = run.trace("V_C1")
    if not run.asks_I_DS or run.trace("I_DS") is not None or measured is None:
        return run, ()
    pieces = drain_currents(measured.time, measured.mean, run.circuit)
    if not pieces:
        raise ParameterError("V_C1 has nowhere three points that are evenly spaced.")
    derived = RecordedSignal(
        signal="I_DS",
        time=np.concatenate([p.time for p in pieces]),
        mean=np.concatenate([p.current for p in pieces]),
        source="derived",
        overrange=measured.overrange,
    )
    bandwidth = min(p.bandwidth for p in pieces)
    averaged = max(p.averaged for p in pieces)
    note = (
        f"I_DS is derived from V_C1 by Eq. (16), averaged over {averaged * 1e3:.0f} "
        f"ms: it follows changes up to {bandwidth:.0f} Hz (−3 dB)."
    )
    return replace(run, traces=(*run.traces, derived)), (note,)
