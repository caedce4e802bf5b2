"""Spikes as the structured array that Tonic's transforms take, in a .npy file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.skin.events import Events

EVENT = np.dtype([("x", np.int16), ("y", np.int16), ("t", np.int64), ("p", np.int8)])
"""Pixel, microseconds, polarity."""
MOST = np.iinfo(np.int16).max
"""Columns or rows that the format can number."""


def pixels(events: Events) -> NDArray[np.int64]:
    """Column and row of each taxel, shape (n, 2), counted from the top left.

    Taxels of one column share x to 0.1 um.

    Raises:
        ParameterError: more columns or rows than pixels have numbers.
    """
    found = []
    for values in (events.places[:, 0], -events.places[:, 1]):
        rounded = np.round(values, 7)
        found.append(np.unique(rounded, return_inverse=True)[1])
    made = np.stack(found, axis=1)
    if made.max() > MOST:
        raise ParameterError(
            f"The taxels lie in {made.max() + 1:,} columns or rows; pixels are "
            f"numbered up to {MOST:,}. Export as nwb, neo or csv, which hold places."
        )
    return made


def whole_us(time: FloatArray) -> NDArray[np.int64]:
    """Times in s as whole microseconds."""
    return np.round(time * 1e6).astype(np.int64)


def structured(events: Events) -> NDArray[np.void]:
    """All spikes as the structured array; times in whole us."""
    place = pixels(events)[events.taxel[:]]
    made = np.empty(place.shape[0], EVENT)
    made["x"], made["y"] = place.T
    made["t"] = whole_us(events.time[:])
    made["p"] = 1
    return made


def write(events: Events, file: Path) -> None:
    """The structured array as a .npy file."""
    with file.open("wb") as opened:
        np.save(opened, structured(events), allow_pickle=False)
