"""What is kept of many points under one name: a number each, or a row of numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray

Value = float | FloatArray
"""Of one point: a number, or a row of numbers, shape (n,)."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Rows of different lengths, one after another.

    Attributes:
        values: of all rows.
        sizes: how many numbers each row has.
    """

    values: FloatArray
    sizes: NDArray[np.int64]

    def take(self, rows: NDArray[np.intp]) -> Rows:
        """Some of the rows, in this order."""
        sizes = self.sizes[rows]
        begins = np.cumsum(self.sizes) - self.sizes
        shift = begins[rows] - (np.cumsum(sizes) - sizes)
        return Rows(
            self.values[np.repeat(shift, sizes) + np.arange(sizes.sum())], sizes
        )


Column = FloatArray | Rows
"""Of each point a number, NaN where it failed; or a row, empty where it failed."""


def packed(values: Sequence[Value | None]) -> Column:
    """The column of these points; None for one that failed."""
    if all(value is None or isinstance(value, float) for value in values):
        return np.array([np.nan if value is None else value for value in values])
    rows = [np.empty(0) if one is None else np.atleast_1d(one) for one in values]
    return Rows(np.concatenate(rows), np.array([row.size for row in rows]))


def as_rows(column: Column) -> Rows:
    """A column as rows: of one number each, none where it is NaN."""
    if isinstance(column, Rows):
        return column
    known = ~np.isnan(column)
    return Rows(column[known], known.astype(np.int64))


def placed(parts: Sequence[tuple[NDArray[np.intp], Column]], size: int) -> Column:
    """One column of `size` points of parts, each with the places of its points.

    Points in no part are NaN, or have an empty row.
    """
    if not any(isinstance(part, Rows) for _, part in parts):
        numbers = np.full(size, np.nan)
        for places, part in parts:
            numbers[places] = part
        return numbers
    rows = [(places, as_rows(part)) for places, part in parts]
    sizes = np.zeros(size, np.int64)
    for places, part in rows:
        sizes[places] = part.sizes
    begins = np.cumsum(sizes) - sizes
    values = np.empty(int(sizes.sum()))
    for places, part in rows:
        shift = begins[places] - (np.cumsum(part.sizes) - part.sizes)
        values[np.repeat(shift, part.sizes) + np.arange(part.values.size)] = part.values
    return Rows(values, sizes)
