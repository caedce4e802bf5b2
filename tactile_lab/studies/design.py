"""Which points a study has: every combination on a grid, draws, repeats."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SceneError
from tactile_lab.studies.axes import Axis

Method = Literal["random", "latin hypercube", "sobol", "indices", "tornado"]
MOST_POINTS = 50_000_000
"""Their addresses and results are held in memory when the data set is gathered."""
BYTES, LEAST_TIME = 48, 30e-6
"""Memory of a point with three numbers; time of one in the batch kernel, s."""
TORNADO = (0.1586552539314571, 0.8413447460685429)
"""Low and high of a tornado: one standard deviation of a normal spread."""

Numbers = Sequence[int] | NDArray[np.intp]


@dataclass(frozen=True, kw_only=True)
class Design:
    """The points of a study, numbered from 0.

    All draws go with all combinations of the values, and each point is repeated; the
    last axis varies fastest, the repeat fastest of all. A draw depends on the seed and
    the axes alone, never on who computes which part.

    Attributes:
        axes: those with values first, then those that are drawn.
        draws: how often the drawn axes are drawn; 1 without any.
        method: how: "random", "latin hypercube" or "sobol" sequence, "indices" (the
            pairs of samples that Sobol indices need, axes + 2 times `draws` points),
            or "tornado" (each axis alone at plus and minus one deviation; `draws` is
            not used).
        repeat: runs at each point.
        seed: of the draws.
    """

    axes: tuple[Axis, ...]
    draws: int = 1
    method: Method = "random"
    repeat: int = 1
    seed: int = 1

    @cached_property
    def groups(self) -> tuple[tuple[Axis, ...], ...]:
        """Axes with values; those that go together in one group."""
        found: dict[str, list[Axis]] = {}
        for axis in self.axes:
            if axis.spread is None:
                found.setdefault(axis.group or f"alone {axis.key}", []).append(axis)
        for name, group in found.items():
            lengths = {axis.key: len(axis.values) for axis in group}
            if len(set(lengths.values())) > 1:
                told = ", ".join(f"{key} has {n}" for key, n in lengths.items())
                raise SceneError(
                    f'axes that go together (zip = "{name}") need as many values '
                    f"each: {told}."
                )
        return tuple(tuple(group) for group in found.values())

    @property
    def drawn(self) -> tuple[Axis, ...]:
        """Axes whose values are drawn."""
        return tuple(axis for axis in self.axes if axis.spread is not None)

    @property
    def sampled(self) -> bool:
        """Whether its draws are a sample of how the parts are distributed."""
        return bool(self.drawn) and self.method not in ("indices", "tornado")

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of values of each group, of draws if there are any, of repeats."""
        grid = tuple(len(group[0].values) for group in self.groups)
        drawn = (self._drawn_points,) if self.drawn else ()
        repeated = (self.repeat,) if self.repeat > 1 else ()
        return (*grid, *drawn, *repeated)

    @property
    def dimensions(self) -> tuple[str, ...]:
        """A name for each entry of `shape`."""
        grid = tuple(group[0].key for group in self.groups)
        drawn = ("draw",) if self.drawn else ()
        repeated = ("repeat",) if self.repeat > 1 else ()
        return (*grid, *drawn, *repeated)

    @property
    def size(self) -> int:
        """Number of points, repeats counted."""
        return math.prod(self.shape)

    def columns(self, points: Numbers) -> list[Sequence[Any] | FloatArray]:
        """Of each axis, in their order, its values at these points.

        An array where they are floating-point numbers, else a list.
        """
        at = np.unravel_index(np.asarray(points), self.shape) if self.shape else ()
        found: dict[str, Sequence[Any] | FloatArray] = {}
        for group, place in zip(self.groups, at, strict=False):
            for axis in group:
                table = self._tables[axis.key]
                found[axis.key] = (
                    table[place]
                    if isinstance(table, np.ndarray)
                    else [table[i] for i in place]
                )
        if self.drawn:
            rows = self._draws[at[len(self.groups)]]
            for axis, column in zip(self.drawn, rows.T, strict=True):
                found[axis.key] = column
        return [found[axis.key] for axis in self.axes]

    def values(self, points: Numbers) -> list[tuple[Any, ...]]:
        """The value of each axis at each of the points, axes in their order."""
        columns = self.columns(points)
        return by_point(columns) if columns else [()] * len(points)

    @cached_property
    def _tables(self) -> dict[str, Sequence[Any] | FloatArray]:
        """Values of the axes that have them, as an array where all are floats."""
        return {
            axis.key: np.array(axis.values)
            if all(isinstance(value, float) for value in axis.values)
            else axis.values
            for axis in self.axes
            if axis.spread is None
        }

    def repeats(self, points: Numbers) -> NDArray[np.intp]:
        """Which repeat, from 0, each of the points is."""
        return np.asarray(points) % self.repeat

    def coordinates(self) -> Iterator[tuple[str, str, Axis, list[Any]]]:
        """(name, its dimension, axis, values along it) for each axis."""
        for group in self.groups:
            for axis in group:
                yield axis.key, group[0].key, axis, list(axis.values)
        for axis, column in zip(self.drawn, self._draws.T, strict=True):
            yield axis.key, "draw", axis, column.tolist()

    @property
    def _drawn_points(self) -> int:
        k = len(self.drawn)
        return {"indices": self.draws * (k + 2), "tornado": 2 * k + 1}.get(
            self.method, self.draws
        )

    @cached_property
    def _draws(self) -> FloatArray:
        """Values of the drawn axes, shape (draws, axes), SI."""
        if not self.drawn:  # what draws takes 2 s to load
            return np.empty((1, 0))
        parts = self._parts()
        columns = [
            axis.spread.at(column)
            for axis, column in zip(self.drawn, parts.T, strict=True)
            if axis.spread is not None
        ]
        return np.column_stack(columns)

    def _parts(self) -> FloatArray:
        """Points in the unit cube, shape (draws, axes)."""
        k, n = len(self.drawn), self.draws
        if self.method == "tornado":
            parts = np.full((2 * k + 1, k), 0.5)
            for i in range(k):
                parts[1 + 2 * i, i], parts[2 + 2 * i, i] = TORNADO
            return parts
        rng = np.random.default_rng(self.seed)
        if self.method == "random":
            found: FloatArray = rng.random((n, k))
            return found
        from scipy.stats import qmc

        if self.method == "latin hypercube":
            found = qmc.LatinHypercube(k, rng=rng).random(n)
            return found
        if self.method == "sobol":
            found = qmc.Sobol(k, rng=rng).random(n)
            return np.clip(found, 1e-15, 1 - 1e-15)
        pairs = np.clip(qmc.Sobol(2 * k, rng=rng).random(n), 1e-15, 1 - 1e-15)
        first, second = pairs[:, :k], pairs[:, k:]
        mixed = []
        for i in range(k):
            one = first.copy()
            one[:, i] = second[:, i]
            mixed.append(one)
        return np.concatenate([first, second, *mixed])


def by_point(columns: Sequence[Sequence[Any] | FloatArray]) -> list[tuple[Any, ...]]:
    """Columns turned: a tuple for each point, numbers as Python's own."""
    plain = [c.tolist() if isinstance(c, np.ndarray) else c for c in columns]
    return list(zip(*plain, strict=True))


def checked(design: Design) -> Design:
    """The design, if it can be carried out.

    Raises:
        SceneError: a key varies twice, there are too many points, or a Sobol sequence
            is asked for a number that is no power of two.
    """
    keys = [axis.key for axis in design.axes]
    twice = next((key for key in keys if keys.count(key) > 1), None)
    if twice is not None:
        raise SceneError(f"axis {twice} stands twice; write each key once.")
    if design.size > MOST_POINTS:
        sizes = " × ".join(map(str, design.shape))
        raise SceneError(
            f"The study has {sizes} = {design.size:.3g} points; at most "
            f"{MOST_POINTS:,} can be carried out. These would take "
            f"{design.size * BYTES / 1e9:.3g} GB of memory, and "
            f"{design.size * LEAST_TIME / 3600:.3g} h of a core where a point takes "
            f"{LEAST_TIME * 1e6:g} µs, as little as any does. Take fewer values or "
            "draws."
        )
    powers = design.method in ("sobol", "indices") and design.drawn
    if powers and design.draws & (design.draws - 1):
        near = 2 ** round(math.log2(design.draws))
        raise SceneError(
            f"[draw] points = {design.draws}: a Sobol sequence is balanced only for a "
            f"power of two; take {near}."
        )
    return design
