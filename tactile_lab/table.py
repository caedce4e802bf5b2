"""Tables of a scene or bench file: plain dataclasses, validated in place.

A noun that a file can describe is a frozen dataclass that inherits `SceneTable`; units
and limits stand at its fields (``current: Annotated[float, Unit("A", above=0.0)]``).
Made in Python it is what it is given; `tactile_lab.complaint.validated` makes one of
what a file holds. Nothing here loads pydantic before a file is read.
"""

from __future__ import annotations

import dataclasses
import inspect
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, cast, get_type_hints

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic import GetCoreSchemaHandler, TypeAdapter
    from pydantic.fields import FieldInfo
    from pydantic_core import CoreSchema

INTERNAL = {"internal": True}
"""Metadata of a dataclass field that no file may set."""


class SceneTable:
    """What a table of a file describes: strict, unknown keys refused."""

    __pydantic_config__: ClassVar[Any] = {
        "extra": "forbid",
        "strict": True,
        "allow_inf_nan": False,
    }

    @classmethod
    def __get_pydantic_core_schema__(
        cls, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """The schema pydantic finds, for a table instead of an instance."""
        made = handler(source)
        whole: Any = handler.resolve_ref_schema(made)
        whole["strict"] = False  # its fields stay strict
        arguments = whole["schema"]
        keys = [name for name in whole["fields"] if name not in _internal(cls)]
        whole["fields"] = keys
        arguments["fields"] = [f for f in arguments["fields"] if f["name"] in keys]
        return made


def fields_of(kind: Any) -> dict[str, FieldInfo]:
    """The keys of a table or a protocol, with type, unit, limits and default.

    Empty for whatever has none.
    """
    from pydantic import BaseModel
    from pydantic.fields import FieldInfo
    from typing_extensions import is_typeddict

    if is_typeddict(kind):
        hints = get_type_hints(kind, include_extras=True)
        return {name: FieldInfo.from_annotation(hint) for name, hint in hints.items()}
    if not isinstance(kind, type):
        return {}
    if issubclass(kind, BaseModel):
        return kind.model_fields
    if not dataclasses.is_dataclass(kind):
        return {}
    hints = get_type_hints(kind, include_extras=True)
    return {
        field.name: FieldInfo.from_annotated_attribute(hints[field.name], field)
        for field in dataclasses.fields(kind)
        if not field.metadata.get("internal")
    }


def described(kind: Any) -> dict[str, str]:
    """What the keys of a table are, by key, as its docstring's `Attributes` tells."""
    found: dict[str, str] = {}
    for one in reversed(inspect.getmro(kind)):
        found |= _attributes(inspect.cleandoc(vars(one).get("__doc__") or ""))
    return found


def _attributes(text: str) -> dict[str, str]:
    found: dict[str, str] = {}
    names: list[str] = []
    for line in text.partition("Attributes:\n")[2].split("\n"):
        if line and not line.startswith(" " * 4):
            break  # another part of the docstring
        if line.startswith(" " * 8):
            for name in names:
                found[name] += f" {line.strip()}"
        elif line.strip():
            keys, _, words = line.strip().partition(": ")
            names = keys.split(", ")
            found |= dict.fromkeys(names, words)
    return found


def dumped(table: Any) -> dict[str, Any]:
    """All keys of a table or protocol as a file holds them; what is None is left out.

    Quantities are exact texts.
    """
    made: dict[str, Any] = adapter(type(table)).dump_python(
        table, by_alias=True, exclude_none=True
    )
    return made


def _adapter(kind: type[Any]) -> TypeAdapter[Any]:
    from pydantic import TypeAdapter

    return TypeAdapter(kind)


adapter = cast("Callable[[type[Any]], TypeAdapter[Any]]", lru_cache(128)(_adapter))
"""Reads and writes a table, or a pydantic model.

Building its schema takes ten times as long as using it. Only so many are kept: a user's
protocol is a new class each time its file is read.
"""


def _internal(kind: Any) -> set[str]:
    return {f.name for f in dataclasses.fields(kind) if f.metadata.get("internal")}
