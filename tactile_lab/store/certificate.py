"""The loss certificate: every sample and every spike of a run accounted for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.quantity import count, show
from tactile_lab.store.folder import UNCOUNTED, digest, write_info
from tactile_lab.store.run import Run
from tactile_lab.store.uncounted import uncounted

PIECE = 1 << 22
"""Samples read at a time."""

SAME_PLACE = 1e-3
"""Two spikes closer than this, in samples, are one; only rounding moves them."""


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """What was produced, what was stored, and what spikes the stored samples hold.

    Attributes:
        produced: samples the scope delivered, all channels, and where it streams
            without gaps those known to be missing; None where the run was cut short
            before it could say, or samples are missing or too many and nobody knows
            how many.
        written: samples stored, all channels.
        gaps: samples per channel known to be missing.
        covered: time that has samples, s; None for a scope that streams without gaps.
        streamed: time from the begin to the end of each stream, s; None likewise.
        online: spikes found while the run went on.
        offline: spikes found again in the stored samples; None where the channel was
            not stored.
        spikes: that only one of the two searches found, lost or invented; None
            likewise.
        seen_from: shortest stretch of missing samples that the scope's driver would
            have noticed by its clock, s; None where it said nothing of that.
        missing: samples are missing, as the run found out, and how many is not known.
        surplus: there are more than time went by for, as the run found out.
        searched: whether spikes were looked for while the run went on.
        asked: whether samples were to be stored.
    """

    produced: int | None
    written: int
    gaps: int
    online: int
    offline: int | None
    spikes: int | None
    covered: float | None = None
    streamed: float | None = None
    seen_from: float | None = None
    missing: bool = False
    surplus: bool = False
    searched: bool = True
    asked: bool = True

    @property
    def samples(self) -> int | None:
        """Samples lost; None if not known."""
        return None if self.produced is None else self.produced - self.written

    @property
    def clean(self) -> bool:
        """Nothing is known to be lost."""
        lost = self.gaps if self.covered is None else 0
        wrong = self.missing or self.surplus
        return not (wrong or self.samples or lost or self.spikes)

    def __str__(self) -> str:
        if self.missing:
            samples = (
                f"samples are missing, not known how many ({self.written:,} stored)"
            )
        elif self.surplus:
            samples = (
                f"more samples than time went by for ({self.written:,} stored), their "
                "times are not known"
            )
        elif self.produced is None:
            samples = f"not known of {self.written:,} samples (the run was cut short)"
        else:
            samples = f"{self.samples:,} of {self.produced:,} samples"
            if self.produced == 0:
                kept = "kept" if self.asked else "asked for"
                samples = f"no samples were {kept}"
            if self.seen_from is not None and self.covered is None:
                samples += f" (gaps of {show(self.seen_from, 's')} or more are seen)"
        if self.covered is not None and self.streamed is not None:
            return (
                f"loss: {samples}; gaps by design, {self.covered:.4g} of "
                f"{self.streamed:.4g} s covered"
            )
        if not self.searched:
            spikes = "spikes were not looked for"
        elif self.spikes is None:
            spikes = (
                f"{count(self.online, 'spike')}, not possible to check (not stored)"
            )
        else:
            spikes = (
                f"{self.spikes} of "
                f"{count(max(self.online, self.offline or 0), 'spike')} in them"
            )
        return f"loss: {samples}, {spikes}"

    def to_json(self) -> dict[str, Any]:
        """For `run.json` and ``--json``."""
        return {
            "samples": self.samples,
            "spikes": self.spikes,
            "produced": self.produced,
            "written": self.written,
            "gaps": self.gaps,
            "covered_s": self.covered,
            "streamed_s": self.streamed,
            "seen_from_s": self.seen_from,
            "spikes_online": self.online,
            "spikes_offline": self.offline,
            "text": str(self),
        }


def certify(run: Run) -> Certificate:
    """Account for the samples and spikes of a run; reads the searched channel."""
    counters = run.info.get("samples") or {}
    rows = run.records("gaps")["missing"]
    missing = int(rows.sum())
    lost = missing if run.gapless else 0
    told = [(counters.get(name) or {}).get("produced") for name in run.signals]
    delivered = [number + lost for number in told if number is not None]
    online = run.records("spikes")["sample"]
    found = redetect(run)
    offline = None if found is None else found["sample"]
    covered = streamed = None
    if run.signals and not run.gapless:
        interval = float(run.attributes["interval"])
        covered = run.samples * interval
        streamed = covered + missing * interval
    return Certificate(
        produced=sum(delivered) if len(delivered) == len(told) else None,
        written=sum(run.stored(name) for name in run.signals),
        gaps=missing,
        covered=covered,
        streamed=streamed,
        seen_from=_seen_from(run.info),
        online=online.size,
        offline=None if offline is None else offline.size,
        spikes=None if offline is None else unmatched(online, offline).size,
        missing=bool(run.info.get("samples_missing")),
        surplus=bool(run.info.get("samples_surplus")),
        searched=run.detection is not None,
        asked=bool(run.signals),
    )


def _seen_from(info: Mapping[str, Any]) -> float | None:
    """What the scope's driver said that it would notice, s; None for nothing sound."""
    instruments = info.get("instruments")
    scope = instruments.get("scope") if isinstance(instruments, dict) else None
    told = scope.get("loss_seen_from_s") if isinstance(scope, dict) else None
    try:
        return None if told is None else float(told)
    except (TypeError, ValueError):
        return None


def write_certificate(path: Path) -> Certificate:
    """Certify the run in folder `path` and note the result in its `run.json`.

    Whether its spikes are no count is noted with it: lists of runs say so.

    Raises:
        RunFolderError: not a run that can be read.
        RecordingError: the folder cannot be written.
    """
    with Run.load(path) as run:
        certificate = certify(run)
        told = {"loss": certificate.to_json(), UNCOUNTED: any(uncounted(run))}
        info = {**run.info, **told, **constants(run)}
    write_info(path, info)
    return certificate


def constants(run: Run) -> dict[str, dict[str, str]]:
    """For `run.json`: hashes of what says what the samples mean, by place in the file.

    That is each dataset's type and the attributes of it and of every group: scales,
    units, sample interval. HDF5 keeps no checksum of them.
    """
    found: dict[str, str] = {}

    def take(name: str, item: h5py.HLObject) -> None:
        said = [repr(item.dtype) if isinstance(item, h5py.Dataset) else "group"]
        for key in sorted(item.attrs):
            value = np.asarray(item.attrs[key])
            said += [key, str(value.dtype), repr(value.tolist())]
        found[name] = digest("\n".join(said).encode())[:16]

    file = run.table("events").file
    take("/", file)
    file.visititems(lambda name, item: take(f"/{name}", item))
    return {"constants": found}


def redetect(run: Run) -> NDArray[Any] | None:
    """Spikes found again in the stored samples, dtype `spikes.detector.SPIKE`.

    Each stretch without a gap is searched by itself, as on line. None where the channel
    is not stored, or none was searched.
    """
    detection = run.detection
    if detection is None or detection.signal not in run.signals:
        return None
    # compiled code is loaded only where it is needed
    from tactile_lab.spikes.detector import SPIKE, detector_of

    found = [np.empty(0, SPIKE)]
    signal = run.signal(detection.signal)
    for start, stop in run.axis.stretches(0, run.samples):
        detector = detector_of(detection)
        for at in range(start, stop, PIECE):
            codes = signal.scope_codes(at, min(at + PIECE, stop))
            found.append(detector.feed(at, codes))
        found.append(detector.flush())
    return np.concatenate(found)


def unmatched(one: FloatArray, other: FloatArray) -> FloatArray:
    """Sample indices that only one of two ascending lists has, ascending."""
    return np.sort(np.concatenate([_without(one, other), _without(other, one)]))


def _without(some: FloatArray, others: FloatArray) -> FloatArray:
    """Those of `some` that are not in `others`."""
    if others.size == 0:
        return some
    after = np.clip(np.searchsorted(others, some), 0, others.size - 1)
    before = np.clip(after - 1, 0, None)
    near = np.minimum(np.abs(others[after] - some), np.abs(others[before] - some))
    return some[near > SAME_PLACE]
