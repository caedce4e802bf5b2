"""Opens `data.h5` for reading: complete, being written, or left behind by a crash.

A file whose writer was killed carries HDF5's consistency flag. HDF5 then opens it with
``swmr=True`` only, and in that mode it waits for ever on damaged metadata, hoping that
a writer will repair it. No writer will, so such a file is read through a view that
shows the superblock as if the file had been closed where it ends. So is a truncated
one, as far as it goes. Nothing on disk is changed.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path
from typing import Any

import h5py
import hdf5plugin  # noqa: F401  (registers the samples' compression filter)

SUPERBLOCK = 48
"""Bytes of a superblock of version 2 or 3 with 8-byte addresses."""

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_FLAGS, _END, _CHECKSUM = 11, 28, 44


def open_data(path: Path, *, live: bool) -> h5py.File:
    """Open for reading.

    Args:
        path: of the file.
        live: whether a writer still has it open.

    Raises:
        OSError: no HDF5 file, or damaged beyond opening.
    """
    if live:
        return h5py.File(path, "r", libver="latest", swmr=True)
    start = _superblock(path)
    if start is not None and (start[_FLAGS] or missing_bytes(path)):
        return _ViewedFile(_ClosedView(path, start))
    return h5py.File(path, "r", libver="latest")


def missing_bytes(path: Path) -> int:
    """Bytes a closed file lacks at its end; 0 where this cannot be told."""
    start = _superblock(path)
    if start is None or start[_FLAGS]:
        return 0
    (end,) = struct.unpack_from("<Q", start, _END)
    return max(0, int(end) - path.stat().st_size)


def _superblock(path: Path) -> bytes | None:
    """The file's superblock; None where it has none of the expected kind."""
    with path.open("rb") as file:
        start = file.read(SUPERBLOCK)
    whole = len(start) == SUPERBLOCK and start.startswith(_SIGNATURE)
    return start if whole and start[8] in (2, 3) else None


class _ClosedView(io.RawIOBase):
    """The file's bytes with a superblock that says it was closed at its real end."""

    def __init__(self, path: Path, superblock: bytes) -> None:
        self._file = path.open("rb")
        self._size = path.stat().st_size
        start = bytearray(superblock)
        start[_FLAGS] = 0
        struct.pack_into("<Q", start, _END, self._size)
        struct.pack_into("<I", start, _CHECKSUM, lookup3(bytes(start[:_CHECKSUM])))
        self._start = bytes(start)

    def readinto(self, buffer: Any) -> int:
        """Fill `buffer` from the current position."""
        view = memoryview(buffer).cast("B")
        at = self._file.tell()
        count = self._file.readinto(view)
        if at < SUPERBLOCK:
            part = self._start[at : at + count]
            view[: len(part)] = part
        return count

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        """Move; see `io.IOBase.seek`."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Position in the file."""
        return self._file.tell()

    def readable(self) -> bool:
        """Always."""
        return True

    def seekable(self) -> bool:
        """Always."""
        return True

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()
        super().close()


class _ViewedFile(h5py.File):  # type: ignore[misc]
    """An HDF5 file over a view, which it closes with itself."""

    def __init__(self, view: _ClosedView) -> None:
        self._view = view
        try:
            super().__init__(view, "r", libver="latest")
        except BaseException:
            view.close()
            raise

    def close(self) -> None:
        """Let go of the file."""
        super().close()
        self._view.close()


def lookup3(data: bytes) -> int:
    """HDF5's metadata checksum (Bob Jenkins' lookup3, `hashlittle` with seed 0)."""
    a = b = c = (0xDEADBEEF + len(data)) & _MASK
    at = 0
    while len(data) - at > 12:
        x, y, z = struct.unpack_from("<III", data, at)
        a, b, c = _mix((a + x) & _MASK, (b + y) & _MASK, (c + z) & _MASK)
        at += 12
    if len(data) == at:
        return c
    x, y, z = struct.unpack("<III", data[at:].ljust(12, b"\0"))
    return _final((a + x) & _MASK, (b + y) & _MASK, (c + z) & _MASK)


_MASK = 0xFFFFFFFF


def _turn(x: int, by: int) -> int:
    return ((x << by) | (x >> (32 - by))) & _MASK


def _mix(a: int, b: int, c: int) -> tuple[int, int, int]:
    for by in (4, 6, 8, 16, 19, 4):
        a = ((a - c) & _MASK) ^ _turn(c, by)
        c = (c + b) & _MASK
        a, b, c = b, c, a  # the next step does the same to the next in turn
    return a, b, c


def _final(a: int, b: int, c: int) -> int:
    for by in (14, 11, 25, 16, 4, 14, 24):
        c = ((c ^ b) - _turn(b, by)) & _MASK
        a, b, c = b, c, a
    # seven steps leave the turn one past a whole round
    return b
