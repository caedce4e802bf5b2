"""The coil by hand: the same thread, limits and safe ending as in a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tactile_lab.acquisition.coil_thread import CoilThread
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.bench import Bench, Coil, OffReport
from tactile_lab.errors import SceneError
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.acquisition.execution import CoilState

FOR_EVER = 1e9


class ManualCoil:
    """Holds the coil at a current until told otherwise.

    The window renews the lease; if the window hangs, the coil's thread switches off.

    Args:
        bench: with a coil; nothing of it is open yet.

    Raises:
        SceneError: the bench has no coil.
    """

    def __init__(self, bench: Bench) -> None:
        if bench.coil is None:
            raise SceneError("This bench has no coil source to drive by hand.")
        self.coil: Coil = bench.coil
        self._clock = bench.clock
        self._stop = StopRequest(bench.clock)
        self._lease = Lease(bench.clock)
        self.thread = CoilThread(bench.coil, bench.clock, self._stop, self._lease)
        self._energised = False

    def start(self) -> None:
        """Open the source in its own thread; the output stays off."""
        self._lease.renew()
        self.thread.start()

    def alive(self) -> None:
        """Renew the lease."""
        self._lease.renew()

    def hold(self, current: float) -> None:
        """Go to `current`, A, as fast as the slew limit lets it, and stay."""
        if not self._energised:
            self.thread.energise()
            self._energised = True
        self.thread.play(Waveform.constant(current), FOR_EVER)

    def stop(self, reason: str) -> None:
        """Switch off; returns at once, `off` tells when it is verified."""
        self._stop(reason)

    @property
    def state(self) -> CoilState:
        """What is known of the coil now."""
        from tactile_lab.acquisition.execution import CoilState

        thread, last = self.thread, self.thread.last
        sent = None if last is None else last.setpoint
        return CoilState(thread.live, sent, thread.measured, thread.off)

    @property
    def ended(self) -> bool:
        """Whether the thread has ended."""
        return self.thread.ended

    @property
    def off(self) -> OffReport | None:
        """How the coil was left; None while it may be live."""
        return self.thread.off

    @property
    def failure(self) -> str:
        """What went wrong, "" if nothing did."""
        return "" if self.thread.failure is None else str(self.thread.failure)
