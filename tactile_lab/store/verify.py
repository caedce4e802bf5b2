"""Looks for damage in a run: every chunk, checksum, counter and spike."""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import RunFolderError
from tactile_lab.quantity import show
from tactile_lab.store.certificate import (
    Certificate,
    certify,
    constants,
    redetect,
    unmatched,
)
from tactile_lab.store.columns import pyramid_of
from tactile_lab.store.folder import (
    CHANGED,
    DATA,
    as_written,
    digest,
    has_lost_data,
    is_live,
    read_info,
)
from tactile_lab.store.layout import BIN, RECORDS
from tactile_lab.store.progress import Progress, counted, each, nothing
from tactile_lab.store.run import Run
from tactile_lab.trust import INFO

UNREADABLE = (OSError, KeyError, RuntimeError)
"""What h5py raises for damaged bytes."""


@dataclass(frozen=True)
class Damage:
    """One thing that is not as it was written.

    Attributes:
        where: file, dataset and place in it.
        what: what is wrong, for a person.
    """

    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


@dataclass(frozen=True)
class Verification:
    """What `verify` found.

    Attributes:
        findings: damage, located; empty for a sound run.
        certificate: loss; None where the data cannot be read far enough.
        notes: what a person should know that is no damage.
    """

    findings: tuple[Damage, ...]
    certificate: Certificate | None
    notes: tuple[str, ...] = ()

    @property
    def sound(self) -> bool:
        """No damage was found."""
        return not self.findings


def verify(path: Path, progress: Progress = nothing) -> Verification:
    """Check the run in folder `path`, reading all of it; changes nothing."""
    try:
        info = read_info(path)
    except RunFolderError as error:
        return Verification((Damage(INFO, str(error)),), None)
    findings, notes = [], []
    if info["status"] == "running":
        if is_live(path):
            notes.append("the run is still being written; what is there was checked")
        else:
            findings.append(
                Damage(INFO, "the run was cut short; `tactile-lab recover` it")
            )
    if lost := info.get("samples_missing"):
        notes.append(f"samples were lost while the run was recorded: {lost}")
    if extra := info.get("samples_surplus"):
        notes.append(f"samples were too many while the run was recorded: {extra}")
    findings += _files(path, info)
    if not (path / DATA).exists():
        if has_lost_data(path, info):
            findings.append(Damage(DATA, "the file is missing"))
        else:
            notes.append("the run stored no samples")
        return Verification(tuple(findings), None, tuple(notes))
    try:
        run = Run.load(path)
    except RunFolderError as error:
        return Verification((*findings, Damage(DATA, str(error))), None, tuple(notes))
    certificate = None
    with run:
        try:
            findings += _length(run)
            findings += _tables(run)
            findings += _missing(run)
            for name, told in each(run.signals, progress, more=1):
                findings += _channel(run, name, told)
            findings += _constants(run)
            if not any(finding.where.startswith(DATA) for finding in findings):
                findings += _counters(run)
                certificate = certify(run)
                progress(1.0)
                findings += _certificate(run, certificate)
                # the spikes of a cut-short run lag behind its samples
                if certificate.spikes and info["status"] != "running":
                    findings += _spikes(run)
        except (OSError, KeyError, RuntimeError, ValueError) as error:
            findings.append(Damage(DATA, f"its structure is damaged ({_brief(error)})"))
    return Verification(
        (*findings, *_sealed(info, findings)), certificate, tuple(notes)
    )


def _sealed(info: dict[str, Any], found: list[Damage]) -> Iterator[Damage]:
    """Whether `run.json` is as it was written, where nothing else tells of it."""
    known = any(finding.where.startswith(INFO) for finding in found)
    if not known and not as_written(info):
        yield Damage(INFO, "was changed after it was written (SHA-256 differs)")
    if info.get(CHANGED):
        yield Damage(
            INFO, "was changed before the run was recovered (SHA-256 differed)"
        )


def _constants(run: Run) -> Iterator[Damage]:
    """Attributes and types that are not as they were written."""
    written = run.info.get("constants")
    if not isinstance(written, dict):
        return  # a run of an older version, or one that was cut short
    found = constants(run)["constants"]
    for place in sorted({*written} & {*found}):  # what is gone is told elsewhere
        if written[place] != found[place]:
            what = "what it says of itself (scale, unit, type) is not as it was written"
            yield Damage(f"{DATA} {place}", what)


def _files(path: Path, info: dict[str, Any]) -> Iterator[Damage]:
    """Files beside the data that are missing or not as they were written."""
    for name, wanted in (info.get("files") or {}).items():
        try:
            data = (path / name).read_bytes()
        except OSError as error:
            yield Damage(name, f"cannot be read ({error.strerror})")
            continue
        if digest(data) != wanted:
            yield Damage(name, "was changed after the run (SHA-256 differs)")


def _length(run: Run) -> Iterator[Damage]:
    """Whether the file is as long as it was when it was closed."""
    length = run.table("events").file.id.get_filesize()
    missing = length - (run.path / DATA).stat().st_size
    if missing > 0 and run.status != "running":
        yield Damage(DATA, f"{missing} bytes are missing at the end")


def _tables(run: Run) -> Iterator[Damage]:
    """Tables that cannot be read; their checksums are HDF5's own."""
    for name in RECORDS:
        try:
            run.records(name)
        except (*UNREADABLE, RunFolderError) as error:
            yield Damage(f"{DATA} /{name}", f"cannot be read ({_brief(error)})")


def _missing(run: Run) -> Iterator[Damage]:
    """Signals that `run.json` counts, or of which a part is there, but no samples."""
    counted = run.info.get("samples") or {}
    for name in sorted({*counted, *run.checked} - {*run.signals}):
        written = (counted.get(name) or {}).get("written")
        told = "" if written is None else f"; {INFO} counts {written}"
        yield Damage(f"{DATA} /samples/{name}", f"the samples are missing{told}")


def _certificate(run: Run, found: Certificate) -> Iterator[Damage]:
    """What the certificate in `run.json` says that the data does not."""
    stored, now = run.info.get("loss"), found.to_json()
    if not stored or run.info.get("status") == "running":
        return
    for name in ("produced", "written", "gaps", "spikes_online", "spikes_offline"):
        if name in stored and stored[name] != now[name]:
            yield Damage(
                f"{INFO} loss.{name}",
                f"says {stored[name]}; counted again it is {now[name]}",
            )


def _channel(run: Run, name: str, progress: Progress) -> Iterator[Damage]:
    """Chunks of one channel that are missing, unreadable or not as written."""
    place, derived = f"{DATA} /samples/{name}", f"{DATA} /pyramid/{name}"
    running = run.status == "running"
    try:
        samples, checks, pyramid = run.column(name)
        written = checks[()]
    except UNREADABLE as error:
        yield Damage(place, f"cannot be read ({_brief(error)})")
        return
    try:
        bins = pyramid[()]
    except UNREADABLE as error:
        yield Damage(derived, f"cannot be read ({_brief(error)})")
        bins = None
    if running:
        written = written[:-1]  # its writer may be, or may have died, in the last chunk
    stored = int(written["samples"].sum(dtype=np.int64))
    if stored != samples.shape[0] and not running:
        yield Damage(
            place, f"{samples.shape[0]} samples are stored but {stored} have checksums"
        )
    chunks = counted(written.tolist(), written.size, progress)
    for number, (count, crc) in enumerate(chunks):
        first = number * samples.chunks[0]
        stop = first + count
        codes = _chunk(samples, first, count, crc)
        if isinstance(codes, str):
            yield Damage(f"{place}[{first}:{stop}]", codes + _when(run, first))
        elif bins is not None:
            part = bins[first // BIN : -(-stop // BIN)]
            # the writer of a running one holds back, or has lost, the newest
            newest = running and -(-stop // BIN) >= bins.size
            if not newest and not np.array_equal(part, pyramid_of(codes)):
                yield Damage(derived, f"does not fit samples {first} to {stop - 1}")


def _chunk(
    samples: h5py.Dataset, first: int, count: int, crc: int
) -> NDArray[Any] | str:
    """The codes of one chunk, or what is wrong with it."""
    try:
        codes: NDArray[Any] = samples[first : first + count]
        if zlib.crc32(codes.data) == crc:
            return codes
        what = "the samples are not those that were written (CRC-32 differs)"
    except UNREADABLE as error:
        what = f"the chunk cannot be decompressed ({_brief(error)})"
    try:
        info = samples.id.get_chunk_info_by_coord((first,))
    except (OSError, RuntimeError, ValueError) as error:
        return f"the chunk's place is not known ({_brief(error)})"
    return "the chunk is missing" if info.byte_offset is None else what


def _when(run: Run, sample: int) -> str:
    """When a sample was taken, where the table that tells it can be read."""
    try:
        axis = run.axis
    except OSError:
        return ""
    if axis.first.size == 0:
        return ""
    return f", from {show(float(axis.time_of(float(sample))), 's', 6)} on"


def _counters(run: Run) -> Iterator[Damage]:
    """Counters in `run.json` that do not fit the file."""
    for name, counters in (run.info.get("samples") or {}).items():
        written = counters.get("written")
        if name in run.signals and written != run.stored(name):
            yield Damage(
                f"{INFO} samples.{name}",
                f"says {written} samples were written; {DATA} has {run.stored(name)}",
            )
    online = run.info.get("spikes_online")
    if online is not None and online != run.records("spikes").size:
        yield Damage(
            f"{INFO} spikes_online",
            f"says {online} spikes; {DATA} has {run.records('spikes').size}",
        )


def _spikes(run: Run) -> Iterator[Damage]:
    """Spikes that are stored but not in the samples, or the other way round."""
    found = redetect(run)
    if found is None:
        return
    odd = unmatched(run.records("spikes")["sample"], found["sample"])
    for sample in odd[:10]:
        yield Damage(
            f"{DATA} /spikes",
            f"stored and found again differ at sample {sample:.3f}"
            + _when(run, int(sample)),
        )
    if odd.size > 10:
        yield Damage(f"{DATA} /spikes", f"and at {odd.size - 10} more")


def _brief(error: Exception) -> str:
    """The first sentence of what a library says."""
    return str(error).strip("'\"").split("\n")[0][:120]
