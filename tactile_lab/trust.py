"""Code in runs: that of a run from elsewhere is not executed until somebody trusts it.

A run folder keeps the Python files it was made from (a protocol, a driver) and names
the library of its scope; whoever reads or repeats the run executes them. Those of runs
made here are known by their SHA-256; of others `tactile-lab trust RUN` says what they
are and makes them known.
"""

from __future__ import annotations

import hashlib
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib.machinery import all_suffixes
from pathlib import Path
from typing import Any

from tactile_lab.columns import read_text
from tactile_lab.errors import SceneError, to_type

INFO = "run.json"
"""What makes a folder that of a run."""


def known_file() -> Path:
    """Where the SHA-256 of each known file is kept, one a line with its path."""
    from platformdirs import user_data_path

    return user_data_path("tactile-lab", appauthor=False) / "trusted-code.txt"


def code_named(table: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """Files of code that a scene names, itself or in its bench file."""
    found = [folder / name for name in _code(table)]
    bench = table.get("bench")
    file = bench.get("file") if isinstance(bench, dict) else None
    if isinstance(file, str) and (folder / file).is_file():
        path = folder / file
        held = tomllib.loads(read_text(path, "Bench file"))
        found += [path.parent / name for name in _code(held)]
    return tuple(dict.fromkeys(path.resolve() for path in found if path.is_file()))


def check(table: Mapping[str, Any], folder: Path) -> None:
    """Refuse the scene of a run that would execute code which nobody here knows.

    Args:
        table: what the scene file holds.
        folder: in which it lies; of a run, or nothing is checked.

    Raises:
        SceneError: it names such code.
    """
    if not (folder / INFO).is_file():
        return
    known = _known()
    strange = [p for p in code_named(table, folder) if _digest(p) not in known]
    if strange:
        raise SceneError(
            f"{folder} holds code that was not run on this computer, or was changed "
            f"since: {', '.join(map(str, strange))}. It would be executed. Read it, "
            f"and if you trust it: {to_type('trust', folder)}"
        )


def remember(files: Iterable[Path]) -> None:
    """Make the code in `files` known here.

    Raises:
        OSError: that cannot be written down.
    """
    known = _known()
    code = {_digest(path): path for path in files}
    new = {found: path for found, path in code.items() if found not in known}
    if new:
        known_file().parent.mkdir(parents=True, exist_ok=True)
        with known_file().open("a", encoding="utf-8") as file:
            file.writelines(f"{found}  {path}\n" for found, path in new.items())


def _known() -> set[str]:
    try:
        text = known_file().read_text(encoding="utf-8")
    except OSError:
        return set()
    return {line.partition(" ")[0] for line in text.splitlines()}


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _code(held: Any) -> Iterator[str]:
    """Texts anywhere in a table that may name a file which is executed."""
    match held:
        case str() if held.endswith(tuple(all_suffixes())):
            yield held
        case Mapping():
            for key, value in held.items():
                if key == "library" and isinstance(value, str):
                    yield value  # however it ends
                else:
                    yield from _code(value)
        case list() | tuple():
            for value in held:
                yield from _code(value)
