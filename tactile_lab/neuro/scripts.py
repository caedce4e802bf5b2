"""Ready scripts that play spikes into a simulator, and the spikes they read."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tactile_lab.skin.events import Events


def script(simulator: str) -> str:
    """The script for brian2, nest or snntorch; it finds its spikes by its own name."""
    return (Path(__file__).parent / "players" / f"{simulator}.txt").read_text("utf-8")


def write_spikes(events: Events, file: Path) -> None:
    """What scripts read: `time` s, `taxel`, `x` and `y` of taxels, m, `duration` s."""
    x, y = events.places.T
    with file.open("wb") as opened:
        np.savez_compressed(
            opened, time=events.time[:], taxel=events.taxel[:], x=x, y=y,
            duration=events.duration,
        )  # fmt: skip
