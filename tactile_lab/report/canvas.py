"""A blank figure in the house style, and its files."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tactile_lab.report.palette import INK, MEASURED, PAPER, QUIET, RULE, SIMULATED

# Any: matplotlib types the keys as some 400 literals
STYLE: Any = {
    "font.family": ["DejaVu Sans"],
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "axes.linewidth": 0.6,
    "axes.edgecolor": QUIET.light,
    "axes.labelcolor": INK.light,
    "text.color": INK.light,
    "xtick.color": QUIET.light,
    "ytick.color": QUIET.light,
    "xtick.labelcolor": INK.light,
    "ytick.labelcolor": INK.light,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.facecolor": PAPER.light,
    "axes.facecolor": "none",
    "legend.frameon": False,
    "legend.fontsize": 7.5,
    "svg.fonttype": "path",
    "svg.hashsalt": "tactile-lab",
    "path.simplify": True,
    "path.simplify_threshold": 0.3,
    "agg.path.chunksize": 20000,
}


WIDTH, HEIGHT = 7.2, 3.7
"""Of a figure with one panel, inches."""
HEADING = "heading"
"""Names the heading's parts in SVG: a page with a heading of its own hides them."""
HEAD_HEIGHT = 0.62
"""Room the heading takes at the top, inches."""
BOX = (0.72, 0.5, WIDTH - 1.02, HEIGHT - 0.5 - HEAD_HEIGHT)
"""Left, bottom, width and height of that panel, inches."""


def blank(width: float, height: float) -> Figure:
    """A figure of that size in inches, drawn by Agg, without pyplot's state."""
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height))
        FigureCanvasAgg(figure)
    return figure


def axes(
    figure: Figure,
    box: tuple[float, float, float, float],
    share: Axes | None = None,
) -> Axes:
    """Axes at `box` (left, bottom, width, height in inches), sharing time."""
    width, height = figure.get_size_inches()
    left, bottom, wide, high = box
    with rc_context(STYLE):
        made = figure.add_axes(
            (left / width, bottom / height, wide / width, high / height), sharex=share
        )
        made.grid(axis="y", color=RULE.light, linewidth=0.5)
        made.set_axisbelow(True)
    return made


def heading(
    figure: Figure, title: str, subtitle: str, *, simulated: bool | None
) -> None:
    """Title, a quiet second line, and the mark that tells simulated from measured.

    Args:
        figure: to put them on.
        title: bold.
        subtitle: below it.
        simulated: the mark; None for a figure that is neither or is not known to be.
    """
    width, height = figure.get_size_inches()
    left, top = 0.12 / width, 1 - 0.12 / height
    texts = [
        figure.text(
            left, top, title, size=11, weight="bold", va="top", color=INK.light
        ),
        figure.text(
            left, top - 0.2 / height, subtitle, size=7.5, va="top", color=QUIET.light
        ),
    ]
    if simulated is not None:
        mark = SIMULATED.light if simulated else MEASURED.light
        texts.append(
            figure.text(
                1 - 0.12 / width,
                top,
                "SIMULATED BENCH" if simulated else "MEASURED",
                size=7.5,
                weight="bold",
                ha="right",
                va="top",
                color=mark,
                bbox={
                    "boxstyle": "round,pad=0.45",
                    "facecolor": "none",
                    "edgecolor": mark,
                    "linewidth": 0.9,
                },
            )
        )
    for number, text in enumerate(texts):
        text.set_gid(f"{HEADING}-{number}")


def svg(figure: Figure) -> str:
    """The figure as SVG text, the same every time."""
    buffer = io.StringIO()
    with rc_context(STYLE):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def save(figure: Figure, stem: Path, *, pdf: bool = False) -> tuple[Path, str]:
    """Write `stem`.png, `stem`.svg and, if asked, `stem`.pdf.

    Returns:
        The PNG's path and the SVG's text.

    Raises:
        OSError: the folder cannot be written.
    """
    png = stem.with_suffix(".png")
    with rc_context(STYLE):
        figure.savefig(png, dpi=160, pil_kwargs={"compress_level": 3})
        if pdf:
            figure.savefig(stem.with_suffix(".pdf"))
    text = svg(figure)
    stem.with_suffix(".svg").write_text(text, encoding="utf-8")
    return png, text
