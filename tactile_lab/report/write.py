"""Write a run's report: figure, report.html and results.json."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tactile_lab import notebook
from tactile_lab.report.bench_conclusions import write_calibration_file
from tactile_lab.report.canvas import save
from tactile_lab.report.figures import figures
from tactile_lab.report.findings import Findings, find
from tactile_lab.report.html import page
from tactile_lab.report.results import as_json
from tactile_lab.report.run_data import RunData


@dataclass(frozen=True, kw_only=True, eq=False)
class Report:
    """What was written, and the findings it was written from."""

    findings: Findings
    png: Path
    svg: Path
    html: Path
    results: Path

    def _repr_html_(self) -> str:
        """The page in a frame, for a notebook."""
        return notebook.framed(self.html.read_text(encoding="utf-8"))


def write(folder: Path, run: RunData, *, pdf: bool = False) -> Report:
    """Write figure.png, figure.svg, report.html and results.json into `folder`.

    A field calibration also gets calibration.csv, for a bench file to name.
    Protocols whose answer is not a trace also get summary.png and summary.svg, runs
    with a model beside them twin.png and twin.svg, runs with rests before their trials
    drift.png and drift.svg.

    Args:
        folder: exists; files of these names are replaced.
        run: the run.
        pdf: also write figure.pdf.

    Raises:
        OSError: the folder cannot be written.
    """
    findings = find(run)
    results = folder / "results.json"
    # the numbers first: they survive if drawing should fail
    results.write_text(as_json(findings), encoding="utf-8")
    write_calibration_file(folder, findings.run)
    pictures = {}
    for drawn in figures(findings):
        _, svg = save(drawn.figure, folder / drawn.stem, pdf=pdf)
        pictures[drawn.stem] = svg, drawn.caption
    html = folder / "report.html"
    html.write_text(page(findings, pictures), encoding="utf-8")
    return Report(
        findings=findings,
        png=folder / "figure.png",
        svg=folder / "figure.svg",
        html=html,
        results=results,
    )
