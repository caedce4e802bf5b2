"""Dialect rows read from TOML files, checked before they may reach a bench.

The rows that ship lie in `drivers/dialects/`; a bench file may name a row by its id or
by the path of a TOML file of its own.
"""

from __future__ import annotations

import difflib
import tomllib
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, Field, ValidationError

from drivers.dialect_row import CoilDialect, MeterDialect
from tactile_lab.errors import SceneError


class _Row(BaseModel):
    row: Annotated[CoilDialect | MeterDialect, Field(discriminator="role")]


def dialect_ids() -> tuple[str, ...]:
    """Ids of the rows that ship, sorted."""
    return tuple(sorted(_shipped()))


def load_dialect(name: str) -> CoilDialect | MeterDialect:
    """The row called `name`: an id, or the path of a TOML file.

    Raises:
        SceneError: no such row (the nearest is named), or a row with a mistake.
    """
    if name.endswith(".toml"):
        path = Path(name)
        try:
            return parse_dialect(path.read_text(encoding="utf-8"), str(path))
        except (OSError, UnicodeDecodeError) as reason:
            raise SceneError(
                f"Dialect file {path} cannot be read: {reason}"
            ) from reason
    rows = _shipped()
    if name not in rows:
        near = difflib.get_close_matches(name, rows, n=1, cutoff=0.3)
        hint = f'did you mean "{near[0]}"?' if near else "no name is near it."
        raise SceneError(
            f'There is no dialect "{name}"; {hint} Known: {", ".join(sorted(rows))}. '
            "A path ending in .toml names a row of your own."
        )
    return rows[name]


def coil_dialect(name: str) -> CoilDialect:
    """The row `name`, which must be a current source's.

    Raises:
        SceneError: no such row, or a row of another role.
    """
    row = load_dialect(name)
    if not isinstance(row, CoilDialect):
        raise SceneError(f'Dialect "{name}" is a {row.role}, not a coil source.')
    return row


def meter_dialect(name: str) -> MeterDialect:
    """The row `name`, which must be a teslameter's.

    Raises:
        SceneError: no such row, or a row of another role.
    """
    row = load_dialect(name)
    if not isinstance(row, MeterDialect):
        raise SceneError(f'Dialect "{name}" is a {row.role}, not a field meter.')
    return row


def parse_dialect(text: str, where: str) -> CoilDialect | MeterDialect:
    """The row written in `text`; `where` names its origin in messages.

    Raises:
        SceneError: not TOML, an unknown or missing key, a value out of range, or a
            template that cannot be filled in.
    """
    try:
        table = tomllib.loads(text)
        row = _Row.model_validate(
            {"row": table}, strict=True, context={"text_only": True}
        ).row
        _try_templates(row)
    except (tomllib.TOMLDecodeError, ValidationError, KeyError, IndexError) as reason:
        raise SceneError(f"Dialect {where} cannot be used: {reason}") from reason
    return row


def _try_templates(row: CoilDialect | MeterDialect) -> None:
    """Fill in every template with extremes: a bad row must not reach a bench."""
    if not isinstance(row, CoilDialect):
        return
    for value in (-row.current, 0.0, row.current):
        for line in row.verified(row.set_line(value)):
            if len(line) + len(row.serial.send_end) > row.serial.max_line:
                raise SceneError(f"Dialect {row.id}: {line!r} is too long for the row.")
    row.limit_line(row.voltage)
    if row.list is not None:
        row.list.points.format(values="0.1,0.2")
        row.list.dwell.format(t=row.list.shortest)
        row.list.count.format(n=1)


@cache
def _shipped() -> dict[str, CoilDialect | MeterDialect]:
    rows = {}
    for entry in resources.files("drivers").joinpath("dialects").iterdir():
        if entry.name.endswith(".toml"):
            row = parse_dialect(entry.read_text(encoding="utf-8"), entry.name)
            rows[row.id] = row
    return rows
