"""Touches with onsets from slow to fast: what the sensor makes of the speed alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.analysis.spike_train import within
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion, Table
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, plus_minus, show
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.stimulus.indentation import fall, rise
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform

LOW, HIGH = 0.1, 0.9
"""Parts of the force between which an onset's time is taken."""


@dataclass(frozen=True)
class Touched:
    """One touch.

    Attributes:
        asked: onset asked for, s.
        took: time from 10 % to 90 % of the force as applied, s.
        latency: from half the force to the first spike, s; None without one.
        timing: half of the band in which half the force is dated, s, 95 %.
        spikes: during onset and hold.
        fastest: rate of the shortest interval, Hz; None below two spikes.
    """

    asked: float
    took: float
    latency: float | None
    timing: float
    spikes: int
    fastest: float | None


class Touch(ForceProtocol):
    """Touches of the same force whose onsets last from milliseconds to tenths.

    Only a source that keeps time by itself follows it: see `[coil] way`.
    """

    name: ClassVar[str] = "touch"
    title: ClassVar[str] = "Touch"
    accuracy: ClassVar[float] = 0.02

    level: Force = Field(default=0.16, description="Force of each touch")
    onsets: tuple[Duration, ...] = Field(
        default=(0.008, 0.02, 0.05, 0.1),
        min_length=1,
        description="Times in which the force comes",
    )
    repeats: int = Field(default=3, ge=1, le=1000, description="Touches of each onset")
    hold: Duration = Field(default=0.5, description="Time at the level")
    release: Duration = Field(default=0.1, description="Time in which it goes")
    rest: Pause = Field(default=2.0, description="Time at no force after each")

    def presentations(self) -> Trials:
        """All touches of one onset, then those of the next."""
        for onset in self.onsets:
            held = Waveform.through([(0.0, self.level), (self.hold, self.level)])
            force = rise(self.level, onset).then(held)
            force = force.then(fall(self.level, self.release))
            if self.rest > 0:
                force = force.then(Waveform.through([(0.0, 0.0), (self.rest, 0.0)]))
            for _ in range(self.repeats):
                yield Trial(
                    force=force,
                    label=f"in {show(onset, 's')}",
                    level=self.level,
                    hold=(onset, onset + self.hold),
                )

    def conclude(self, run: Measurement) -> Conclusion:
        """Latency, spikes and rate for each onset, each touch by itself."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        found = self.touches(run)
        if not found:
            return Conclusion(missing=("No touch was completed.",))
        stated = "lags" if run.lag_uncertainty else "lags of the force not stated"
        timed = "" if run.clock_uncertainty is None else f" (95 %: clocks, {stated})"
        rows = tuple(self._row(onset, found) for onset in self.onsets)
        answered = [one for one in found if one.latency is not None]
        said: tuple[str, ...] = ()
        if answered:
            first = min(answered, key=lambda one: one.latency or 0.0)
            latency = plus_minus(first.latency or 0.0, first.timing, "s")
            said = (
                f"The shortest latency is {latency} after half the force{timed}, at an "
                f"onset of {show(first.asked, 's')}.",
            )
        values = [
            {
                "onset_s": one.asked,
                "onset_10_90_s": one.took,
                "latency_s": one.latency,
                "latency_uncertainty_s_95": one.timing or None,
                "spikes": one.spikes,
                "fastest_Hz": one.fastest,
            }
            for one in found
        ]
        missing = () if answered else ("No touch made a spike.",)
        return Conclusion(said, {"touches": values}, missing, (self._table(rows),))

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Latency and fastest rate against the onset as it was applied."""
        found = [one for one in self.touches(run) if one.latency is not None]
        if not found:
            return
        paired = [one for one in found if one.fastest is not None]
        yield Plot(
            name="summary",
            title="onset",
            caption="Each touch by itself, against the time its force took from 10 % "
            "to 90 % as applied: time from half the force to the first spike, and the "
            "rate of its shortest interval.",
            x_label="Onset",
            x_unit="s",
            x_log=True,
            panels=(
                Panel(
                    label="Latency",
                    unit="s",
                    series=(
                        Series(
                            x=[one.took for one in found],
                            y=[one.latency or 0.0 for one in found],
                            y_error=[one.timing for one in found],
                            mark="points", colour="V_C1",
                        ),
                    ),
                    height=1.8,
                ),
                Panel(
                    label="Fastest rate",
                    unit="Hz",
                    series=(
                        Series(
                            x=[one.took for one in paired],
                            y=[one.fastest or 0.0 for one in paired],
                            mark="points",
                        ),
                    ),
                    limits=(0, None),
                    height=1.55,
                ),
            ),
        )  # fmt: skip

    def touches(self, run: Measurement) -> list[Touched]:
        """Every completed touch, in order."""
        asked = {f"in {show(onset, 's')}": onset for onset in self.onsets}
        return [
            _touched(run, trial, asked[trial.label], trial.hold)
            for trial in run.results
            if trial.label in asked and trial.complete and trial.hold is not None
        ]

    def _row(self, onset: float, found: list[Touched]) -> tuple[str, ...]:
        these = [one for one in found if one.asked == onset]
        latencies = [one.latency for one in these if one.latency is not None]
        rates = [one.fastest for one in these if one.fastest is not None]
        took = np.array([one.took for one in these])
        return (
            show(onset, "s"),
            show(float(np.median(took)), "s", 3) if took.size else "–",
            _range([float(one.spikes) for one in these], ""),
            _range(latencies, "s"),
            _range(rates, "Hz"),
        )

    def _table(self, rows: tuple[tuple[str, ...], ...]) -> Table:
        return Table(
            headings=("Onset", "10 to 90 %", "Spikes", "Latency", "Fastest rate"),
            rows=rows,
            note="Least to largest of the touches. Latency: from half the force as "
            "applied to the first spike; spikes: from there to the end of the hold, "
            "those of the release left out.",
        )


def _touched(
    run: Measurement, trial: MeasuredTrial, asked: float, hold: tuple[float, float]
) -> Touched:
    """One touch, its times taken from the force that was applied."""
    aligned = run.clock_uncertainty
    time = trial.start + np.linspace(-0.05, hold[0] + 0.1, 8000)
    level = float(run.force.at(trial.start + (hold[0] + hold[1]) / 2))
    low, half, high = (
        _reached(run.force, time, part * level) for part in (LOW, 0.5, HIGH)
    )
    near = half + np.linspace(-2 * asked - 0.05, asked + 0.05, 500)
    onset = Waveform(near, run.force.at(near))
    late = _reached(run.late(onset), near, 0.5 * level)
    late -= _reached(onset, near, 0.5 * level)
    spikes = within(trial.spike_times, (half - trial.start, hold[1]))
    return Touched(
        asked=asked,
        took=high - low,
        latency=float(spikes[0] + trial.start - half) if spikes.size else None,
        timing=math.hypot(aligned, late) if aligned else 0.0,
        spikes=int(spikes.size),
        fastest=float(1 / np.diff(spikes).min()) if spikes.size > 1 else None,
    )


def _reached(force: Waveform, time: FloatArray, level: float) -> float:
    """When it first comes as far as `level`, N, to either side, s."""
    size = np.abs(force.at(time))
    after = max(int(np.argmax(size >= abs(level))), 1)
    pair = slice(after - 1, after + 1)
    return float(np.interp(abs(level), size[pair], time[pair]))


def _range(values: list[float], unit: str) -> str:
    """Least to largest."""
    if not values:
        return "–"
    low, high = min(values), max(values)
    if low == high:
        return show(low, unit, 3) if unit else f"{low:g}"
    if not unit:
        return f"{low:g} to {high:g}"
    return f"{show(low, unit, 3)} to {show(high, unit, 3)}"
