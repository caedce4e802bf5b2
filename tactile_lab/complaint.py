"""From what validation found to a message: where, what, and what is allowed."""

from __future__ import annotations

import typing
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from tactile_lab.errors import SceneError, nearest

M = TypeVar("M", bound=BaseModel)
Blame = Callable[[tuple[str, ...]], str]
"""Names the origin of a key: the file, or the option that set it."""

_NEEDED = {
    "string_type": "a text in quotes is needed",
    "bool_type": "true or false is needed",
    "int_type": "a whole number is needed",
    "int_from_float": "a whole number is needed",
    "float_type": "a number is needed",
    "finite_number": "a finite number is needed",
    "tuple_type": "a list [...] is needed",
    "list_type": "a list [...] is needed",
    "dict_type": "a table is needed",
    "model_type": "a table is needed",
    "missing": "this key is missing",
}
_BOUNDS = {
    "greater_than": ("more than", "gt"),
    "greater_than_equal": ("at least", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("at most", "le"),
}
_TAGS = frozenset({"word", "table"})


def validated(
    model: type[M], table: Mapping[str, Any], at: tuple[str, ...], blame: Blame
) -> M:
    """`table`, found under the keys `at`, as a `model`.

    Raises:
        SceneError: one line for each key that is wrong.
    """
    try:
        return model.model_validate(table, context={"text_only": True})
    except ValidationError as wrong:
        found = wrong.errors()
        inside = {error["loc"][:-1] for error in found}
        lines = [
            _line(error, model, at, blame)
            for error in found
            if not (error["type"] == "too_short" and error["loc"] in inside)
        ]
        raise SceneError("\n".join(dict.fromkeys(lines))) from wrong


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


def _line(error: Any, model: type[BaseModel], at: tuple[str, ...], blame: Blame) -> str:
    loc = tuple(part for part in error["loc"] if part not in _TAGS)
    full = (*at, *loc)
    origin = blame(tuple(str(part) for part in full))
    if error["type"] == "extra_forbidden":
        known = known_keys(model, loc[:-1])
        hint = nearest(str(loc[-1]), known)
        where = place(full[:-1], table=True)
        what = "table" if isinstance(error["input"], dict) else "key"
        return (
            f'{origin}: {where} has no {what} "{loc[-1]}"; {hint + " " if hint else ""}'
            f"Known: {', '.join(known)}."
        )
    if not loc:  # a check of the whole table
        return f"{origin}: {place(full, table=True)}: {_sentence(_reason(error))}"
    if error["type"] == "missing":
        return f"{origin}: {place(full)} is missing{_example(model, loc)}."
    reason = _reason(error)
    value = written(error["input"])
    shown = "" if value in reason or isinstance(error["input"], dict) else f" = {value}"
    if isinstance(error["input"], str) and value not in reason:
        reason = reason.replace(error["input"], value.strip('"'))
    return f"{origin}: {place(full)}{shown}: {_sentence(reason)}"


def _sentence(text: str) -> str:
    return text if text.endswith(("?", ".")) else f"{text}."


def _reason(error: Any) -> str:
    kind = error["type"]
    if kind == "value_error":
        return str(error["ctx"]["error"]).rstrip(".")
    if kind == "literal_error":
        expected = str(error["ctx"]["expected"]).replace("'", '"')
        choices = [
            part.strip('" ') for part in expected.replace(" or ", ", ").split(",")
        ]
        hint = nearest(str(error["input"]), [c for c in choices if c])
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


def _example(model: type[BaseModel], loc: tuple[Any, ...]) -> str:
    table = _model_at(model, loc[:-1])
    field = table.model_fields.get(str(loc[-1])) if table is not None else None
    if field is None:
        return ""
    if field.description:
        return f": {field.description}"
    return ""


def known_keys(model: type[BaseModel], loc: tuple[Any, ...]) -> list[str]:
    """Keys allowed in the table found under `loc` of `model`."""
    table = _model_at(model, loc)
    if table is None:
        return []
    return [field.alias or name for name, field in table.model_fields.items()]


def _model_at(model: type[BaseModel], loc: tuple[Any, ...]) -> type[BaseModel] | None:
    for part in loc:
        if isinstance(part, int):
            continue
        for name, field in model.model_fields.items():
            if part in (name, field.alias):
                inner = _inner(field.annotation)
                break
        else:
            return None
        if inner is None:
            return None
        model = inner
    return model


def _inner(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for part in typing.get_args(annotation):
        found = _inner(part)
        if found is not None:
            return found
    return None
