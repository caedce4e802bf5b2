"""Write a run's report: figures, report.html and results.json."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from tactile_lab import notebook
from tactile_lab.report.canvas import draw, save
from tactile_lab.report.findings import Findings, find
from tactile_lab.report.page import page
from tactile_lab.report.results import as_json
from tactile_lab.report.run_data import RunData
from tactile_lab.store.folder import REPORT
from tactile_lab.store.progress import Progress, counted, nothing, share
from tactile_lab.whole_file import replacing, write_text

FOUND = 0.3
"""Part of the work until all is found that is then drawn."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """What was written, and the findings it was written from."""

    findings: Findings
    png: Path
    svg: Path
    html: Path
    results: Path

    def __repr__(self) -> str:
        return f"<Report of {self.findings.run.run}: {self.html}>"

    def _repr_html_(self) -> str:
        """The page in a frame, for a notebook."""
        return notebook.framed(self.html.read_text(encoding="utf-8"))


def write(
    folder: Path, run: RunData, *, pdf: bool = False, progress: Progress = nothing
) -> Report:
    """Write figure.png, figure.svg, report.html and results.json into `folder`.

    Each further plot of the run gets files of its own name: summary (the protocol's
    answer), twin (the model beside it), drift (the rests before its trials). So do the
    files the protocol concludes with, such as a calibration.csv.

    Args:
        folder: exists; figures and pages of these names are replaced.
        run: the run.
        pdf: also write the figures as PDF.
        progress: told as figures are drawn.

    Raises:
        OSError: the folder cannot be written.
    """
    findings = find(run)
    progress(FOUND)
    results = folder / "results.json"
    # the numbers first: they survive if drawing should fail
    write_text(results, as_json(findings))
    _keep(folder, findings.conclusion.files)
    pictures = []
    plots = findings.plots
    for plot in counted(plots, len(plots), share(progress, FOUND, 1.0)):
        title = ": ".join(part for part in (run.title, plot.title) if part)
        try:
            figure = draw(plot, title, run.subtitle, simulated=run.simulated)
            pictures.append((plot, save(figure, folder / plot.name, pdf=pdf)[1]))
        except (ValueError, TypeError) as error:
            if plot not in findings.answers:
                raise
            said = f"No plot {plot.name!r}: it cannot be drawn ({error})"
            findings = replace(findings, missing=(*findings.missing, said))
    html = folder / REPORT
    write_text(html, page(findings, pictures))
    return Report(
        findings=findings,
        png=folder / "figure.png",
        svg=folder / "figure.svg",
        html=html,
        results=results,
    )


def _keep(folder: Path, files: Mapping[str, str]) -> None:
    """Write files that are never changed; one that is there already stays."""
    for name, text in files.items():
        path = folder / Path(name).name
        if path.exists():
            continue
        with replacing(path) as new:
            new.write_bytes(text.encode())
            new.chmod(0o444)
