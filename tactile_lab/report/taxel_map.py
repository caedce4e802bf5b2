"""Maps of taxels: each where it lies, the stronger the colour the more."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.plot import scale
from tactile_lab.report import palette
from tactile_lab.report.canvas import (
    BETWEEN,
    FOOT,
    HEAD_HEIGHT,
    LEFT,
    RIGHT,
    STYLE,
    WIDTH,
    heading,
)

Chosen = NDArray[np.bool_]

FAINTEST = 0.15
"""Part of the colour that the least value above 0 has."""
MOST_DRAWN = 4000
"""Of more taxels, the squares become a picture within the figure."""
BAR, OVER_BAR, BELOW = 0.09, 0.58, 0.3
"""Height of the bar of colours, room for it over a map, and for the marks' names below,
inches."""
LOWEST, HIGHEST = 0.35, 4.0
"""Height of a map, inches."""
STEPS = 64
"""Shades in the bar."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TaxelMap:
    """One value for each taxel.

    Attributes:
        label: of the bar of colours.
        unit: SI unit of the values, "" for none, "%" for parts.
        values: shape (taxels,), at least 0; NaN where none is known.
        most: what has full colour; None for the largest value.
        grey, dotted: taxels to be marked so, each with what that means.
    """

    label: str
    unit: str = ""
    values: FloatArray
    most: float | None = None
    grey: tuple[str, Chosen] | None = None
    dotted: tuple[str, Chosen] | None = None

    @property
    def full(self) -> float:
        """The value of full colour."""
        known = self.values[np.isfinite(self.values)]
        return self.most or float(known.max(initial=0.0)) or 1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class TaxelMaps:
    """Maps of one array side by side.

    Attributes:
        name: of the figure's files.
        caption: for the report.
        places: of the taxels' centres, shape (taxels, 2), m.
        side: of a taxel, m.
        maps: from left to right.
        crossed: taxels to be crossed out in each, with what that means.
        framed: taxels to be framed in each, with what that means.
    """

    name: str
    caption: str
    places: FloatArray
    side: float
    maps: tuple[TaxelMap, ...]
    crossed: tuple[str, Chosen]
    framed: tuple[str, Chosen]


GREY = (*to_rgb(palette.QUIET.light), 0.45)
"""Of taxels of whom there is no value."""


def draw_maps(shown: TaxelMaps, title: str, subtitle: str) -> Figure:
    """The maps as a figure in the house style, drawn by Agg and marked as simulated."""
    low = shown.places.min(axis=0) - shown.side / 2
    high = shown.places.max(axis=0) + shown.side / 2
    across, up = high - low
    centre = (low + high) / 2
    many = max(len(shown.maps), 2)
    wide = (WIDTH - LEFT - RIGHT + BETWEEN) / many - BETWEEN
    tall = float(np.clip(wide * up / across, LOWEST, HIGHEST))
    per_m = min(wide / across, tall / up)
    half = np.array([wide, tall]) / per_m / 2
    height = HEAD_HEIGHT + OVER_BAR + tall + FOOT + BELOW
    with rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, height))
        FigureCanvasAgg(figure)
        left, bottom = LEFT, FOOT + BELOW
        for number, one in enumerate(shown.maps):
            box = np.array([left, bottom, wide, tall])
            size = np.array([WIDTH, height, WIDTH, height])
            axes = figure.add_axes(tuple(box / size))
            bar_box = np.array([left, bottom + tall + 0.1, wide, BAR])
            bar = figure.add_axes(tuple(bar_box / size))
            _map(axes, shown, one, 72 * per_m * shown.side)
            _bar(bar, one)
            least, most = 1e3 * (centre - half), 1e3 * (centre + half)
            axes.set_xlim(least[0], most[0])
            axes.set_ylim(least[1], most[1])
            if axes.get_legend_handles_labels()[1]:
                axes.legend(
                    loc="upper left", bbox_to_anchor=(0, -0.42 / tall), ncol=3,
                    borderaxespad=0, handletextpad=0.2, columnspacing=1, borderpad=0,
                )  # fmt: skip
            axes.set_xlabel("x (mm)")
            if number == 0:
                axes.set_ylabel("y (mm)")
            left += wide + BETWEEN
        heading(figure, title, subtitle, True)
    return figure


def _map(axes: Axes, shown: TaxelMaps, one: TaxelMap, points: float) -> None:
    """The squares, `points` wide on paper, and their marks with names below."""
    corner = 1e3 * (shown.places - shown.side / 2)
    square = 1e3 * shown.side * np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    faces = np.empty((corner.shape[0], 4))
    faces[:] = (*to_rgb(palette.BAND.light), 1.0)
    some = np.isfinite(one.values) & (one.values > 0)
    faces[some, :3] = to_rgb(palette.RATE.light)
    faces[some, 3] = shade(one.values[some] / one.full)
    if one.grey is not None:
        faces[one.grey[1]] = GREY
    squares = PolyCollection(
        list(corner[:, None, :] + square), facecolors=faces, lw=0, snap=False
    )
    many = corner.shape[0] > MOST_DRAWN
    squares.set_rasterized(many)
    axes.add_collection(squares)
    size = float(np.clip(0.5 * points, 1.0, 9.0))
    looks: tuple[tuple[tuple[str, Chosen] | None, dict[str, Any]], ...] = (
        (shown.crossed, {"marker": "x", "ms": size, "mew": 0.8,
                         "color": palette.QUIET.light}),
        (shown.framed, {"marker": "s", "ms": 1.7 * size, "mew": 1.0, "mfc": "none",
                        "color": palette.SIMULATED.light}),
        (one.dotted, {"marker": "o", "ms": 0.5 * size, "mew": 0,
                      "color": palette.V_C1.light}),
    )  # fmt: skip
    for mark, look in looks:
        if mark is not None and mark[1].any():
            x, y = 1e3 * shown.places[mark[1]].T
            axes.plot(x, y, ls="", label=mark[0], rasterized=many, **look)
    if one.grey is not None and one.grey[1].any():
        axes.plot([], [], ls="", marker="s", ms=7, mew=0, label=one.grey[0], color=GREY)


def _bar(bar: Axes, one: TaxelMap) -> None:
    """Which shade stands for which value."""
    factor, label = 100.0, f"{one.label} (%)"
    if one.unit != "%":
        factor, label = scale(one.label, one.unit, None, [one.full])
    most = factor * one.full
    begins = np.arange(STEPS) / STEPS
    through = 1 - shade(begins + 0.5 / STEPS)
    thinner = 1 - through / np.concatenate([[1.0], through[:-1]])
    for begin, opaque in zip(begins, thinner, strict=True):  # over each other: no seams
        bar.axvspan(most * begin, most, color=palette.RATE.light, alpha=opaque, lw=0)
    bar.set_xlim(0, most)
    bar.set_yticks([])
    bar.spines[["left", "bottom"]].set_visible(False)
    bar.xaxis.set_ticks_position("top")
    bar.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
    bar.set_title(label, size=8.0, loc="left", pad=14)


def shade(part: FloatArray) -> FloatArray:
    """How opaque a part of the full value is drawn."""
    opaque: FloatArray = FAINTEST + (1 - FAINTEST) * np.minimum(part, 1.0)
    return opaque
