"""Events as others read them: CSV, and the structured array of Tonic."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import ParameterError
from tactile_lab.skin.events import Events

TONIC = np.dtype([("x", np.int16), ("y", np.int16), ("t", np.int64), ("p", np.int8)])
"""As Tonic's transforms take events: pixel, microseconds, polarity."""
PIECE = 1 << 20
"""Events written in one go."""


def pixels(events: Events) -> NDArray[np.int64]:
    """Column and row of each taxel, shape (n, 2), counted from the top left.

    Taxels of one column share x to a tenth of the least distance between columns.
    """
    found = []
    for values in (events.places[:, 0], -events.places[:, 1]):
        rounded = np.round(values, 7)
        found.append(np.unique(rounded, return_inverse=True)[1])
    return np.stack(found, axis=1)


def tonic(events: Events) -> NDArray[np.void]:
    """All events as the structured array that Tonic works on; times in whole us."""
    place = pixels(events)[events.taxel[:]]
    made = np.empty(place.shape[0], TONIC)
    made["x"], made["y"] = place.T
    made["t"] = np.round(events.time[:] * 1e6)
    made["p"] = 1
    return made


def write_npy(events: Events, file: Path) -> None:
    """The structured array as a .npy file."""
    np.save(file, tonic(events), allow_pickle=False)


def write_csv(events: Events, file: Path) -> None:
    """One line an event: time, taxel, and where it lies."""
    with file.open("w", encoding="utf-8") as lines:
        lines.write("time_s,taxel,x_m,y_m\n")
        for first in range(0, events.time.shape[0], PIECE):
            time = events.time[first : first + PIECE].tolist()
            taxel = events.taxel[first : first + PIECE].tolist()
            place = events.places.tolist()
            lines.writelines(
                f"{t!r},{i},{place[i][0]!r},{place[i][1]!r}\n"
                for t, i in zip(time, taxel, strict=True)
            )


WRITERS: dict[str, Callable[[Events, Path], None]] = {
    ".csv": write_csv,
    ".npy": write_npy,
}


def export(events: Events, file: Path) -> None:
    """Write events in the format that the file's ending names.

    Raises:
        ParameterError: no format has that ending.
        OSError: it cannot be written.
    """
    writer = WRITERS.get(file.suffix)
    if writer is None:
        raise ParameterError(
            f"{file}: events are exported as {' or '.join(WRITERS)}; end the name so."
        )
    part = file.with_name(f".{file.name}.part{file.suffix}")
    try:
        writer(events, part)
        part.replace(file)
    finally:
        part.unlink(missing_ok=True)
