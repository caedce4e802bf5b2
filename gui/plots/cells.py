"""Maps: cells coloured by a number, and which cell lies below a place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pyqtgraph as pg

from tactile_lab.arrays import FloatArray
from tactile_lab.plot import Series, grid

COLOURS = pg.colormap.get("viridis")
SHADES = 9
"""Of the colours in a heading."""


def levels(s: Series) -> tuple[float, float]:
    """Least and largest of what colours cells, SI; apart even where all are one."""
    known = np.asarray(s.z, dtype=np.float64)
    known = known[np.isfinite(known)]
    if not known.size:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    return low, high if high > low else low + abs(low) * 1e-6 + 1e-12


def shades() -> list[str]:
    """The colours from the least to the largest."""
    return [c.name() for c in COLOURS.map(np.linspace(0, 1, SHADES), mode="qcolor")]


def item(s: Series, x: FloatArray, y: FloatArray) -> pg.PColorMeshItem:
    """The cells between these edges, as axes show them; what is not known is bare."""
    *_, z = grid(s)
    if not np.any(np.isfinite(z)):
        return pg.PColorMeshItem()
    return pg.PColorMeshItem(
        *np.meshgrid(x, y), z, colorMap=COLOURS, levels=levels(s),
        enableAutoLevels=False,
    )  # fmt: skip


def cell_at(s: Series, x: float, y: float) -> int:
    """What the cell at a place, SI, stands for; -1 outside of all."""
    across, up, numbers = grid(replace(s, z=s.of))
    place = int(np.searchsorted(up, y)) - 1, int(np.searchsorted(across, x)) - 1
    inside = all(0 <= i < n for i, n in zip(place, numbers.shape, strict=True))
    return int(np.nan_to_num(numbers[place], nan=-1)) if inside else -1
