"""One key of a table as a form edits it: kind, text in the field, what a file holds.

No Qt here. Any table can be a form: `tactile_lab.table.fields_of` has its keys.
"""

from __future__ import annotations

import json
import re
import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import cached_property
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import ConfigDict, PydanticUserError, TypeAdapter, ValidationError
from pydantic.fields import FieldInfo

from tactile_lab.complaint import reason
from tactile_lab.quantity import DECIMAL_COMMA, Unit, exact, parse, printed, typed
from tactile_lab.table import described, fields_of


class Kind(Enum):
    """How a parameter is edited."""

    QUANTITY = "quantity"
    QUANTITIES = "quantities"
    INTEGER = "integer"
    NUMBER = "number"
    SWITCH = "switch"
    CHOICE = "choice"
    FILE = "file"
    NAMES = "names"
    TEXT = "text"
    OTHER = "other"


PLAIN = {bool: Kind.SWITCH, int: Kind.INTEGER, float: Kind.NUMBER, str: Kind.TEXT}


class FieldError(ValueError):
    """What stands in a field cannot be used; the message says why."""


@dataclass(frozen=True)
class FormField:
    """One key of a table as a form needs it.

    Attributes:
        key: its name in the table, with a dot before that in a table within.
        info: type, limits, default and description.
        kind: how it is edited.
        unit: of a quantity or of each of several; None otherwise.
        optional: whether it may be left out.
        choices: of a choice.
        about: what it is, where its type does not say.
    """

    key: str
    info: FieldInfo
    kind: Kind
    unit: Unit | None
    optional: bool
    choices: tuple[str, ...] = ()
    about: str = ""

    @property
    def title(self) -> str:
        """The key as a person reads it, where its table has no better name for it.

        A symbol such as V_GS or g31 stays one.
        """
        if self.info.title:
            return self.info.title
        table, _, name = self.key.rpartition(".")
        key = f"{name}_{table}" if table else name
        if symbol := re.fullmatch(r"([A-Z]_[A-Za-z0-9]+|[A-Z]\d)_([a-z_]+)", key):
            return f"{symbol[1]} {symbol[2].replace('_', ' ')}"
        if len(key) < 3 or key[0].isupper() or key[-1].isdigit():
            return key
        words = key.replace("_", " ")
        return words[:1].upper() + words[1:]

    @property
    def required(self) -> bool:
        """Whether it has no default."""
        return self.info.is_required()

    @property
    def default(self) -> Any:
        """Its default; None where it must be given."""
        if self.required:
            return None
        return self.info.get_default(call_default_factory=True)

    @property
    def help(self) -> str:
        """What it is and what is allowed, for a person."""
        limits = self.unit.limits() if self.unit is not None else ""
        parts = [
            self.info.description or self.about,
            f"Allowed: {limits}." if limits else "",
        ]
        default = text_of(self, self.default)
        parts.append(f"Default: {default}." if default else "")
        return " ".join(part for part in parts if part)

    @cached_property
    def type(self) -> TypeAdapter[Any]:
        """Validates one value."""
        kind: Any = self.info.annotation
        for constraint in self.info.metadata:
            kind = Annotated[kind, constraint]
        try:
            return TypeAdapter(kind, config=ConfigDict(strict=True))
        except PydanticUserError:  # a table within the table: it has its own
            return TypeAdapter(kind)


class FieldText:
    """What stands in a field, whether or not anybody sees the field.

    Args:
        parameter: what it is a value of.
        value: SI; one that a scene holds or a default, so that it needs no check.
        usual: SI, what it is unless somebody says otherwise; the parameter's own
            default where None.

    Attributes:
        text: as a person reads and writes it.
        default: text of what is usual.
        problem: why the text cannot be used, "" if it can.
    """

    def __init__(self, parameter: FormField, value: Any, usual: Any = None) -> None:
        self.parameter = parameter
        self.text = text_of(parameter, value)
        self.default = text_of(parameter, parameter.default if usual is None else usual)
        self.problem = ""
        if not self.text:  # what must be given may be missing
            self.put("")

    def put(self, text: str) -> None:
        """Replace the text, and find out whether it can be used."""
        self.text = text
        try:
            self.entry()
            self.problem = ""
        except FieldError as error:
            self.problem = str(error)

    @property
    def is_changed(self) -> bool:
        """Whether it differs from what it is unless somebody says otherwise."""
        return self.text.strip() != self.default

    def entry(self) -> str | None:
        """What a scene file would hold; None to leave the key out.

        Raises:
            FieldError: the text cannot be used.
        """
        return entry_of(self.parameter, self.text)


def parameter(key: str, info: FieldInfo, about: str = "") -> FormField:
    """The parameter that a field of a table describes; `about` says what it is."""
    inner, optional, units = _taken_apart(info.annotation)
    units += [entry for entry in info.metadata if isinstance(entry, Unit)]
    choices: tuple[str, ...] = ()
    if get_origin(inner) is tuple and (items := _taken_apart(get_args(inner)[0])[2]):
        kind, units = Kind.QUANTITIES, items
    elif get_origin(inner) is tuple and _is_word(get_args(inner)[0]):
        kind = Kind.NAMES
    elif units:
        kind = Kind.QUANTITY if units[0].symbol else Kind.NUMBER
    elif get_origin(inner) is Literal:
        kind, choices = Kind.CHOICE, tuple(str(choice) for choice in get_args(inner))
    elif inner is str and key in ("file", "path"):
        kind = Kind.FILE
    else:
        kind = PLAIN.get(inner, Kind.OTHER)
    unit = units[0] if units else None
    about = about[:1].upper() + about[1:]
    return FormField(key, info, kind, unit, optional, choices, about)


def opened(
    key: str, info: FieldInfo, about: str = ""
) -> Iterator[tuple[str, FieldInfo, str]]:
    """A key of a table, or where it is a table itself, each of its own.

    Yields:
        Key with a dot before that of an inner table, type and default, what it is.
    """
    kind = info.annotation
    inner = fields_of(kind)
    words = described(kind) if inner and kind is not None else {}
    if get_origin(kind) is dict and not info.is_required():
        item = get_args(kind)[1]
        for name, usual in info.get_default(call_default_factory=True).items():
            inner[name] = FieldInfo.from_annotation(item)
            inner[name].default = usual
    if not inner:
        yield key, info, about
    for name, one in inner.items():
        yield f"{key}.{name}", one, words.get(name, about)


def value_at(values: Mapping[str, Any], key: str, otherwise: Any = None) -> Any:
    """What a table has at a key as `opened` names it."""
    name, _, within = key.partition(".")
    value = values.get(name)
    if within and value is not None:
        inner = isinstance(value, Mapping)
        value = value.get(within) if inner else getattr(value, within)
    return otherwise if name not in values else value


def _is_word(kind: Any) -> bool:
    inner = _taken_apart(kind)[0]
    return inner is str or get_origin(inner) is Literal


def _taken_apart(kind: Any) -> tuple[Any, bool, list[Unit]]:
    """A type without Annotated and None, whether None was allowed, and its units."""
    if hasattr(kind, "__metadata__"):
        inner, optional, units = _taken_apart(kind.__origin__)
        kept = [entry for entry in kind.__metadata__ if isinstance(entry, Unit)]
        return inner, optional, units + kept
    if get_origin(kind) in (Union, types.UnionType):
        rest = [one for one in get_args(kind) if one is not type(None)]
        if len(rest) == 1:
            inner, _, units = _taken_apart(rest[0])
            return inner, True, units
        return kind, len(rest) < len(get_args(kind)), []
    return kind, False, []


def text_of(parameter: FormField, value: Any) -> str:
    """A parameter's SI value as it stands in its field."""
    if value is None:
        return ""
    unit = parameter.unit
    if parameter.kind is Kind.QUANTITY and unit is not None:
        return exact(float(value), unit.symbol)
    if parameter.kind is Kind.QUANTITIES and unit is not None:
        return listed([float(v) for v in value], unit.symbol)
    if parameter.kind is Kind.NAMES:
        return ", ".join(value)
    if parameter.kind is Kind.OTHER:
        held = parameter.type.dump_python(value)
        return held if isinstance(held, str) else toml(held)
    if parameter.kind is Kind.SWITCH:
        return toml(value)
    return str(value)


def listed(values: list[float], symbol: str) -> str:
    """Values with one unit at the end where that is exact: "80, 120, 160 mN"."""
    if not values:
        return ""
    unit = exact(max(values, key=abs), symbol).partition(" ")[2]
    factor = parse(f"1 {unit}", symbol)
    short = [f"{value / factor:.10g}" for value in values]
    if [parse(f"{text} {unit}", symbol) for text in short] == values:
        return printed(f"{', '.join(short)} {unit}")
    return ", ".join(exact(value, symbol) for value in values)


def entry_of(parameter: FormField, text: str) -> str | None:
    """What a scene file holds for the text in a field; None to leave the key out.

    Raises:
        FieldError: the text cannot be used; says what is allowed.
    """
    text = text.strip()
    if not text and parameter.required:
        raise FieldError(f"{parameter.title} must be given.")
    if not text and not parameter.optional:
        text = text_of(parameter, parameter.default)  # which the field shows in grey
    if not text:
        return None
    if parameter.kind is Kind.OTHER:
        return toml(text) if re.fullmatch(r"[a-z]+", text) else text
    value = _value(parameter, text)
    try:
        parameter.type.validate_python(value)
    except ValidationError as wrong:
        told = reason(wrong.errors()[0])
        named = told[:1].isupper() or not told[:1].isalpha()
        raise FieldError(f"{told if named else f'{text}: {told}'}.") from wrong
    return toml(value)


def _value(parameter: FormField, text: str) -> Any:
    """What a field's text means, not yet checked; quantities are texts."""
    symbol = parameter.unit.symbol if parameter.unit is not None else ""
    match parameter.kind:
        case Kind.QUANTITY:
            return _quantity(text, symbol)
        case Kind.QUANTITIES:
            if DECIMAL_COMMA.search(text):
                raise FieldError(
                    f"{text}: a comma between digits may be a decimal one. Write a "
                    "decimal point, and a space after a comma that parts two values."
                )
            parts = [one.strip() for one in text.replace(";", ",").split(",")]
            parts = [one for one in parts if one] or [""]
            shared = parts[-1].partition(" ")[2].strip() or symbol
            return tuple(_quantity(one, shared) for one in parts if one)
        case Kind.NAMES:
            return tuple(text.replace(",", " ").split())
        case Kind.SWITCH:
            return text == "true"
        case Kind.INTEGER | Kind.NUMBER as kind:
            number, what = (
                (int, "whole number") if kind is Kind.INTEGER else (float, "number")
            )
            try:
                return number(typed(text))
            except ValueError as error:
                raise FieldError(f"{text} is not a {what}.") from error
    return text


def with_unit(parameter: FormField, text: str) -> str:
    """The text of a quantity with the unit it is taken in, where none is written."""
    quantities = Kind.QUANTITY, Kind.QUANTITIES
    if parameter.kind not in quantities or parameter.unit is None:
        return text
    try:
        float(typed(re.split("[,;]", text)[-1]))
    except ValueError:
        return text
    return f"{text.strip()} {parameter.unit.symbol}"


def _quantity(text: str, unit: str) -> str:
    """Text with a unit: a bare number gets `unit`."""
    text = typed(text)
    try:
        float(text)
    except ValueError:
        return text
    return f"{text} {unit}"


def toml(value: Any) -> str:
    """A value in one line of TOML."""
    if isinstance(value, dict):
        inner = ", ".join(f"{key} = {toml(item)}" for key, item in value.items())
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml(item) for item in value)}]"
    return json.dumps(value, ensure_ascii=False)
