"""The bench by hand in the engine: the coil held at a current, the field read."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from gui.session.commands import TakeCoil
from gui.session.messages import CoilByHand, FieldByHand, HandOff, Told
from gui.session.request import Request
from gui.session.task import Task
from tactile_lab.engine.bench import open_bench
from tactile_lab.errors import TactileLabError
from tactile_lab.planning.needs import needs
from tactile_lab.quantity import show

if TYPE_CHECKING:
    from tactile_lab.bench import Bench
    from tactile_lab.engine.manual import ManualControl

EVERY = 0.02
"""Seconds between two looks at the coil."""

AT_LEAST = 0.2
"""Seconds after which its state is told although nothing changed: each word asks the
window for a renewal of the lease."""


class Hand(Task):
    """Drives the coil of one bench as the window says, until stopped.

    What it is asked goes straight to the coil's thread. The lease is the window's: if
    it is not renewed for 2 s, that thread switches off.

    Args:
        asked: whose coil.
        tell: tells the window, from any thread.
    """

    def __init__(self, asked: TakeCoil, tell: Callable[[Told], None]) -> None:
        super().__init__("coil by hand", tell)
        self._asked = asked
        self._coil: ManualControl | None = None
        self._current: float | None = None

    def hold(self, current: float) -> None:
        """Go to `current`, A, as soon as the source is open, and stay."""
        with self._lock:
            self._current = current
            coil = self._coil
        if coil is not None:
            coil.hold(current)

    def renew(self) -> None:
        """The window lives."""
        if self._coil is not None:
            self._coil.renew()

    @property
    def bench(self) -> Bench | None:
        """What the coil belongs to; None before it is made."""
        return None if self._coil is None else self._coil.bench

    def _work(self) -> None:
        self._tell(self._drive())

    def _drive(self) -> HandOff:
        from tactile_lab.engine.manual import ManualControl

        try:
            coil = ManualControl(self._asked.request.load(), realtime=True)
        except (TactileLabError, OSError) as error:
            return HandOff(None, str(error), opened=False)
        coil.renew()
        coil.thread.start()
        with self._lock:
            self._coil = coil
            current = self._current
        if not self._stopped_by(coil) and current is not None:
            coil.hold(current)
        self._watch(coil)
        return HandOff(coil.thread.off, str(coil.thread.failure or ""))

    def _watch(self, coil: ManualControl) -> None:
        """Tell the coil's state as it changes, to the very last."""
        last, said = None, 0.0
        while not coil.thread.ended:
            applied = coil.thread.take_applied()
            known = coil.coil_state, coil.thread.opened
            if applied or known != last or time.monotonic() - said > AT_LEAST:
                read = any(one.measured is not None for one in applied)
                self._tell(CoilByHand(*known, acted=bool(applied), read_back=read))
                last, said = known, time.monotonic()
            coil.thread.join(EVERY)


def read_field(request: Request, hand: Hand | None) -> FieldByHand:
    """Read the field a few times; of the bench in `hand`, if there is one."""
    from tactile_lab.engine import manual

    try:
        bench = hand.bench if hand is not None else None
        if bench is None:
            scene = request.load()
            bench = open_bench(scene, needs(scene), realtime=True)
        found = manual.read_field(bench)
    except (TactileLabError, OSError) as error:
        return FieldByHand(None, f"The field was not read: {error}")
    text = f"{show(found.mean, 'T', 4)} ± {show(found.spread, 'T', 2)}"
    return FieldByHand(found.mean, f"Field {text}")
