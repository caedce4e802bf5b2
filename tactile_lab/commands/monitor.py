"""``tactile-lab monitor``: watch the sensor, coil off; keep a minute on demand."""

from __future__ import annotations

import signal
import sys
import threading
import time
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, TextIO

import click

from tactile_lab.commands.attended import Signals, run_attended
from tactile_lab.commands.options import (
    noted,
    notes_option,
    runs_option,
    scene_asked,
    scene_options,
)
from tactile_lab.commands.terminal import StatusLine, fail, refusing, say, warn

if TYPE_CHECKING:
    from tactile_lab.engine.monitor import Monitor

SHOWN_EVERY, LINE_EVERY = 0.5, 5.0
"""Time between two looks on a terminal, and between two lines where piped, s."""
RECORD = "SIGUSR1"


@click.command()
@scene_options
@click.option(
    "--keep",
    type=click.FloatRange(1, 600),
    default=60.0,
    show_default=True,
    metavar="SECONDS",
    help="How much is held for Record.",
)
@runs_option
@notes_option
def command(
    scene: str | None,
    overrides: tuple[str, ...],
    bench: str | None,
    keep: float,
    out: Path,
    notes: tuple[str, ...],
) -> None:
    """Watch V_C1, V_C2, rate and distance to threshold until Ctrl-C, the coil off.

    Enter, or the signal SIGUSR1, records: the last 60 s become a run whose folder is
    printed, and watching goes on. Nothing else is stored. The simulated bench keeps
    pace with the clock.

    Exit codes: 0 ended by Ctrl-C, 129 or 143 by SIGHUP or SIGTERM; others as of `run`.
    """
    asked: SimpleQueue[str] = SimpleQueue()
    with Signals({RECORD: lambda: asked.put(RECORD)}) as signals:
        with refusing():
            from tactile_lab.engine.monitor import Monitor
            from tactile_lab.engine.sensor import LONG_PARTS

            loaded = scene_asked(scene or "monitor", (*LONG_PARTS, *overrides), bench)
            kept = noted(notes)
            ends = any(one.startswith("protocol.duration") for one in overrides)
            monitor = Monitor(loaded, realtime=True, keep=keep, endless=not ends)
            signals.look()
        _watch(monitor, signals, asked, out, kept)


def _watch(
    monitor: Monitor,
    signals: Signals,
    asked: SimpleQueue[str],
    out: Path,
    kept: dict[str, str],
) -> None:
    _listen(sys.stdin, asked)
    sight = SensorLine(sys.stderr)

    def look() -> None:
        sight.show(str(monitor.sensor))
        if _any(asked):
            sight.wipe()
            _record(monitor, out, kept)

    ending = run_attended(monitor, signals, look)
    sight.wipe()
    if not ending.exit_code or ending.signal == signal.SIGINT:
        return  # Ctrl-C is how watching ends
    if ending.signal is None:
        fail(ending.told, ending.exit_code)
    raise click.exceptions.Exit(ending.exit_code)


def _record(monitor: Monitor, out: Path, notes: dict[str, str]) -> None:
    from tactile_lab.engine.memory import give_back
    from tactile_lab.errors import TactileLabError
    from tactile_lab.report.from_run import read
    from tactile_lab.report.write import write

    try:
        folder = monitor.record(out, notes)
        say(f"run     {folder}")
        write(folder, read(folder))
        give_back()  # it watches on for days
    except (TactileLabError, OSError) as reason:
        warn(f"not recorded: {reason}")


class SensorLine:
    """The sensor's state on stderr: one changing line on a terminal, else lines."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._line = StatusLine(stream) if stream.isatty() else None
        self._next = 0.0
        if self._line is not None:  # on a line of its own: 80 columns hold the state
            say("Enter records, Ctrl-C ends", stream)

    def show(self, text: str) -> None:
        """Show `text` if it is time to."""
        now = time.monotonic()
        if now < self._next:
            return
        if self._line is not None:
            self._next = now + SHOWN_EVERY
            self._line.show(text)
        else:
            self._next = now + LINE_EVERY
            say(text, self._stream)

    def wipe(self) -> None:
        """Leave the terminal ready for other output."""
        if self._line is not None:
            self._line.close()


def _listen(stream: TextIO, lines: SimpleQueue[str]) -> None:
    """Put the lines of `stream` into `lines` as they come."""

    def read() -> None:
        for line in stream:
            lines.put(line)

    threading.Thread(target=read, name="keyboard", daemon=True).start()


def _any(lines: SimpleQueue[str]) -> bool:
    """Whether there was a line; all are taken."""
    found = False
    while True:
        try:
            lines.get_nowait()
        except Empty:
            return found
        found = True
