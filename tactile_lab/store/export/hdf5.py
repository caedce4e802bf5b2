"""A new HDF5 file on a disk that may be full before it is whole."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tactile_lab.store.progress import Progress


class _Disk(io.RawIOBase):
    """A file that takes what HDF5 writes even where the disk does not.

    HDF5 goes on closing a file that it could not write, prints a trace for each of its
    parts and ends the program. From the first failure on all stays in memory, which
    `failure` tells to whoever looks soon.
    """

    def __init__(self, path: Path) -> None:
        self.failure: OSError | None = None
        self._file = path.open("w+b", buffering=0)
        self._place = self._end = 0
        self._kept: list[tuple[int, bytes]] = []

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        begin = {io.SEEK_SET: 0, io.SEEK_CUR: self._place, io.SEEK_END: self._end}
        self._place = begin[whence] + offset
        return self._place

    def tell(self) -> int:
        return self._place

    def readinto(self, buffer: Any) -> int:
        into = memoryview(buffer).cast("B")
        begin, end = self._place, min(self._place + len(into), self._end)
        size = max(end - begin, 0)
        self._file.seek(begin)
        into[:size] = self._file.read(size).ljust(size, b"\0")
        for at, data in self._kept:
            first, last = max(at, begin), min(at + len(data), end)
            if first < last:
                into[first - begin : last - begin] = data[first - at : last - at]
        self._place += size
        return size

    def write(self, data: Any) -> int:
        left = memoryview(data).cast("B")
        size = len(left)
        while len(left) and self.failure is None:
            try:
                self._file.seek(self._place)
                done = self._file.write(left)
            except OSError as full:
                self.failure = full
            else:
                self._place, left = self._place + done, left[done:]
        if len(left):
            self._kept.append((self._place, bytes(left)))
            self._place += len(left)
        self._end = max(self._end, self._place)
        return size

    def truncate(self, size: int | None = None) -> int:
        self._end = self._place if size is None else size
        if self.failure is None:
            try:
                self._file.truncate(self._end)
            except OSError as full:
                self.failure = full
        return self._end

    def close(self) -> None:
        self._file.close()
        super().close()


@contextmanager
def writing(path: Path, progress: Progress) -> Iterator[tuple[io.RawIOBase, Progress]]:
    """What to open as the HDF5 file at `path`, and a `progress` to tell of it often.

    Raises:
        OSError: the disk did not take all of it; from the progress, and at the end.
    """
    disk = _Disk(path)

    def look(done: float) -> None:
        if disk.failure is not None:
            raise disk.failure
        progress(done)

    try:
        yield disk, look
        if disk.failure is not None:
            raise disk.failure
    finally:
        disk.close()
