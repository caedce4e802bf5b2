"""Ctrl-C that comes when all of a run is stored, so that it cannot end the run."""

import os
import signal
from collections.abc import Callable
from threading import Event
from typing import Any

from tactile_lab.acquisition.ending import Executed

Run = Callable[[Any], Executed]


def late(run: Run) -> Run:
    """`Execution.run`, which returns once a Ctrl-C that came after it was heeded."""
    heard = Event()

    def run_until_late(execution: Any) -> Executed:
        done, stop = run(execution), execution.stop

        def heeded(*reason: Any, **more: Any) -> None:
            stop(*reason, **more)
            heard.set()

        execution.stop = heeded
        os.kill(os.getpid(), signal.SIGINT)
        assert heard.wait(600)
        return done

    return run_until_late
