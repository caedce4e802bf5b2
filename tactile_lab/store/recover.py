"""Makes a run that was cut short whole again, on a copy."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RecordingError, RunFolderError
from tactile_lab.store.certificate import certify, redetect, searched_is_stored
from tactile_lab.store.columns import pyramid_of
from tactile_lab.store.folder import (
    DATA,
    INFO,
    RESERVE,
    check_space,
    is_live,
    read_info,
    write_json,
)
from tactile_lab.store.layout import CHECK, RECORDS, create_channel
from tactile_lab.store.opening import missing_bytes
from tactile_lab.store.places import PLACES
from tactile_lab.store.run import Run
from tactile_lab.store.salvage import Salvage
from tactile_lab.store.torn import rows_of

KEPT = "data.killed.h5"
"""What the file is called that the crash left."""


@dataclass(frozen=True)
class Recovery:
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


def recover(path: Path) -> Recovery:
    """Recover the run in folder `path`; the file as it was stays beside the new one.

    Raises:
        RunFolderError: the run is whole, still being written, or beyond reading.
        RecordingError: no room or no right to write.
    """
    if is_live(path):
        raise RunFolderError(f"{path} is still being recorded; wait until it ends.")
    if not (path / DATA).exists():
        return _without_data(path)
    try:
        loaded = Run.load(path)
    except RunFolderError:
        if missing_bytes(path / DATA) or read_info(path)["status"] != "running":
            raise
        # killed while the datasets were declared: there is no sample yet
        (path / DATA).rename(path / KEPT)
        return _without_data(path)
    with loaded as run:
        if run.status != "running":
            raise RunFolderError(
                f"{path} was not cut short (status {run.status}); nothing to recover. "
                "`tactile-lab verify` checks it."
            )
        check_space(path, (path / DATA).stat().st_size + RESERVE)
        new = path / "data.recovering.h5"
        try:
            with h5py.File(new, "w", libver="latest") as file:
                samples, dropped = _copy(run, file)
                file.flush()
        except OSError as error:
            new.unlink(missing_ok=True)
            raise RecordingError(f"{new} cannot be written: {error}.") from error
    (path / DATA).rename(path / KEPT)
    new.rename(path / DATA)
    (path / PLACES).unlink(missing_ok=True)
    return _derive(path, samples, dropped)


def _without_data(path: Path) -> Recovery:
    """A run that died before its first sample."""
    info = read_info(path)
    if info["status"] != "running":
        raise RunFolderError(f"{path} was not cut short; nothing to recover.")
    write_json(path / INFO, {**info, "status": "recovered", "samples": {}})
    kept = path / KEPT
    return Recovery(0, 0, 0, kept if kept.exists() else None)


def _copy(run: Run, file: h5py.File) -> tuple[int, int]:
    """Copy what can be read; (samples per channel, samples dropped)."""
    file.attrs.update(run.attributes)
    for name, record in RECORDS.items():
        rows = _readable_rows(run, name, record)
        dataset = file.create_dataset(
            name, data=rows, maxshape=(None,), chunks=True, fletcher32=True
        )
        dataset.attrs.update(run.table_attributes(name))
    salvages = {name: Salvage(run, name) for name in run.signals}
    longest = max(
        (int(run.column(name)[0].shape[0]) for name in run.signals), default=0
    )
    samples = min((one.samples for one in salvages.values()), default=0)
    for name, salvage in salvages.items():
        _copy_channel(run, name, salvage, samples, file)
    _cut(file, samples)
    return samples, max(0, longest - samples)


def _readable_rows(run: Run, name: str, record: np.dtype[Any]) -> NDArray[Any]:
    """A table; empty where the crash left it unreadable."""
    try:
        return rows_of(run.table(name))
    except (OSError, RuntimeError):
        return np.empty(0, record)


def _copy_channel(
    run: Run, name: str, salvage: Salvage, length: int, file: h5py.File
) -> None:
    """Copy the first `length` samples; rebuild what is derived from them."""
    samples, _, _ = run.column(name)
    new = create_channel(file, name, samples.dtype, salvage.size)
    new.attrs.update(samples.attrs)
    new.resize(length, axis=0)
    checks, bins = [], [pyramid_of(np.empty(0, samples.dtype))]
    for first in range(0, length, salvage.size):
        codes = salvage.chunk(first // salvage.size)
        assert codes is not None, "it was there when samples were counted"
        codes = codes[: length - first]
        new[first : first + codes.size] = codes
        checks.append((codes.size, zlib.crc32(codes.data)))
        bins.append(pyramid_of(codes))
    for kind, rows in (
        ("checks", np.array(checks, CHECK)),
        ("pyramid", np.concatenate(bins)),
    ):
        file[f"{kind}/{name}"].resize(rows.size, axis=0)
        file[f"{kind}/{name}"][:] = rows


def _cut(file: h5py.File, samples: int) -> None:
    """Drop records of samples that are not there any more."""
    if "samples" not in file:
        return
    for name, column in (
        ("segments", "first"),
        ("gaps", "sample"),
        ("overrange", "sample"),
    ):
        rows = file[name][()]
        keep = rows[rows[column] < max(samples, 1)]
        file[name].resize(keep.size, axis=0)
        file[name][:] = keep


def _derive(path: Path, samples: int, dropped: int) -> Recovery:
    """Find the spikes again, count, and patch `run.json`."""
    with Run.load(path) as run:
        found = redetect(run) if searched_is_stored(run) else None
        axis = run.axis
    if found is not None:
        times = axis.time_of(found["sample"]) if axis.first.size else found["sample"]
        rows = np.empty(found.size, RECORDS["spikes"])
        for column in ("sample", "amplitude", "width"):
            rows[column] = found[column]
        rows["time"] = times
        with h5py.File(path / DATA, "r+", libver="latest") as file:
            file["spikes"].resize(rows.size, axis=0)
            file["spikes"][:] = rows
    with Run.load(path) as run:
        spikes = int(run.records("spikes").size)
        counters = {
            name: {"produced": None, "written": run.stored(name)}
            for name in run.signals
        }
        info = {
            **run.info,
            "status": "recovered",
            "samples": counters,
            "spikes_online": spikes,
            "dropped": dropped,
            "duration_s": run.duration,
        }
        write_json(path / INFO, info)
        run.info = info
        certificate = certify(run)
    write_json(path / INFO, {**info, "loss": certificate.to_json()})
    return Recovery(samples, dropped, spikes, path / KEPT)
