"""One self-contained report.html: numbers, figures, settings, certificate, warnings.

No scripts and nothing to fetch; it follows the reader's light or dark system and prints
on white paper. What stands where is page.html's; how it looks, page.css's.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from tactile_lab.measurement import MeasuredTrial
from tactile_lab.plot import Plot
from tactile_lab.quantity import show
from tactile_lab.report.drift import drift_sentence
from tactile_lab.report.findings import Findings
from tactile_lab.report.html import picture, rendered
from tactile_lab.report.run_data import RunData
from tactile_lab.report.table import (
    NONE,
    circuit_fits_table,
    fits_table,
    trials_table,
)
from tactile_lab.report.twin import sentences
from tactile_lab.signals import DAGGER

LONG = 12
"""Rows of a table one reads before anything else; a longer one follows the figures."""

UNITS = ("V", "A", "s")
"""Behind the name of what an instrument was asked for: compliance_V."""
LONG_NUMBER = re.compile(r"\b\d+\.\d{9,}\b")
"""What was computed, not stated: 1.5297506925207756."""
SPOKEN = {"True": "yes", "False": "no", "None": NONE}


def page(findings: Findings, pictures: Sequence[tuple[Plot, str]]) -> str:
    """The report as one HTML page.

    Args:
        findings: what to say.
        pictures: each plot with its SVG text as matplotlib wrote it in the light
            palette.
    """
    run, beside = findings.run, findings.beside
    drawn = {plot.name: picture(run.title, plot, svg) for plot, svg in pictures}
    said = drift_sentence(run)
    return rendered(
        "page.html",
        run=run,
        findings=findings,
        none=NONE,
        key=_key_numbers(run),
        trials=trials_table(run),
        long=len(run.results) > LONG,
        fits=fits_table(run),
        laws=circuit_fits_table(run),
        twin=drawn.pop("twin", None),
        drift=drawn.pop("drift", None),
        answers=tuple(drawn.values()),
        beside=() if beside is None else sentences(beside, run),
        budgets=findings.budget_lines,
        drift_said=(said,) if said else (),
        certificate=_certificate(run),
        settings=_settings(run),
    )


def _key_numbers(run: RunData) -> dict[str, str]:
    cut = any(not trial.complete for trial in run.results)
    cells = {
        "Status": run.status,
        "Duration": _seconds(run.duration),
        "Trials": f"{len(run.results)}{', the last cut short' if cut else ''}",
        "Spikes": _spikes(run.results) if run.searched else "not looked for",
    }
    if run.loss is not None:
        cells["Lost"] = run.loss.sentence.removeprefix("loss: ")
    if run.took is not None:
        cells["Took"] = _seconds(run.took, 3)
    return cells


def _spikes(trials: Sequence[MeasuredTrial]) -> str:
    """How many were seen, marked where they are not all counted."""
    mark = DAGGER if any(t.uncounted for t in trials) else ""
    return f"{sum(t.spike_times.size for t in trials)}{mark}"


def _seconds(time: float, digits: int = 4) -> str:
    """A time as one says it: 50 ms, 18.2 s, 1,767 s."""
    return show(time, "s", digits) if time < 1000 else f"{time:,.0f} s"


def _certificate(run: RunData) -> dict[str, str]:
    rows = {"Loss": "nothing was acquired"}
    if run.loss is not None:
        loss = run.loss
        rows = {
            "Samples produced": _count(loss.samples_produced, "not known"),
            "Samples stored": _count(loss.samples_stored),
            "Samples lost": _count(loss.samples, "not known"),
        }
        if run.searched:
            rows["Spikes found on line"] = _count(loss.spikes_online)
            rows["Differing when searched again"] = _count(
                loss.spikes, "not possible: the searched channel was not stored"
            )
        if loss.covered is not None and loss.streamed is not None:
            rows["Time covered"] = (
                f"{loss.covered:.4g} of {loss.streamed:.4g} s; gaps by design"
            )
    if run.accuracy:
        rows["Accuracy"] = run.accuracy
    return rows


def _count(number: int | None, otherwise: str = "") -> str:
    return otherwise if number is None else f"{number:,}"


def _settings(run: RunData) -> list[tuple[str, Mapping[str, str]]]:
    groups = (
        ("Protocol", run.parameters),
        ("Sensor", run.sensor),
        ("Calibration", run.calibration),
        *((name.capitalize(), values) for name, values in run.settings.items()),
        ("Conditions", run.conditions),
        ("Environment", run.environment),
    )
    return [
        (name, dict(_setting(*one) for one in values.items()))
        for name, values in groups
        if values
    ]


def _setting(name: str, value: str) -> tuple[str, str]:
    """A setting as people write it: its unit behind its value, yes or no."""
    plain, _, unit = name.rpartition("_")
    if plain and unit in UNITS:
        try:
            return plain.replace("_", " "), show(float(value), unit, 3)
        except ValueError:
            return name, value
    value = LONG_NUMBER.sub(lambda m: f"{float(m[0]):.6g}", value)
    return name, SPOKEN.get(value, value.replace("^2", "²"))
