"""What all verbs share: errors as one message and a code, progress, JSON."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, TextIO

import click

from tactile_lab.errors import TactileLabError

REFUSED = 2
LINE_EVERY = 0.1
"""Part of the whole after which progress writes a line where it is piped."""
REDRAW_EVERY = 0.1
"""Seconds between redraws on a terminal."""


def scene_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """The argument and options of all verbs that take a scene."""
    for option in (
        click.argument("scene", required=False, type=click.Path()),
        click.option(
            "--set",
            "overrides",
            multiple=True,
            metavar="KEY=VALUE",
            help='Change one key, such as --set protocol.duration="2 s".',
        ),
        click.option(
            "--bench",
            metavar="FILE|sim",
            help="Bench file to use instead of the scene's own.",
        ),
    ):
        command = option(command)
    return command


@contextmanager
def refusing() -> Iterator[None]:
    """Turn this program's errors into one message on stderr and exit code 2.

    For work that opens nothing; what happens once instruments are open has codes of
    its own.
    """
    try:
        yield
    except TactileLabError as error:
        fail(str(error), REFUSED)


def fail(message: str, code: int) -> None:
    """Write `message` to stderr and exit with `code`."""
    click.echo(f"tactile-lab: {message}", err=True)
    raise click.exceptions.Exit(code)


def warn(message: str) -> None:
    """Write a warning to stderr."""
    click.echo(f"warning: {message}", err=True)


def print_json(data: Mapping[str, Any]) -> None:
    """The one object on stdout: full double precision, no NaN."""
    click.echo(json.dumps(data, allow_nan=False))


def somebody() -> Callable[[str], str] | None:
    """Asks the person at the terminal for something; None where none sits there."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return None

    def ask(text: str) -> str:
        click.echo(f"\n{text} Then press Enter.", err=True)
        # not readline: a thread left waiting in it would crash Python's exit
        typed = os.read(sys.stdin.fileno(), 4096)
        if not typed:
            raise EOFError("the terminal was closed")
        return typed.decode(errors="replace").strip()

    return ask


class Progress:
    """How far a long piece of work is, on stderr.

    A bar with the time left on a terminal, a plain line per tenth where piped.

    Args:
        total: the whole, in any unit.
        label: what is being done.
        stream: where to write; stderr unless given.
        now: seconds, for tests.
    """

    def __init__(
        self,
        total: float,
        label: str,
        stream: TextIO | None = None,
        now: Callable[[], float] = time.monotonic,
    ) -> None:
        self._total = total
        self._label = label
        self._stream = sys.stderr if stream is None else stream
        self._now = now
        self._began = now()
        self._first: tuple[float, float] | None = None
        self._drawn = -REDRAW_EVERY
        self._next_line = 0.0
        self._width = 0
        self._live = self._stream.isatty()

    def update(self, done: float, text: str = "") -> None:
        """`done` of the total is done; `text` says what is happening now."""
        part = min(max(done / self._total, 0.0), 1.0) if self._total > 0 else 1.0
        if self._first is None:
            self._first = part, self._now()
        if self._live:
            if self._now() - self._drawn >= REDRAW_EVERY or part == 1.0:
                self._drawn = self._now()
                self._draw(part, text)
        elif part >= self._next_line:
            self._next_line = (int(part / LINE_EVERY + 1e-9) + 1) * LINE_EVERY
            self._write(self._line(part, text))

    def note(self, line: str) -> None:
        """Write a line of its own above the bar."""
        self._wipe()
        self._write(line)

    def close(self) -> None:
        """Leave the terminal ready for other output; idempotent."""
        self._wipe()

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _line(self, part: float, text: str) -> str:
        spent = self._now() - self._began
        left = self._time_left(part)
        more = f"  {text}" if text else ""
        return f"{self._label} {part:4.0%}  {_clock(spent)}{left}{more}"

    def _time_left(self, part: float) -> str:
        # at the pace since the first update: what comes before it (connecting,
        # compiling) happens once
        first, when = self._first or (0.0, self._began)
        if not first < part < 1:
            return ""
        pace = (self._now() - when) / (part - first)
        return f", {_clock(pace * (1 - part))} left"

    def _draw(self, part: float, text: str) -> None:
        filled = round(24 * part)
        line = f"[{'#' * filled}{'.' * (24 - filled)}] {self._line(part, text)}"[:118]
        self._stream.write("\r" + line + " " * max(0, self._width - len(line)))
        self._stream.flush()
        self._width = len(line)

    def _wipe(self) -> None:
        if self._live and self._width:
            self._stream.write("\r" + " " * self._width + "\r")
            self._stream.flush()
            self._width = 0

    def _write(self, line: str) -> None:
        self._stream.write(line + "\n")
        self._stream.flush()


def _clock(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = int(seconds // 60)
    if minutes < 60:
        return f"{minutes} min {int(seconds % 60):02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"
