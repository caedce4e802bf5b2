"""An array that is computed beside the window, or read from disk, and told of."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

import numpy as np
from numpy.typing import NDArray

from gui.skin.film import Film
from tactile_lab.arrays import FloatArray
from tactile_lab.engine.threads import start
from tactile_lab.errors import TactileLabError
from tactile_lab.skin.events import Events
from tactile_lab.skin.press import press
from tactile_lab.skin.skin import Skin


@dataclass(frozen=True, eq=False)
class TrainsFound:
    """The trains of some taxels are computed.

    Attributes:
        first: number of the first of them.
        count: spikes of each.
        time: s, taxel after taxel.
    """

    first: int
    count: NDArray[np.int64]
    time: FloatArray


@dataclass(frozen=True)
class Failed:
    """Nothing more comes; `text` says why."""

    text: str


class WindowClosedError(Exception):
    """The window was closed."""


class SkinComputation:
    """Computes in a thread: the kernel does not hold Python back.

    Args:
        skin: to be computed; None where it is on disk.
        folder: of the events.
    """

    def __init__(self, skin: Skin | None, folder: Path) -> None:
        self._skin, self._folder = skin, folder
        self._told: SimpleQueue[TrainsFound | Film | Failed] = SimpleQueue()
        self._leave = threading.Event()
        self.thread = start(self._main, "skin")

    def told(self) -> list[TrainsFound | Film | Failed]:
        """What has come since the last look."""
        found = []
        try:
            while True:
                found.append(self._told.get_nowait())
        except Empty:
            return found

    def leave(self) -> None:
        """Compute no further; nothing is written then."""
        self._leave.set()

    def _main(self) -> None:
        try:
            if self._skin is not None:
                press(self._skin, self._folder, watch=self._trains)
            self._told.put(Film(Events.read(self._folder)))
        except WindowClosedError:
            return
        except (TactileLabError, OSError) as error:
            self._told.put(Failed(str(error)))
        except Exception as error:  # the window says so
            self._told.put(Failed(f"It broke. {type(error).__name__}: {error}"))

    def _trains(self, first: int, count: NDArray[np.int64], time: FloatArray) -> None:
        if self._leave.is_set():
            raise WindowClosedError
        self._told.put(TrainsFound(first, count, time))
