"""What all verbs share at a terminal: text, colour, errors, progress, JSON.

Colour, bars and spinners are rich's, imported where somebody looks; lines that are
piped stay plain.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from _thread import interrupt_main
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import FrameType
from typing import TYPE_CHECKING, Any, NoReturn, TextIO

import click

from tactile_lab.errors import RunFolderError, TactileLabError

if TYPE_CHECKING:
    from rich.text import Text

REFUSED = 2
SHOWN = {code: f"\\x{code:02x}" for code in (*range(32), *range(127, 160))}
del SHOWN[ord("\t")], SHOWN[ord("\n")]
LINE_EVERY = 0.1
"""Part of the whole after which progress writes a line where it is piped."""
ENDING = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
    if hasattr(signal, name)
)
"""Signals that end a program, of those that this system has."""

SOON = 0.001
"""Seconds between looks whether a signal that was lost can come again."""
PATIENCE = 10.0
"""Seconds that piped work may take unmentioned."""
REDRAW_EVERY = 0.1
"""Seconds between redraws on a terminal."""
STYLES = {
    r"\bWRONG\b|\bREAL INSTRUMENTS\b|^damage\b|^problem\b|^tactile-lab:": "bold red",
    r"\b(faulted|cut short|aborted)\b|loss: [1-9]\S*": "red",
    r"^warning:|^changed\b": "yellow",
    r"^sound$|^ok\b|\bcomplete\b|loss: 0 of": "green",
    r"not identifiable|not determined": "dim",
    r"^(needs|leaves out|takes|resolution, one code|rests on)$": "bold",
    r"^the lab's defaults$": "bold",
}
"""What is coloured, and how."""


def say(text: str = "", stream: TextIO | None = None) -> None:
    """Write a line, or several, for a person; to stdout unless told otherwise.

    Characters that would act on a terminal, in a note of a run one was sent, are shown.
    """
    stream = sys.stdout if stream is None else stream
    text = text.translate(SHOWN)
    if not stream.isatty():
        click.echo(text, file=stream)
        return
    from rich.console import Console

    Console(file=stream).print(_coloured(text), soft_wrap=True)


def _coloured(text: str) -> Text:
    import re

    from rich.text import Text

    shown = Text(text)
    for pattern, style in STYLES.items():
        shown.highlight_regex(re.compile(pattern, re.MULTILINE), style)
    return shown


def warn(message: str) -> None:
    """Write a warning to stderr, if anybody is there to read it."""
    with suppress(OSError):
        say(f"warning: {message}", sys.stderr)


def fail(message: str, code: int) -> NoReturn:
    """Write `message` to stderr, if anybody is there to read it; exit with `code`."""
    with suppress(OSError):
        say(f"tactile-lab: {message}", sys.stderr)
    raise click.exceptions.Exit(code)


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


@contextmanager
def reading(run: Path) -> Iterator[None]:
    """As `refusing`, for what reads a run: whatever damage breaks is told as damage.

    What fails in a run that is as it was written is a mistake of this program.
    """
    with refusing():
        try:
            with _as_signalled():
                yield
        except (TactileLabError, click.exceptions.Exit):
            raise
        except Exception as error:
            from tactile_lab.store.verify import verify

            found = verify(run).findings
            if not found:
                raise
            raise RunFolderError(
                f"{run} is damaged ({found[0]}). `tactile-lab verify` lists all that "
                "is not as it was written."
            ) from error


def let_go() -> None:
    """Where nobody reads on, have what still waits to be written go nowhere.

    Else Python's own exit fails to write it and changes the exit code.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError):
            with suppress(OSError, ValueError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def print_json(data: Mapping[str, Any]) -> None:
    """The one object on stdout: full double precision, no NaN."""
    import json

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


@contextmanager
def working(text: str) -> Iterator[None]:
    """A sign of life on a terminal, for work whose length is not known."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    with Console(stderr=True).status(f"{text} ..."):
        yield


@contextmanager
def progress(text: str) -> Iterator[Callable[[float], None]]:
    """How far a piece of work is: give what it yields the part done, 0 to 1.

    On a terminal a bar with the time left; where piped, lines once it takes long. A
    Ctrl-C that was swallowed, in a callback from C, ends the work at its next update.
    """
    with (
        _noting_endings() as look,
        ProgressLine(1.0, text, patience=PATIENCE) as line,
    ):

        def update(done: float) -> None:
            look()
            line.update(done)

        yield update


def leave(number: int, _: FrameType | None) -> NoReturn:
    """Leave the program as a signal asks; the next of its kind ends it at once."""
    signal.signal(number, signal.SIG_DFL)
    raise SystemExit(128 + number)


@contextmanager
def minded(handlers: Mapping[int, Any]) -> Iterator[None]:
    """Within, signals are handled so, and as before after it; of the main thread."""
    before = {n: signal.signal(n, handler) for n, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def leaving_tidily() -> Iterator[None]:
    """Within, SIGTERM and SIGHUP let what is being written be cleared away first."""
    ours = threading.current_thread() is threading.main_thread()
    unminded = (n for n in ENDING if ours and signal.getsignal(n) == signal.SIG_DFL)
    with minded(dict.fromkeys(unminded, leave)), _heard_again(), _as_signalled():
        yield


@contextmanager
def _heard_again() -> Iterator[None]:
    """Within, a signal that an object's end swallowed comes again when that is over."""
    told = sys.unraisablehook

    def again(lost: sys.UnraisableHookArgs) -> None:
        number = _number(lost.exc_value)
        if number is None:
            told(lost)
            return
        if signal.getsignal(number) == signal.SIG_DFL:  # it left already, in vain
            signal.signal(number, leave)
        threading.Thread(target=send, args=[number], daemon=True).start()

    def send(number: signal.Signals) -> None:
        main = threading.main_thread().ident or 0
        frames = sys._current_frames  # noqa: SLF001 (documented all the same)
        while _runs(again, frames().get(main)):
            time.sleep(SOON)  # it would be lost within, too
        interrupt_main(number)

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = told


def _runs(function: Callable[..., Any], frame: FrameType | None) -> bool:
    """Whether `function` is among those that run in a thread whose frame that is."""
    while frame is not None and frame.f_code is not function.__code__:
        frame = frame.f_back
    return frame is not None


def _number(ending: BaseException | None) -> signal.Signals | None:
    """The signal that raised it; None for what no signal raises."""
    if isinstance(ending, KeyboardInterrupt):
        return signal.SIGINT
    code = ending.code if isinstance(ending, SystemExit) else None
    return next((number for number in ENDING if code == 128 + number), None)


@contextmanager
def _as_signalled() -> Iterator[None]:
    """Within, a signal that met compiled code raises what it raises elsewhere.

    Numba returns what it computed, so that Python raises a SystemError of both.
    """
    try:
        yield
    except SystemError as both:
        if isinstance(both.__cause__, SystemExit | KeyboardInterrupt):
            raise both.__cause__ from None
        raise


@contextmanager
def _noting_endings() -> Iterator[Callable[[], None]]:
    """Looks whether a signal came that ends the program, and raises what it raised."""
    heard: list[int] = []
    # another thread sets no handler, and one of another kind minds them itself
    ours = threading.current_thread() is threading.main_thread()
    handlers: dict[int, Callable[[int, FrameType | None], Any]] = {
        number: handler
        for number in (ENDING if ours else ())
        if callable(handler := signal.getsignal(number))
        and handler in (signal.default_int_handler, leave)
    }

    def note(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        handlers[number](number, frame)

    def look() -> None:
        if heard:
            handlers[heard[0]](heard[0], None)

    told = sys.unraisablehook

    def untold(lost: sys.UnraisableHookArgs) -> None:
        # an object's end raises nothing; `look` does, so Python need not print it
        if not (heard and issubclass(lost.exc_type, SystemExit | KeyboardInterrupt)):
            told(lost)

    with minded(dict.fromkeys(handlers, note)):
        sys.unraisablehook = untold
        try:
            yield look
            look()
        finally:
            sys.unraisablehook = told


class StatusLine:
    """A line on a terminal that changes in place and leaves nothing behind."""

    def __init__(self, stream: TextIO) -> None:
        from rich.console import Console
        from rich.live import Live

        self._live = Live(
            console=Console(file=stream), auto_refresh=False, transient=True
        )

    def show(self, text: str, part: float | None = None) -> None:
        """Show `text`, beside a bar where a part of a whole is given."""
        from rich.progress_bar import ProgressBar
        from rich.table import Table
        from rich.text import Text

        row = Table.grid(padding=(0, 1))
        line = Text(text, no_wrap=True, overflow="ellipsis")
        if part is None:
            row.add_row(line)
        else:
            bar = ProgressBar(
                total=1.0, completed=part, width=24, complete_style="cyan"
            )
            row.add_row(bar, line)
        if not self._live.is_started:
            self._live.start()
        self._live.update(row, refresh=True)

    def note(self, text: str) -> None:
        """Write a line that stays, above the one that changes."""
        self._live.console.print(_coloured(text), soft_wrap=True)

    def close(self) -> None:
        """Take the line away; it comes back when something is shown."""
        self._live.stop()


class ProgressLine:
    """How far a long piece of work is, on stderr.

    A bar with the time left on a terminal, a plain line per tenth where piped.

    Args:
        total: the whole, in any unit.
        label: what is being done.
        stream: where to write; stderr unless given.
        now: seconds, for tests.
        patience: seconds before a first line is written where it is piped.
    """

    def __init__(
        self,
        total: float,
        label: str,
        stream: TextIO | None = None,
        now: Callable[[], float] = time.monotonic,
        patience: float = 0.0,
    ) -> None:
        self._patience = patience
        self._total = total
        self._label = label
        self._stream = sys.stderr if stream is None else stream
        self._now = now
        self._began = now()
        self._first: tuple[float, float] | None = None
        self._drawn = -REDRAW_EVERY
        self._next_line = 0.0
        self._line = StatusLine(self._stream) if self._stream.isatty() else None
        if self._line is not None:
            self._line.show(f"{label}: getting ready", 0.0)

    def update(self, done: float, text: str = "") -> None:
        """`done` of the total is done; `text` says what is happening now."""
        part = min(max(done / self._total, 0.0), 1.0) if self._total > 0 else 1.0
        if self._first is None:
            self._first = part, self._now()
        if self._line is not None:
            if self._now() - self._drawn >= REDRAW_EVERY or part == 1.0:
                self._drawn = self._now()
                self._line.show(self._described(part, text), part)
        elif part >= self._next_line and self._now() - self._began >= self._patience:
            self._next_line = (int(part / LINE_EVERY + 1e-9) + 1) * LINE_EVERY
            self.note(self._described(part, text))

    def note(self, line: str) -> None:
        """Write a line of its own above the bar."""
        if self._line is not None:
            self._line.note(line)
        else:
            say(line, self._stream)

    def close(self) -> None:
        """Leave the terminal ready for other output; idempotent."""
        if self._line is not None:
            self._line.close()

    def __enter__(self) -> ProgressLine:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _described(self, part: float, text: str) -> str:
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


def _clock(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = int(seconds // 60)
    if minutes < 60:
        return f"{minutes} min {int(seconds % 60):02d} s"
    return f"{minutes // 60} h {minutes % 60:02d} min"
