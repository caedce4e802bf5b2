"""A serial wire inside this process: pyserial on one side, an instrument on the other.

Bytes take the time the baud rate gives them and the instrument its time to act, all
on the bench's clock; the real driver opens the wire as `sim://NAME` and cannot tell.
"""

from __future__ import annotations

import errno
import itertools
import math
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol
from weakref import WeakValueDictionary

import serial

from sim_backend.serial_line.faults import (
    ANSWER_KINDS,
    REFUSAL,
    Call,
    FaultSchedule,
    SerialFault,
    Unplugged,
    spoilt,
)
from tactile_lab.clock import Clock
from tactile_lab.instruments.serial_dialect import SerialSettings

if TYPE_CHECKING:
    from _typeshed import ReadableBuffer as Buffer


HELD = 1 << 16
"""Bytes of a line that an instrument holds; what comes beyond is lost, as in one."""


class LineInstrument(Protocol):
    """A far end without transport."""

    @property
    def reply_end(self) -> bytes:
        """Terminator of its answers."""
        ...

    @property
    def clearing(self) -> bytes:
        """Characters that clear what it has received of a line."""
        ...

    @property
    def gap(self) -> float:
        """Rest it wants before a line, s; what begins sooner is not heard."""
        ...

    def line(self, line: bytes) -> bytes | None:
        """Act on one line; the answer without terminator, or None."""
        ...


@dataclass(frozen=True)
class DelayedBytes:
    """Bytes that start to come back `delay` s from now."""

    delay: float
    data: bytes


class Address(str):
    """A `sim://` address with what answers there, which lives as long as it."""

    far_end: FarEnd


class FarEnd:
    """An instrument that takes bytes, at any split, and gives bytes.

    Args:
        instrument: acts on whole lines.
        wire: its serial settings and the time it takes to act.
        clock: the bench's time.
        name: unique part of the address.
    """

    def __init__(
        self, instrument: LineInstrument, wire: SerialSettings, clock: Clock, name: str
    ) -> None:
        self.instrument = instrument
        self.wire = wire
        self.clock = clock
        self.name = name
        self.held = False
        self.faults = FaultSchedule()
        self.unplugged: Unplugged | None = None
        self.gap = instrument.gap
        self._partial = bytearray()
        self._hears_from = -math.inf

    @property
    def url(self) -> Address:
        """Address for pyserial; whoever holds it keeps the far end alive."""
        address = Address(f"sim://{self.name}")
        address.far_end = self
        return address

    def take(self, data: bytes, began: float | None = None) -> list[DelayedBytes]:
        """Any bytes; the answers of the lines they complete.

        Args:
            data: what came.
            began: clock time at which it began to come, s; now unless given.
        """
        answers = []
        began = self.clock.now() if began is None else began
        for byte in data:
            if not self._partial and began < self._hears_from:
                continue
            if byte in self.instrument.clearing:
                self._partial.clear()
            elif byte not in b"\r\n":
                if len(self._partial) < HELD:
                    self._partial.append(byte)
            elif self._partial:
                line = bytes(self._partial)
                self._partial.clear()
                answer = self._answer(line)
                if self.gap:
                    said = answer.delay + len(answer.data) * self.wire.character_time
                    self._hears_from = self.clock.now() + said + self.gap
                if answer.data:
                    answers.append(answer)
        return answers

    def _answer(self, line: bytes) -> DelayedBytes:
        clock = self.clock
        if self.faults.strike(line, clock.now(), ("deaf",)):
            return DelayedBytes(0.0, b"")
        clock.sleep_until(clock.now() + self.wire.latency)
        if self.faults.strike(line, clock.now(), ("refused",)):
            answer = REFUSAL if b"?" in line else None
        else:
            answer = self.instrument.line(line)
        faults = self.faults.strike(line, clock.now(), ANSWER_KINDS)
        end = self.instrument.reply_end
        said = DelayedBytes(*spoilt(answer, line, end, faults))
        if not self.wire.echo:
            return said
        return DelayedBytes(said.delay, line + end + said.data)


_far_ends: WeakValueDictionary[str, FarEnd] = WeakValueDictionary()
_numbers = itertools.count(1)


def plug_in(
    instrument: LineInstrument,
    wire: SerialSettings,
    clock: Clock,
    name: str = "instrument",
    faults: Iterable[SerialFault] = (),
) -> FarEnd:
    """Make `instrument` answer at a new `sim://` address, the result's `url`."""
    if "sim_backend" not in serial.protocol_handler_packages:
        serial.protocol_handler_packages.append("sim_backend")
    far_end = FarEnd(instrument, wire, clock, f"{name}-{next(_numbers)}")
    far_end.faults = FaultSchedule(faults)
    _far_ends[far_end.name] = far_end
    return far_end


def unplug(far_end: FarEnd) -> None:
    """Take the address away; idempotent."""
    _far_ends.pop(far_end.name, None)


class SimPort(serial.SerialBase):
    """What pyserial's `serial_for_url` gives for a `sim://` address.

    `write` returns when the far end has acted on the bytes, as if flushed, so that
    what they do happens at its own time on the bench's clock.
    """

    def __init__(self, *args: object, **kwargs: object) -> None:
        self._far_end: FarEnd | None = None
        self._arriving: list[tuple[float, int]] = []
        self._line_free = 0.0
        self._last = b""
        self._sends = True
        super().__init__(*args, **kwargs)  # type: ignore[arg-type]

    def open(self) -> None:
        """Connect to the far end named by the address."""
        name = str(self.port).partition("://")[2]
        far_end = _far_ends.get(name)
        if far_end is None:
            raise serial.SerialException(errno.ENOENT, f"no simulated port {name}")
        if far_end.held:
            raise serial.SerialException(errno.EAGAIN, "the port is locked")
        gone = far_end.unplugged
        if gone is not None:
            if far_end.clock.now() < gone.returns:
                raise serial.SerialException(errno.ENOENT, f"no such port {name}")
            far_end.unplugged = None
        far_end.held = True
        self._far_end = far_end
        self._arriving.clear()
        self.is_open = True

    def close(self) -> None:
        """Let go of the far end; idempotent."""
        if self._far_end is not None:
            self._far_end.held = False
            self._far_end = None
        self.is_open = False

    def write(self, b: Buffer, /) -> int:
        """Send bytes; returns once the far end has acted on them."""
        far_end, data = self._connected(), bytes(b)
        clock, each = far_end.clock, far_end.wire.character_time
        heard = self._same_settings(far_end.wire)
        for group in re.findall(rb"[^\r\n]*[\r\n]|[^\r\n]+", data):
            self._last = group
            self._strike(far_end, group)
            if far_end.unplugged is not None:
                far_end.unplugged.write()
                continue
            began = clock.now()
            clock.sleep_until(began + len(group) * each)
            for answer in far_end.take(group, began) if heard else ():
                start = max(clock.now() + answer.delay, self._line_free)
                for i, sent in enumerate(answer.data):
                    self._arriving.append((start + (i + 1) * each, sent))
                self._line_free = self._arriving[-1][0]
        return len(data)

    def read(self, size: int = 1, /) -> bytes:
        """Up to `size` bytes, waiting at most the timeout on the bench's clock."""
        return self._read(size, None)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Bytes up to and including `expected`, or what came within the timeout."""
        return self._read(size, expected)

    @property
    def in_waiting(self) -> int:
        """Bytes that have arrived."""
        far_end = self._connected()
        if (gone := self._gone("waiting")) is not None:
            return gone.in_waiting()
        now = far_end.clock.now()
        return sum(time <= now for time, _ in self._arriving)

    def reset_input_buffer(self) -> None:
        """Drop the bytes that have arrived."""
        self.flush()
        del self._arriving[: self.in_waiting]

    def reset_output_buffer(self) -> None:
        """Nothing waits to be sent: `write` returns when all is done."""
        self.flush()

    def flush(self) -> None:
        """Nothing waits to be sent: `write` returns when all is done."""
        if (gone := self._gone("reset")) is not None:
            gone.reset()

    def _gone(self, call: Call) -> Unplugged | None:
        """The far end's absence, if it is gone, from this call on if need be."""
        far_end = self._connected()
        now = far_end.clock.now()
        for fault in far_end.faults.strike(self._last, now, ("unplug",), call):
            self._unplug(far_end, fault)
        return far_end.unplugged

    def _unplug(self, far_end: FarEnd, fault: SerialFault) -> None:
        now = far_end.clock.now()
        back = now + fault.amount if fault.amount else float("inf")
        far_end.unplugged = Unplugged(fault.form, back)
        self._arriving.clear()

    def set_output_flow_control(self, enable: bool = True) -> None:
        """Send, or not, whatever the far end said."""
        self._sends = enable

    def _strike(self, far_end: FarEnd, group: bytes) -> None:
        """Let the wire's own faults happen before these bytes go out."""
        clock, kinds = far_end.clock, ("unplug", "stuck", "xoff")
        stuck = False
        for fault in far_end.faults.strike(group, clock.now(), kinds):
            if fault.kind == "unplug":
                self._unplug(far_end, fault)
            elif fault.kind == "stuck":
                stuck = True
            elif self.xonxoff:
                self._sends = False
        if stuck or not self._sends:
            clock.sleep_until(clock.now() + (self.write_timeout or 0.0))
            raise serial.SerialTimeoutException("Write timeout")

    def _read(self, size: int | None, end: bytes | None) -> bytes:
        far_end = self._connected()
        if (gone := self._gone("read")) is not None:
            gone.read()
        clock = far_end.clock
        values = bytes(value for _, value in self._arriving)
        count = len(values) + 1 if size is None else size
        if end is not None and end in values:
            count = min(count, values.index(end) + len(end))
        deadline = None if self.timeout is None else clock.now() + self.timeout
        complete = count <= len(values)
        until = self._arriving[count - 1][0] if complete and count else deadline
        if until is None:
            raise serial.SerialException("a simulated port needs a read timeout")
        clock.sleep_until(until if deadline is None else min(until, deadline))
        count = min(count, self.in_waiting)
        taken = bytes(value for _, value in self._arriving[:count])
        del self._arriving[:count]
        return taken

    def _connected(self) -> FarEnd:
        if self._far_end is None:
            raise serial.PortNotOpenError
        return self._far_end

    def _same_settings(self, wire: SerialSettings) -> bool:
        """With other settings the far end hears only noise."""
        return (self.baudrate, self.bytesize, self.parity) == (
            wire.baud,
            wire.bytesize,
            wire.parity,
        )

    def _reconfigure_port(self, force_update: bool = False) -> None:
        """Settings are looked at when bytes are sent."""

    def _update_dtr_state(self) -> None:
        """No modem lines."""

    def _update_rts_state(self) -> None:
        """No modem lines."""
