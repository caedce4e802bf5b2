"""Files that are there whole or as they were before: written beside, then renamed.

Every output takes this way, so that no reader, crash or full disk leaves half of one.
What grows while a run goes on (samples, ledger, log) has a way of its own.
"""

from __future__ import annotations

import csv
import errno
import itertools
import os
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from glob import escape
from pathlib import Path

from tactile_lab.errors import RecordingError, TactileLabError

LONGEST = 40
"""Characters of a file's name that its part repeats: a name has 255 bytes at most."""

_NUMBERS = itertools.count()


def check_space(path: Path, needed: int, what: str = "") -> None:
    """Refuse when the disk under `path` has fewer than `needed` bytes free.

    Args:
        path: a folder.
        needed: bytes.
        what: they are needed for, where that is more than a file.

    Raises:
        RecordingError: too little room.
    """
    free = shutil.disk_usage(path).free
    if free < needed:
        raise RecordingError(
            f"The disk of {path} has {_size(free)} free but {_size(needed)} are needed"
            f"{what and f' {what}'}. Free some space, or write to another disk."
        )


def _size(number: int) -> str:
    """A number of bytes for a person."""
    for unit, scale in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if number >= scale:
            return f"{number / scale:.3g} {unit}"
    return f"{number} B"


@contextmanager
def failing_as(
    what: str, advice: str = "", kind: type[TactileLabError] = RecordingError
) -> Iterator[None]:
    """Tell of an error of the disk `what` could not be done, and what to do about it.

    Raises:
        RecordingError: or one of `kind`, with both sentences.
    """
    try:
        yield
    except TactileLabError:
        raise
    except OSError as reason:
        file = "" if reason.filename is None else str(reason.filename)
        where = "" if file in what else f" ({file})"
        said = f"{what}: {reason.strerror or reason}{where}. {advice}"
        raise kind(said.rstrip()) from reason


@contextmanager
def replacing(path: Path, size: int = 0, *, lasting: bool = False) -> Iterator[Path]:
    """A new file to write, which takes the place of `path` once it is whole.

    Args:
        path: what it will be called; its folder is made.
        size: about how many bytes it will take.
        lasting: wait until the disk has it, so that a power cut leaves it whole, too.

    Raises:
        RecordingError: that many are not free, or a device or pipe has that name.
        OSError: it cannot be written, or is a folder.
    """
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if path.exists() and not path.is_file():
        raise RecordingError(
            f"{path} is a device or a pipe; a file in its place would end it. "
            "Give another name."
        )
    check_space(next(one for one in path.absolute().parents if one.exists()), size)
    path.parent.mkdir(parents=True, exist_ok=True)
    # another program, or another part of this one, may write the same file
    name, number = f".{path.stem[:LONGEST]}", next(_NUMBERS)
    part = path.with_name(f"{name}.{os.getpid()}.{number}.part{path.suffix}")
    for other in path.parent.glob(f"{escape(name)}.*.*.part{escape(path.suffix)}"):
        if not _is_written(other):
            with suppress(PermissionError):
                other.unlink(missing_ok=True)
    try:
        yield part
        if lasting:
            with part.open("r+b") as file:
                os.fsync(file.fileno())
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _is_written(part: Path) -> bool:
    """Whether the program that began a part is there still; it may have been killed."""
    process = part.name.removesuffix(part.suffix).split(".")[-3]
    if not process.isdecimal():
        return True
    if os.name == "nt":
        return False  # a file that is open cannot be removed there
    try:
        os.kill(int(process), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def write_text(path: Path, text: str, *, lasting: bool = False) -> None:
    """Replace `path` in one step by this text, in UTF-8; see `replacing`."""
    data = text.encode()
    with replacing(path, len(data), lasting=lasting) as part:
        part.write_bytes(data)


def write_rows(
    path: Path, heads: Iterable[object], rows: Iterable[Iterable[object]]
) -> None:
    """Replace `path` in one step by a table of comma-separated values, in UTF-8."""
    with replacing(path) as part, part.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(heads)
        writer.writerows(rows)
