"""Several runs on one page: what each found, rate against force, each specimen."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from tactile_lab.analysis.control_chart import mean_and_error
from tactile_lab.analysis.estimate import student_95
from tactile_lab.conclusion import Table
from tactile_lab.errors import ParameterError
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import count, show, show_within
from tactile_lab.report.canvas import draw, save
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.html import picture, write_page_of_runs
from tactile_lab.report.results import results
from tactile_lab.signals import DAGGER, NO_COUNT
from tactile_lab.store.catalogue import summary
from tactile_lab.store.facts import Fact, grouped, of_results
from tactile_lab.store.progress import Progress, each, nothing, share
from tactile_lab.store.summary import RunSummary

PAGE = "runs.html"
COLOURS = ("V_C1", "rate", "V_K", "force", "V_C2", "ink")
"""Of the specimens' curves; more begin again."""
OF_A_FORCE = frozenset({"peak_rate", "first_spike"})
"""Numbers that depend on the forces of a run: drawn against them, not averaged."""
MOST_KEYS = 12
"""Most numbers that a table of runs has columns for."""


@dataclass(frozen=True, eq=False)
class OneOfSeveral:
    """What one run found.

    Attributes:
        entry: what it says of itself.
        rates: force of each trial, N, and its highest rate, Hz; NaN below two spikes.
        numbers: that were concluded or measured, by key.
    """

    entry: RunSummary
    rates: tuple[tuple[float, float], ...]
    numbers: dict[str, list[Fact]]

    @property
    def spikes(self) -> str:
        """How many were found; empty where they were not looked for."""
        found, mark = self.entry.spikes, DAGGER if self.entry.uncounted else ""
        return "" if found is None else f"{found}{mark}"

    @property
    def specimen(self) -> str:
        """The sensor that was noted; the run itself where none was."""
        return self.entry.sensor or self.entry.name

    def mean(self, key: str) -> float:
        """Of a number's values in this run; NaN where it has none."""
        values = [f.number for f in self.numbers.get(key, ()) if f.number is not None]
        return sum(values) / len(values) if values else math.nan


@dataclass(frozen=True, eq=False)
class SeveralRuns:
    """Runs side by side.

    Attributes:
        runs: at least two, in the order asked for.
    """

    runs: tuple[OneOfSeveral, ...]

    @classmethod
    def of(cls, folders: Sequence[Path], progress: Progress = nothing) -> SeveralRuns:
        """Read the runs in these folders.

        Raises:
            ParameterError: one is named twice.
            RunFolderError: not a run, or one without data.
        """
        places = [folder.resolve() for folder in folders]
        twice = next((p for p in places if places.count(p) > 1), None)
        if twice is not None:
            raise ParameterError(
                f"{twice.name} is named twice; it would count twice. Name it once."
            )
        found = (_read(folder, part) for folder, part in each(folders, progress))
        return cls(tuple(found))

    @property
    def specimens(self) -> dict[str, list[OneOfSeveral]]:
        """Runs by specimen, in order of its name."""
        found: dict[str, list[OneOfSeveral]] = {}
        for run in sorted(self.runs, key=lambda one: one.specimen):
            found.setdefault(run.specimen, []).append(run)
        return found

    @property
    def keys(self) -> dict[str, str]:
        """Numbers that at least two runs have, the most frequent first: their units."""
        units: dict[str, str] = {}
        often: dict[str, int] = {}
        for run in self.runs:
            for key, facts in run.numbers.items():
                units[key] = facts[0].unit
                often[key] = often.get(key, 0) + 1
        kept = sorted(
            (k for k in often.keys() - OF_A_FORCE if often[k] > 1),
            key=lambda k: (-often[k], k),
        )
        return {key: units[key] for key in kept[:MOST_KEYS]}

    @property
    def sentences(self) -> list[str]:
        """What is side by side."""
        many = count(len(self.specimens), "specimen")
        said = [f"{count(len(self.runs), 'run')} of {many}."]
        unnamed = sum(not run.entry.sensor for run in self.runs)
        if unnamed:
            said.append(
                f"{unnamed} of them note no sensor and count as a specimen each: "
                "--note sensor=S1 names it."
            )
        simulated = sum(bool(run.entry.simulated) for run in self.runs)
        if 0 < simulated < len(self.runs):
            said.append(f"{simulated} of them are simulated and count as the others.")
        ended = [r.entry.name for r in self.runs if r.entry.status != "complete"]
        if ended:
            said.append(
                f"Not complete: {', '.join(ended)}. No mean is of a trial that was cut "
                "short."
            )
        return said

    @property
    def table(self) -> Table:
        """What each run found; the mean where it has several values."""
        keys = self.keys
        rows = []
        for run in self.runs:
            told = (_shown(run.mean(key), unit) for key, unit in keys.items())
            rows.append((run.entry.name, run.entry.sensor, run.spikes, *told))
        note = (
            "Of a number that a run has several times, such as at each force, the mean."
        )
        if any(run.entry.uncounted for run in self.runs):
            note += f" {NO_COUNT}"
        return Table(
            title="Runs",
            headings=("Run", "Sensor", "Spikes", *keys),
            rows=tuple(rows),
            note=note,
        )

    @property
    def by_specimen(self) -> Table:
        """Mean and standard error of each specimen, and of all of them."""
        rows = []
        for key, unit in self.keys.items():
            means = []
            for name, runs in self.specimens.items():
                values = _known(run.mean(key) for run in runs)
                if values:
                    mean, error = mean_and_error(values)
                    means.append(mean)
                    told = _pair(mean, error, unit)
                    rows.append((key, name, str(len(values)), *told))
            if len(means) > 1:
                mean, error = mean_and_error(means)
                of = count(len(means), "specimen")
                rows.append((key, f"all {of}", "", *_pair(mean, error, unit)))
        return Table(
            title="Specimens",
            headings=("", "Specimen", "Runs", "Mean", "Standard error"),
            rows=tuple(rows),
            note="The standard error of a specimen is over its runs, that of all over "
            "the specimens' means: runs of one specimen are no specimens.",
        )

    @property
    def plot(self) -> Plot | None:
        """Rate against force of each specimen; None where no trial has both."""
        series = []
        for number, (name, runs) in enumerate(self._curves().items()):
            points = list(_against_force(runs))
            if not points:
                continue
            level, mean, half = np.array(points).T
            series.append(
                Series(
                    x=level,
                    y=mean,
                    y_error=half if np.isfinite(half).any() else None,
                    name=name,
                    mark="joined",
                    colour=COLOURS[number % len(COLOURS)],
                )
            )
        if not series:
            return None
        return Plot(
            name="rate_force_of_runs",
            caption="Highest rate of each force, mean over a specimen's runs of one "
            "protocol; bars are 95 % intervals of the mean (Student) where there are "
            "several runs. Trials with fewer than two spikes have no rate.",
            x_label="Force",
            x_unit="N",
            panels=(
                Panel(
                    label="Highest rate",
                    unit="Hz",
                    prefix="",
                    series=tuple(series),
                    limits=(0.0, None),
                ),
            ),
        )

    def _curves(self) -> dict[str, list[OneOfSeveral]]:
        """Runs of a specimen by protocol: the rate depends on how a force comes on."""
        protocols = {run.entry.protocol for run in self.runs}
        found: dict[str, list[OneOfSeveral]] = {}
        for name, runs in self.specimens.items():
            for run in runs:
                of = f", {run.entry.protocol}" if len(protocols) > 1 else ""
                found.setdefault(f"{name}{of}", []).append(run)
        return found

    def write(
        self, folder: Path, *, pdf: bool = False, progress: Progress = nothing
    ) -> Path:
        """Write the page and its figure into `folder`; the page.

        Raises:
            OSError: the folder cannot be written.
        """
        title = f"{count(len(self.runs), 'run')} side by side"
        simulated = any(run.entry.simulated for run in self.runs)
        folder.mkdir(parents=True, exist_ok=True)
        drawn = None
        if (plot := self.plot) is not None:
            figure = draw(plot, title, "", simulated=simulated)
            drawn = picture(title, plot, save(figure, folder / plot.name, pdf=pdf)[1])
        progress(0.8)
        write_page_of_runs(
            folder / PAGE,
            title=title,
            simulated=simulated,
            key={"Runs": str(len(self.runs)), "Specimens": str(len(self.specimens))},
            said=self.sentences,
            drawn=drawn,
            tables=(self.by_specimen, self.table),
        )
        return folder / PAGE

    def to_dict(self) -> dict[str, Any]:
        """For machines, SI."""
        return {
            run.entry.name: {
                "sensor": run.entry.sensor,
                "rates": [
                    {"force_N": force, "rate_Hz": None if math.isnan(rate) else rate}
                    for force, rate in run.rates
                ],
                "numbers": {
                    key: {"values": [f.number for f in facts], "unit": facts[0].unit}
                    for key, facts in run.numbers.items()
                },
            }
            for run in self.runs
        }


def _read(folder: Path, progress: Progress) -> OneOfSeveral:
    told = results(find(read(folder, share(progress, 0.0, 0.5))))
    progress(1.0)
    whole = [trial for trial in told["trials"] if trial["complete"]]
    rates = tuple(
        (trial["level_N"], math.nan if rate is None else rate)
        for trial in whole
        if trial["level_N"] is not None
        for rate in (trial["peak_rate_Hz"],)
    )
    # runs of older versions do not say so themselves
    uncounted = any(trial["uncounted"] for trial in told["trials"])
    entry = replace(summary(folder), uncounted=uncounted)
    return OneOfSeveral(entry, rates, grouped(of_results(told)))


def _against_force(
    runs: Sequence[OneOfSeveral],
) -> Iterator[tuple[float, float, float]]:
    """Force, mean rate over the runs and half of its 95 % interval, NaN of one run."""
    for level in sorted({force for run in runs for force, _ in run.rates}):
        of_runs = (
            _known(rate for force, rate in run.rates if force == level) for run in runs
        )
        means = [sum(rates) / len(rates) for rates in of_runs if rates]
        if means:
            mean, error = mean_and_error(means)
            half = student_95(len(means) - 1) * error if len(means) > 1 else math.nan
            yield level, mean, half


def _known(values: Iterable[float]) -> list[float]:
    return [value for value in values if math.isfinite(value)]


def _pair(mean: float, error: float, unit: str) -> tuple[str, str]:
    return show_within(mean, error, unit), _shown(error, unit)


def _shown(value: float, unit: str) -> str:
    return "" if math.isnan(value) else show(value, unit)
