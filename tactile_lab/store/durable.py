"""Pushes a growing file to the disk, so that a power cut costs seconds, not a run."""

from __future__ import annotations

import os
import threading
from pathlib import Path

EVERY = 1.0
"""Seconds between two syncs; what a power cut can cost beside the block in flight."""


class Durable:
    """Syncs a file in a thread of its own, because a disk may take its time for it.

    What a program has written survives its own death, but lies in the computer's
    memory until the system writes it out, which may be half a minute later.

    Args:
        path: of the file, which exists.
        every: s from the end of one sync to the next.
    """

    def __init__(self, path: Path, *, every: float = EVERY) -> None:
        self.failure: OSError | None = None
        self.count = 0
        self._every = every
        self._file = os.open(path, os.O_RDWR)
        self._ended = threading.Event()
        _sync_folder(path.parent)
        _sync_folder(path.parent.parent)
        self._thread = threading.Thread(target=self._work, name="sync", daemon=True)
        self._thread.start()

    def raise_failure(self) -> None:
        """Raise what the disk answered to a sync, if that was an error."""
        if self.failure is not None:
            raise self.failure

    def close(self) -> None:
        """Sync once more and let go of the file; idempotent.

        Raises:
            OSError: the disk did not take it.
        """
        if self._ended.is_set():
            return
        self._ended.set()
        self._thread.join()
        try:
            os.fsync(self._file)
        finally:
            os.close(self._file)

    def _work(self) -> None:
        while not self._ended.wait(self._every):
            try:
                os.fsync(self._file)
            except OSError as failure:
                self.failure = failure
                return
            self.count += 1


def _sync_folder(path: Path) -> None:
    """Make the names in a folder last; Windows has no such call and no need."""
    if os.name != "posix":
        return
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
