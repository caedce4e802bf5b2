"""What is done by hand between runs: benches are opened and read in threads.

Opening one loads drivers and, for the simulated bench, compiles its model.
"""

from __future__ import annotations

from collections.abc import Callable
from queue import SimpleQueue

from gui.session.messages import CoilByHand, FieldByHand, Told
from gui.session.request import Request
from gui.session.threads import start
from tactile_lab.bench import Bench
from tactile_lab.errors import TactileLabError
from tactile_lab.plugins import open_bench
from tactile_lab.quantity import show


def take_coil(request: Request, inbox: SimpleQueue[Told]) -> None:
    """Make the coil of a request's bench ready to be driven by hand; it stays off."""

    def work() -> None:
        from tactile_lab.acquisition.by_hand import ManualCoil

        try:
            coil = ManualCoil(open_bench(request.load(), realtime=True))
        except (TactileLabError, OSError) as error:
            inbox.put(CoilByHand(request, None, str(error)))
        else:
            inbox.put(CoilByHand(request, coil, ""))

    start(work, "take coil")


def read_field(opened: Callable[[], Bench], inbox: SimpleQueue[Told]) -> None:
    """Read the field a few times."""

    def work() -> None:
        from tactile_lab.acquisition import by_hand

        try:
            found = by_hand.read_field(opened())
        except (TactileLabError, OSError) as error:
            inbox.put(FieldByHand(None, f"The field was not read: {error}"))
        else:
            text = f"{show(found.mean, 'T', 4)} ± {show(found.spread, 'T', 2)}"
            inbox.put(FieldByHand(found.mean, f"Field {text}"))

    start(work, "read field")
