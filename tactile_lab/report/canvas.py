"""Plots drawn by matplotlib in the house style, and the files of a figure."""

from __future__ import annotations

import io
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch
from matplotlib.path import Path as Outline
from matplotlib.text import Annotation
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator
from matplotlib.transforms import Bbox
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.plot import (
    Guide,
    Panel,
    Plot,
    Series,
    grid,
    with_room,
    y_scale,
    z_scale,
)
from tactile_lab.report import palette
from tactile_lab.report.near import from_near
from tactile_lab.report.palette import INK, MEASURED, PAPER, QUIET, RULE, SIMULATED
from tactile_lab.whole_file import replacing, write_text

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
    "axes.formatter.useoffset": False,
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
WIDTH = 7.2
"""Of a figure, inches; so are all lengths below."""
LEFT, RIGHT, FOOT, GAP = 0.72, 0.3, 0.5, 0.18
BETWEEN = 0.75
"""Between panels side by side."""
NUMBER = 0.45
"""From one number along x to the next, where each stands at a value of its own."""
HEAD_HEIGHT = 0.62
"""Room the heading takes at the top."""
HEADING = "heading"
"""Names the heading's parts in SVG: a page with a heading of its own hides them."""
BESIDE = "beside"
"""Names the texts of a series that is drawn as texts alone."""
ROW = 8.0
"""From one row of them to the next, points."""
DASHES, DOTS = (0, (4, 2)), (0, (1, 2.5))
DPI = 160
MANY, MOST = 60, 200
"""So many points are drawn smaller."""


def draw(
    plot: Plot, title: str, subtitle: str = "", *, simulated: bool | None = None
) -> Figure:
    """The plot as a figure, drawn by Agg, without pyplot's state.

    Args:
        plot: what to draw.
        title: bold, above it.
        subtitle: a quiet second line.
        simulated: the mark that tells simulated from measured; None for neither.
    """
    heights = [panel.height for panel in plot.panels]
    high = max(heights) if plot.beside else sum(heights) + GAP * (len(heights) - 1)
    with rc_context(STYLE):
        size = WIDTH, FOOT + high + HEAD_HEIGHT
        figure = Figure(figsize=size, dpi=DPI)  # texts are measured as they are drawn
        FigureCanvasAgg(figure)
        factor, x_text = plot.x_scale()
        drawn = _boxes(figure, plot)
        for axes, panel in zip(drawn, plot.panels, strict=True):
            _panel(axes, panel, factor)
            _x_axis(axes, plot, factor)
        for axes, letter in zip(drawn, "abcdef" if plot.letters else "", strict=False):
            axes.annotate(
                letter, (0, 1), (-0.66 * 72, -1), xycoords="axes fraction",
                textcoords="offset points", weight="bold", size=10, va="top",
            )  # fmt: skip
        labelled = drawn if plot.beside else drawn[-1:]
        for axes in drawn:
            if axes in labelled:
                axes.set_xlabel(_math(x_text))
            else:
                axes.tick_params(axis="x", labelbottom=False, length=0)
                axes.spines["bottom"].set_visible(False)
        heading(figure, title, subtitle, simulated)
        for axes in drawn:
            _clear_of_numbers(axes)
            _stagger(
                axes,
                [
                    t
                    for t in axes.texts
                    if isinstance(t, Annotation) and t.get_gid() == BESIDE
                ],
            )
    return figure


def _clear_of_numbers(axes: Axes) -> None:
    """Move the name of y to the left where its numbers have many digits."""
    label = axes.yaxis.label
    numbers = [one.get_window_extent() for one in axes.get_yticklabels()]
    left = min((one.x0 for one in numbers if one.width), default=np.inf)
    if label.get_rotation() and label.get_window_extent().x1 > left:
        clear = left - 0.03 * DPI - axes.bbox.x0
        axes.yaxis.set_label_coords(clear / axes.bbox.width, 0.5)


def _stagger(axes: Axes, texts: list[Annotation]) -> None:
    """Raise texts that would run into another, left to right; drop what still would.

    Numbers stand left of the axes: no text begins there, and none ends right of them.
    """
    placed: list[Bbox] = []
    for text in texts:
        box, (_, up) = text.get_window_extent(), text.xyann
        aside = max(axes.bbox.x0 - box.x0, 0.0) + min(axes.bbox.x1 - box.x1, 0.0)
        away = -ROW if text.get_verticalalignment() == "top" else ROW
        placed = [one for one in placed if one.x1 > box.x0 + aside]
        for row in (0, 1):
            text.xyann = (aside * 72 / DPI, up + row * away)
            box = text.get_window_extent()
            if not any(box.overlaps(one) for one in placed):
                room = 0.8 * box.height  # to the next one beside it
                placed.append(Bbox([[box.x0, box.y0], [box.x1 + room, box.y1]]))
                break
        else:
            text.set_visible(False)


def _boxes(figure: Figure, plot: Plot) -> list[Axes]:
    """Empty axes for the panels."""
    width, height = figure.get_size_inches()
    room = width - LEFT - RIGHT
    made: list[Axes] = []
    top, left = height - HEAD_HEIGHT, LEFT
    for panel in plot.panels:
        wide, share = room, made[0] if made else None
        if plot.beside:
            wide, share = (room + BETWEEN) / len(plot.panels) - BETWEEN, None
        bottom = FOOT if plot.beside else top - panel.height
        box = (left / width, bottom / height, wide / width, panel.height / height)
        axes = figure.add_axes(box, sharex=share)
        axes.grid(axis="y", color=RULE.light, linewidth=0.5)
        axes.set_axisbelow(True)
        axes.yaxis.set_label_coords(-0.42 / wide, 0.5)
        made.append(axes)
        if plot.beside:
            left += wide + BETWEEN
        else:
            top -= panel.height + GAP
    return made


def _x_axis(axes: Axes, plot: Plot, factor: float) -> None:
    if plot.x_log:
        _log_x(axes)
    if plot.x_ticks:
        at = _roomy(axes, [factor * x for x in plot.x_ticks])
        axes.set_xticks(at, [f"{x:.3g}" for x in at])
        axes.minorticks_off()
    elif plot.whole:
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    elif not plot.x_log:
        few = 10 if not plot.beside else 6
        axes.xaxis.set_major_locator(MaxNLocator(few, steps=[1, 2, 5, 10]))
    first, last = plot.x_limits or (0.0, 0.0)
    if first < last:  # a run may have ended at once
        axes.set_xlim(factor * first, factor * last)


def _roomy(axes: Axes, values: list[float]) -> list[float]:
    """Of values along x, ascending, as many as have room for their numbers."""
    axes.get_xlim()  # else it is not known yet how far they lie apart
    places = axes.transData.transform([(value, 1.0) for value in values])[:, 0]
    return [values[n] for n in with_room((places / DPI).tolist(), NUMBER)]


def _log_x(axes: Axes) -> None:
    """A logarithmic x axis whose numbers are written out: 5, 10, 20, not 10^1."""
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_locator(NullLocator())


def _panel(axes: Axes, panel: Panel, x_factor: float) -> None:
    panel = from_near(panel)
    factor, text = y_scale(panel)
    if panel.log:
        axes.set_yscale("log")
    behind = [guide for guide in panel.guides if _behind(guide)]
    for colour in dict.fromkeys(guide.colour for guide in behind):
        alike = [guide for guide in behind if guide.colour == colour]
        _bands(axes, alike, x_factor, GREY[colour])
    for guide in panel.guides:
        _guide(axes, guide, factor if guide.along == "x" else x_factor)
    for order, series in enumerate(panel.series):
        _series(axes, series, x_factor, factor, 3 + order)
    low, high = panel.limits
    axes.set_ylim(
        None if low is None else low * factor, None if high is None else high * factor
    )
    if high is None and low is not None and not panel.log:
        bottom, top = axes.get_ylim()  # its margin is of the data, which may be flat
        axes.set_ylim(bottom, top + 0.04 * (top - bottom))
    axes.set_ylabel(_math(text))
    if panel.blank:
        axes.yaxis.label.set(rotation=0, ha="right", va="center")
        axes.yaxis.set_label_coords(-0.08 / (WIDTH - LEFT - RIGHT), 0.5)
    if panel.blank:
        axes.set_yticks([])
        axes.spines["left"].set_visible(False)
    elif not panel.log:
        few = max(3, round((4 if panel.whole else 3) * panel.height))
        axes.yaxis.set_major_locator(
            MaxNLocator(few, steps=[1, 2, 5, 10], integer=panel.whole)
        )
    _legend(axes, panel.series)
    if panel.text:
        up = panel.corner == "upper"
        axes.annotate(
            _math(panel.text), (0.99, 1 if up else 0.04), xycoords="axes fraction",
            ha="right", va="top" if up else "bottom", size=7.5, zorder=20, bbox=PLATE,
        )  # fmt: skip
    if panel.note:
        axes.annotate(
            _math(panel.note), (1, 1), (-2, -2), xycoords="axes fraction",
            textcoords="offset points", ha="right", va="top", size=6.5, zorder=20,
            color=QUIET.light, bbox=PLATE,
        )  # fmt: skip


def _behind(guide: Guide) -> bool:
    """Whether it is a band from bottom to top that lies behind the grid."""
    return guide.to is not None and guide.along == "y" and guide.colour in GREY


def _bands(axes: Axes, guides: list[Guide], factor: float, colour: str) -> None:
    """Bands from bottom to top as one path: those of an hour of trials are thousands.

    Each by itself took matplotlib 2 ms and 10 kB.
    """
    ends = factor * np.array([(guide.at, guide.to) for guide in guides])
    x, y = ends[:, [0, 0, 1, 1, 0]], np.tile([0.0, 1.0, 1.0, 0.0, 0.0], len(ends))
    outline = Outline(np.column_stack([x.ravel(), y]), np.tile(RECTANGLE, len(ends)))
    over = axes.get_xaxis_transform()
    axes.add_artist(PathPatch(outline, transform=over, color=colour, lw=0, zorder=0))
    axes.update_datalim(np.column_stack([ends.ravel(), ends.ravel()]), updatey=False)
    axes.autoscale_view(scaley=False)


def _guide(axes: Axes, guide: Guide, factor: float) -> None:
    at, across = guide.at * factor, guide.along == "x"
    colour = _colour(guide.colour)
    if _behind(guide):
        pass  # drawn with all of them
    elif guide.to is not None:
        grey = GREY.get(guide.colour)
        shade: Any = {"color": grey, "zorder": 0} if grey else _TINT | {"color": colour}
        span = axes.axhspan if across else axes.axvspan
        span(at, guide.to * factor, lw=0, **shade)
    else:
        look: Any = {"color": colour, "lw": 0.6, "zorder": 1}
        if guide.dashed:
            look["ls"] = DASHES if guide.text else (0, (2, 2))
        (axes.axhline if across else axes.axvline)(at, **look)
    if guide.text:
        place, where = (0.01, at), axes.get_yaxis_transform()
        if not across:
            up = 0.99 if guide.to is None else 0.55
            place, where = (at, up), axes.get_xaxis_transform()
        beside = (3, 0) if not across else (0, 3) if guide.above else (0, -3)
        axes.annotate(
            _math(guide.text), place, beside, xycoords=where,
            textcoords="offset points", va="bottom" if guide.above else "top", size=7,
            color=colour, zorder=19,
        )  # fmt: skip


PLATE: Any = {"fc": PAPER.light, "ec": "none", "alpha": 0.8, "pad": 1}
"""Behind texts within a panel: no line of the grid runs through their digits."""
RECTANGLE = [Outline.MOVETO, *[Outline.LINETO] * 3, Outline.CLOSEPOLY]
GREY = {"band": palette.BAND.light, "quiet": RULE.light}
"""Colours of bands that lie behind the grid."""
_TINT: Any = {"alpha": 0.22, "zorder": 0.5}


def _series(axes: Axes, s: Series, x_by: float, y_by: float, order: int) -> None:
    x, colour = _scaled(s.x, x_by), _colour(s.colour)
    y = _scaled(s.y, y_by) if np.size(s.y) else np.empty(0)
    over: Any = {"color": colour, "zorder": order}
    if s.mark == "ticks":
        axes.vlines(x, 0.1, 0.9, transform=axes.get_xaxis_transform(), lw=0.7, **over)
        return
    if s.mark == "cells":
        _cells(axes, s, x_by, y_by)
        return
    if s.low is not None and s.high is not None:
        _between(axes, s, x, _scaled(s.low, y_by), _scaled(s.high, y_by), over)
    errors = [
        None if e is None else _scaled(e, by)
        for e, by in ((s.x_error, x_by), (s.y_error, y_by))
    ]
    if any(e is not None for e in errors):
        axes.errorbar(
            x, y, xerr=errors[0], yerr=errors[1], fmt="none", elinewidth=0.8,
            ecolor=colour if errors[0] is None else QUIET.light, capsize=2,
            zorder=order,
        )  # fmt: skip
    if s.mark == "filled":
        axes.fill_between(x, 0, y, color=colour, alpha=0.14, lw=0, zorder=order)
    if s.mark not in ("range", "band", "text"):
        axes.plot(x, y, clip_on=s.mark not in _DISCS, **over, **_look(s, x.size))
    for at, value, text in zip(x, y, s.texts, strict=False):
        beside = s.mark == "text"
        up = 1 if value >= 0 or not beside else -1
        axes.annotate(
            _plain(text), (at, value), (0, (3 if beside else 6) * up),
            textcoords="offset points", ha="center",
            va="bottom" if up > 0 else "top", size=7.5 if beside else 7,
            color=colour if beside else QUIET.light, gid=BESIDE if beside else None,
        )  # fmt: skip


def _cells(axes: Axes, s: Series, x_by: float, y_by: float) -> None:
    """A map, and beside it what its colours mean."""
    x, y, z = grid(s)
    by, text = z_scale(s)
    mesh = axes.pcolormesh(x * x_by, y * y_by, z * by, cmap=CELLS, zorder=2)
    mesh.set_rasterized(True)
    bar = axes.figure.colorbar(mesh, ax=axes, label=_math(text))
    bar.outline.set_visible(False)


CELLS = "viridis"
_DISCS = ("points", "dots", "open", "joined")


def _between(
    axes: Axes, s: Series, x: FloatArray, low: FloatArray, high: FloatArray, over: Any
) -> None:
    """What lies between the extremes, or within the tolerance."""
    if s.mark == "range":
        axes.fill_between(x, low, high, lw=0.5, **{**over, "zorder": 2.5})
    elif s.mark in _DISCS:
        wide = 3 if x.size < MANY else 1
        axes.vlines(x, low, high, color=palette.TWIN.light, alpha=0.35, lw=wide)
    else:
        axes.fill_between(x, low, high, **{**over, "zorder": over["zorder"] - 0.5},
                          alpha=0.25, lw=0)  # fmt: skip


def _look(s: Series, count: int) -> Any:
    """How matplotlib draws that mark."""
    size = 5.5 if count < MANY else 3.2 if count < MOST else 1.6
    looks: dict[str, Any] = {
        "line": {"lw": 1.1},
        "filled": {"lw": 1.2},
        "dashed": {"lw": 1.0, "ls": DASHES},
        "dotted": {"lw": 0.8, "ls": DOTS},
        "steps": {"lw": 0.6, "alpha": 0.6, "drawstyle": "steps-post"},
        "dots": {"marker": "o", "ls": "", "ms": min(size, 3.2), "mew": 0},
        "points": {"marker": "o", "ls": "", "ms": size, "mew": 0},
        "open": {"marker": "o", "ls": "", "ms": size, "mew": 1.2, "mfc": PAPER.light},
        "up": {"marker": "^", "ls": "", "ms": 4, "mew": 0},
        "crosses": {"marker": "x", "ls": "", "ms": 4, "mew": 1.2},
        "down": {"marker": "v", "ls": "", "ms": 4, "mew": 0},
        "joined": {"marker": "o", "ms": 0.8 * size, "mew": 0, "lw": 0.8},
    }
    return looks.get(s.mark, {"lw": 1.6})


def _legend(axes: Axes, series: Iterable[Series]) -> None:
    """Named series in a line above the panel."""
    named = [s for s in series if s.name and s.mark != "cells"]
    if not named:
        return
    handles = [
        Line2D([], [], color=_colour(s.colour), label=_math(s.name), **_look(s, 0))
        for s in named
    ]
    axes.legend(
        handles=handles, loc="lower right", bbox_to_anchor=(1.0, 1.005),
        ncol=len(named), labelcolor=INK.light, handlelength=1.6,
        borderaxespad=0, borderpad=0, columnspacing=1.2,
    )  # fmt: skip


def _colour(name: str) -> str:
    return palette.BY_NAME.get(name, INK).light


def _scaled(values: ArrayLike, factor: float) -> FloatArray:
    return np.asarray(values, dtype=np.float64) * factor


def _math(text: str) -> str:
    """Text with V_C1 as a symbol with its subscript."""
    return re.sub(r"\b([A-Z])_([A-Z0-9]+)\b", r"$\1_{\2}$", _plain(text))


def _plain(text: str) -> str:
    """Text of others: what stands between two $ is no formula in it."""
    return text.replace("$", r"\$")


def heading(figure: Figure, title: str, subtitle: str, simulated: bool | None) -> None:
    """Title, a quiet second line, and the mark that tells simulated from measured."""
    width, height = figure.get_size_inches()
    left, top = 0.12 / width, 1 - 0.12 / height
    below, grey = top - 0.2 / height, QUIET.light
    texts = [
        figure.text(left, top, _plain(title), size=11, weight="bold", va="top"),
        figure.text(left, below, _plain(subtitle), size=7.5, va="top", color=grey),
    ]
    if simulated is not None:
        mark = SIMULATED.light if simulated else MEASURED.light
        box = {
            "boxstyle": "round,pad=0.45", "facecolor": "none", "edgecolor": mark,
            "linewidth": 0.9,
        }  # fmt: skip
        texts.append(
            figure.text(
                1 - 0.12 / width, top, "SIMULATED" if simulated else "MEASURED",
                size=7.5, weight="bold", ha="right", va="top", color=mark, bbox=box,
            )
        )  # fmt: skip
    for number, text in enumerate(texts):
        text.set_gid(f"{HEADING}-{number}")


def save(figure: Figure, stem: Path, *, pdf: bool = False) -> tuple[Path, str]:
    """Write `stem`.png, `stem`.svg and, if asked, `stem`.pdf.

    Returns:
        The PNG's path and the SVG's text, the same every time.

    Raises:
        OSError: the folder cannot be written.
    """
    png, buffer = stem.with_suffix(".png"), io.StringIO()
    with rc_context(STYLE):
        with replacing(png) as new:
            figure.savefig(new, pil_kwargs={"compress_level": 3})
        if pdf:
            with replacing(stem.with_suffix(".pdf")) as new:
                figure.savefig(new)
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    write_text(stem.with_suffix(".svg"), buffer.getvalue())
    return png, buffer.getvalue()
