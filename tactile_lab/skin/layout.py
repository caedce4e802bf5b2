"""``[array]``: where the taxels are, and how each differs from the next."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial import cKDTree

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SceneError
from tactile_lab.quantity import Unit, show
from tactile_lab.table import SceneTable

Length = Annotated[float, Unit("m", above=0.0, most=1.0)]
Place = Annotated[float, Unit("m", least=-10.0, most=10.0)]
Rate = Annotated[float, Unit("Hz", above=0.0, most=1e4)]
Modulus = Annotated[float, Unit("Pa", above=0.0)]
Side = Annotated[int, Field(ge=1, le=10_000)]
MOST = 10_000_000
"""Most taxels."""


@dataclass(frozen=True, kw_only=True)
class Array(SceneTable):
    """``[array]``: taxels under one elastic layer, each a sensor of its own.

    One of `grid`, `hexagonal` and `positions` says where they are.

    Attributes:
        grid: rows and columns of a square grid about the origin.
        hexagonal: rows and columns; every other row is shifted by half a pitch.
        positions: x and y of each taxel, m.
        pitch: from a taxel to the next of its row, m.
        side: of the square that gathers the stress for one sensor, m.
        depth: of the taxels under the surface of the layer, m.
        modulus: effective modulus E/(1 - nu^2) of the layer, Pa.
        spread: whether each taxel is a specimen of its own, its parts within their
            tolerances; otherwise all are as marked.
        dead: numbers of taxels that never fire.
        stuck: numbers of taxels that fire at `stuck_rate` whatever presses on them.
        stuck_rate: Hz.
    """

    grid: tuple[Side, Side] | None = None
    hexagonal: tuple[Side, Side] | None = None
    positions: (
        Annotated[tuple[tuple[Place, Place], ...], Field(min_length=1)] | None
    ) = None
    pitch: Length = 2e-3
    side: Length = 1e-3
    depth: Length = 1e-3
    modulus: Modulus = 1e6
    spread: bool = True
    dead: tuple[Annotated[int, Field(ge=0)], ...] = ()
    stuck: tuple[Annotated[int, Field(ge=0)], ...] = ()
    stuck_rate: Rate = 20.0

    def __post_init__(self) -> None:
        given = [n for n in ("grid", "hexagonal", "positions") if getattr(self, n)]
        if len(given) != 1:
            raise SceneError(
                f"{' and '.join(given) or 'no taxels'}: write one of grid = [rows, "
                "columns], hexagonal = [rows, columns] and positions = [[x, y], ...]"
            )
        if self.size > MOST:
            raise SceneError(f"{self.size:,} taxels; at most {MOST:,} are possible")
        for name in ("dead", "stuck"):
            beyond = [n for n in getattr(self, name) if n >= self.size]
            if beyond:
                raise SceneError(
                    f"{name} names taxel {beyond[0]}; they are numbered 0 to "
                    f"{self.size - 1}"
                )
        both = set(self.dead) & set(self.stuck)
        if both:
            raise SceneError(f"taxel {min(both)} is both dead and stuck")
        self._refuse_overlaps()

    @property
    def size(self) -> int:
        """Number of taxels."""
        if self.positions is not None:
            return len(self.positions)
        rows, columns = self.grid or self.hexagonal or (0, 0)
        return rows * columns

    @cached_property
    def places(self) -> FloatArray:
        """Where each taxel's centre is, shape (n, 2), m; row by row from the top."""
        if self.positions is not None:
            return np.array(self.positions)
        rows, columns = self.grid or self.hexagonal or (0, 0)
        row, column = np.divmod(np.arange(rows * columns), columns)
        x, y = column - (columns - 1) / 2, (rows - 1) / 2 - row
        if self.hexagonal:
            x = x + np.where(row % 2, 0.25, -0.25)
            y = y * np.sqrt(0.75)
        return self.pitch * np.stack([x, y], axis=1)

    def named(self, numbers: tuple[int, ...]) -> NDArray[np.bool_]:
        """Which taxels have these numbers, shape (n,)."""
        mask = np.zeros(self.size, np.bool_)
        mask[list(numbers)] = True
        return mask

    def _refuse_overlaps(self) -> None:
        if self.size < 2:
            return
        nearest, pair = self.pitch, (0, 1)
        if self.hexagonal and self.hexagonal[0] > 1:  # rows are closer than columns
            nearest, pair = float(self.pitch * np.sqrt(0.75)), (0, self.hexagonal[1])
        if self.positions is not None:
            # squares overlap where both coordinates are nearer than a side
            tree = cKDTree(self.places)
            apart, which = map(np.asarray, tree.query(self.places, k=2, p=np.inf))
            first = int(np.argmin(apart[:, 1]))
            nearest = float(apart[first, 1])
            # of two in one place either may be found first
            pair = (first, int(which[first][which[first] != first][0]))
        if nearest < self.side * (1 - 1e-9):
            raise SceneError(
                f"taxels {pair[0]} and {pair[1]} overlap: they are "
                f"{show(nearest, 'm')} apart and {show(self.side, 'm')} wide; make "
                "side smaller or the pitch larger"
            )
