"""A run's folder: `run.json` says what it is from the first moment to the last."""

from __future__ import annotations

import hashlib
import json
import os
import re
import sys
from collections.abc import Mapping
from datetime import datetime, timedelta
from pathlib import Path
from typing import IO, Any, Literal

from tactile_lab.errors import RecordingError, RunFolderError
from tactile_lab.trust import INFO
from tactile_lab.whole_file import check_space, failing_as, write_text

Status = Literal["running", "complete", "aborted", "faulted", "recovered"]

SCHEMA = 1
"""Version of the folder's layout; raised when old readers would misread it."""

SEAL = "sha256"
"""Key of `run.json` with the hash of all the others; runs of older versions lack it."""

CHANGED = "changed_before_recovery"
"""Key of `run.json`: its hash was wrong when the run was recovered."""

ZERO = "time_zero"
"""Key of `run.json`: when the run's time was 0; runs of older versions lack it."""

PLANNED = "instruments_planned"
"""Key of `run.json`: what the run is to open; runs of older versions lack it."""

UNCOUNTED = "spikes_uncounted"
"""Key of `run.json`: whether spikes of a trial are no count; older runs lack it."""

DATA, LOG, SCENE, REPORT = "data.h5", "log.jsonl", "scene.toml", "report.html"

LEDGER = "ledger.bin"
"""What was written of the data; gone once the run has ended well."""

KEPT = "data.killed.h5"
"""What the file is called that a crash left, once the run is recovered."""

INPUTS = "inputs"
"""Folder within a run for copies of what it was made from."""

OWN = frozenset((INFO, DATA, LOG, SCENE, KEPT, LEDGER, "remarks.json"))
"""Files that a run is made of: nothing makes them again."""

NAMED = 3
"""Runs that a refusal names of those there are."""

RESERVE = 200_000_000
"""Bytes that must stay free on the disk while a run is written."""


def refuse_own(file: Path) -> None:
    """Refuse to put an export in the place of what a run is made of.

    Raises:
        RecordingError: `file` is that, of any run.
    """
    found = file.resolve()
    copied = found.parent.name == INPUTS
    run = found.parent.parent if copied else found.parent
    if (run / INFO).exists() and (copied or found.name in OWN):
        raise RecordingError(
            f"{file} is what the run {run.name} is made of; nothing else may take its "
            "place. Give another name."
        )


class RunFolder:
    """The folder of a run that is being recorded.

    Attributes:
        path: the folder.
        info: what `run.json` holds.
    """

    def __init__(self, path: Path, info: dict[str, Any], log: IO[str]) -> None:
        self.path = path
        self.info = info
        self._log = log

    @classmethod
    def create(
        cls,
        root: Path,
        name: str,
        info: Mapping[str, Any],
        *,
        needed: int = 0,
    ) -> RunFolder:
        """Make a new folder under `root`, its `run.json` with status running first.

        Args:
            root: made if missing.
            name: of protocol or scene; becomes part of the folder's name.
            info: further entries of `run.json`, plain JSON types.
            needed: bytes the run is expected to take.

        Raises:
            RecordingError: the disk lacks room, or the folder cannot be written.
        """
        began = datetime.now()
        lost = f"No run folder can be made under {root}"
        with failing_as(lost, "Choose a writable folder with --out."):
            root.mkdir(parents=True, exist_ok=True)
            check_space(root, needed + RESERVE, "for the run and its reserve")
            path = _unique(root, f"{began:%Y-%m-%d_%H%M%S}_{_plain(name)}")
            content = {
                "schema": SCHEMA,
                "status": "running",
                "started": _iso(began),
                "ended": None,
                "process": os.getpid(),
                **info,
            }
            write_info(path, content)
            log = (path / LOG).open("a", encoding="utf-8")
        lock(log, wait=True)
        return cls(path, content, log)

    def update(self, **entries: Any) -> None:
        """Put further entries into `run.json`."""
        self.info.update(entries)
        write_info(self.path, self.info)

    def begin(self, ago: float, **entries: Any) -> None:
        """Put into `run.json` when the run's time was 0, and what is known by then.

        A run that is killed has it as well.

        Args:
            ago: how long before now that was, s.
            entries: as `update` takes them.
        """
        zero = datetime.now() - timedelta(seconds=ago)
        self.update(**{ZERO: _iso(zero)}, **entries)

    def log(self, kind: str, text: str, **entries: Any) -> None:
        """Append one line to the log."""
        line = {"at": _iso(datetime.now()), "kind": kind, "text": text, **entries}
        with failing_as(f"{self.path / LOG} cannot be written"):
            self._log.write(json.dumps(line, ensure_ascii=False, default=str) + "\n")
            self._log.flush()

    def write_text(self, name: str, text: str) -> Path:
        """Put a text file into the folder, such as "inputs/calibration.csv".

        Its SHA-256 goes into `run.json`, so that a later change shows.
        """
        path = self.path / name
        with failing_as(f"{path} cannot be written"):
            write_text(path, text)
        files = {**self.info.get("files", {}), name: digest(text.encode())}
        self.update(files=files)
        return path

    def finish(self, status: Status, **entries: Any) -> None:
        """Patch `run.json` for the last time and let go of the folder.

        Raises:
            RecordingError: it cannot be written, and says still that the run goes on.
        """
        try:
            self.update(status=status, ended=_iso(datetime.now()), **entries)
        except RecordingError as error:
            raise RecordingError(
                f"{error} What was recorded is kept, as of a run that goes on: once "
                "the folder can be written, run `tactile-lab recover` on it."
            ) from error
        finally:
            self._log.close()


def digest(data: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """Replace `path` in one step, so that no reader or crash sees half a file.

    Raises:
        RecordingError: the folder cannot be written.
    """
    text = json.dumps(content, indent=2, ensure_ascii=False, default=str)
    with failing_as(f"{path} cannot be written", "The old one stays."):
        write_text(path, f"{text}\n", lasting=True)


def write_info(folder: Path, info: Mapping[str, Any]) -> None:
    """Write `run.json` of a run folder, with the SHA-256 of what it says.

    Raises:
        RecordingError: the folder cannot be written.
    """
    said = {name: value for name, value in info.items() if name != SEAL}
    write_json(folder / INFO, {**said, SEAL: seal(said)})


def seal(info: Mapping[str, Any]) -> str:
    """SHA-256 of what `run.json` says, however it is laid out."""
    said = {name: value for name, value in info.items() if name != SEAL}
    return digest(json.dumps(said, sort_keys=True, default=str).encode())


def as_written(info: Mapping[str, Any]) -> bool:
    """Whether `run.json` is what was written; one of an older version cannot tell."""
    return SEAL not in info or seal(info) == info[SEAL]


def read_info(path: Path) -> dict[str, Any]:
    """What `run.json` in the folder `path` says.

    Raises:
        RunFolderError: no folder, no `run.json`, or not one this version reads.
    """
    file = path / INFO
    try:
        info = json.loads(file.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError) as error:
        what = f"it has no {INFO}" if path.is_dir() else "it is no folder"
        raise RunFolderError(
            f"{path} is no run folder: {what}. {_give_one(path)}"
        ) from error
    except (OSError, ValueError) as error:
        raise RunFolderError(f"{file} cannot be read: {error}.") from error
    if not isinstance(info, dict) or info.get("schema") != SCHEMA:
        found = info.get("schema") if isinstance(info, dict) else None
        raise RunFolderError(
            f"{file} has schema {found}; this version reads schema {SCHEMA}."
        )
    return info


def _give_one(path: Path) -> str:
    """What to give instead of a folder that is no run's, but may hold some."""
    inside = sorted(file.parent for file in path.glob(f"*/{INFO}"))
    inside = inside or sorted(file.parent for file in path.glob(f"*/*/{INFO}"))
    if not inside:
        return "Give the folder of one run; `tactile-lab runs` lists them."
    names = ", ".join(str(run) for run in inside[:NAMED])
    more = f" and {len(inside) - NAMED} more" if len(inside) > NAMED else ""
    return f"Give one of the runs in it: {names}{more}."


def has_lost_data(path: Path, info: Mapping[str, Any]) -> bool:
    """Whether a run's samples were written, and their file is there no more."""
    if (path / DATA).exists() or (path / KEPT).exists():
        return False
    return bool(info.get("samples")) or (path / LEDGER).exists()


def told_status(path: Path, status: str) -> str:
    """The status in `run.json`; "cut short" where a running run has no writer."""
    return "cut short" if status == "running" and not is_live(path) else status


def is_live(path: Path) -> bool:
    """Whether a process still writes the run in folder `path`."""
    try:
        with (path / LOG).open(encoding="utf-8") as log:
            return not lock(log, shared=True)
    except OSError:
        return False  # no log, or none that may be read: nobody here can be its writer


def _iso(time: datetime) -> str:
    return time.astimezone().isoformat(timespec="milliseconds")


def _unique(root: Path, name: str) -> Path:
    """Make a folder nobody else has made."""
    for number in range(1, 1000):
        path = root / (name if number == 1 else f"{name}_{number}")
        try:
            path.mkdir()
        except FileExistsError:
            continue
        return path
    raise RecordingError(f"{root} holds a thousand runs called {name}.")


def _plain(name: str) -> str:
    """A name every file system takes."""
    return re.sub(r"[^A-Za-z0-9-]+", "-", name).strip("-")[:60] or "run"


def lock(file: IO[str], *, shared: bool = False, wait: bool = False) -> bool:
    """Lock an open file until it is closed or its process dies; False if taken.

    Args:
        file: such as a run's log.
        shared: as a reader does who looks whether a writer has it.
        wait: for such a look to end, as a writer does.
    """
    if sys.platform == "win32":
        import msvcrt

        file.seek(1 << 30)  # a byte nobody reads
        try:
            msvcrt.locking(file.fileno(), msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        return True
    import fcntl

    try:
        kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
        fcntl.flock(file, kind if wait else kind | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
