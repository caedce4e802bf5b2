"""The short table of a run: for the terminal as text, for the report as cells."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass

from tactile_lab.quantity import show
from tactile_lab.report.findings import Findings
from tactile_lab.report.run_data import RunData
from tactile_lab.report.trial_finding import TrialFinding

NONE = "–"

WIDTH = 100
"""Columns of a terminal the table is fitted to."""


@dataclass(frozen=True)
class Table:
    """Headings and rows of text; first and last column stand left, the rest right."""

    headings: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @property
    def text(self) -> str:
        """Aligned columns under headings, for a terminal; no trailing newline.

        What is too long for the last column goes on below.
        """
        widths = [
            max(len(cell) for cell in column)
            for column in zip(self.headings, *self.rows, strict=True)
        ]
        before = sum(widths[:-1]) + 2 * len(widths[:-1])
        room = max(WIDTH - before, len(self.headings[-1]))
        widths[-1] = min(widths[-1], room)
        lines = [self._line(self.headings, widths)]
        lines.append("  ".join("─" * width for width in widths))
        for row in self.rows:
            first, *more = textwrap.wrap(row[-1], room) or [""]
            lines.append(self._line((*row[:-1], first), widths))
            lines.extend(" " * before + part for part in more)
        return "\n".join(lines)

    def _line(self, cells: tuple[str, ...], widths: list[int]) -> str:
        last = len(cells) - 1
        padded = [
            cell.ljust(width) if i in (0, last) else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(cells, widths, strict=True))
        ]
        return "  ".join(padded).rstrip()


def table(findings: Findings) -> Table:
    """One row per trial: force, spikes, latency, rates, fall, time constant."""
    if not findings.run.searched:
        return _without_spikes(findings)
    headings = (
        "Force", "Spikes", "First spike", "Peak rate", "Final rate", "Fall in hold",
        "Time constant",
    )  # fmt: skip
    return Table(headings, tuple(_row(findings.run, t) for t in findings.trials))


def _without_spikes(findings: Findings) -> Table:
    """Trials of a run whose V_K nobody asked for."""
    rows = []
    for finding in findings.trials:
        trial = finding.trial
        rows.append(
            (
                trial.label,
                show(trial.start, "s"),
                show(trial.duration, "s"),
                _shown(trial.rest, "V", 4),
            )
        )
    return Table(("Trial", "Start", "Length", "V_C1 before"), tuple(rows))


def _row(run: RunData, finding: TrialFinding) -> tuple[str, ...]:
    trial, response = finding.trial, finding.response
    force = trial.label
    if trial.level is not None:
        force = _with(trial.level, run.uncertain(trial.level), "N", 4)
    latency = NONE
    if response.latency is not None:
        latency = _with(response.latency, trial.clock_uncertainty, "s", 3)
    fall = NONE if response.fall is None else f"{100 * response.fall:.0f} %"
    return (
        force,
        str(response.spikes),
        latency,
        _shown(response.peak_rate, "Hz"),
        _shown(response.final_rate, "Hz"),
        fall,
        time_constant(finding),
    )


def time_constant(finding: TrialFinding) -> str:
    """1/|beta| with its 95 % interval, or why there is none."""
    fit = finding.adaptation
    if fit is None:
        return NONE if finding.response.spikes == 0 else finding.why_not
    tau = fit.time_constant
    return f"{tau.value:.3g} s ({tau.low:.3g} to {tau.high:.3g} s)"


def _with(value: float, uncertainty: float | None, unit: str, digits: int) -> str:
    """A value with its uncertainty, where that is known."""
    text = show(value, unit, digits)
    return text if uncertainty is None else f"{text} ± {show(uncertainty, unit, 2)}"


def _shown(value: float | None, unit: str, digits: int = 3) -> str:
    return NONE if value is None else show(value, unit, digits)
