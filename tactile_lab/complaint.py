"""From what validation found to a message: where, what, and what is allowed."""

from __future__ import annotations

import typing
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import ValidationError
from pydantic.fields import FieldInfo

from tactile_lab.errors import SceneError, choices, nearest
from tactile_lab.table import adapter, fields_of

M = TypeVar("M")
Blame = Callable[[tuple[str, ...]], str]
"""Names the origin of a key: the file, or the option that set it."""

_NEEDED = {
    "string_type": "a text in quotes is needed",
    "string_too_short": "a text that is not empty is needed",
    "bool_type": "true or false is needed",
    "int_type": "a whole number is needed",
    "int_from_float": "a whole number is needed",
    "float_type": "a number is needed",
    "finite_number": "a finite number is needed",
    "tuple_type": "a list [...] is needed",
    "list_type": "a list [...] is needed",
    "dict_type": "a table is needed",
    "model_type": "a table is needed",
    "dataclass_type": "a table is needed",
    "missing": "this key is missing",
}
_BOUNDS = {
    "greater_than": ("more than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_UNKNOWN = frozenset({"extra_forbidden", "unexpected_keyword_argument"})
_TAGS = frozenset({"word", "table"})


def validated(
    kind: type[M],
    table: Mapping[str, Any],
    at: tuple[str, ...],
    blame: Blame,
    folder: Path | None = Path(),
) -> M:
    """What a file holds as the noun it describes.

    Args:
        kind: a `tactile_lab.table.SceneTable`, or a pydantic model.
        table: as the file has it; quantities are texts, lists are tuples.
        at: keys under which it was found.
        blame: names the origin of a key.
        folder: what the files it names are relative to; None: they are not looked at.

    Raises:
        SceneError: one line for each key that is wrong.
    """
    try:
        context = {"text_only": True, "folder": folder}
        made: M = adapter(kind).validate_python(table, context=context)
    except ValidationError as wrong:
        found = wrong.errors()
        inside = {error["loc"][:-1] for error in found}
        lines = [
            _line(error, kind, at, blame)
            for error in found
            if not (error["type"] == "too_short" and error["loc"] in inside)
        ]
        raise SceneError("\n".join(dict.fromkeys(lines))) from wrong
    return made


def complaint(at: tuple[str, ...], message: str, blame: Blame) -> SceneError:
    """An error about the key `at`, or about a whole table where `at` is one name."""
    return SceneError(f"{blame(at)}: {place(at, table=len(at) == 1)}: {message}")


def place(at: Iterable[str | int], *, table: bool = False) -> str:
    """Where a key is, as a person finds it: ``[coil.limits] current``."""
    parts: list[str] = []
    for part in at:
        if isinstance(part, int) and parts:
            parts[-1] += f" number {part + 1}"
        else:
            parts.append(str(part))
    if not parts:
        return "the file"
    if table:
        return f"[{'.'.join(parts)}]"
    if len(parts) == 1:
        return parts[0]
    return f"[{'.'.join(parts[:-1])}] {parts[-1]}"


def written(value: Any) -> str:
    """A value as the file writes it, shortened."""
    match value:
        case bool():
            text = "true" if value else "false"
        case str():
            text = f'"{value}"'
        case dict():
            text = "{...}"
        case tuple() | list():
            text = f"[{', '.join(written(item) for item in value)}]"
        case _:
            text = str(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _line(error: Any, kind: Any, at: tuple[str, ...], blame: Blame) -> str:
    loc = tuple(part for part in error["loc"] if part not in _TAGS)
    full = (*at, *loc)
    origin = blame(tuple(str(part) for part in full))
    if error["type"] in _UNKNOWN:
        known = known_keys(kind, loc[:-1])
        where = place(full[:-1], table=True)
        what = "table" if isinstance(error["input"], dict) else "key"
        told = choices(str(loc[-1]), known)
        return f'{origin}: {where} has no {what} "{loc[-1]}"; {told}'
    if not loc:  # a check of the whole table
        return f"{origin}: {place(full, table=True)}: {_sentence(reason(error))}"
    if error["type"] == "missing":
        return f"{origin}: {place(full)} is missing{_example(kind, loc)}."
    told = reason(error)
    value = written(error["input"])
    shown = "" if value in told or isinstance(error["input"], dict) else f" = {value}"
    if isinstance(error["input"], str) and value not in told:
        told = told.replace(error["input"], value.strip('"'))
    if origin.startswith(f"{'.'.join(map(str, full))} = "):  # says key and value itself
        return f"{origin}: {_sentence(told)}"
    return f"{origin}: {place(full)}{shown}: {_sentence(told)}"


def _sentence(text: str) -> str:
    return text if text.endswith(("?", ".")) else f"{text}."


def reason(error: Any) -> str:
    """What pydantic found wrong with one value, for a person; no full stop."""
    kind = error["type"]
    if kind == "value_error":
        return str(error["ctx"]["error"]).rstrip(".")
    if kind == "literal_error":
        expected = str(error["ctx"]["expected"]).replace("'", '"')
        words = [part.strip('" ') for part in expected.replace(" or ", ",").split(",")]
        hint = nearest(str(error["input"]), filter(None, words))
        return f"{expected} is needed" + (f"; {hint}" if hint else "")
    if kind in _BOUNDS:
        sign, key = _BOUNDS[kind]
        return f"{sign} {error['ctx'][key]} is needed"
    if kind == "too_short":
        return "at least one value is needed"
    if kind in _NEEDED:
        return _NEEDED[kind]
    message = str(error["msg"])
    return message[:1].lower() + message[1:]


def _example(kind: Any, loc: tuple[Any, ...]) -> str:
    field = _keys_at(kind, loc[:-1]).get(str(loc[-1]))
    told = None if field is None else field.description
    return f": {told}" if told else ""


def known_keys(kind: Any, loc: tuple[Any, ...]) -> list[str]:
    """Keys allowed in the table found under `loc` of `kind`."""
    return [field.alias or name for name, field in _keys_at(kind, loc).items()]


def _keys_at(kind: Any, loc: tuple[Any, ...]) -> Mapping[str, FieldInfo]:
    """The fields of the table under `loc`; none where that is no table."""
    keys: Mapping[str, FieldInfo] = fields_of(kind)
    for part in loc:
        if not isinstance(part, int):
            found = (f for name, f in keys.items() if part in (name, f.alias))
            keys = _inner(getattr(next(found, None), "annotation", None))
    return keys


def _inner(annotation: Any) -> Mapping[str, FieldInfo]:
    """The fields of the first table in a type such as ``tuple[Channel, ...]``."""
    return fields_of(annotation) or next(
        filter(None, map(_inner, typing.get_args(annotation))), {}
    )
