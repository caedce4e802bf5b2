"""A profile that the sensor is drawn over at each of some speeds."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.analysis.phase_locking import LOCKED, strongest_frequency
from tactile_lab.analysis.spike_train import within
from tactile_lab.arrays import FloatArray
from tactile_lab.columns import read_columns
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion, Table
from tactile_lab.errors import NotIdentifiableError, SceneError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, Unit, plus_minus, show
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.stimulus.indentation import balanced, on_indentation, turned_over
from tactile_lab.trial import Trial, Trials

Length = Annotated[float, Unit("m", above=0.0)]
Speed = Annotated[float, Unit("m/s", above=0.0)]
PushForce = Annotated[float, Unit("N", above=0.0)]

SEARCHED = 0.5, 1.6
"""Between which parts of the expected frequency the spikes' own is looked for: not at
its double, which repeats as well."""


class Texture(ForceProtocol):
    """A grating, or a profile of your own, scanned at each of some speeds.

    The force is what the profile would give a sensor that moves over it: the force at
    position x comes at the time x / speed. Half of the scans begin half a period
    farther on: see `turned_over`.
    """

    name: ClassVar[str] = "texture"
    title: ClassVar[str] = "Texture"
    accuracy: ClassVar[float] = 0.03

    base: Force = Field(default=0.2, description="Force the sensor is pressed on with")
    depth: PushForce = Field(
        default=0.08, description="Of the grating: half of ridge less groove"
    )
    period: Length = Field(default=2e-3, description="Of the grating")
    file: str = Field(
        default="",
        description="CSV with columns position_m,force_N instead of the grating; it "
        "repeats itself over its length",
    )
    speeds: tuple[Speed, ...] = Field(
        default=(0.01, 0.02, 0.04), min_length=1, description="Of the scan"
    )
    passes: int = Field(default=6, ge=1, le=1000, description="Scans at each speed")
    down: Duration = Field(default=0.1, description="Time down, and up again")
    lasts: Duration = Field(
        default=0.8, title="Duration", description="Time of one scan"
    )
    rest: Pause = Field(default=2.0, description="Time at no force after each")

    def presentations(self) -> Trials:
        """All scans at one speed, then those at the next."""
        for speed in self.speeds:
            forces = [
                on_indentation(
                    self.base,
                    partial(self._passing, speed, begin),
                    down=self.down,
                    lasts=self.lasts,
                    rest=self.rest,
                    highest=speed / self._length * self._details,
                )
                for begin in (0.0, self._length / 2)
            ]
            for number in range(self.passes):
                force, hold = forces[turned_over(number)]
                label = f"{show(speed, 'm/s')}"
                yield Trial(force=force, label=label, hold=hold)

    def _begins(self, number: int) -> float:
        """Where on the profile the scan of that number, from 0, begins, m."""
        return self._length / 2 if turned_over(number) else 0.0

    def _passing(self, speed: float, begin: float, time: FloatArray) -> FloatArray:
        return self.profile(begin + speed * time)

    def profile(self, position: FloatArray) -> FloatArray:
        """Force above the base, N, at positions, m."""
        if not self.file:
            return np.asarray(self.depth * np.sin(2 * np.pi * position / self.period))
        at, force = read_profile(Path(self.file))
        return np.asarray(np.interp(position % at[-1], at, force))

    @property
    def _length(self) -> float:
        """After which the profile repeats itself, m."""
        return float(read_profile(Path(self.file))[0][-1]) if self.file else self.period

    @property
    def _details(self) -> int:
        """How often the profile changes in that length: a fourth of its rows."""
        rows = read_profile(Path(self.file))[0].size if self.file else 4
        return max(1, rows // 4)

    def located(self, folder: Any) -> Texture:
        """The same with `file` found relative to `folder`, and read once to check it.

        Raises:
            SceneError: the file is missing or not such a table.
        """
        if not self.file:
            return self
        path = (Path(folder) / self.file).resolve()
        read_profile(path)
        return self.model_copy(update={"file": str(path)})

    def conclude(self, run: Measurement) -> Conclusion:
        """The frequency in the spikes at each speed, and the period that it means."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        rows, values, missing = [], [], []
        told: dict[bool, list[str]] = {True: [], False: []}
        for speed, scans in self._scans(run).items():
            expected = speed / self._length
            pairs = balanced((begin > 0, (begin, trial)) for begin, trial in scans)
            spikes = sum(self._spikes(t).size for _, t in pairs)
            try:
                found = self.frequency(run, pairs, expected)
            except NotIdentifiableError as why:
                missing.append(f"No period at {show(speed, 'm/s')}: {why}.")
                continue
            half = 0.5 / self._scanned(scans)
            period = speed / found
            told[abs(found - expected) <= half].append(show(speed, "m/s"))
            rows.append(
                (
                    show(speed, "m/s"),
                    str(spikes),
                    plus_minus(found, half, "Hz"),
                    f"{expected:.3g} Hz",
                    plus_minus(period, period * half / found, "m"),
                )
            )
            values.append(
                {
                    "speed_m_per_s": speed,
                    "spikes": spikes,
                    "frequency_Hz": found,
                    "frequency_half_width_Hz": half,
                    "expected_Hz": expected,
                    "period_m": period,
                }
            )
        if not rows:
            return Conclusion(missing=tuple(missing) or ("No scan was completed.",))
        table = Table(
            headings=("Speed", "Spikes", "In the spikes", "Profile", "Period"),
            rows=tuple(rows),
            note="In the spikes: the frequency at which they repeat themselves most, "
            "looked for between half and 1.6 times the profile's (p < 0.01); ± is the "
            "resolution of one scan's length.",
        )
        length = show(self._length, "m", 3)
        said = []
        if told[True]:
            said.append(
                f"The spikes tell the profile's period of {length} at "
                f"{', '.join(told[True])}."
            )
        if told[False]:
            said.append(
                f"At {', '.join(told[False])} they repeat themselves otherwise than "
                "the profile: the sensor's own rhythm begins with each scan, too."
            )
        return Conclusion(tuple(said), {"texture": values}, tuple(missing), (table,))

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Spikes of every scan against the position on the profile, by speed."""
        found = self._scans(run)
        if not any(self._spikes(t).size for scans in found.values() for _, t in scans):
            return
        panels = []
        for speed, scans in found.items():
            x, y = [], []
            for number, (begin, trial) in enumerate(scans, start=1):
                times = self._spikes(trial)
                x += (begin + (times - self.down) * speed).tolist()
                y += [float(number)] * times.size
            panels.append(
                Panel(
                    label="Scan",
                    series=(Series(x=x, y=y, mark="dots"),),
                    limits=(0.5, len(scans) + 0.5),
                    whole=True,
                    note=show(speed, "m/s"),
                    height=1.3,
                )
            )
        yield Plot(
            name="summary",
            title="spikes along the profile",
            caption="Every spike of every scan, at the position that the sensor would "
            f"be over; the profile repeats itself every {show(self._length, 'm', 3)}.",
            x_label="Position",
            x_unit="m",
            panels=tuple(panels),
        )

    def frequency(
        self,
        run: Measurement,
        scans: list[tuple[float, MeasuredTrial]],
        expected: float,
    ) -> float:
        """At which the spikes of some scans repeat themselves most, Hz.

        All count from the profile's beginning, where `expected`, Hz, is its frequency.

        Raises:
            NotIdentifiableError: too few spikes, or none that chance does not give.
        """
        if not scans:
            raise NotIdentifiableError(
                "the sensor's own rhythm cancels out in scans of both beginnings "
                "alone, and there are of one"
            )
        low, high = (part * expected for part in SEARCHED)
        passed = expected * self._length
        spikes = [
            self._spikes(trial) - self._landed(run, trial) + begin / passed
            for begin, trial in scans
        ]
        found, chance = strongest_frequency(spikes, low, high, self._scanned(scans))
        if chance >= LOCKED:
            raise NotIdentifiableError(
                f"the spikes of all scans together repeat themselves at no frequency "
                f"more than chance would have it (p = {chance:.2g})"
            )
        return found

    def _landed(self, run: Measurement, trial: MeasuredTrial) -> float:
        """When half the base was reached, s from the trial's start: scans begin so."""
        time = trial.start + np.linspace(-0.05, self.down + 0.05, 4000)
        past = np.abs(run.force.at(time)) >= abs(self.base) / 2
        return float(time[np.argmax(past)] - trial.start) if past.any() else 0.0

    def _scans(
        self, run: Measurement
    ) -> dict[float, list[tuple[float, MeasuredTrial]]]:
        """Completed scans by speed, each with where on the profile it began, m."""
        found: dict[float, list[tuple[float, MeasuredTrial]]] = {}
        known = {show(speed, "m/s"): speed for speed in self.speeds}
        for trial in run.results:
            if trial.label in known and trial.hold is not None and trial.complete:
                scans = found.setdefault(known[trial.label], [])
                scans.append((self._begins(len(scans) % self.passes), trial))
        return found

    def _spikes(self, trial: MeasuredTrial) -> FloatArray:
        """Spikes while the profile acts in full, s from the trial's start."""
        return within(trial.spike_times, trial.hold)

    def _scanned(self, scans: list[tuple[float, MeasuredTrial]]) -> float:
        """Time for which the profile acts in full, s."""
        start, end = scans[0][1].hold or (0.0, 0.0)
        return end - start


def read_profile(path: Path) -> tuple[FloatArray, FloatArray]:
    """Positions, m from 0, and forces, N, of a CSV with ``position_m,force_N``.

    Raises:
        SceneError: not such a table, or positions that do not rise; the line is named.
    """
    _, rows, lines = read_columns(path, (("position_m", "force_N"),))
    if len(rows) < 2:
        raise SceneError(f"{path}: a profile needs two rows or more.")
    back = np.flatnonzero(np.diff(rows[:, 0]) <= 0)
    if back.size:
        i = int(back[0]) + 1
        raise SceneError(
            f"{path}, line {lines[i]}: position {rows[i, 0]:g} m follows "
            f"{rows[i - 1, 0]:g} m; positions must rise."
        )
    return rows[:, 0] - rows[0, 0], rows[:, 1]
