"""The bench by hand, between runs: hold a current, read the field.

The coil has the same thread, limits and safe ending as in a run::

    scene = load("demo", bench="my bench.toml")
    bench = open_bench(scene, needs(scene), realtime=True)
    coil = ManualCoil(bench)
    coil.start()
    coil.hold(0.1)
    print(read_field(bench))
    coil.stop("done")
"""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tactile_lab.acquisition.coil_thread import CoilThread
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.bench import Bench, Coil, OffReport
from tactile_lab.errors import SceneError
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import CoilState

FOR_EVER = 1e9


class ManualCoil:
    """Holds the coil at a current until told otherwise.

    Whoever holds it calls `alive` at least every 2 s; else the coil's thread switches
    off.

    Args:
        bench: with a coil; nothing of it is open yet.

    Raises:
        SceneError: the bench has no coil.
    """

    def __init__(self, bench: Bench) -> None:
        if bench.coil is None:
            raise SceneError("This bench has no coil source to drive by hand.")
        self.bench = bench
        self.coil: Coil = bench.coil
        self._clock = bench.clock
        self._stop = StopRequest(bench.clock)
        self._lease = Lease(
            bench.clock,
            holder=("Whoever drives the coil by hand", "a window or script that hangs"),
        )
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
        from tactile_lab.acquisition.ending import CoilState

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


READINGS = 5


@dataclass(frozen=True)
class FieldReading:
    """The field as read a few times in a row.

    Attributes:
        mean: T.
        spread: standard deviation of the readings, T.
    """

    mean: float
    spread: float


def read_field(bench: Bench) -> FieldReading:
    """Open the teslameter, read the field a few times, close it; takes about 1 s.

    Raises:
        SceneError: the bench has no teslameter.
        InstrumentError: it does not answer.
    """
    meter = bench.field_meter
    if meter is None:
        raise SceneError("This bench has no teslameter to read.")
    with bench.clock.taking_part("field by hand"):
        meter.open()
        try:
            values = [meter.read().value for _ in range(READINGS)]
        finally:
            meter.close()
    return FieldReading(statistics.fmean(values), statistics.stdev(values))
