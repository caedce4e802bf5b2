"""Dialects read from TOML files, checked before they may reach a bench.

Those that ship lie in `rows/`, a folder for each role; a bench file names one by its
id, which is the name of its file, or a file of the user's own by its path.
"""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources
from pathlib import Path
from typing import TypeVar

from tactile_lab.complaint import validated
from tactile_lab.errors import SceneError, choices
from tactile_lab.instruments.meter_dialect import (
    TeslameterDialect,
    ThermometerDialect,
)
from tactile_lab.instruments.scope_dialect import ScopeDialect
from tactile_lab.instruments.serial_dialect import CoilDialect, Dialect
from tactile_lab.instruments.voltage_dialect import VoltageDialect

D = TypeVar("D", bound=Dialect)

ROLES: dict[str, type[Dialect]] = {
    "coil": CoilDialect,
    "field meter": TeslameterDialect,
    "scope": ScopeDialect,
    "thermometer": ThermometerDialect,
    "voltage source": VoltageDialect,
}
"""What a dialect may be for, and the keys it then has."""


@cache
def dialect_ids(role: str | None = None) -> tuple[str, ...]:
    """Ids of the dialects that ship, sorted; only those for `role`, if given."""
    every = (file for file in _files() if role in (None, _role(file)))
    return tuple(sorted(file.stem for file in every))


def coil_dialect(name: str) -> CoilDialect:
    """The dialect `name`, which must be a current source's; see `load_dialect`."""
    return _for_role(load_dialect(name), name, CoilDialect)


def teslameter_dialect(name: str) -> TeslameterDialect:
    """The dialect `name`, which must be a teslameter's; see `load_dialect`."""
    return _for_role(load_dialect(name), name, TeslameterDialect)


def thermometer_dialect(name: str) -> ThermometerDialect:
    """The dialect `name`, which must be a thermometer's; see `load_dialect`."""
    return _for_role(load_dialect(name), name, ThermometerDialect)


def scope_dialect(name: str) -> ScopeDialect:
    """The dialect `name`, which must be an oscilloscope's; see `load_dialect`."""
    return _for_role(load_dialect(name), name, ScopeDialect)


def voltage_dialect(name: str) -> VoltageDialect:
    """The dialect `name`, which must be a voltage source's; see `load_dialect`."""
    return _for_role(load_dialect(name), name, VoltageDialect)


def load_dialect(name: str) -> Dialect:
    """The dialect called `name`: an id, or the path of a TOML file.

    Raises:
        SceneError: no such dialect (the nearest is named), or one with a mistake.
    """
    if name.endswith(".toml"):
        try:
            return parse_dialect(Path(name).read_text(encoding="utf-8"), name)
        except (OSError, UnicodeDecodeError) as reason:
            raise SceneError(f"Dialect {name} cannot be read: {reason}") from reason
    known = dialect_ids()
    if name not in known:
        raise SceneError(
            f'There is no dialect "{name}"; {choices(name, known)} A path ending in '
            ".toml names one of your own."
        )
    return _shipped(name)


def parse_dialect(text: str, where: str) -> Dialect:
    """The dialect written in `text`; `where` names its origin in messages.

    Raises:
        SceneError: not TOML, an unknown or missing key, a value out of range, or a
            template that cannot be filled in.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as reason:
        raise SceneError(f"Dialect {where} is not TOML: {reason}.") from reason
    role = table.get("role")
    if role not in ROLES:
        said = "is missing" if role is None else f'= "{role}" is not known'
        allowed = ", ".join(f'"{name}"' for name in ROLES)
        raise SceneError(f"Dialect {where}: role {said}; write one of {allowed}.")
    row = validated(ROLES[role], table, (), lambda _: f"Dialect {where}")
    row.try_templates(where)
    return row


def _for_role(found: Dialect, name: str, kind: type[D]) -> D:
    if isinstance(found, kind):
        return found
    wanted = next(role for role, one in ROLES.items() if one is kind)
    raise SceneError(
        f'Dialect "{name}" is a {found.role}, not a {wanted}; there are '
        f"{', '.join(dialect_ids(wanted))}."
    )


def _files() -> list[Path]:
    folder = Path(str(resources.files("tactile_lab.instruments") / "rows"))
    return list(folder.glob("*/*.toml"))


def _role(file: Path) -> str:
    return file.parent.name.replace("_", " ")


@cache
def _shipped(name: str) -> Dialect:
    (file,) = (one for one in _files() if one.stem == name)
    return parse_dialect(file.read_text(encoding="utf-8"), file.name)
