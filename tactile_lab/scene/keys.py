"""Every key of a scene: its value now, and what it means."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from tactile_lab.complaint import written
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.table import described


@dataclass(frozen=True)
class Key:
    """One key, as ``--set`` takes it.

    Attributes:
        name: ``table.key``.
        value: as the scene has it, in TOML.
        meaning: for a person; empty where the name says it.
    """

    name: str
    value: str
    meaning: str


def keys(scene: Scene) -> list[Key]:
    """Keys of the protocol first, then of the other tables."""
    fields = scene.protocol.parameters()
    meanings = {f"protocol.{n}": f.description or "" for n, f in fields.items()}
    values = dict(_flat(scene.to_dict()))
    names = [*meanings, *(name for name in values if name not in meanings)]
    for table in ("record", "detect", "sensor", "coil", "simulated", "conditions"):
        said = described(type(getattr(scene, table)))
        meanings |= {f"{table}.{key}": text for key, text in said.items()}
    return [
        Key(
            name,
            _shown(values[name]) if name in values else "",
            meanings.get(name, ""),
        )
        for name in names
        if name not in ("protocol.name", "protocol.source")
    ]


def _shown(value: Any) -> str:
    """As a file would have it, quantities with a prefix."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_shown, value))}]"
    match value.split(" ", 1) if isinstance(value, str) else ():
        case number, unit if re.fullmatch(r"[-+.e0-9]+", number):
            return f'"{show(float(number), unit, 6)}"'
    return written(value)


def _flat(table: dict[str, Any], at: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{at}{name}.")
        else:
            yield at + name, value
