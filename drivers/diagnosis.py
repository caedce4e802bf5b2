"""Whether this computer can run an experiment: each finding with its remedy."""

from __future__ import annotations

import os
import platform
import struct
import tempfile
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

from drivers.attached import NO_USB, attached
from drivers.coil.guard import Guard
from drivers.picoscope.sdk import load
from tactile_lab.errors import InstrumentError
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.lab import lab

NEEDED = ("numpy", "scipy", "numba", "h5py", "hdf5plugin", "pyserial", "pyusb")
DISK_TRIAL = 64 * 1024 * 1024
"""Bytes written to measure the disk."""

LATE = 0.02
"""A thread that wakes later than this after its time is a note, s."""


@dataclass(frozen=True, kw_only=True)
class Diagnosis:
    """One thing looked at.

    Attributes:
        topic: what.
        state: "ok", "note" (matters for hardware only) or "problem".
        text: what was found.
        remedy: what to do, or None.
    """

    topic: str
    state: Literal["ok", "note", "problem"]
    text: str
    remedy: str | None = None


def diagnose(
    folder: Path, needed_rate: float, library: str | None = None
) -> list[dict[str, Any]]:
    """Look at everything, as plain data; opens no port and no instrument.

    Args:
        folder: where runs are stored.
        needed_rate: what a run must be able to store, bytes/s.
        library: PicoSDK's, as a bench file names it; the usual places unless given.
    """
    looks: tuple[Callable[[], Diagnosis], ...] = (
        python,
        packages,
        lambda: picosdk(library),
        guard,
        wake_up,
        lambda: disk(folder, needed_rate),
        defaults,
    )
    return [asdict(finding) for finding in (*(look() for look in looks), *ports())]


def defaults() -> Diagnosis:
    """What the lab has set, and where."""
    said = "; ".join(f"{key}: {value}" for key, value in lab().rows)
    return Diagnosis(topic="lab", state="ok", text=said)


def python() -> Diagnosis:
    """Interpreter, its width and the system."""
    bits = struct.calcsize("P") * 8
    text = f"Python {platform.python_version()}, {bits} bits, {platform.platform()}"
    if bits != 64:
        return Diagnosis(
            topic="python",
            state="problem",
            text=text,
            remedy="install a 64-bit Python: PicoSDK's library must be as wide",
        )
    return Diagnosis(topic="python", state="ok", text=text)


def packages() -> Diagnosis:
    """Packages a run needs."""
    missing, versions = [], []
    for name in NEEDED:
        try:
            versions.append(f"{name} {metadata.version(name)}")
        except metadata.PackageNotFoundError:
            missing.append(name)
    if missing:
        return Diagnosis(
            topic="packages",
            state="problem",
            text=f"missing: {', '.join(missing)}",
            remedy="pip install -e .",
        )
    return Diagnosis(topic="packages", state="ok", text=", ".join(versions))


def picosdk(library: str | None = None) -> Diagnosis:
    """Whether PicoScope's library is where it is looked for."""
    try:
        found = load(library)
    except InstrumentError:
        where = library or "any of the usual places"
        return Diagnosis(
            topic="picosdk",
            state="note",
            text=f"no library ps3000a that can be used in {where}; only a PicoScope "
            "needs it",
            remedy='install PicoSDK, or name its file: library = "..." in the bench '
            "file, or the environment variable TACTILE_LAB_PS3000A",
        )
    file = str(found._name)  # noqa: SLF001  ctypes has no other name for it
    return Diagnosis(topic="picosdk", state="ok", text=file)


def guard() -> Diagnosis:
    """Whether the guard process starts, and how long that takes."""
    row = coil_dialect("kepco-bop")
    one = Guard("/dev/null", row, row.serial)
    began = time.monotonic()
    try:
        one.start()
        took = time.monotonic() - began
        one.stop()
    except (InstrumentError, OSError) as reason:
        return Diagnosis(
            topic="guard",
            state="problem",
            text=f"the guard process does not start: {reason}",
            remedy="without it no current source is energised; look at the message",
        )
    return Diagnosis(topic="guard", state="ok", text=f"starts in {took:.2f} s")


def wake_up() -> Diagnosis:
    """How late a waiting thread wakes, which sets the jitter of set-points."""
    late = []
    for _ in range(40):
        wanted = time.monotonic() + 0.005
        time.sleep(0.005)
        late.append(time.monotonic() - wanted)
    worst = max(late)
    text = f"a waiting thread wakes up to {1e3 * worst:.1f} ms late"
    if worst > LATE:
        return Diagnosis(
            topic="timing",
            state="note",
            text=text,
            remedy="close other programs; set-points will jitter as much",
        )
    return Diagnosis(topic="timing", state="ok", text=text)


def disk(folder: Path, needed: float) -> Diagnosis:
    """How fast the disk under `folder` takes data, against `needed` bytes/s."""
    there = folder.absolute()
    while not there.exists():
        there = there.parent
    block = os.urandom(1024 * 1024)
    try:
        with tempfile.TemporaryFile(dir=there) as file:
            began = time.monotonic()
            for _ in range(DISK_TRIAL // len(block)):
                file.write(block)
            file.flush()
            os.fsync(file.fileno())
            rate = DISK_TRIAL / (time.monotonic() - began)
    except OSError as reason:
        return Diagnosis(
            topic="disk",
            state="problem",
            text=f"{there} cannot be written to: {reason}",
            remedy="choose another folder with --out",
        )
    text = f"{there} takes {rate / 1e6:.0f} MB/s; a run needs {needed / 1e6:.0f} MB/s"
    if rate < 2 * needed:
        return Diagnosis(
            topic="disk",
            state="problem",
            text=text,
            remedy="store runs on a faster disk (--out), or lower the sample rate",
        )
    return Diagnosis(topic="disk", state="ok", text=text)


def ports() -> list[Diagnosis]:
    """Permissions and links of what is attached."""
    found = attached(ask=False)
    findings = [
        Diagnosis(
            topic="port",
            # without libusb nothing of USB is seen, and only USBTMC scopes need it
            state="note" if one["address"] == NO_USB else "problem",
            text=one["title"],
            remedy=one["problem"],
        )
        for one in found
        if one["problem"]
    ]
    fine = [one["address"] for one in found if not one["problem"]]
    text = f"usable: {', '.join(fine)}" if fine else "no instrument's port is attached"
    return [
        *findings,
        Diagnosis(topic="ports", state="ok" if fine else "note", text=text),
    ]
