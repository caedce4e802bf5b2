"""A condition on runs, such as ``protocol.levels > 100 mN and note ~ cal``, as SQL."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection
from typing import NamedTuple

from tactile_lab.errors import QuantityError, SceneError, choices
from tactile_lab.store.facts import quantity

EXAMPLE = "--where 'protocol.levels > 100 mN and note ~ cal'"
_TOKEN = re.compile(
    r"\s*(?:(?P<sign>!=|>=|<=|=|>|<|~)|(?P<bracket>[()])"
    r"|(?P<quoted>\"[^\"]*\"|'[^']*')|(?P<word>[^\s()=<>~!\"]+))"
)


class Condition(NamedTuple):
    """SQL over the column `run` of the index, and its parameters."""

    sql: str
    values: tuple[str | float, ...]


Units = Callable[[str], Collection[str]]
"""The units of a key's numbers, "" for none of them; empty where it holds texts."""


def condition(text: str, keys: Collection[str], units: Units) -> Condition:
    """The condition that `text` states.

    ``KEY SIGN VALUE``, joined by and, or, not and brackets. Signs are = != > >= < <=
    and ~ (contains, in any case); a key that holds several values fits if one does. A
    key alone asks whether it is there. Values with spaces may stand in quotes.

    Args:
        text: as a person typed it.
        keys: that may be asked for; empty for any.
        units: of a key's numbers; empty where it holds texts alone.

    Raises:
        SceneError: it cannot be read, a key is unknown, or a unit does not fit.
    """
    return _Reader(text, keys, units).read()


class _Reader:
    def __init__(self, text: str, keys: Collection[str], units: Units) -> None:
        self._text, self._keys, self._units = text, keys, units
        self._tokens: list[tuple[str, str]] = []
        at = 0
        while text[at:].strip():
            match = _TOKEN.match(text, at)
            if match is None:
                raise self._wrong(f"{text[at:].strip()[:20]!r} cannot be read")
            kind = match.lastgroup or ""
            found = match[kind]
            self._tokens.append((kind, found[1:-1] if kind == "quoted" else found))
            at = match.end()
        self._at = 0

    def read(self) -> Condition:
        if not self._tokens:
            raise self._wrong("it is empty")
        found = self._any()
        if self._at < len(self._tokens):
            raise self._wrong(f"{self._tokens[self._at][1]!r} stands where it ends")
        return found

    def _any(self) -> Condition:
        return self._joined("or", self._all)

    def _all(self) -> Condition:
        return self._joined("and", self._one)

    def _joined(self, word: str, part: Callable[[], Condition]) -> Condition:
        parts = [part()]
        while self._is("word", word):
            parts.append(part())
        if len(parts) == 1:
            return parts[0]
        sql = f" {word.upper()} ".join(one.sql for one in parts)
        return Condition(f"({sql})", tuple(v for one in parts for v in one.values))

    def _one(self) -> Condition:
        if self._is("word", "not"):
            sql, values = self._one()
            return Condition(f"NOT {sql}", values)
        if self._is("bracket", "("):
            found = self._any()
            if not self._is("bracket", ")"):
                raise self._wrong("a bracket is not closed")
            return found
        key = self._next("a key")
        if self._keys and key not in self._keys:
            told = choices(key, sorted(self._keys), "Keys")
            raise SceneError(f'--where: no run has "{key}"; {told}')
        if self._at == len(self._tokens) or self._tokens[self._at][0] != "sign":
            return _exists("key = ?", key)
        sign = self._tokens[self._at][1]
        self._at += 1
        return self._compared(key, sign, self._value())

    def _compared(self, key: str, sign: str, value: str) -> Condition:
        if sign == "~":
            folded = value.casefold().replace("\\", "\\\\")
            folded = folded.replace("%", "\\%").replace("_", "\\_")
            return _exists("key = ? AND folded LIKE ? ESCAPE '\\'", key, f"%{folded}%")
        units = self._units(key)
        if not units:
            if sign == "!=":
                sql, values = _exists("key = ? AND folded = ?", key, value.casefold())
                return Condition(f"NOT {sql}", values)
            return _exists(f"key = ? AND folded {sign} ?", key, value.casefold())
        found: list[Condition] = []
        wrong: QuantityError | None = None
        for unit in sorted(units):
            try:
                number = quantity(value, unit)
            except QuantityError as reason:
                wrong = reason
                continue
            sql = f"key = ? AND unit = ? AND number {sign} ?"
            found.append(_exists(sql, key, unit, number))
        if not found:
            raise SceneError(f"--where: {key} {sign} {value}: {wrong}")
        sql = " OR ".join(one.sql for one in found)
        return Condition(f"({sql})", tuple(v for one in found for v in one.values))

    def _value(self) -> str:
        """A quoted text, or words up to the next and, or, bracket or the end."""
        if self._at < len(self._tokens) and self._tokens[self._at][0] == "quoted":
            return self._next("a value")
        words = []
        while self._at < len(self._tokens):
            kind, text = self._tokens[self._at]
            if kind != "word" or text in ("and", "or"):
                break
            words.append(text)
            self._at += 1
        if not words:
            raise self._wrong("a value is missing")
        return " ".join(words)

    def _next(self, what: str) -> str:
        if self._at == len(self._tokens) or self._tokens[self._at][0] not in (
            "word",
            "quoted",
        ):
            raise self._wrong(f"{what} is missing")
        self._at += 1
        return self._tokens[self._at - 1][1]

    def _is(self, kind: str, text: str) -> bool:
        here = self._at < len(self._tokens) and self._tokens[self._at] == (kind, text)
        self._at += here
        return here

    def _wrong(self, why: str) -> SceneError:
        return SceneError(
            f'--where "{self._text}": {why}; write for example {EXAMPLE}.'
        )


def _exists(sql: str, *values: str | float) -> Condition:
    return Condition(f"run IN (SELECT run FROM facts WHERE {sql})", values)
