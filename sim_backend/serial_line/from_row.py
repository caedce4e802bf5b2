"""Far ends for rows of a user's own, as far as the row itself describes them.

They say what the row expects to hear, so they cannot find out that a row is wrong; the
models that ship are written from their manuals instead.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable
from functools import partial
from re import _parser  # type: ignore[attr-defined]
from string import Formatter
from typing import Any

from tactile_lab.errors import SceneError
from tactile_lab.instruments.serial_dialect import SerialDialect

UNKNOWN = '-113,"Undefined header"'

Answer = Callable[[], str]


class RowParser:
    """What is common to all rows: name, settings that are accepted, error queue.

    An instrument that only answers is no more than this.

    Args:
        row: the dialect.
        answers: further queries.
        acts: further lines; each says whether it was meant.
        errors: of the instrument, oldest first.

    Attributes:
        reply_end, clearing, gap: as the row has them, see `LineInstrument`.

    Raises:
        SceneError: no answer can be made from one of the row's patterns.
    """

    def __init__(
        self,
        row: SerialDialect,
        answers: dict[str, Answer],
        acts: Callable[[str], bool] = lambda line: False,
        errors: deque[str] | None = None,
    ) -> None:
        errors = deque() if errors is None else errors
        self.reply_end = row.serial.reply_end.encode("ascii")
        self.clearing = row.serial.preamble.encode("ascii")
        self.gap = row.serial.min_gap
        name, fine = invented(row.match), invented(row.error_ok)
        self._answers = {row.identify: lambda: name} | answers
        for query, wanted in row.confirm.items():
            if isinstance(wanted, str):
                self._answers[query] = partial(invented, wanted)
            else:
                self._answers[query] = partial(invented, row.number, f"{wanted[0]:g}")
        if row.error is not None:
            self._answers[row.error] = lambda: errors.popleft() if errors else fine
        self._accepted = {*row.init, *row.optional, *row.release}
        self._acts, self._errors = acts, errors
        self._error = row.error or ""
        self._tail = row.verified("")[0]  # behind a line that is verified in one
        for answer in answers.values():
            answer()  # a pattern without an answer is found here, not in a run

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        parts = [line.decode("ascii", "replace")]
        if self._tail and parts[0].endswith(self._tail):
            parts = [parts[0].removesuffix(self._tail), self._error]
        said = [self._one(part) for part in parts]
        told = ";".join(one for one in said if one)
        return told.encode("ascii") if told else None

    def _one(self, text: str) -> str | None:
        if text in self._answers:
            return self._answers[text]()
        if not self._acts(text) and text not in self._accepted:
            self._errors.append(UNKNOWN)
        return None


def reader(template: str) -> Callable[[str], float | None]:
    """Reads the number back that `template` was filled with; None for other lines."""
    pattern = "".join(
        re.escape(literal) + ("" if name is None else r"([-+]?\d+\.?\d*)")
        for literal, name, _, _ in Formatter().parse(template)
    )

    def read(line: str) -> float | None:
        found = re.fullmatch(pattern, line)
        return None if found is None else float(found.group(1))

    return read


_BY_CATEGORY = {
    "CATEGORY_DIGIT": "1",
    "CATEGORY_NOT_DIGIT": "x",
    "CATEGORY_SPACE": " ",
    "CATEGORY_NOT_SPACE": "x",
    "CATEGORY_WORD": "x",
    "CATEGORY_NOT_WORD": " ",
}


def invented(pattern: str, number: str | None = None) -> str:
    """The shortest text of the first kind that `pattern` finds.

    Args:
        pattern: of a row.
        number: what group 1 shall be.

    Raises:
        SceneError: no such text could be made.
    """
    text = _text(_parser.parse(pattern), number).strip()
    found = re.search(pattern, text)
    if found is None or (number is not None and found.group(1) != number):
        raise SceneError(
            f"No simulated answer can be made from the pattern {pattern!r}; it gives "
            f"{text!r}. Write a simpler pattern, or simulate the model in "
            "sim_backend/."
        )
    return text


def _text(tree: Any, number: str | None) -> str:
    return "".join(_part(str(kind), value, number) for kind, value in tree)


def _part(kind: str, value: Any, number: str | None) -> str:
    text = ""  # places and look-arounds have no text of their own
    match kind:
        case "LITERAL":
            text = chr(value)
        case "ANY" | "NOT_LITERAL":
            text = "x"
        case "IN":
            text = _one_of(value)
        case "BRANCH":
            text = _text(value[1][0], number)
        case "SUBPATTERN" if value[0] == 1 and number is not None:
            text = number
        case "SUBPATTERN":
            text = _text(value[3], number)
        case "MAX_REPEAT" | "MIN_REPEAT":
            least, _, tree = value
            text = _text(tree, number) * least
    return text


def _one_of(choices: Any) -> str:
    kind, value = str(choices[0][0]), choices[0][1]
    if kind == "RANGE":
        return chr(value[0])
    if kind == "CATEGORY":
        return _BY_CATEGORY[str(value)]
    return "x" if kind == "NEGATE" else chr(value)
