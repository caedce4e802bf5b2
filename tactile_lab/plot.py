"""Plain descriptions of plots: what is drawn, not how.

The report draws them with matplotlib, the window paints them, results.json holds them.
All values are in SI; whoever draws chooses the prefix of the unit, so that a force of
0.2 N stands as 200 on an axis "Force (mN)". Names such as V_C1 get a subscript.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.quantity import PREFIXES, count, prefix_of

MOST_TICKS = 150
"""More spikes than that run into one another: their density is drawn."""
SPIKES_IN_BIN, MOST_BINS = 5, 200
"""Of that density: spikes in a bin on average, at least, and bins."""

Mark = Literal[
    "line", "dashed", "dotted", "steps", "filled",
    "points", "dots", "open", "up", "down", "joined", "ticks", "range", "band", "text",
    "cells", "crosses",
]  # fmt: skip
"""Lines, one of them in steps and one filled down to 0; discs, small ones, open ones,
triangles, discs joined by a line; ticks along the top at `x`; the range from `low` to
`high` as the trace itself, or as a pale band alone; `texts` beside the points; cells of
a map, coloured by `z`; crosses."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """Points or a line; a value that is not a number is a gap.

    Attributes:
        x, y: shape (n,), SI; `y` may be missing for ticks and ranges.
        name: in the legend; "" for no entry.
        mark: how it is drawn.
        colour: of a signal ("V_C1", "force", "rate", ...), "model", "ink" or "quiet".
        x_error, y_error: half-widths of the 95 % interval, shape (n,), SI.
        low, high: shape (n,), SI: shaded between, such as extremes or a tolerance.
        texts: n of them, beside the points.
        z: shape (n,), SI: what colours the cell about each point.
        z_unit: SI; "" without one.
        of: what each point stands for, such as the number of a study's point; -1 for
            nothing. The window tells which one was clicked.
    """

    x: ArrayLike
    y: ArrayLike = ()
    name: str = ""
    mark: Mark = "line"
    colour: str = "rate"
    x_error: ArrayLike | None = None
    y_error: ArrayLike | None = None
    low: ArrayLike | None = None
    high: ArrayLike | None = None
    texts: tuple[str, ...] = ()
    z: ArrayLike | None = None
    z_unit: str = ""
    of: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        size, others = (
            np.size(self.x),
            (self.x_error, self.y_error, self.low, self.high, self.z),
        )
        y = () if self.mark in ("ticks", "range", "band") else (self.y,)
        for values in (*y, *(v for v in others if v is not None)):
            if np.shape(values) != (size,):
                raise ParameterError(
                    f"series {self.name or self.colour!r} has {size} values of x and "
                    f"others of shape {np.shape(values)}; give as many."
                )


@dataclass(frozen=True, kw_only=True)
class Guide:
    """A reference line, or a shaded band where `to` is given.

    Attributes:
        at: where it lies or begins, SI.
        to: where the band ends; None for a line.
        along: "x" for one across at that y, "y" for one upright at that x.
        text: beside the line, or at the beginning of a band.
        colour: as of a series; "quiet" and "band" are greys.
        dashed: whether the line is.
        above: whether the text stands above a line across, not below it.
    """

    at: float
    to: float | None = None
    along: Literal["x", "y"] = "y"
    text: str = ""
    colour: str = "quiet"
    dashed: bool = True
    above: bool = False


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One pair of axes.

    Attributes:
        label: of its y axis.
        unit: SI unit of y, "" for none.
        prefix: of that unit; None for the one that suits the values.
        series: drawn in this order.
        guides: reference lines and bands.
        limits: of y, SI; None at either end for what the values need.
        log: whether y is logarithmic.
        whole: whether y counts something.
        text: some lines within it, such as fitted values.
        corner: the one on the right where they stand.
        note: a small line above it.
        blank: without numbers on the y axis, where they mean nothing.
        height: inches in the report.
    """

    label: str
    unit: str = ""
    prefix: str | None = None
    series: tuple[Series, ...]
    guides: tuple[Guide, ...] = ()
    limits: tuple[float | None, float | None] = (None, None)
    log: bool = False
    whole: bool = False
    text: str = ""
    corner: Literal["upper", "lower"] = "upper"
    note: str = ""
    blank: bool = False
    height: float = 2.5


@dataclass(frozen=True, kw_only=True)
class Plot:
    """Panels above one another on one x axis, or side by side.

    Attributes:
        name: of its files without the ending. "figure" takes the place of the general
            one (force, voltages, spikes).
        caption: for the report, one or more sentences.
        title: what it shows, after the protocol's own title; "" where that says it.
        x_label, x_unit, x_prefix: of the x axis, as a panel's of y.
        panels: at least one.
        x_limits: SI; None for what the values need.
        x_ticks: where the x axis has numbers, SI; empty for where they fall.
        x_log: whether x is logarithmic.
        whole: whether x counts something.
        beside: side by side, each with an x axis of its own.
        letters: whether panels are called a, b, c.
    """

    name: str
    caption: str
    title: str = ""
    x_label: str
    x_unit: str = ""
    x_prefix: str | None = None
    panels: tuple[Panel, ...]
    x_limits: tuple[float, float] | None = None
    x_ticks: tuple[float, ...] = ()
    x_log: bool = False
    whole: bool = False
    beside: bool = False
    letters: bool = False

    def __post_init__(self) -> None:
        if not self.panels:
            raise ParameterError(f"plot {self.name!r} has no panel; give one or more.")
        if not re.fullmatch(r"[a-z0-9_]+", self.name):
            raise ParameterError(
                f"a plot cannot be called {self.name!r}: small letters, digits and _ "
                "make the name of its files."
            )

    def x_scale(self) -> tuple[float, str]:
        """(Factor, axis text): SI values times the factor are what the axis shows."""
        values = [s.x for p in self.panels for s in p.series]
        return scale(self.x_label, self.x_unit, self.x_prefix, values)

    def to_dict(self) -> dict[str, Any]:
        """As JSON takes it: only what differs from the defaults; null is a gap."""
        found: dict[str, Any] = _plain(self)
        return found

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Plot:
        """The plot that `to_dict` wrote.

        Raises:
            KeyError, TypeError, ValueError: it is not one.
        """
        panels = tuple(
            Panel(
                **{
                    **panel,
                    "series": tuple(_series(s) for s in panel["series"]),
                    "guides": tuple(Guide(**g) for g in panel.get("guides", ())),
                    "limits": tuple(panel.get("limits", (None, None))),
                }
            )
            for panel in data["panels"]
        )
        return cls(**{**data, "panels": panels})


def spike_train(
    spikes: FloatArray,
    begin: float,
    end: float,
    looked: Sequence[tuple[float, float]] | None = None,
) -> tuple[Panel, str]:
    """A lane of ticks, and its caption; many spikes as how many a second there are.

    Args:
        spikes: times, s.
        begin: of the x axis, s.
        end: of the x axis, s.
        looked: (start, end), s, ascending, where spikes were looked for, as far as
            they can lie; None for all of the axis.
    """
    told = count(spikes.size, "spike")
    if spikes.size <= MOST_TICKS:
        ticks = Series(x=spikes, mark="ticks", colour="V_K")
        panel = Panel(
            label="Spikes", series=(ticks,), limits=(0, 1), blank=True, height=0.3
        )
        return panel, f"{told}"
    wanted = min(spikes.size // SPIKES_IN_BIN, MOST_BINS)
    spans = _joined([(begin, end)] if looked is None else looked)
    width = sum(stop - start for start, stop in spans) / wanted
    x: list[FloatArray] = []
    y: list[FloatArray] = []
    bins = 0
    for start, stop in spans:
        here = max(round((stop - start) / width), 1)
        edges = np.linspace(start, stop, here + 1)
        density = np.histogram(spikes, edges)[0] / np.diff(edges)
        # where nobody looked there is no rate, which is not a rate of none
        x += [np.repeat(edges, 2)[1:-1], edges[-1:]]
        y += [np.repeat(density, 2), np.full(1, np.nan)]
        bins += here
    filled = Series(
        x=np.concatenate(x), y=np.concatenate(y), mark="filled", colour="V_K"
    )
    panel = Panel(label="Spikes/s", series=(filled,), limits=(0, None), height=0.5)
    return panel, f"{told}: how many a second, in {bins} bins"


def _joined(spans: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    """Ascending stretches; those that touch or overlap are one."""
    found: list[tuple[float, float]] = []
    for start, stop in spans:
        if found and start <= found[-1][1] + 1e-6:
            start, stop = found[-1][0], max(found.pop()[1], stop)
        if stop > start:
            found.append((start, stop))
    return found


def y_scale(panel: Panel) -> tuple[float, str]:
    """(Factor, axis text): SI values times the factor are what the y axis shows."""
    values = [v for s in panel.series for v in (s.y, s.low, s.high) if v is not None]
    values += [limit for limit in panel.limits if limit is not None]
    return scale(panel.label, panel.unit, panel.prefix, values)


def z_scale(series: Series) -> tuple[float, str]:
    """(Factor, text) of what colours cells, as of an axis."""
    return scale(
        series.name, series.z_unit, None, [() if series.z is None else series.z]
    )


def grid(series: Series) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cells as a grid: edges along x and y, SI, and z of shape (along y, along x).

    An edge lies in the middle between two values; z is NaN where there is no cell.
    """
    x, column = np.unique(series.x, return_inverse=True)
    y, row = np.unique(series.y, return_inverse=True)
    z = np.full((y.size, x.size), np.nan)
    z[row, column] = np.nan if series.z is None else series.z
    return _edges(x), _edges(y), z


def with_room(places: Sequence[float], least: float) -> list[int]:
    """Which of some places, ascending, lie so far apart that each can have a number."""
    kept: list[int] = []
    for number, place in enumerate(places):
        if not kept or place - places[kept[-1]] >= least:
            kept.append(number)
    return kept


def _edges(values: FloatArray) -> FloatArray:
    if values.size < 2:
        wide = np.abs(values) / 2 + (values == 0)
        return np.concatenate([values - wide, values + wide])
    middles = (values[1:] + values[:-1]) / 2
    first, last = 2 * values[0] - middles[0], 2 * values[-1] - middles[-1]
    return np.concatenate([[first], middles, [last]])


def scale(
    label: str, unit: str, prefix: str | None, values: list[ArrayLike]
) -> tuple[float, str]:
    """Factor from SI to what an axis shows, and its text: (1000, "Force (mN)")."""
    if prefix is None:
        largest = max((_largest(v) for v in values), default=0.0)
        prefix = prefix_of(largest, unit)
    whole = f"{prefix}{unit}"
    return 1 / PREFIXES[prefix], f"{label} ({whole})" if whole else label


def _largest(values: ArrayLike) -> float:
    known = np.abs(np.asarray(values, dtype=np.float64))
    return float(np.max(known[np.isfinite(known)], initial=0.0))


def _plain(value: Any) -> Any:
    if dataclasses.is_dataclass(value):
        return {
            f.name: _plain(getattr(value, f.name))
            for f in dataclasses.fields(value)
            if not _same(getattr(value, f.name), f.default)
        }
    if isinstance(value, np.ndarray | list | tuple):
        return [_plain(v) for v in value]
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _same(value: Any, default: Any) -> bool:
    return not isinstance(value, np.ndarray) and bool(value == default)


def _series(data: Mapping[str, Any]) -> Series:
    if data.get("mark", "line") not in get_args(Mark):
        raise ValueError(f"no such mark: {data['mark']!r}")
    arrays = ("x", "y", "x_error", "y_error", "low", "high", "z")
    numbers = {k: np.array(data[k], dtype=np.float64) for k in arrays if k in data}
    rows = {key: tuple(data.get(key, ())) for key in ("texts", "of")}
    return Series(**{**data, **numbers, **rows})
