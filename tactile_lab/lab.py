"""What a lab sets once: its bench, its folder for runs, who it is, what follows a run.

    # ~/.config/tactile-lab/lab.toml, or the file that TACTILE_LAB_CONFIG names
    bench = "bench.toml"
    runs = "/data/runs"
    operator = "A. Petaru"
    institution = "Kiel University"
    after_run = ["rsync", "-a", "--", "{run}", "archive:runs/"]

An environment variable such as TACTILE_LAB_RUNS wins over the file, an option of the
command line or of the window over both. Scripts are told nothing of it: what they do is
what they say.
"""

from __future__ import annotations

import os
import subprocess
import tomllib
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

from tactile_lab.columns import read_text
from tactile_lab.errors import SceneError, choices

KEYS = ("bench", "runs", "operator", "institution", "after_run")
VARIABLE = "TACTILE_LAB_"
RUN = "{run}"

LONGEST = 3600.0
"""Time that a program after a run may take, s: a night's sequence waits for it."""

NICENESS = 10
"""Of programs that follow a run."""

LAST_WORDS = 300
"""Bytes of what it printed that are told where it fails."""


@dataclass(frozen=True, kw_only=True)
class Lab:
    """What a lab has set; defaults where it has not.

    Attributes:
        bench: bench file of scenes that name no bench; "sim" is the built-in one.
        runs: folder for run folders.
        operator, institution: noted with each run; "" for none.
        after_run: program and arguments, called after each run; its folder stands for
            `{run}`, or is the last argument.
        origin: where each key that was set came from.
    """

    bench: str = "sim"
    runs: Path = Path("runs")
    operator: str = ""
    institution: str = ""
    after_run: tuple[str, ...] = ()
    origin: Mapping[str, str] = field(default_factory=dict)

    @property
    def notes(self) -> dict[str, str]:
        """Kept with each run."""
        said = {"operator": self.operator, "institution": self.institution}
        return {key: text for key, text in said.items() if text}

    @property
    def rows(self) -> list[tuple[str, str]]:
        """Each key with its value and where that came from, for a person."""
        return [
            (key, f"{value}, {self.origin.get(key, 'unless you say otherwise')}")
            for key in KEYS
            if (value := self._shown(key))
        ]

    def _shown(self, key: str) -> str:
        value = getattr(self, key)
        return " ".join(value) if isinstance(value, tuple) else str(value)

    def follow(self, run: Path) -> str:
        """Call what follows a run; what went wrong with it, "" if nothing did.

        The run is on disk and its coil off: a program that fails costs nothing but
        itself, and one that hangs is ended after `LONGEST` s, or by Ctrl-C. What it
        leaves in the background is not waited for.
        """
        if not self.after_run:
            return ""
        words = [word.replace(RUN, str(run)) for word in self.after_run]
        if words == list(self.after_run):
            words.append(str(run))
        told = f"after_run: {' '.join(words)}"
        # a file: a pipe would be waited for as long as any child of it holds it
        with TemporaryFile() as said:
            try:
                with subprocess.Popen(
                    words, stdin=subprocess.DEVNULL, stdout=said,
                    stderr=subprocess.STDOUT,
                ) as called:  # fmt: skip
                    stand_back(called)
                    _wait_for(called)
            except OSError as reason:
                return f"after_run: {words[0]} cannot be started: {reason.strerror}."
            except subprocess.TimeoutExpired:
                return f"{told} did not end within {LONGEST / 60:g} min and was ended."
            if called.returncode == 0:
                return ""
            said.seek(max(0, said.seek(0, os.SEEK_END) - LAST_WORDS))
            last = said.read().decode(errors="replace").strip()
        return f"{told} ended with {called.returncode}: {last}"


def stand_back(program: subprocess.Popen[Any]) -> None:
    """Have a program that follows a run come after whatever runs a bench meanwhile."""
    if hasattr(os, "setpriority"):
        with suppress(OSError):  # it may stand farther back already
            os.setpriority(os.PRIO_PROCESS, program.pid, NICENESS)


def _wait_for(called: subprocess.Popen[bytes]) -> None:
    """Wait for its end, at most `LONGEST` s, after which it is ended."""
    try:
        called.wait(LONGEST)
    except BaseException:
        called.kill()
        raise


def config_file() -> Path:
    """The lab's file, which need not be there."""
    named = os.environ.get(f"{VARIABLE}CONFIG")
    if named:
        return Path(named)
    from platformdirs import user_config_path

    return user_config_path("tactile-lab", appauthor=False) / "lab.toml"


def state_folder() -> Path:
    """Where programs on this computer keep what the next one must know of the bench."""
    state = os.environ.get("XDG_STATE_HOME") or os.environ.get("LOCALAPPDATA")
    folder = Path(state) if state else Path.home() / ".local" / "state"
    return folder / "tactile-lab"


def lab() -> Lab:
    """What the lab's file and the environment say.

    Raises:
        SceneError: the file cannot be read, or a key is not as it must be.
    """
    file = config_file()
    said: dict[str, Any] = {}
    if file.is_file():
        try:
            said = tomllib.loads(read_text(file, "Lab's file"))
        except SceneError:
            raise
        except ValueError as reason:
            raise SceneError(f"{file} is not TOML: {reason}.") from reason
    elif os.environ.get(f"{VARIABLE}CONFIG"):
        raise SceneError(f"{VARIABLE}CONFIG names {file}, which does not exist.")
    values: dict[str, Any] = {}
    origin: dict[str, str] = {}
    for key, value in said.items():
        values[key] = _checked(key, value, file)
        origin[key] = f"from {file}"
    for key in KEYS[:-1]:
        text = os.environ.get(VARIABLE + key.upper())
        if text:
            text = os.path.expanduser(text) if key in ("bench", "runs") else text
            values[key] = Path(text).resolve() if key == "runs" else text
            origin[key] = f"from {VARIABLE}{key.upper()}"
    return Lab(**values, origin=origin)


def _checked(key: str, value: Any, file: Path) -> Any:
    if key not in KEYS:
        raise SceneError(f'{file} has no key "{key}"; {choices(key, KEYS)}')
    if key == "after_run":
        if not (isinstance(value, list) and value and all(map(_is_text, value))):
            raise SceneError(
                f"{file}: after_run = {value!r}: a list of texts is needed, such as "
                '["python3", "archive.py"].'
            )
        return tuple(value)
    if not _is_text(value):
        raise SceneError(f"{file}: {key} = {value!r}: a text in quotes is needed.")
    path = file.parent / os.path.expanduser(value)
    if key == "runs":
        return path
    if key == "bench" and value != "sim":
        return str(path.resolve())
    return value


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value) and "\0" not in value
