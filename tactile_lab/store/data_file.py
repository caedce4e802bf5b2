"""`data.h5` as a file: written for SWMR with a ledger beside it, opened for reading."""

from __future__ import annotations

import ctypes
import os
import sys
from contextlib import suppress
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tactile_lab.scope import Stream
from tactile_lab.store.columns import Column, SampleColumn
from tactile_lab.store.durable import DiskSync
from tactile_lab.store.folder import DATA, LEDGER
from tactile_lab.store.layout import RECORDS, Layout, declare
from tactile_lab.store.ledger import Ledger


class DataFile:
    """The file of a run that is being written; every dataset is there from the start.

    Args:
        folder: of the run.
        layout: what to store.
        stream: scaling of the samples; None where the run has no scope.
        sync: push file and ledger to the disk every second (see `DiskSync`).

    Attributes:
        samples: one per signal of the layout.

    Raises:
        OSError: it exists, or cannot be written.
        RecordingError: a signal of the layout is not streamed.
    """

    def __init__(
        self, folder: Path, layout: Layout, stream: Stream | None, *, sync: bool
    ) -> None:
        # no chunk cache, for chunks are not read back; no free space to fill with them
        self._file = h5py.File(
            folder / DATA, "x", libver="latest", rdcc_nbytes=0, fs_strategy="none"
        )
        declare(self._file, layout, stream)
        self._path = folder / LEDGER
        self._file.flush()
        self._ledger = Ledger(self._path, self._file.id.get_file_image())
        names = layout.signals if stream is not None else ()
        self.samples = [SampleColumn(self._file, name, self._ledger) for name in names]
        self._tables = {name: Column(self._file[name]) for name in RECORDS}
        self._durable = DiskSync(folder / DATA, self._path) if sync else None
        self._file.swmr_mode = True
        self._file.flush()

    def append(self, table: str, rows: list[tuple[Any, ...]]) -> None:
        """Put rows, fields in order, behind those a table has."""
        self._write(table, self._tables[table].length, rows)

    def replace_last(self, table: str, row: tuple[Any, ...]) -> None:
        """Overwrite a table's newest row."""
        self._write(table, self._tables[table].length - 1, [row])

    def flush(self) -> None:
        """Let readers see what was written.

        Raises:
            OSError: now, or what the disk answered to the last sync.
        """
        if self._durable is not None:
            self._durable.raise_failure()
        self._file.flush()

    def close(self, *, failed: bool) -> None:
        """Close and sync, as far as that goes where writing has `failed` before."""
        try:
            self._file.close()
        finally:
            self._ledger.close()
            if self._durable is not None:
                # a failure has been told already
                with suppress(*(OSError,) if failed else ()):
                    self._durable.close()

    def drop_ledger(self) -> None:
        """Nobody will have to recover the run."""
        self._path.unlink()

    def _write(self, table: str, first: int, rows: list[tuple[Any, ...]]) -> None:
        values = np.array(rows, RECORDS[table])
        self._tables[table].put(first, values)
        self._ledger.note(table, first, values)


def open_data(path: Path, *, live: bool) -> h5py.File:
    """Open for reading: complete, being written, or as a crash left it.

    Args:
        path: of the file.
        live: whether a writer still has it open.

    Raises:
        OSError: no HDF5 file, or damaged beyond opening.
    """
    if live:
        return h5py.File(path, "r", libver="latest", swmr=True)
    _check_texts(path)
    try:
        return h5py.File(path, "r", libver="latest")
    except OSError as refused:
        try:
            return _open_unclosed(path)
        except OSError:
            raise refused from None


def check_inside(file: h5py.File) -> None:
    """Refuse what is kept in another file: it is not what was recorded.

    Raises:
        OSError: something in it is a link, or a table's bytes lie elsewhere.
    """
    found: list[tuple[bytes, int]] = []
    # nothing is opened within the visit: what is raised there becomes a SystemError
    file.id.links.visit(lambda name, link: found.append((name, link.type)), info=True)
    for name, kind in found:
        outside = kind != h5py.h5l.TYPE_HARD
        if not outside:
            try:
                node = h5py.h5o.open(file.id, name)
            except (OSError, KeyError, RuntimeError):
                continue  # damaged: said where it is read
            if isinstance(node, h5py.h5d.DatasetID):
                made = node.get_create_plist()
                virtual = made.get_layout() == h5py.h5d.VIRTUAL
                outside = virtual or made.get_external_count() > 0
        if outside:
            raise OSError(
                f"/{name.decode()} leads elsewhere, to what this run did not record"
            )


HEAP = b"GCOL\x01\x00\x00\x00"
"""With which HDF5 begins a heap of texts (its file format, III.E)."""
DECLARED = 1 << 20
"""Length of the file's begin in which all attributes stand, bytes."""


def _check_texts(path: Path) -> None:
    """Refuse a heap of texts in which a free place has no length.

    HDF5 would look for the place behind it for ever as it reads an attribute.
    """
    with path.open("rb") as file:
        begin = file.read(DECLARED)
    at = begin.find(HEAP)
    while at >= 0:
        end = min(at + int.from_bytes(begin[at + 8 : at + 16], "little"), len(begin))
        place = at + 16
        while place + 16 <= end:
            used = begin[place : place + 2] != b"\0\0"
            size = int.from_bytes(begin[place + 8 : place + 16], "little")
            if not used and size == 0:
                raise OSError(
                    f"{path.name} is damaged at byte {place}, among the texts that "
                    "say what the samples are"
                )
            place += 16 + (size + 7) // 8 * 8 if used else size
        at = begin.find(HEAP, at + len(HEAP))


def _open_unclosed(path: Path) -> h5py.File:
    """Open a file that nobody closed, or that was cut, as far as it goes.

    HDF5 takes its writer for alive: it would read damaged metadata 100 times, with
    pauses that double, until the writer has mended it. There is none, so once will do.
    """
    access = h5py.h5p.create(h5py.h5p.FILE_ACCESS)
    access.set_fclose_degree(h5py.h5f.CLOSE_STRONG)
    access.set_libver_bounds(h5py.h5f.LIBVER_LATEST, h5py.h5f.LIBVER_LATEST)
    # h5py has no name for this call of the library it brings along
    library = ctypes.CDLL("hdf5" if sys.platform == "win32" else h5py.h5p.__file__)
    library.H5Pset_metadata_read_attempts(ctypes.c_int64(access.id), ctypes.c_uint(1))
    flags = h5py.h5f.ACC_RDONLY | h5py.h5f.ACC_SWMR_READ
    return h5py.File(h5py.h5f.open(os.fsencode(path), flags, access))
