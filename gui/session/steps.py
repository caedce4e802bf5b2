"""What the steps of a run gave, as the results show it; `measurement` computes it."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from gui.plots.numbers import number
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.quantity import show
from tactile_lab.store.applied_trial import begun, stood
from tactile_lab.trial import Outcome
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource


def cells(step: MeasuredTrial) -> tuple[str, ...]:
    """One row of the table of steps."""
    found = step.response
    return (
        step.name,
        step.seen,
        "—" if found.latency is None else number(found.latency * 1e3, 0),
        "—" if found.peak_rate is None else number(found.peak_rate, 1),
        "—" if found.final_rate is None else number(found.final_rate, 1),
        "—" if found.fall is None else number(100 * found.fall, 0),
    )


def of_outcome(outcome: Outcome, uncounted: str = "") -> MeasuredTrial | None:
    """What a trial that has just ended gave; None for a pause.

    Args:
        outcome: of the trial.
        uncounted: why its spikes are not all counted; "" where they are.
    """
    trial = outcome.trial
    if trial.pause:
        return None
    onset, hold = _applied(outcome)
    return MeasuredTrial(
        label=trial.label,
        level=trial.level,
        start=outcome.start,
        duration=trial.length,
        spike_times=outcome.spike_times,
        onset=onset,
        hold=hold,
        uncounted=uncounted,
        skipped=outcome.skipped,
    )


def _applied(
    outcome: Outcome,
) -> tuple[float | None, tuple[float, float] | None]:
    """When its current began to change, and (start, end) of its hold, s from its start.

    None where it never changed, and without a hold.
    """
    trial, length = outcome.trial, outcome.trial.length
    onset, hold = trial.onset, trial.hold
    if not len(outcome.current):
        return onset, hold
    current = Waveform.stairs(outcome.current, length)
    if onset is not None:
        onset = begun(onset, current, 0.0, length)
    return onset, stood(hold, trial.level, current, current, 0.0, length)


def of_run(source: RunSource) -> list[MeasuredTrial]:
    """What each step of a run on disk gave."""
    found = []
    rows = zip(
        source.trials, source.holds, source.onsets, source.uncounted, strict=True
    )
    for row, hold, onset, uncounted in rows:
        if hold.pause:
            continue
        inside = (source.spikes >= hold.start) & (source.spikes < hold.end)
        level = float(row["level"])
        held = hold.held and (hold.held[0] - hold.start, hold.held[1] - hold.start)
        found.append(
            MeasuredTrial(
                label=hold.label,
                level=level if level == level else None,
                start=hold.start,
                duration=hold.end - hold.start,
                spike_times=source.spikes[inside] - hold.start,
                onset=onset,
                hold=held,
                complete=bool(row["complete"]),
                uncounted=uncounted,
                skipped=int(row["skipped"]),
            )
        )
    return found


def facts_of(source: RunSource) -> str:
    """Statements on a run as a whole, as rich text."""
    info = source.info
    loss = info.get("loss") or {}
    sim = "simulated" if source.simulated else "measured"
    facts = [
        f"<b>{source.path.name}</b> · {sim}",
        html.escape(str(info.get("reason") or "")),
        str(info.get("coil") or "").partition(" | ")[0],
    ]
    if source.sampled:
        rate = float(info.get("sample_rate_Hz") or 0)
        facts += [f"{show(rate, 'S/s')} per channel.", loss_text(loss)]
    return "<br>".join(fact for fact in facts if fact)


def loss_text(loss: Mapping[str, Any]) -> str:
    """What was lost, as far as it can be told."""
    samples, spikes = loss.get("samples"), loss.get("spikes")
    if samples is None:
        return ""
    if loss.get("produced") == 0:
        return "Loss: no samples were kept."
    also = "" if spikes is None else f", {spikes} spikes"
    covered, streamed = loss.get("covered_s"), loss.get("streamed_s")
    if covered is not None and streamed is not None:
        also = f"; gaps by design, {covered:.4g} of {streamed:.4g} s covered"
    return f"Loss: {samples} samples{also}."
