"""``--set key=value``: single keys of a scene changed from the command line."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from typing import Any

from tactile_lab.errors import SceneError


def apply(data: dict[str, Any], overrides: Sequence[str]) -> dict[str, str]:
    """Change `data` in place by ``table.key=value`` texts.

    A value is TOML where it reads as TOML (numbers, true, lists, quoted texts), and
    otherwise a text, so that quantities need no quotes of their own.

    Returns:
        The option as written for each dotted key it set, to be named in messages.

    Raises:
        SceneError: not of that form, or the key lies inside something that is no table.
    """
    origins = {}
    for text in overrides:
        key, equals, value = text.partition("=")
        path = [part.strip() for part in key.split(".")]
        if not equals or len(path) < 2 or not all(path):
            raise SceneError(
                f'--set {text}: write table.key=value, such as protocol.hold="2 s".'
            )
        table = data
        for depth, part in enumerate(path[:-1]):
            table = table.setdefault(part, {})
            if not isinstance(table, dict):
                raise SceneError(
                    f"--set {text}: {'.'.join(path[: depth + 1])} is no table."
                )
        table[path[-1]] = _value(value.strip())
        origins[".".join(path)] = f"--set {text}"
    return origins


def _value(text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (ValueError, RecursionError):
        return text
    return parsed["value"] if set(parsed) == {"value"} else text
