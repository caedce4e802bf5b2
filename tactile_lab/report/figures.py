"""All figures of a run, each with the name of its file and its caption."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from matplotlib.figure import Figure

from tactile_lab.report import drift_figure, twin_figure
from tactile_lab.report.figure import CAPTION, figure
from tactile_lab.report.findings import Findings
from tactile_lab.report.summary import CAPTIONS, summary


@dataclass(frozen=True, eq=False)
class Drawn:
    """One figure.

    Attributes:
        stem: name of its files without the ending.
        figure: as matplotlib has it.
        caption: for the page.
    """

    stem: str
    figure: Figure
    caption: str


def figures(findings: Findings) -> Iterator[Drawn]:
    """The figures, "figure" always among them.

    A field calibration pushes nothing: its figure is that of the field.
    """
    second = summary(findings)
    caption = CAPTIONS.get(findings.run.protocol, "")
    if second is not None and findings.run.protocol == "calibrate_field":
        yield Drawn("figure", second, caption)
    else:
        if second is not None:
            yield Drawn("summary", second, caption)
        yield Drawn("figure", figure(findings), CAPTION)
    for stem, drawn, text in (
        ("twin", twin_figure.twin_figure(findings), twin_figure.CAPTION),
        ("drift", drift_figure.drift_figure(findings), drift_figure.CAPTION),
    ):
        if drawn is not None:
            yield Drawn(stem, drawn, text)
