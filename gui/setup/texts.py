"""Between what stands in a form field and what a scene file holds. No Qt here."""

from __future__ import annotations

import json
from typing import Any

from gui.setup.kinds import Kind, Parameter
from tactile_lab.errors import QuantityError
from tactile_lab.quantity import Unit, parse, show


class FieldError(ValueError):
    """What stands in a field cannot be used; the message says why."""


def text_of(parameter: Parameter, value: Any) -> str:
    """A parameter's SI value as it stands in its field."""
    if value is None:
        return ""
    unit = parameter.unit
    if parameter.kind is Kind.QUANTITY and unit is not None:
        return exact(float(value), unit.symbol)
    if parameter.kind is Kind.QUANTITIES and unit is not None:
        return listed([float(v) for v in value], unit.symbol)
    if parameter.kind is Kind.OTHER:
        return toml(value)
    return str(value)


def exact(value: float, symbol: str) -> str:
    """The shortest text with a prefix that reads back to the same value."""
    for digits in range(4, 18):
        text = show(value, symbol, digits)
        if parse(text, symbol) == value:
            return text
    return f"{value!r} {symbol}"


def listed(values: list[float], symbol: str) -> str:
    """Values with one unit at the end where that is exact: "80, 120, 160 mN"."""
    if not values:
        return ""
    texts = [exact(value, symbol) for value in values]
    largest = max(values, key=abs)
    unit = exact(largest, symbol).partition(" ")[2]
    factor = parse(f"1 {unit}", symbol)
    short = [f"{value / factor:.10g}".replace("-", "−") for value in values]
    if all(
        parse(f"{s} {unit}", symbol) == v for s, v in zip(short, values, strict=True)
    ):
        return f"{', '.join(short)} {unit}"
    return ", ".join(texts)


def entry_of(parameter: Parameter, text: str) -> str | None:
    """What a scene file holds for the text in a field; None to leave the key out.

    Raises:
        FieldError: the text cannot be used; says what is allowed.
    """
    text = text.strip()
    if not text:
        if parameter.optional or not parameter.required:
            return None
        raise FieldError(f"{parameter.title} must be given.")
    if parameter.kind is Kind.QUANTITY and parameter.unit is not None:
        return toml(_quantity(parameter.unit, text))
    if parameter.kind is Kind.QUANTITIES and parameter.unit is not None:
        return toml(_quantities(parameter.unit, text))
    if parameter.kind is Kind.INTEGER:
        return toml(_integer(parameter, text))
    if parameter.kind is Kind.NUMBER:
        try:
            return repr(float(text.replace("−", "-")))
        except ValueError as error:
            raise FieldError(f"{text} is not a number.") from error
    if parameter.kind is Kind.SWITCH:
        return "true" if text == "True" else "false"
    if parameter.kind is Kind.OTHER:
        return text
    return toml(text)


def _quantity(unit: Unit, text: str, default_unit: str | None = None) -> str:
    """Text with a unit; a bare number gets `default_unit`, or the SI unit."""
    bare = text.replace("−", "-")
    try:
        float(bare)
    except ValueError:
        whole = text
    else:
        whole = f"{bare} {default_unit or unit.symbol}"
    try:
        value = parse(whole, unit.symbol)
        unit.validate(value, _NoContext())  # type: ignore[arg-type]
    except QuantityError as error:
        raise FieldError(str(error)) from error
    return whole.replace("−", "-")


class _NoContext:
    """Stands for pydantic's validation info outside of a validation."""

    context = None


def _quantities(unit: Unit, text: str) -> list[str]:
    parts = [part.strip() for part in text.replace(";", ",").split(",")]
    parts = [part for part in parts if part]
    if not parts:
        raise FieldError("Give at least one value.")
    last = parts[-1].split(maxsplit=1)
    shared = last[1] if len(last) == 2 else unit.symbol
    return [_quantity(unit, part, shared) for part in parts]


def _integer(parameter: Parameter, text: str) -> int:
    try:
        value = int(text.replace("−", "-"))
    except ValueError as error:
        raise FieldError(f"{text} is not a whole number.") from error
    if parameter.least is not None and value < parameter.least:
        raise FieldError(f"{value} is too small; allowed is {parameter.least} or more.")
    if parameter.most is not None and value > parameter.most:
        raise FieldError(f"{value} is too large; allowed is {parameter.most} or less.")
    return value


def toml(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        inner = ", ".join(f"{key} = {toml(item)}" for key, item in value.items())
        return f"{{ {inner} }}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(toml(item) for item in value)}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)
