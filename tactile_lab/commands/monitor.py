"""``tactile-lab monitor``: watch the sensor, coil off; keep a minute on demand."""

from __future__ import annotations

import sys
import threading
import time
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, TextIO

import click

from tactile_lab.commands.attended import run_attended
from tactile_lab.commands.run import noted
from tactile_lab.commands.terminal import fail, refusing, scene_options, warn

if TYPE_CHECKING:
    from tactile_lab.engine.monitor import Monitor

ENDLESS = ('protocol.duration="86400 s"', 'protocol.part="600 s"')
"""Until stopped; what the user sets comes after and wins."""
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
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("runs"),
    show_default=True,
    metavar="DIR",
    help="Where recorded runs are put.",
)
@click.option("--note", "notes", multiple=True, metavar="KEY=TEXT", help="As in run.")
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
    """
    with refusing():
        from tactile_lab.engine.monitor import Monitor
        from tactile_lab.scene.load import load

        loaded = load(scene or "monitor", (*ENDLESS, *overrides), bench)
        kept = noted(notes)
        monitor = Monitor(loaded, realtime=True, keep=keep)
    asked = _entered(sys.stdin)
    sight = Sight(sys.stderr)

    def look() -> None:
        sight.show(str(monitor.sensor))
        if _any(asked):
            sight.wipe()
            _record(monitor, out, kept)

    ending = run_attended(monitor, look, {RECORD: lambda: asked.put(RECORD)})
    sight.wipe()
    if ending.exit_code and ending.signal is None:
        fail(f"{ending.state}: {ending.reason} {ending.off.text}", ending.exit_code)


def _record(monitor: Monitor, out: Path, notes: dict[str, str]) -> None:
    from tactile_lab.errors import TactileLabError
    from tactile_lab.report.from_run import read
    from tactile_lab.report.write import write

    try:
        folder = monitor.record(out, notes)
        click.echo(f"run     {folder}")
        write(folder, read(folder))
    except (TactileLabError, OSError) as reason:
        warn(f"not recorded: {reason}")


class Sight:
    """The sensor's state on stderr: one changing line on a terminal, else lines."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._live = stream.isatty()
        self._next = 0.0
        self._width = 0

    def show(self, text: str) -> None:
        """Show `text` if it is time to."""
        now = time.monotonic()
        if now < self._next:
            return
        self._next = now + (SHOWN_EVERY if self._live else LINE_EVERY)
        if not self._live:
            self._stream.write(text + "\n")
        else:
            text = f"{text}   Enter records, Ctrl-C ends"
            self._stream.write("\r" + text.ljust(self._width))
            self._width = len(text)
        self._stream.flush()

    def wipe(self) -> None:
        """Leave the terminal ready for other output."""
        if self._live and self._width:
            self._stream.write("\r" + " " * self._width + "\r")
            self._stream.flush()
            self._width = 0


def _entered(stream: TextIO) -> SimpleQueue[str]:
    """Lines of `stream` as they come."""
    lines: SimpleQueue[str] = SimpleQueue()

    def read() -> None:
        for line in stream:
            lines.put(line)

    threading.Thread(target=read, name="keyboard", daemon=True).start()
    return lines


def _any(lines: SimpleQueue[str]) -> bool:
    """Whether there was a line; all are taken."""
    found = False
    while True:
        try:
            lines.get_nowait()
        except Empty:
            return found
        found = True
