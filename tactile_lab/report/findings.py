"""The numbers a run gives, per trial, each with the reason where there is none."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from tactile_lab.analysis.twin import ELSEWHERE, Twin
from tactile_lab.errors import TactileLabError
from tactile_lab.model.drain_current import drain_current
from tactile_lab.report.conclusion import Conclusion
from tactile_lab.report.conclusions import conclude
from tactile_lab.report.run_data import RunData, Trace, TrialData
from tactile_lab.report.trial_finding import TrialFinding
from tactile_lab.report.twinned import with_twin


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """A run with its numbers.

    Attributes:
        run: the run, with I_DS among its traces where it can be derived.
        trials: one finding per trial that is no pause.
        notes: statements on derived quantities, one sentence each.
        missing: what could not be told, and why, one sentence each.
        conclusion: what the protocol was run for.
        twin: the model beside the run, or None.
    """

    run: RunData
    trials: tuple[TrialFinding, ...]
    notes: tuple[str, ...]
    missing: tuple[str, ...]
    conclusion: Conclusion
    twin: Twin | None


def find(run: RunData) -> Findings:
    """Compute a run's numbers.

    Too few spikes, uneven traces or a force that the model cannot follow give a
    statement, never an error: what can be told is told.
    """
    notes: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    beside = None
    if run.protocol not in ELSEWHERE:
        run, beside, notes, missing = _derived(run)
    trials = tuple(TrialFinding.of(trial) for trial in _shown(run.trials))
    try:
        conclusion = conclude(run, trials)
    except TactileLabError as reason:
        conclusion = Conclusion(missing=(f"No conclusion: {reason}",))
    return Findings(
        run=run,
        trials=trials,
        notes=notes,
        missing=(*conclusion.missing, *missing),
        conclusion=conclusion,
        twin=beside,
    )


def _derived(
    run: RunData,
) -> tuple[RunData, Twin | None, tuple[str, ...], tuple[str, ...]]:
    """The run with I_DS and the model beside it, what to say of them, what failed."""
    notes: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    beside = None
    try:
        run, notes = _with_drain_current(run)
    except TactileLabError as reason:
        missing = (f"No I_DS: {reason}",)
    try:
        run, beside = with_twin(run)
    except TactileLabError as reason:
        missing = (*missing, f"No model beside the run: {reason}")
    return run, beside, notes, missing


def _shown(trials: Sequence[TrialData]) -> list[TrialData]:
    """Trials with something to say: no pauses, no silent looks at the rest."""
    played = [trial for trial in trials if not trial.pause]
    telling = [
        trial
        for trial in played
        if trial.level is not None or trial.hold is not None or trial.spike_times.size
    ]
    return telling or played


def _with_drain_current(run: RunData) -> tuple[RunData, tuple[str, ...]]:
    """The run with I_DS derived piecewise from V_C1, gap by gap, and what to say."""
    measured = run.trace("V_C1")
    if run.trace("I_DS") is not None or measured is None:
        return run, ()
    pieces = [
        drain_current(measured.time[piece], measured.mean[piece], run.divider)
        for piece in stretches(measured.time)
        if piece.stop - piece.start >= 3
    ]
    if not pieces:
        return run, ()
    derived = Trace(
        signal="I_DS",
        time=np.concatenate([p.time for p in pieces]),
        mean=np.concatenate([p.current for p in pieces]),
        source="derived",
    )
    bandwidth = min(p.bandwidth for p in pieces)
    averaged = max(p.averaged for p in pieces)
    note = (
        f"I_DS is derived from V_C1 by Eq. (16), averaged over {averaged * 1e3:.0f} "
        f"ms: it follows changes up to {bandwidth:.0f} Hz (−3 dB)."
    )
    return replace(run, traces=(*run.traces, derived)), (note,)


def stretches(time: np.ndarray) -> list[slice]:
    """Runs of points without a gap: no step above 1.5 times the median step."""
    if time.size == 0:
        return []
    step = np.diff(time)
    if step.size == 0:
        return [slice(0, 1)]
    breaks = np.flatnonzero(step > 1.5 * np.median(step)) + 1
    edges = [0, *breaks.tolist(), time.size]
    return [slice(a, b) for a, b in pairwise(edges)]
