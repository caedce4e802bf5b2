"""The process an engine works in.

On Linux it is forked from one that has loaded what every engine needs (`ahead`): it is
there at once, and what was loaded is in memory once. Elsewhere each loads for itself.
"""

from __future__ import annotations

import os
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection

FORKS = sys.platform == "linux"
AHEAD = "tactile_lab.engine.ahead"

CONTEXT = get_context("forkserver") if FORKS else get_context("spawn")

if FORKS:
    from multiprocessing import forkserver

Serve = Callable[[Connection, bool], None]

FIRST, SECOND, BEHIND = -10, -5, 5
"""Niceness of what holds instruments; of the window, through whose thread STOP comes;
and of what works beside them: on a busy computer it has a third of the usual share."""


def load_ahead() -> None:
    """Begin to load what engines need, in a process beside this; returns at once."""
    if FORKS:
        forkserver.set_forkserver_preload([AHEAD])
        forkserver.ensure_running()


class EngineProcess:
    """Serves one end of a pipe; starts without holding up who asks for it.

    Args:
        serve: what it does: with its end of the pipe, and `realtime`.
        pipe: its end; closed here once it has it, or could not be started.
        realtime: pace a simulated bench by the wall clock.
        behind: it holds no instrument, and comes after those that do.
    """

    def __init__(
        self, serve: Serve, pipe: Connection, *, realtime: bool, behind: bool = False
    ) -> None:
        self._pipe = pipe
        asked = dict(os.environ), serve, pipe, realtime, behind
        self._process = CONTEXT.Process(
            target=_main, args=asked, daemon=True
        )  # daemonic: a window that ends without `close` still sends it SIGTERM
        self._starting = threading.Thread(target=self._start, name="start", daemon=True)
        self._starting.start()

    @property
    def pid(self) -> int | None:
        """Its process id; None before it has one."""
        return self._process.pid

    def is_alive(self) -> bool:
        """Whether it works, or is about to."""
        return self._starting.is_alive() or self._process.is_alive()

    def join(self, timeout: float | None = None) -> None:
        """Wait for its end, at most `timeout` s."""
        self._starting.join(timeout)
        if self._process.pid is not None:
            self._process.join(timeout)

    def _start(self) -> None:
        load_ahead()
        try:
            self._process.start()
        except (OSError, EOFError):
            pass  # whoever reads the other end sees that it is closed
        finally:
            self._pipe.close()


def take_place(niceness: int) -> None:
    """Ask for this thread's place among what a busy computer runs.

    What it starts from then on has it, too. To come before others has to be allowed,
    which it mostly is not. Nothing where it would be the whole process's.
    """
    if sys.platform == "linux":
        with suppress(OSError):
            os.setpriority(os.PRIO_PROCESS, 0, niceness)


def _main(
    environment: Mapping[str, str],
    serve: Serve,
    pipe: Connection,
    realtime: bool,
    behind: bool,
) -> None:
    """Serve in the environment of who asked, which the one forked from may not have."""
    take_place(BEHIND if behind else FIRST)
    os.environ.clear()
    os.environ.update(environment)
    serve(pipe, realtime)
