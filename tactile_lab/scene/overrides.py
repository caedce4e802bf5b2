"""Single keys of a scene changed: ``--set key=value``, or a mapping in Python."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from os.path import isfile
from pathlib import Path
from typing import Any

from tactile_lab.errors import SceneError
from tactile_lab.quantity import SIFloat, SIInt

Overrides = Sequence[str] | Mapping[str, Any]
"""``table.key=value`` texts, or values by ``table.key``."""

FILES = (
    "protocol.file", "protocol.source", "bench.file", "bench.magnet.calibration",
    "bench.coil.dialect", "bench.scope.dialect", "bench.field_meter.dialect",
    "bench.thermometer.dialect",
)  # fmt: skip
"""Keys that name a file: one that lies where the program was started is meant."""


def apply(data: dict[str, Any], overrides: Overrides) -> dict[str, str]:
    """Change keys of `data` in place.

    The value in a text is TOML where it reads as TOML (numbers, true, lists, quoted
    texts), and otherwise a text, so that quantities need no quotes of their own. In a
    mapping a quantity is a text with its unit or a number in SI.

    Returns:
        The change as written for each dotted key it set, to be named in messages.

    Raises:
        SceneError: not of that form, or the key lies inside something that is no table.
    """
    origins = {}
    for path, value, origin in _changes(overrides):
        if len(path) < 2 or not all(path):
            raise SceneError(
                f'{origin}: write table.key=value, such as protocol.hold="2 s".'
            )
        table = data
        for depth, part in enumerate(path[:-1]):
            table = table.setdefault(part, {})
            if not isinstance(table, dict):
                raise SceneError(
                    f"{origin}: {'.'.join(path[: depth + 1])} is no table."
                )
        key = ".".join(path)
        if key in FILES and isinstance(value, str) and isfile(value):
            value = str(Path(value).resolve())
        table[path[-1]] = value
        origins[key] = origin
    return origins


def _changes(overrides: Overrides) -> Iterable[tuple[list[str], Any, str]]:
    """Path of the key, value, and how the change was written."""
    if isinstance(overrides, str) or not isinstance(overrides, Iterable):
        raise SceneError(
            f"{overrides!r} changes no key; write for example "
            '{"protocol.hold": 2.0}, or ["protocol.hold=2 s"].'
        )
    if isinstance(overrides, Mapping):
        for key, value in overrides.items():
            yield _path(str(key)), _from_python(value), f"{key} = {value!r}"
        return
    for text in overrides:
        key, equals, written = str(text).partition("=")
        yield _path(key) if equals else [], _from_text(written.strip()), f"--set {text}"


def _path(key: str) -> list[str]:
    return [part.strip() for part in key.split(".")]


def _from_text(text: str) -> Any:
    """A value as ``--set`` takes it: TOML where it reads as TOML, else a text."""
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return parsed["value"] if set(parsed) == {"value"} else text


def _from_python(value: Any) -> Any:
    """`value` as a file would hold it; numbers, those of numpy too, are SI."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    match value:
        case Mapping():
            return {key: _from_python(item) for key, item in value.items()}
        case list() | tuple():
            return [_from_python(item) for item in value]
        case Path():
            return str(value)
        case bool():
            return value
        case int():
            return SIInt(value)
        case float():
            return SIFloat(value)
    return value
