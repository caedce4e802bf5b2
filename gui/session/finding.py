"""One step's numbers as the results show them; the analysis room computes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from gui.lanes.axis import number
from tactile_lab.analysis.spike_train import respond
from tactile_lab.quantity import show
from tactile_lab.trial import Outcome

if TYPE_CHECKING:
    from gui.lanes.stored import RunSource


@dataclass(frozen=True, eq=False)
class Finding:
    """What one step gave.

    Attributes:
        label: of the step.
        level: force it is filed under, N.
        spikes: count.
        latency: from onset to the first spike, s.
        peak_rate, final_rate: Hz.
        fall: part by which the rate fell during the hold.
        times: of its spikes, s from the step's start.
        hold: (start, end) of the constant force, s from the step's start.
        start, end: of the step on the run's time axis, s.
    """

    label: str
    level: float | None
    spikes: int
    latency: float | None
    peak_rate: float | None
    final_rate: float | None
    fall: float | None
    times: NDArray[np.float64]
    hold: tuple[float, float] | None
    start: float
    end: float

    def cells(self) -> tuple[str, ...]:
        """One row of the table."""
        return (
            self.label,
            str(self.spikes),
            "—" if self.latency is None else number(self.latency * 1e3, 0),
            "—" if self.peak_rate is None else number(self.peak_rate, 1),
            "—" if self.final_rate is None else number(self.final_rate, 1),
            "—" if self.fall is None else number(100 * self.fall, 0),
        )


def of_outcome(outcome: Outcome) -> Finding | None:
    """What a trial that has just ended gave; None for a pause."""
    trial = outcome.trial
    if trial.pause:
        return None
    end = outcome.start + trial.length
    return finding(
        trial.label, trial.level, outcome.spike_times, trial.hold, outcome.start, end
    )


def finding(
    label: str,
    level: float | None,
    spikes: NDArray[np.float64],
    hold: tuple[float, float] | None,
    start: float,
    end: float,
) -> Finding:
    """What spikes (s from the step's start) say; `start`, `end`: of the step, s."""
    response = respond(spikes, hold=hold)
    return Finding(
        label,
        level,
        response.spikes,
        response.latency,
        response.peak_rate,
        response.final_rate,
        response.fall,
        spikes,
        hold,
        start,
        end,
    )


def of_run(source: RunSource) -> list[Finding]:
    """What each step of a run on disk gave."""
    found = []
    for row, hold in zip(source.trials, source.holds, strict=True):
        if hold.pause:
            continue
        inside = (source.spikes >= hold.start) & (source.spikes < hold.end)
        level = float(row["level"])
        span = (float(row["hold_start"]), float(row["hold_end"]))
        found.append(
            finding(
                hold.label,
                level if level == level else None,
                source.spikes[inside] - hold.start,
                span if span[0] == span[0] else None,
                hold.start,
                hold.end,
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
        str(info.get("coil") or "").partition(" | ")[0],
        f"{show(float(info.get('sample_rate_Hz') or 0), 'S/s')} per channel.",
    ]
    facts.append(loss_text(loss))
    return "<br>".join(fact for fact in facts if fact)


def loss_text(loss: Mapping[str, Any]) -> str:
    """What was lost, as far as it can be told."""
    samples, spikes = loss.get("samples"), loss.get("spikes")
    if samples is None:
        return ""
    also = "" if spikes is None else f", {spikes} spikes"
    covered, streamed = loss.get("covered_s"), loss.get("streamed_s")
    if covered is not None and streamed is not None:
        also = f"; gaps by design, {covered:.4g} of {streamed:.4g} s covered"
    return f"Loss: {samples} samples{also}."
