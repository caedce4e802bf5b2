"""Pushes growing files to the disk, so that a power cut costs seconds, not a run."""

from __future__ import annotations

import os
import threading
from pathlib import Path

EVERY = 1.0
"""Seconds between two syncs; what a power cut can cost beside the block in flight."""


class DiskSync:
    """Syncs files in a thread of its own, because a disk may take its time for it.

    What a program has written survives its own death, but lies in the computer's
    memory until the system writes it out, which may be half a minute later.

    Args:
        paths: of the files, in one folder, which exist.
        every: s from the end of one sync to the next.
    """

    def __init__(self, *paths: Path, every: float = EVERY) -> None:
        self.failure: OSError | None = None
        self.count = 0
        self._every = every
        self._files = [os.open(path, os.O_RDWR) for path in paths]
        self._ended = threading.Event()
        _sync_folder(paths[0].parent)
        _sync_folder(paths[0].parent.parent)
        self._thread = threading.Thread(target=self._work, name="sync", daemon=True)
        self._thread.start()

    def raise_failure(self) -> None:
        """Raise what the disk answered to a sync, if that was an error."""
        if self.failure is not None:
            raise self.failure

    def close(self) -> None:
        """Sync once more and let go of the files; idempotent.

        Raises:
            OSError: the disk did not take it.
        """
        if self._ended.is_set():
            return
        self._ended.set()
        self._thread.join()
        try:
            self._sync()
        finally:
            for file in self._files:
                os.close(file)

    def _work(self) -> None:
        while not self._ended.wait(self._every):
            try:
                self._sync()
            except OSError as failure:
                self.failure = failure
                return
            self.count += 1

    def _sync(self) -> None:
        for file in self._files:
            os.fsync(file)


def _sync_folder(path: Path) -> None:
    """Make the names in a folder last; Windows has no such call and no need."""
    if os.name != "posix":
        return
    folder = os.open(path, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
