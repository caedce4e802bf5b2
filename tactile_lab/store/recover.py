"""Makes a run that was cut short whole again, on a copy."""

from __future__ import annotations

import io
import zlib
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RunFolderError
from tactile_lab.store.certificate import redetect, write_certificate
from tactile_lab.store.columns import Column, SampleColumn
from tactile_lab.store.data_file import open_data
from tactile_lab.store.folder import (
    CHANGED,
    DATA,
    KEPT,
    LEDGER,
    RESERVE,
    as_written,
    is_live,
    read_info,
    write_info,
)
from tactile_lab.store.layout import RECORDS
from tactile_lab.store.ledger import LedgerContents, goes_on, read_ledger
from tactile_lab.store.progress import Progress, nothing, share
from tactile_lab.store.run import Run
from tactile_lab.whole_file import check_space, failing_as

ELSEWHERE = (
    "Copy it to where there is room and the right to write, and recover it there."
)
"""What to do with a run that cannot be written where it is."""
FILLING = 0.6
"""Part of the work until the samples are copied; then spikes are searched twice."""

EMPTY = 1 << 18
"""Bytes that no data file has before its first sample."""

BITSHUFFLE, OF_ITS_OWN = 32008, 3
"""A filter's number in HDF5, and how many values it puts before those it is given
whenever a dataset is made with it."""

OF_SAMPLES = {"segments": "first", "gaps": "sample", "overrange": "sample"}
"""Tables about samples, and the column that tells which; lost ones are dropped."""


@dataclass(frozen=True)
class Recovered:
    """What could be saved.

    Attributes:
        samples: per channel, as many as all channels have.
        dropped: samples per channel that some channel had beyond that or could not
            give back.
        spikes: found again in the stored samples, or as stored on line.
        original: the file as the crash left it; None where there was none.
    """

    samples: int
    dropped: int
    spikes: int
    original: Path | None


def recover(path: Path, progress: Progress = nothing) -> Recovered:
    """Recover the run in folder `path`; the file as it was stays beside the new one.

    Raises:
        RunFolderError: the run is whole, still being written, or beyond reading.
        RecordingError: no room or no right to write.
    """
    if is_live(path):
        raise RunFolderError(f"{path} is still being recorded; wait until it ends.")
    info = read_info(path)
    # the ledger outlives a run whose record failed, of which nobody was killed
    if info["status"] != "running" and not (path / LEDGER).exists():
        raise RunFolderError(
            f"{path} was not cut short (status {info['status']}); nothing to recover. "
            "`tactile-lab verify` checks it."
        )
    if not as_written(info):  # what is written now gets a hash of its own
        info = {**info, CHANGED: True}
    # a recovery that was cut short itself has put it there already
    killed = path / KEPT if (path / KEPT).exists() else path / DATA
    listed = written = read_ledger(path / LEDGER)
    if not written.declared and killed.exists():
        written = _told_by(killed)
    if not written.declared or not killed.exists():
        _refuse_if_there_may_be_samples(path, killed)
        return _without_samples(path, info)
    if not written.rows.get("segments"):
        written.rows["segments"] = _told_by(killed).rows.get("segments", [])
    needed = killed.stat().st_size + RESERVE
    check_space(path, needed, "for the copy and the reserve")
    new = path / "data.recovering.h5"
    with failing_as(f"{path} cannot be written", ELSEWHERE):
        try:
            new.write_bytes(written.declared)
            with h5py.File(new, "r+", libver="latest") as file:
                told = share(progress, 0.0, FILLING)
                samples, dropped = _fill(file, written, killed, told)
        except BaseException:
            with suppress(OSError):  # it is not there on a disk that may only be read
                new.unlink(missing_ok=True)
            raise
    killed.rename(path / KEPT)
    new.replace(path / DATA)
    recovery = _derive(path, info, samples, dropped)
    progress(1.0)
    if listed.declared:  # else somebody may have a better copy of it
        (path / LEDGER).unlink()
    return recovery


def _told_by(killed: Path) -> LedgerContents:
    """What a data file itself tells was written: older versions kept no ledger.

    Nothing where it cannot be opened; tables and chunks as far as they can be read.
    """
    image = io.BytesIO()
    rows: dict[str, list[Any]] = {name: [] for name in RECORDS}
    chunks: dict[str, Any] = {}
    try:
        with (
            open_data(killed, live=False) as file,
            h5py.File(image, "w", libver="latest") as declared,
        ):
            declared.attrs.update(file.attrs)
            file.visititems(lambda name, item: _declare_again(declared, name, item))
            for name in (name for name in RECORDS if name in file):
                rows[name] = _readable_rows(file[name])
            for name in file.get("samples", ()):
                chunks[f"samples/{name}"] = _listed(file, name)
    except (OSError, KeyError, RuntimeError, ValueError):
        return LedgerContents(b"", {}, {})
    return LedgerContents(image.getvalue(), rows, chunks)


def _declare_again(file: h5py.File, name: str, item: h5py.Dataset | h5py.Group) -> None:
    """Declare a dataset as it is, but empty."""
    if isinstance(item, h5py.Dataset):
        folder, _, own = name.rpartition("/")
        group = file.require_group(folder or "/")
        empty = h5py.h5s.create_simple((0,), (h5py.h5s.UNLIMITED,))
        like = item.id.get_create_plist()
        filters = [like.get_filter(number) for number in range(like.get_nfilters())]
        like.remove_filter(h5py.h5z.FILTER_ALL)
        for code, flags, values, _ in filters:
            own_values = values[OF_ITS_OWN:] if code == BITSHUFFLE else values
            like.set_filter(code, flags, own_values)
        h5py.h5d.create(group.id, own.encode(), item.id.get_type(), empty, dcpl=like)
        file[name].attrs.update(item.attrs)


def _readable_rows(table: h5py.Dataset) -> list[Any]:
    """Rows of a table up to the first that cannot be read."""
    rows: list[Any] = []
    with suppress(OSError):
        for first in range(0, table.shape[0], table.chunks[0]):
            rows += table[first : first + table.chunks[0]].tolist()
    return rows


def _listed(file: h5py.File, name: str) -> dict[int, list[tuple[int, int, int, int]]]:
    """Chunks as `LedgerContents` has them; the newest may lack its checksum."""
    samples, found = file[f"samples/{name}"], {}
    checks = _readable_rows(file[f"checks/{name}"])

    def note(chunk: Any) -> None:
        number = chunk.chunk_offset[0] // samples.chunks[0]
        if number < len(checks):
            found[number] = [(chunk.byte_offset, chunk.size, *checks[number])]

    samples.id.chunk_iter(note)
    return found


def _refuse_if_there_may_be_samples(path: Path, killed: Path) -> None:
    """Call no run empty whose ledger is damaged: what it says could still be mended."""
    size = killed.stat().st_size if killed.exists() else 0
    if size > EMPTY or goes_on(path / LEDGER):
        raise RunFolderError(
            f"{path} cannot be recovered: the beginning of {LEDGER} is damaged or "
            f"gone, but {killed.name} has {size} bytes and may hold samples. Nothing "
            f"was changed. Keep {killed.name} and {LEDGER}, and put an undamaged copy "
            "of the ledger in its place."
        )


def _without_samples(path: Path, info: dict[str, Any]) -> Recovered:
    """A run that died before its first sample."""
    kept = None
    with failing_as(f"{path} cannot be written", ELSEWHERE):
        if (path / DATA).exists():
            kept = (path / DATA).rename(path / KEPT)
        (path / LEDGER).unlink(missing_ok=True)
    write_info(path, {**info, "status": "recovered", "samples": {}})
    return Recovered(0, 0, 0, kept)


def _fill(
    file: h5py.File, written: LedgerContents, killed: Path, progress: Progress
) -> tuple[int, int]:
    """Put what was written and can be read into `file`.

    Returns:
        Samples per channel, and samples dropped.
    """
    names = list(file.get("samples", ()))
    channels = [_Chunks(file[f"samples/{name}"], written, killed) for name in names]
    columns = [SampleColumn(file, name) for name in names]
    longest = max((channel.length for channel in channels), default=0)
    # samples of which nothing tells the time are none
    for number in count() if names and written.rows["segments"] else ():
        progress(min(number * channels[0].size / max(longest, 1), 1.0))
        codes = [channel.read(number) for channel in channels]
        samples = min(part.size for part in codes)
        for column, part in zip(columns, codes, strict=True):
            column.append(part[:samples])
        if samples < channels[0].size:
            break  # written when it was the last
    for column in columns:
        column.write()
        column.write_pyramid()
    kept = min((column.written for column in columns), default=0)
    for name in (name for name in RECORDS if name in file):
        rows = np.array(written.rows[name], file[name].dtype)
        if names and name in OF_SAMPLES:
            rows = rows[rows[OF_SAMPLES[name]] < max(kept, 1)]
        Column(file[name]).put(0, rows)
    return kept, longest - kept


class _Chunks:
    """Chunks of one channel, from where the ledger says they were written.

    Args:
        like: the channel's dataset, for type, filters and scale.
        written: what the ledger says.
        killed: the file that holds the chunks.

    Attributes:
        size: samples in a full chunk.
        length: samples that were written.
    """

    def __init__(
        self, like: h5py.Dataset, written: LedgerContents, killed: Path
    ) -> None:
        name = like.name.strip("/")
        self.size = int(like.chunks[0])
        self._killed, self._entries = killed, written.chunks[name]
        ends = [n * self.size + new[-1][2] for n, new in self._entries.items()]
        self.length = max(ends, default=0)
        self._scale = int(like.attrs["code_scale"])
        # HDF5 decompresses what it finds in a dataset of its own
        memory = h5py.File(name, "w", driver="core", backing_store=False)
        _declare_again(memory, "one", like)
        self._one = memory["one"]
        self._one.resize((self.size,))

    def read(self, number: int) -> NDArray[np.int16]:
        """Scope codes of a chunk as last written, or before; none where none hold."""
        for offset, size, samples, crc in reversed(self._entries.get(number, [])):
            with self._killed.open("rb") as file:
                file.seek(offset)
                self._one.id.write_direct_chunk((0,), file.read(size).ljust(size))
            with suppress(OSError):
                codes = self._one[:samples]
                if zlib.crc32(codes.data) == crc:
                    found: NDArray[np.int16] = codes.astype(np.int16) * self._scale
                    return found
        return np.empty(0, np.int16)


def _derive(path: Path, info: dict[str, Any], samples: int, dropped: int) -> Recovered:
    """Find the spikes again, count, and patch `run.json`."""
    with Run.load(path) as run:
        found = redetect(run)
        if found is not None:
            rows = np.empty(found.size, RECORDS["spikes"])
            for column in ("sample", "amplitude", "width"):
                rows[column] = found[column]
            if found.size:
                rows["time"] = run.axis.time_of(found["sample"])
        else:
            rows = run.records("spikes")
        counters = {
            name: {"produced": None, "written": run.stored(name)}
            for name in run.signals
        }
        info = {
            **info,
            "status": "recovered",
            "samples": counters,
            "spikes_online": rows.size,
            "dropped": dropped,
            "duration_s": run.duration,
        }
    with h5py.File(path / DATA, "r+", libver="latest") as file:
        Column(file["spikes"]).put(0, rows)
    write_info(path, info)
    write_certificate(path)
    return Recovered(samples, dropped, rows.size, path / KEPT)
