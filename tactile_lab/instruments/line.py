"""What may stand in a dialect's lines: what a wire carries, and places to fill in."""

from __future__ import annotations

import re
from string import Formatter
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator

FIXED = re.compile(r"\+?0?\d?\d?\.\d\d?f")
"""Format of a number with fixed decimals."""


def frozen(value: object) -> object:
    """TOML arrays as tuples."""
    return tuple(value) if isinstance(value, list) else value


def _carried(text: str) -> str:
    if not text.isascii():
        odd = next(one for one in text if not one.isascii())
        raise ValueError(f"{odd!r} is no ASCII character; no instrument would read it")
    return text


def _line(text: str) -> str:
    if not _carried(text).isprintable():
        odd = next(one for one in text if not one.isprintable())
        raise ValueError(
            f"{odd!r} does not belong into a line; what ends it is send_end of [serial]"
        )
    return text


Characters = Annotated[str, AfterValidator(_carried)]
"""Any characters of a wire, such as a terminator."""

Line = Annotated[str, AfterValidator(_line)]
"""What is sent as one line, without its terminator."""

Lines = Annotated[tuple[Line, ...], BeforeValidator(frozen)]


def takes(*names: str) -> AfterValidator:
    """Of a line in which `names`, and nothing else, may stand in braces."""

    def known(line: str) -> str:
        for name, form in _places(line):
            if name not in names or form:
                raise _unknown(name, form, names)
        return line

    return AfterValidator(known)


def needs(name: str) -> AfterValidator:
    """Of a line in which `name` stands in braces."""

    def there(line: str) -> str:
        if _only(line, name):
            raise ValueError(f"write {{{name}}} alone into the braces")
        return line

    return AfterValidator(there)


def amount(name: str) -> AfterValidator:
    """Of a line in which the number `name` stands in braces, with fixed decimals."""

    def fixed(line: str) -> str:
        if FIXED.fullmatch(_only(line, name)) is None:
            raise ValueError(
                "an exponent might come of it, which many an instrument misreads; "
                f"write {{{name}:.5f}} for five decimals"
            )
        return line

    return AfterValidator(fixed)


def decimals(line: str) -> int:
    """How many the number in a line has that was checked by `amount`."""
    ((_, form),) = _places(line)
    return int(form.removesuffix("f").rpartition(".")[2])


def _only(line: str, name: str) -> str:
    """Format of the one place of a line, which must be `name`."""
    places = _places(line)
    for found, form in places:
        if found != name:
            raise _unknown(found, form, (name,))
    if len(places) != 1:
        raise ValueError(f"{{{name}}} must stand in it once")
    return places[0][1]


def _unknown(name: str, form: str, known: tuple[str, ...]) -> ValueError:
    wrong = name + (form and f":{form}")
    told = " and ".join(f"{{{one}}}" for one in known) or "nothing"
    return ValueError(f"{{{wrong}}} cannot be filled in; what can is {told}")


def _places(line: str) -> list[tuple[str, str]]:
    """Name and format of each place in braces."""
    try:
        parts = list(Formatter().parse(line))
    except ValueError as reason:
        raise ValueError(f"its braces cannot be read: {reason}") from reason
    return [
        (name + (f"!{kind}" if kind else ""), form or "")
        for _, name, form, kind in parts
        if name is not None
    ]
