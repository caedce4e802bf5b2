"""What plugs in from above or outside: entry points, and Python files of a user.

This package imports nothing above it. Drivers, simulated far ends, the simulated bench,
protocols and further verbs register as entry points of an installed distribution, this
one's in `pyproject.toml`; they are imported when they are asked for.
"""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import traceback
from functools import cache
from importlib import metadata, resources
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_lab.errors import SceneError, choices

if TYPE_CHECKING:
    from collections.abc import Mapping
    from importlib.resources.abc import Traversable
    from types import ModuleType
    from typing import NoReturn

    from tactile_lab.trial import Protocol


class _AsWritten(SourceFileLoader):
    """Loads a Python file without byte code, which would lie beside it and may be old.

    What runs is what the file says now, also where it was changed twice in a second.
    """

    def path_stats(self, path: object) -> NoReturn:
        """Nothing that byte code could be compared with."""
        raise OSError(f"no byte code of {path} is used")


@cache
def registered(group: str) -> Mapping[str, metadata.EntryPoint]:
    """Entry points of a group by name, ours and other distributions'; none imported."""
    return {entry.name: entry for entry in metadata.entry_points(group=group)}


def plugged_in(group: str, name: str) -> Any:
    """What is registered as `name` in a group, imported.

    Raises:
        SceneError: nothing is, or it does not import.
    """
    entry = registered(group).get(name)
    if entry is None:
        raise SceneError(
            f'Nothing is registered as "{name}" in {group}. If this checkout is newer '
            "than its installation, install it again: pip install -e ."
        )
    try:
        return entry.load()
    except (ImportError, AttributeError) as reason:
        raise SceneError(
            f'"{name}" of {group} cannot be imported from {entry.value}: {reason}.'
        ) from reason


def module_from_file(path: Path, what: str) -> ModuleType:
    """A Python file of the user's own, run as a module.

    Args:
        path: of the file.
        what: is in it, for messages: "Protocol", "Driver".

    Raises:
        SceneError: the file is missing or does not run.
    """
    path = path.resolve()
    if not path.is_file():
        raise SceneError(f"{what} file {path} does not exist or is not a file.")
    mark = hashlib.sha256(str(path).encode()).hexdigest()[:8]
    name = f"_{what.lower()}_{path.stem}_{mark}"
    loader = _AsWritten(name, str(path))
    spec = importlib.util.spec_from_file_location(name, path, loader=loader)
    if spec is None or path.suffix != ".py":
        raise SceneError(f"{what} file {path} is not Python; its name must end in .py.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # annotations of the class are resolved there
    try:
        loader.exec_module(module)
    except (Exception, SystemExit) as reason:
        del sys.modules[name]
        frames = traceback.extract_tb(reason.__traceback__)
        lines = [f.lineno for f in frames if f.filename == str(path)]
        line = f" (line {lines[-1]})" if lines else ""
        raise SceneError(
            f"{what} file {path} does not run: {type(reason).__name__}: {reason}{line}"
        ) from reason
    return module


def protocol_names() -> tuple[str, ...]:
    """Names of the protocols that ship, sorted; imports none of them."""
    return tuple(sorted(_protocols()))


def scene_names() -> tuple[str, ...]:
    """Names of the scenes that ship, sorted."""
    return tuple(sorted(_shipped("scenes")))


def scene_path(name: str) -> Path:
    """Where the shipped scene `name` lies."""
    return Path(str(_shipped("scenes")[name]))


def study_names() -> tuple[str, ...]:
    """Names of the studies that ship, sorted."""
    return tuple(sorted(_shipped("studies")))


def study_path(name: str) -> Path:
    """Where the shipped study `name` lies."""
    return Path(str(_shipped("studies")[name]))


def protocol_class(name: str) -> type[Protocol]:
    """The protocol called `name`.

    Raises:
        SceneError: there is none of that name (the nearest is named), or its file is
            not a protocol.
    """
    known = _protocols()
    if name not in known:
        raise SceneError(
            f'protocol "{name}" does not exist; {choices(name, sorted(known))} A '
            'protocol of your own is named by source = "path/to/file.py".'
        )
    return _only_protocol(importlib.import_module(known[name]), name)


def ships(kind: type) -> bool:
    """Whether a class stands in a file of a protocol that ships."""
    return kind.__module__ in _protocols().values()


def protocol_checking(what: str) -> str:
    """Name of the protocol that ships, and of its scene, that checks that of a bench.

    Args:
        what: as `Protocol.checks` has it: "wiring", "field" or "force".
    """
    return next(n for n in protocol_names() if protocol_class(n).checks == what)


def protocol_from_file(path: Path) -> type[Protocol]:
    """The protocol in a Python file of the user's own.

    Raises:
        SceneError: the file is missing, does not run, or holds no protocol of its name.
    """
    return _only_protocol(module_from_file(path, "Protocol"), path.stem)


def _packages() -> list[ModuleType]:
    """Registered packages of protocols; their modules are protocols."""
    group = "tactile_lab.protocols"
    return [plugged_in(group, name) for name in registered(group)]


@cache
def _protocols() -> dict[str, str]:
    """Module of each protocol by its name."""
    return {
        name: f"{package.__name__}.{name}"
        for package in _packages()
        for name in _inside(resources.files(package), ".py")
    }


@cache
def _shipped(what: str) -> dict[str, Traversable]:
    """File of each scene, or each study, by its name."""
    folders = (resources.files(package) / what for package in _packages())
    return {
        name: file
        for folder in folders
        if folder.is_dir()
        for name, file in _inside(folder, ".toml").items()
    }


def _inside(folder: Traversable, ending: str) -> dict[str, Traversable]:
    return {
        entry.name.removesuffix(ending): entry
        for entry in folder.iterdir()
        if entry.name.endswith(ending) and not entry.name.startswith("_")
    }


def _only_protocol(module: ModuleType, name: str) -> type[Protocol]:
    from tactile_lab.trial import Protocol

    found = [
        kind
        for kind in vars(module).values()
        if isinstance(kind, type)
        and issubclass(kind, Protocol)
        and kind.__module__ == module.__name__
        and getattr(kind, "name", None) == name
    ]
    if len(found) != 1:
        raise SceneError(
            f"{module.__file__} must hold one subclass of tactile_lab.trial.Protocol "
            f'with name = "{name}" (the name of its file); it holds {len(found)}.'
        )
    return found[0]
