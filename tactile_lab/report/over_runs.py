"""One number of many runs: a control chart over time, and each specimen."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from tactile_lab.analysis.control_chart import (
    LEAST,
    RUN,
    ControlChart,
    control_chart,
    mean_and_error,
)
from tactile_lab.conclusion import Table
from tactile_lab.errors import ParameterError
from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.quantity import count, plus_minus, show, show_within
from tactile_lab.report.canvas import draw, save
from tactile_lab.report.html import picture, write_page_of_runs

TIMES = {"Days": 86400.0, "Hours": 3600.0, "Minutes": 60.0, "Seconds": 1.0}
"""What runs may be apart in, s: the first of which they span two."""


@dataclass(frozen=True)
class RunValue:
    """One number of one run.

    Attributes:
        run: its name.
        started: when, with zone.
        sensor: noted with it; "" for none.
        value: SI; the mean where the run has several.
        simulated: whether physics was computed.
    """

    run: str
    started: datetime
    sensor: str
    value: float
    simulated: bool


@dataclass(frozen=True, eq=False)
class OverRuns:
    """A key over runs, in order of time.

    Attributes:
        key: what it is called.
        unit: SI.
        points: at least one.
        chart: None where there are too few to say what is usual.
    """

    key: str
    unit: str
    points: tuple[RunValue, ...]
    chart: ControlChart | None

    @classmethod
    def of(cls, key: str, unit: str, points: Sequence[RunValue]) -> OverRuns:
        """The points in order of time, and their chart.

        Raises:
            ParameterError: there is none.
        """
        if not points:
            raise ParameterError(
                f"No run has the number {key}; `runs --keys` lists all."
            )
        ordered = tuple(sorted(points, key=lambda one: (one.started, one.run)))
        enough = len(ordered) >= LEAST
        values = [one.value for one in ordered]
        chart = control_chart(values) if enough else None
        counts = not unit and all(v >= 0 and v.is_integer() for v in values)
        if chart is not None and counts:
            chart = replace(chart, low=max(chart.low, 0.0))
        return cls(key, unit, ordered, chart)

    @property
    def sentences(self) -> list[str]:
        """What it says, for a person."""
        of = count(len(self.points), "run")
        values = [one.value for one in self.points]
        specimens = self._specimens()
        if 1 < len(specimens) < len(values):
            values = [mean_and_error(of_one)[0] for of_one in specimens.values()]
            of = f"over the means of {count(len(values), 'specimen')}, {of}"
        known = plus_minus(*mean_and_error(values), self.unit)
        said = [f"{self.key}: {known} (standard error, {of})."]
        simulated = sum(one.simulated for one in self.points)
        if 0 < simulated < len(self.points):
            said.append(
                f"{simulated} of them are simulated and count as the others: "
                "--where 'simulated = no' leaves them out."
            )
        if self.chart is None:
            return [*said, f"{LEAST} runs or more say what is usual."]
        chart = self.chart
        low, high, *outside = self._told_apart(
            chart.low, chart.high, *(self.points[i].value for i in chart.outside)
        )
        said.append(
            f"Usual is {low} to {high} "
            "(mean ± 2.66 mean moving ranges, Shewhart's chart of single values)."
        )
        for i, told in zip(chart.outside, outside, strict=True):
            said.append(f"{self.points[i].run} lies outside: {told}.")
        if chart.drifting:
            said.append(
                f"{RUN} or more in a row lie on one side of the mean up to "
                f"{self.points[chart.drifting[-1]].run}: it drifts."
            )
        if not (chart.outside or chart.drifting):
            said.append("All lie within, and none drifts.")
        return said

    def _specimens(self) -> dict[str, list[float]]:
        """Values by specimen; a run without one is a specimen of its own."""
        found: dict[str, list[float]] = {}
        for one in self.points:
            found.setdefault(one.sensor or one.run, []).append(one.value)
        return found

    def _told_apart(self, low: float, high: float, *outside: float) -> list[str]:
        """The limits and what lies outside, in digits that tell them apart."""
        for digits in range(4, 18):
            told = [show(value, self.unit, digits) for value in (low, high, *outside)]
            limits = set(told[:2])
            if limits.isdisjoint(told[2:]) and len(limits) == len({low, high}):
                break
        return told

    @property
    def table(self) -> Table:
        """Mean and standard error of each specimen."""
        rows = []
        for sensor in sorted({one.sensor for one in self.points}):
            values = [one.value for one in self.points if one.sensor == sensor]
            mean, error = mean_and_error(values)
            shown = "" if math.isnan(error) else show(error, self.unit)
            told = show_within(mean, error, self.unit)
            rows.append((sensor or "not noted", str(len(values)), told, shown))
        return Table(
            title="Specimens",
            headings=("Sensor", "Runs", f"{self.key}", "Standard error"),
            rows=tuple(rows),
        )

    @property
    def plot(self) -> Plot:
        """Every run, the mean and the limits, against time."""
        first = self.points[0].started
        after = np.array([(p.started - first).total_seconds() for p in self.points])
        name = next((n for n, unit in TIMES.items() if after[-1] >= 2 * unit), "Days")
        times = after / TIMES[name]
        values = np.array([one.value for one in self.points])
        guides: tuple[Guide, ...] = ()
        series = [Series(x=times, y=values, mark="joined")]
        if self.chart is not None:
            guides = (
                Guide(at=self.chart.mean, along="x", text="mean", dashed=False),
                Guide(at=self.chart.low, along="x"),
                Guide(at=self.chart.high, along="x", text="usual up to here"),
            )
            odd = list(self.chart.outside)
            if odd:
                series.append(
                    Series(x=times[odd], y=values[odd], mark="open", colour="V_C1",
                           name="outside")
                )  # fmt: skip
        return Plot(
            name="over_runs",
            caption=f"{self.key} of each run"
            + ("; dashed, the limits of what is usual." if guides else "."),
            x_label=f"{name} since {first:%Y-%m-%d %H:%M}",
            panels=(
                Panel(
                    label=self.key, unit=self.unit, series=tuple(series), guides=guides
                ),
            ),
        )

    def write(self, file: Path) -> None:
        """Write the page.

        Raises:
            OSError: it cannot be written.
        """
        title = f"{self.key} over {count(len(self.points), 'run')}"
        simulated = any(one.simulated for one in self.points)
        drawn = draw(self.plot, title, "", simulated=simulated)
        _, svg = save(drawn, file.with_suffix(""))
        rows = tuple(
            (p.run, f"{p.started:%Y-%m-%d %H:%M}", p.sensor, show(p.value, self.unit))
            for p in self.points
        )
        every = Table(
            title="Runs", headings=("Run", "Started", "Sensor", self.key), rows=rows
        )
        write_page_of_runs(
            file,
            title=title,
            simulated=simulated,
            key={"Runs": str(len(self.points))},
            said=self.sentences,
            drawn=picture(title, self.plot, svg),
            tables=(self.table, every),
        )
