"""What a page draws of an array: a square a taxel, or one for several side by side.

A picture has fewer pixels than a large array has taxels, and a page that names each of
a million of them takes 26 MB. Of more than `MOST_SQUARES` taxels, those within a square
of whole rows and columns are drawn as one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.skin.layout import Array

MOST_SQUARES = 10_000


@dataclass(frozen=True, eq=False)
class Squares:
    """Squares of an array.

    Attributes:
        of_taxel: the square of each taxel, shape (taxels,).
        places: of their centres, m, shape (squares, 2).
        side: of each, m.
        fullest: most taxels in one.
    """

    of_taxel: NDArray[np.int64]
    places: FloatArray
    side: float
    fullest: int

    @property
    def single(self) -> bool:
        """Whether each is one taxel."""
        return self.fullest == 1

    def total(self, values: FloatArray | NDArray[np.bool_]) -> FloatArray:
        """The sum over the taxels of each, shape (squares,)."""
        weights = values.astype(np.float64)
        count = self.places.shape[0]
        return np.bincount(self.of_taxel, weights, count).astype(np.float64)

    def mean(self, values: FloatArray) -> FloatArray:
        """The mean over the taxels of each whose value is known, NaN without any."""
        known = np.isfinite(values)
        with np.errstate(invalid="ignore"):
            return self.total(np.where(known, values, 0.0)) / self.total(known)


def squares_of(array: Array, most: int = MOST_SQUARES) -> Squares:
    """One for each taxel, or at most about so many."""
    places = array.places
    if array.size <= most:
        return Squares(np.arange(array.size), places, array.side, 1)
    low = places.min(axis=0)
    if array.positions is not None:
        across, up = np.ptp(places, axis=0) + array.side
        wide = high = max(math.sqrt(across * up / most), max(across, up) / most)
    else:
        wide = high = array.pitch * math.ceil(math.sqrt(array.size / most))
        if array.hexagonal:
            high *= math.sqrt(0.75)
    # a thousandth of a square: rows that lie on its edge to rounding belong to it
    cell = np.floor((places - low) / (wide, high) + 1e-3).astype(np.int64)
    number = cell[:, 1] * (int(cell[:, 0].max()) + 1) + cell[:, 0]
    _, of_taxel, fullest = np.unique(number, return_inverse=True, return_counts=True)
    count = fullest.astype(np.float64)
    centres = [np.bincount(of_taxel, axis) / count for axis in places.T]
    return Squares(
        of_taxel, np.stack(centres, axis=1), min(wide, high), int(fullest.max())
    )
