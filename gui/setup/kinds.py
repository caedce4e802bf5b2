"""What kind of field a protocol's parameter needs, found from its type."""

from __future__ import annotations

import types
from dataclasses import dataclass
from enum import Enum
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from tactile_lab.quantity import Unit


class Kind(Enum):
    """How a parameter is edited."""

    QUANTITY = "quantity"
    QUANTITIES = "quantities"
    INTEGER = "integer"
    NUMBER = "number"
    SWITCH = "switch"
    CHOICE = "choice"
    FILE = "file"
    TEXT = "text"
    OTHER = "other"


@dataclass(frozen=True)
class Parameter:
    """One parameter of a protocol as the form needs it.

    Attributes:
        key: field name.
        kind: how it is edited.
        unit: of a quantity; None otherwise.
        optional: whether it may be left out.
        default: value, or None where it must be given.
        required: whether it has no default.
        help: one line for a person.
        choices: of a choice.
        least, most: of an integer.
    """

    key: str
    kind: Kind
    unit: Unit | None
    optional: bool
    default: Any
    required: bool
    help: str
    choices: tuple[str, ...] = ()
    least: int | None = None
    most: int | None = None

    @property
    def title(self) -> str:
        """The key as a person reads it."""
        words = self.key.replace("_", " ")
        return words if words[:1].isupper() else words[:1].upper() + words[1:]


def parameter(key: str, info: FieldInfo) -> Parameter:
    """The parameter that a pydantic field describes."""
    kept = [entry for entry in info.metadata if isinstance(entry, Unit)]
    inner, optional, unit = _unwrap(info.annotation, kept[0] if kept else None)
    kind = _kind(key, inner, unit)
    item = _item_unit(inner) if kind is Kind.QUANTITIES else unit
    least = next((int(e.ge) for e in info.metadata if hasattr(e, "ge")), None)
    most = next((int(e.le) for e in info.metadata if hasattr(e, "le")), None)
    required = info.is_required()
    default = info.get_default(call_default_factory=True) if not required else None
    return Parameter(
        key=key,
        kind=kind,
        unit=item,
        optional=optional,
        default=None if default is PydanticUndefined else default,
        required=required,
        help=info.description or "",
        choices=tuple(str(c) for c in get_args(inner)) if kind is Kind.CHOICE else (),
        least=least,
        most=most,
    )


def _unwrap(kind: Any, unit: Unit | None) -> tuple[Any, bool, Unit | None]:
    """Take Optional and Annotated apart."""
    optional = False
    while True:
        origin = get_origin(kind)
        if hasattr(kind, "__metadata__"):
            found = [e for e in kind.__metadata__ if isinstance(e, Unit)]
            unit = found[0] if found else unit
            kind = kind.__origin__
        elif origin in (Union, types.UnionType):
            rest = [k for k in get_args(kind) if k is not type(None)]
            optional = optional or len(rest) < len(get_args(kind))
            if len(rest) != 1:
                return kind, optional, unit
            kind = rest[0]
        else:
            return kind, optional, unit


def _kind(key: str, kind: Any, unit: Unit | None) -> Kind:
    if unit is not None:
        return Kind.QUANTITY
    if get_origin(kind) is tuple and _item_unit(kind) is not None:
        return Kind.QUANTITIES
    if get_origin(kind) is Literal:
        return Kind.CHOICE
    if kind is str:
        return Kind.FILE if key in ("file", "path") else Kind.TEXT
    plain = {bool: Kind.SWITCH, int: Kind.INTEGER, float: Kind.NUMBER}
    return plain.get(kind, Kind.OTHER)


def _item_unit(kind: Any) -> Unit | None:
    items = [k for k in get_args(kind) if k is not Ellipsis]
    for item in items:
        for entry in getattr(item, "__metadata__", ()):
            if isinstance(entry, Unit):
                return entry
    return None
