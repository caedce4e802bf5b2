"""Figures of a study: what is kept against what varies."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.estimate import student_95
from tactile_lab.arrays import FloatArray
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.studies.axes import Axis
from tactile_lab.studies.dataset import Gathered

CURVES = 8
"""Most curves in one panel."""
DOTS = 3000
"""Most dots in one panel."""
CELLS = 100
"""Most cells of a map along either axis."""
FAILED = "refused or failed"
COLOURS = ("V_C1", "V_C2", "V_K", "force", "rate", "model", "ink", "quiet")


def plots(found: Gathered) -> Iterator[Plot]:
    """Figures of a study: what is kept against what varies."""
    design = found.study.design
    numbers = found.numbers()
    if not numbers:
        return
    grid = [g[0] for g in design.groups if len(g[0].values) > 1]
    if len(grid) == 2 and all(axis.numeric for axis in grid):
        yield _map(found, *grid)
    for number, (key, dimension, axis, values) in enumerate(design.coordinates()):
        if not axis.numeric or dimension != key:
            continue
        yield _response(found, axis, number, np.array(values, dtype=np.float64))
    if design.sampled:
        for number, axis in enumerate(design.drawn):
            yield _scatter(found, axis, number)


def _map(found: Gathered, across: Axis, up: Axis) -> Plot:
    """Every number over two axes of values; where it failed it is crossed out."""
    dimensions = list(found.study.design.dimensions)
    along = dimensions.index(up.key), dimensions.index(across.key)
    steps = [math.ceil(len(axis.values) / CELLS) for axis in (up, across)]

    def laid(column: NDArray[Any]) -> NDArray[Any]:
        """Shape (cells, all other axes and repeats)."""
        thin = np.moveaxis(column, along, (0, 1))[:: steps[0], :: steps[1]]
        return thin.reshape(thin.shape[0] * thin.shape[1], -1)

    y, x = (
        np.array(axis.values, dtype=np.float64)[::step]
        for axis, step in zip((up, across), steps, strict=True)
    )
    x, y = np.tile(x, y.size), np.repeat(y, x.size)
    of = laid(_points(found))[:, 0]
    panels = []
    for name, column in found.numbers().items():
        z = _known_mean(laid(column))
        failed = laid(_failed(found, column)).any(axis=1)
        crossed = Series(
            x=x[failed], y=y[failed], name=FAILED if failed.any() else "",
            mark="crosses", colour="ink", of=tuple(of[failed].tolist()),
        )  # fmt: skip
        cells = Series(
            x=x, y=y, z=z, z_unit=found.unit(name), name=name, mark="cells",
            of=tuple(of.tolist()),
        )  # fmt: skip
        panels.append(Panel(label=up.key, unit=up.unit, series=(cells, crossed)))
    thinned = "" if max(steps) == 1 else f"; one value in {max(steps)} of a long axis"
    return Plot(
        name="map",
        title=f"map of {across.key} and {up.key}",
        caption="Means over all other axes and repeats. A cell without colour has no "
        f"number, one with a cross was refused or failed{thinned}.",
        x_label=across.key,
        x_unit=across.unit,
        panels=tuple(panels),
    )


def _failed(found: Gathered, column: FloatArray) -> NDArray[np.bool_]:
    """Where a point that was refused or failed has no such number."""
    why = found.reasons.reshape(found.study.design.shape)
    failed: NDArray[np.bool_] = (why != "") & ~np.isfinite(column)
    return failed


def _points(found: Gathered) -> NDArray[np.intp]:
    """Numbers of the points, in the shape of the design."""
    design = found.study.design
    return np.arange(design.size).reshape(design.shape)


def _response(found: Gathered, axis: Axis, number: int, at: FloatArray) -> Plot:
    """Every number against one axis of values; a curve for each of another."""
    design = found.study.design
    dimensions = list(design.dimensions)
    along = dimensions.index(axis.key)
    others = [g[0] for g in design.groups if g[0].key != axis.key]
    by = min(others, key=lambda one: len(one.values)) if others else None
    if by is not None and len(by.values) > CURVES:
        by = None
    sampled = len(others) == (by is not None) and (
        design.sampled if design.drawn else design.repeat > 1
    )
    points = np.moveaxis(_points(found), along, 0)
    panels = []
    for name, column in found.numbers().items():
        failed = np.moveaxis(_failed(found, column), along, 0)
        if design.drawn and design.repeat > 1:
            column = _known_mean(column)  # one number of each draw
        if by is None:
            moved = np.moveaxis(column, along, 0)
            curves = [_mean(moved, at, points, "", sampled=sampled)]
        else:
            place = dimensions.index(by.key)
            moved = np.moveaxis(column, (along, place), (0, 1))
            each = np.moveaxis(_points(found), (along, place), (0, 1))
            curves = [
                _mean(moved[:, i], at, each[:, i], by.shown(value), i, sampled=sampled)
                for i, value in enumerate(by.values)
            ]
        curves += _crossed(at, column, points, failed)
        panels.append(Panel(label=name, unit=found.unit(name), series=tuple(curves)))
    of = "draws" if design.drawn else "repeats"
    return Plot(
        name=f"response_{number}",
        title=f"response to {axis.key}",
        caption=f"Means over all other axes and repeats against {axis.key}"
        + (f"; bars are 95 % intervals of the mean over {of}" if sampled else "")
        + (
            ". Crosses along the bottom were refused or failed."
            if found.failed
            else "."
        ),
        x_label=axis.key,
        x_unit=axis.unit,
        panels=tuple(panels),
    )


def _crossed(
    at: FloatArray,
    column: FloatArray,
    points: NDArray[np.intp],
    failed: NDArray[np.bool_],
) -> Iterator[Series]:
    """Crosses where a point was refused or failed, at the least that is known."""
    known, bad = column[np.isfinite(column)], failed.reshape(at.size, -1)
    where = np.flatnonzero(bad.any(axis=1))
    if where.size:
        first = points.reshape(at.size, -1)[where, bad[where].argmax(axis=1)]
        yield Series(
            x=at[where],
            y=np.full(where.size, np.min(known, initial=np.inf) if known.size else 0.0),
            name=FAILED,
            mark="crosses",
            colour="ink",
            of=tuple(first.tolist()),
        )


def _known_mean(column: FloatArray) -> FloatArray:
    """Mean along the last axis of what is known there; NaN where nothing is."""
    known = np.isfinite(column)
    size = known.sum(axis=-1)
    total = np.where(known, column, 0.0).sum(axis=-1)
    none = np.full(size.shape, np.nan)
    mean: FloatArray = np.divide(total, size, out=none, where=size > 0)
    return mean


def _mean(
    column: FloatArray,
    at: FloatArray,
    points: NDArray[np.intp],
    name: str,
    number: int = 0,
    *,
    sampled: bool,
) -> Series:
    """Mean of everything but the first axis; its 95 % interval where it is a sample.

    By rising values, whatever their order in the file.
    """
    rising = np.argsort(at, kind="stable")
    at, rows = at[rising], column.reshape(at.size, -1)[rising]
    mean, error = _known_mean(rows), None
    known = np.isfinite(rows)
    size = known.sum(axis=1)
    if sampled and np.max(size, initial=0) > 1:
        off = np.where(known, rows - mean[:, None], 0.0)
        variance = (off**2).sum(axis=1) / np.maximum(size - 1, 1)
        wide = np.array([student_95(int(max(n - 1, 1))) for n in size])
        error = wide * np.sqrt(variance / np.maximum(size, 1))
        error[size < 2] = np.nan
    return Series(
        x=at,
        y=mean,
        y_error=error,
        name=name,
        mark="joined",
        colour=COLOURS[number % len(COLOURS)],
        of=tuple(points.reshape(at.size, -1)[rising, 0].tolist()),
    )


def _scatter(found: Gathered, axis: Axis, number: int) -> Plot:
    """Every number against one drawn axis."""
    design = found.study.design
    _, _, _, drawn = next(c for c in design.coordinates() if c[2] is axis)
    along = design.dimensions.index("draw")
    panels = []
    for name, column in found.numbers().items():
        moved = np.moveaxis(column, along, -1)
        x = np.broadcast_to(np.array(drawn), moved.shape).ravel()
        step = math.ceil(x.size / DOTS)
        of = np.moveaxis(_points(found), along, -1).ravel()[::step]
        dots = Series(
            x=x[::step], y=moved.ravel()[::step], mark="dots", of=tuple(of.tolist())
        )
        panels.append(Panel(label=name, unit=found.unit(name), series=(dots,)))
    return Plot(
        name=f"draws_{number}",
        title=f"draws of {axis.key}",
        caption=f"{_each(design.size)} against its {axis.key}; all other axes vary as "
        "well.",
        x_label=axis.key,
        x_unit=axis.unit,
        panels=tuple(panels),
    )


def _each(size: int) -> str:
    step = math.ceil(size / DOTS)
    return "Each point" if step == 1 else f"One point in {step}"
