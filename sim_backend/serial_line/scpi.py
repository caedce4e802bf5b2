"""A strict SCPI far end: headers, short and long forms, an error queue.

What the command table does not know is an error, never a polite default.
"""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Callable, Mapping

Handler = Callable[[str], str | None]
"""Takes the argument text (empty for none), returns the answer or None."""

QUEUE_LENGTH = 20


class ScpiError(Exception):
    """A command the instrument refuses.

    Args:
        code: SCPI error number, negative.
        text: SCPI error text.
    """

    def __init__(self, code: int, text: str) -> None:
        super().__init__(f"{code} {text}")
        self.code = code
        self.text = text


class ScpiParser:
    """Runs program messages against a table of header patterns.

    Patterns are written as manuals do, `[SOURce:]CURRent[:LEVel]?`; the upper-case
    part is the short form, and brackets are optional.

    Args:
        commands: header pattern to handler.
        max_line: longest message in characters; None for no limit.
        max_queries: most queries in one message; None for no limit.
        standard: understands `SYSTem:ERRor?` and `*CLS`.
        errors: the queue, where others look at it too.
    """

    def __init__(
        self,
        commands: Mapping[str, Handler],
        *,
        max_line: int | None = None,
        max_queries: int | None = None,
        standard: bool = True,
        errors: deque[tuple[int, str]] | None = None,
    ) -> None:
        self.errors = deque() if errors is None else errors
        self._max_line = max_line
        self._max_queries = max_queries
        table = dict(commands)
        if standard:
            table["SYSTem:ERRor[:NEXT]?"] = self._next_error
            table["*CLS"] = self._clear
        self._table = [(header_pattern(h), run) for h, run in table.items()]

    def line(self, line: bytes) -> bytes | None:
        """Run one program message; the answer without terminator, or None."""
        text = line.decode("ascii", errors="replace").strip()
        if self._max_line is not None and len(line) + 1 > self._max_line:
            self.push(-400, "QUE error")
            return b"\x15"
        units = [unit.strip() for unit in text.split(";") if unit.strip()]
        asked = sum("?" in unit for unit in units)
        if self._max_queries is not None and asked > self._max_queries:
            self.push(-400, "QUE error")
            return b"\x15"
        answers, path = [], ""
        for unit in units:
            header, _, argument = unit.partition(" ")
            full, path = resolved(header, path)
            try:
                answer = self._run(full, argument.strip())
            except ScpiError as refused:
                self.push(refused.code, refused.text)
                continue
            if answer is not None:
                answers.append(answer)
        return ";".join(answers).encode("ascii") if answers else None

    def push(self, code: int, text: str) -> None:
        """Put an error in the queue; the last place says that it overflowed."""
        if len(self.errors) >= QUEUE_LENGTH:
            self.errors[-1] = (-350, "Queue overflow")
        else:
            self.errors.append((code, text))

    def _run(self, header: str, argument: str) -> str | None:
        for pattern, run in self._table:
            if pattern.fullmatch(header):
                return run(argument)
        raise ScpiError(-113, "Undefined header")

    def _next_error(self, _: str) -> str:
        code, text = self.errors.popleft() if self.errors else (0, "No error")
        return f'{code},"{text}"'

    def _clear(self, _: str) -> None:
        self.errors.clear()


def resolved(header: str, path: str) -> tuple[str, str]:
    """(absolute header, path for the next unit) by SCPI's rule for `;`."""
    if header.startswith("*"):
        return header, path
    full = header[1:] if header.startswith(":") else path + header
    return full, full[: full.rfind(":") + 1]


def header_pattern(written: str) -> re.Pattern[str]:
    """Pattern that takes the short and the long form of each part of a header."""
    out = []
    for part in re.findall(r"[A-Za-z]+|.", written):
        if part.isalpha():
            short = "".join(c for c in part if c.isupper())
            out.append(part if part == short else f"(?:{short}|{part})")
        elif part == "[":
            out.append("(?:")
        elif part == "]":
            out.append(")?")
        else:
            out.append(re.escape(part))
    return re.compile("".join(out), re.IGNORECASE)


def number(argument: str, low: float, high: float) -> float:
    """A numeric argument from low to high.

    Raises:
        ScpiError: not a number (-120), missing (-109) or out of range (-222).
    """
    if not argument:
        raise ScpiError(-109, "Missing parameter")
    if not re.fullmatch(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", argument):
        raise ScpiError(-120, "Numeric data error")
    value = float(argument)
    if not low <= value <= high:
        raise ScpiError(-222, "Data out of range")
    return value


def boolean(argument: str) -> bool:
    """A boolean argument.

    Raises:
        ScpiError: neither 0, 1, OFF nor ON.
    """
    try:
        return {"0": False, "OFF": False, "1": True, "ON": True}[argument.upper()]
    except KeyError:
        raise ScpiError(-224, "Illegal parameter value") from None


def no_argument(argument: str) -> None:
    """Refuse an argument where the header takes none.

    Raises:
        ScpiError: there is one (-108).
    """
    if argument:
        raise ScpiError(-108, "Parameter not allowed")


def bare(action: Callable[[], None]) -> Handler:
    """A handler for a header without argument."""

    def run(argument: str) -> None:
        no_argument(argument)
        action()

    return run


def numeric(action: Callable[[float], None], low: float, high: float) -> Handler:
    """A handler for a number from `low` to `high`."""
    return lambda argument: action(number(argument, low, high))


def one_of(action: Callable[[str], None], *choices: str) -> Handler:
    """A handler for one of some words, short or long form; given the short one."""

    def run(argument: str) -> None:
        for choice in choices:
            short = "".join(c for c in choice if not c.islower())
            if argument.upper() in (short, choice.upper()):
                action(short)
                return
        raise ScpiError(-224, "Illegal parameter value")

    return run
