"""What people say of a run: its name, tags, star and notes; not what was measured.

They stand in a file of their own beside the record, and can be changed at any time.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from pathlib import Path

from tactile_lab.errors import RunFolderError
from tactile_lab.store.folder import LOG, lock, write_json
from tactile_lab.trust import INFO
from tactile_lab.whole_file import failing_as

REMARKS = "remarks.json"


@dataclass(frozen=True, kw_only=True)
class Note:
    """One note.

    Attributes:
        text: as typed.
        time: on the run's axis, s; None where it is about the run as a whole.
        at: when it was written, ISO time with zone.
    """

    text: str
    time: float | None = None
    at: str = field(
        default_factory=lambda: (
            datetime.now().astimezone().isoformat(timespec="milliseconds")
        )
    )

    def __str__(self) -> str:
        """The note after its time."""
        return self.text if self.time is None else f"{self.time:.1f} s: {self.text}"


@dataclass(frozen=True, kw_only=True)
class Remarks:
    """All that people say of one run.

    Attributes:
        title: instead of the protocol's; "" for none.
        tags: for finding it again.
        starred: it matters.
        notes: those with a time come in its order, after those without.
    """

    title: str = ""
    tags: Sequence[str] = ()
    starred: bool = False
    notes: Sequence[Note] = ()


def read_remarks(path: Path) -> Remarks:
    """Remarks on the run in folder `path`; notes of older runs stand in their log.

    Raises:
        RunFolderError: the file is damaged.
    """
    file = path / REMARKS
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        notes = tuple(Note(**note) for note in found.pop("notes"))
        return Remarks(**found, notes=notes)
    except FileNotFoundError:
        return Remarks(notes=tuple(_logged(path / LOG)))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise RunFolderError(
            f"{file} cannot be read ({type(error).__name__}: {error}). Mend it, or "
            "delete it: it holds only name, tags and notes of the run."
        ) from error


def write_remarks(path: Path, remarks: Remarks) -> None:
    """Replace the remarks on the run in folder `path`.

    Raises:
        RecordingError: the folder cannot be written.
    """
    ordered = sorted(remarks.notes, key=lambda note: (note.time or -1.0, note.at))
    write_json(path / REMARKS, asdict(replace(remarks, notes=ordered)))


def change_remarks(path: Path, change: Callable[[Remarks], Remarks]) -> Remarks:
    """Change the remarks on the run in folder `path`, one hand after another.

    Args:
        path: the run's folder.
        change: makes the new ones of those that are there; what it raises changes
            nothing.

    Returns:
        The remarks as they are now.

    Raises:
        RunFolderError: the remarks so far are damaged.
        RecordingError: the folder cannot be written.
    """
    with failing_as(f"{path} cannot be written"), (path / INFO).open("r+") as run:
        lock(run, wait=True)
        before = read_remarks(path)
        after = change(before)
        if after != before:
            write_remarks(path, after)
        return after


def add_note(path: Path, text: str, time: float | None = None) -> None:
    """Add a note, at `time` s on the run's axis, to the run in folder `path`.

    Raises:
        RunFolderError: the remarks so far are damaged.
        RecordingError: the folder cannot be written.
    """
    note = Note(text=text, time=time)
    change_remarks(path, lambda said: replace(said, notes=(*said.notes, note)))


def _logged(log: Path) -> Iterator[Note]:
    """Notes in the log of a run that has no file of remarks."""
    try:
        lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        return
    for line in lines:
        try:
            found = json.loads(line)
            if found["kind"] == "note":
                text, time = str(found["text"]), found.get("time_s")
                yield Note(text=text, time=time, at=str(found["at"]))
        except (ValueError, KeyError, TypeError):
            continue  # the last line of a run that was cut short
