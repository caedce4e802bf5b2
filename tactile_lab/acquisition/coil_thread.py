"""The coil's thread: plays a current waveform by host time, and always ends at 0 A."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from tactile_lab.acquisition.ending import CoilState
from tactile_lab.acquisition.instrument_thread import InstrumentThread, drained
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.bench import Coil, OffReport
from tactile_lab.clock import Clock
from tactile_lab.errors import InstrumentError
from tactile_lab.waveform import Waveform

READ_BACK_EVERY = 0.25
"""Seconds between read-backs while the set-point rests."""

READ_BACK_AT_LEAST = 1.0
"""Seconds between read-backs while it moves: each costs a part of an update."""


RESOLUTION = 2e-5
"""Set-points closer than this are the same to any source here, A."""


@dataclass(frozen=True)
class Applied:
    """One set-point as it was applied.

    Attributes:
        asked: clock time at which the source was addressed, s.
        time: clock time at which it had acted, s.
        setpoint: A.
        measured: current read back, A; None where only the set-point was sent.
        ratio: resistance over that of the cold coil, as last looked at, or None.
    """

    asked: float
    time: float
    setpoint: float
    measured: float | None
    ratio: float | None = None


class CoilThread(InstrumentThread):
    """Owns the current source.

    Each set-point is the waveform's value at the time it is sent, so a late one is
    never queued: the latest value wins and slots that passed unused are counted.
    """

    def __init__(
        self,
        coil: Coil,
        clock: Clock,
        stop: StopRequest,
        lease: Lease,
    ) -> None:
        super().__init__("coil", clock)
        self.coil = coil
        self.off: OffReport | None = None
        self.live = False
        self.skipped = 0
        self.last: Applied | None = None
        self.measured: float | None = None
        self._stop = stop
        self._lease = lease
        self._applied: deque[Applied] = deque()
        self._warned = 0
        self._read = float("-inf")
        self._energise = False
        self._waveform: Waveform | None = None
        self._until = 0.0
        self._next = 0.0

    @property
    def state(self) -> CoilState:
        """What is known of the coil now."""
        sent = None if self.last is None else self.last.setpoint
        return CoilState(self.live, sent, self.measured, self.off)

    def energise(self) -> None:
        """Ask for the output to be switched on at 0 A; `live` tells when it is."""
        self._energise = True
        self.clock.notify()

    def play(self, current: Waveform, until: float) -> None:
        """Play `current` (A against clock time, s) from now until `until` s."""
        self._waveform, self._until = current, until
        self._next = self.clock.now()
        self.clock.notify()

    def take_warnings(self) -> list[str]:
        """Warnings of the source since this was last asked."""
        new = list(self.coil.warnings[self._warned :])
        self._warned += len(new)
        return new

    def take_applied(self) -> list[Applied]:
        """Set-points applied since this was last asked."""
        return drained(self._applied)

    def open(self) -> None:
        """Open the source; it makes itself safe on the way."""
        self.coil.open()
        self.settings = {"identity": self.coil.identity, **self.coil.settings()}

    def work(self) -> None:
        """Play what is asked for until told to leave, to stop, or left alone."""
        while not self._leaving:
            self.coil.beat()
            if self._stop.requested:
                return
            self._lease.check()
            if self._energise:
                self.coil.energise()
                self.settings.update(self.coil.settings())
                # before the first trial: its ramp would lose set-points to this
                self._note(self._read_back(self.clock.now(), 0.0))
                self._energise, self.live = False, True
                self.clock.notify()
            now = self.clock.now()
            if self._waveform is not None and now >= self._next:
                self._update(self._waveform, now)
            self.clock.wait_for(self._called, self._wake())

    def make_safe_and_close(self) -> None:
        """Switch off, verify by read-back, close."""
        self.off = self.coil.safe_off()
        self.live = False
        try:
            if self.off.verified and self.opened:
                self.settings_after = self.coil.settings()
            self.coil.close()
        except InstrumentError as failure:
            self.failure = self.failure or failure

    def _called(self) -> bool:
        due = self._waveform is not None and self.clock.now() >= self._next
        return due or self._leaving or self._stop.requested or self._energise

    def _wake(self) -> float:
        pulse = self.clock.now() + 0.1
        return min(self._next, pulse) if self._waveform is not None else pulse

    def _update(self, waveform: Waveform, now: float) -> None:
        """Send the value of now if it changed, else read back now and then."""
        setpoint = float(waveform.at(min(now, self._until)))
        last = self.last
        if last is None or abs(setpoint - last.setpoint) > RESOLUTION:
            commanded = self.coil.set_current(setpoint)
            acted = self.clock.now()
            measured = None
            if now - self._read >= READ_BACK_AT_LEAST:
                measured = self.coil.read_current().value
            self._note(
                Applied(now, acted, commanded, measured, self.coil.resistance_ratio)
            )
        elif now - last.time >= READ_BACK_EVERY and self._rests(waveform, now):
            self._note(self._read_back(now, last.setpoint))
        interval = self.coil.update_interval
        late = int((self.clock.now() - self._next) / interval)
        self.skipped += max(0, late - 1)
        self._next += interval * max(1, late)
        arrived = self.last and abs(self.last.setpoint - setpoint) <= RESOLUTION
        if now >= self._until and arrived:
            self._waveform = None

    def _rests(self, waveform: Waveform, now: float) -> bool:
        """Whether a read-back delays no set-point: it takes about an update."""
        soon = min(now + 2 * self.coil.update_interval, self._until)
        ahead = waveform.at(soon) - waveform.at(min(now, self._until))
        return abs(float(ahead)) <= RESOLUTION

    def _read_back(self, now: float, setpoint: float) -> Applied:
        """The current under a set-point that stands."""
        reading = self.coil.read_current()
        ratio = self.coil.resistance_ratio
        return Applied(now, reading.time, setpoint, reading.value, ratio)

    def _note(self, applied: Applied) -> None:
        self.last = applied
        if applied.measured is not None:
            self.measured, self._read = applied.measured, applied.time
        self._applied.append(applied)
