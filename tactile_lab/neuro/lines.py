"""Spikes as CSV: one line each."""

from __future__ import annotations

from pathlib import Path

from tactile_lab.skin.events import Events

PIECE = 1 << 20
"""Spikes written in one go."""


def write(events: Events, file: Path) -> None:
    """One line a spike: time, taxel, and where it lies; numbers in full."""
    places = [f"{x!r},{y!r}" for x, y in events.places.tolist()]
    with file.open("w", encoding="utf-8") as lines:
        lines.write("time_s,taxel,x_m,y_m\n")
        for first in range(0, events.time.shape[0], PIECE):
            time = events.time[first : first + PIECE].tolist()
            taxel = events.taxel[first : first + PIECE].tolist()
            lines.writelines(
                f"{t!r},{i},{places[i]}\n" for t, i in zip(time, taxel, strict=True)
            )
