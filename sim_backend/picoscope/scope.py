"""A simulated PicoScope 3404D: one state machine behind every skin of the library.

It knows states, power, settings and time; C types and pointers belong to the skin.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from sim_backend.picoscope import codes as pico
from sim_backend.picoscope.faults import Schedule, ScopeFault
from sim_backend.plant.scope_source import Acquisition, Codes, Input, SampleSource
from tactile_lab.clock import Clock

SIMULATED = "SIM04/0001"
"""Serial number of a simulated unit."""


@dataclass(frozen=True, kw_only=True)
class UnitModel:
    """What a simulated unit is, and how it is connected.

    Attributes:
        serial: batch and serial number.
        variant: model.
        usb: "3.0" or "2.0".
        others: serial numbers of other units that are attached.
        powers: power states reported when it is opened, one after the other.
        taken: another program has it open.
        usb_powered_inputs: inputs that work without the mains adapter.
        fifo: samples a channel kept for a late poll; None for the size of the ring.
        parts: callbacks a poll may make; the real library makes one.
        longest_part: most samples of one callback; None for no limit.
        empty_callbacks: make a callback with no samples when there are none.
        clock_error: relative error of its sample clock; 50e-6 is 50 ppm.
        beyond: times the model's own streaming rate, to find a computer's limit.
    """

    serial: str = SIMULATED
    variant: str = "3404D"
    usb: str = "3.0"
    others: tuple[str, ...] = ()
    powers: tuple[int, ...] = ()
    taken: bool = False
    usb_powered_inputs: str = pico.INPUT_NAMES
    fifo: int | None = None
    parts: int = 1
    longest_part: int | None = None
    empty_callbacks: bool = False
    clock_error: float = 0.0
    beyond: int = 1

    @property
    def inputs(self) -> int:
        """Number of inputs, the second digit of the model."""
        return int(self.variant[1])


@dataclass
class _Streaming:
    acquisition: Acquisition
    rows: tuple[int, ...]
    ring: int
    begun: float
    next: int = 0
    place: int = 0


@dataclass
class RingPart:
    """One contiguous part of the ring: what one callback announces."""

    start: int
    rows: tuple[int, ...]
    codes: Codes
    overflow: int


@dataclass
class SimulatedPicoScope:
    """The unit's state."""

    source: SampleSource
    clock: Clock
    make: UnitModel = field(default_factory=UnitModel)
    faults: Sequence[ScopeFault] = ()
    dropped: int = 0
    """Samples a channel that a starved stream has lost so far."""

    def __post_init__(self) -> None:
        self.schedule = Schedule(list(self.faults))
        self.is_open = False
        self.dead = False
        self.present = True
        self.silent = False
        self.settings: dict[int, Input] = {}
        self._powers: list[int] = []
        self._supply = True
        self._streaming: _Streaming | None = None
        self._stream_status = pico.OK
        self._answers: list[tuple[str | None, int]] = []
        self._saturated: dict[str, float] = {}
        self._held_back, self._held_until = 0, -math.inf

    @property
    def streaming(self) -> bool:
        """Whether a stream runs."""
        return self._streaming is not None

    def enter(self, call: str) -> int:
        """Begin a call: faults strike; the status it must answer, or OK to go on."""
        now = self.clock.now()
        for fault in self.schedule.strike(call, now, self.produced()):
            self._strike(fault, now)
        for answer in self._answers:
            if answer[0] in (None, call):
                self._answers.remove(answer)
                return answer[1]
        if call in ("OpenUnit", "EnumerateUnits"):
            return pico.OK
        if not self.is_open:
            return pico.INVALID_HANDLE
        if self.dead:
            polls = call == "GetStreamingLatestValues"
            return pico.OK if self.silent and polls else pico.NOT_RESPONDING
        exempt = ("CloseUnit", "Stop", "ChangePowerSource", "CurrentPowerSource",
                  "PingUnit", "GetUnitInfo")  # fmt: skip
        if self._powers and call not in exempt:
            return self._powers[0]
        return pico.OK

    def _strike(self, fault: ScopeFault, now: float) -> None:
        if fault.kind == "status":
            wanted = None if fault.call is None else fault.call.removeprefix("ps3000a")
            self._answers += [(wanted, fault.code)] * fault.times
        elif fault.kind == "gap":
            self.drop(fault.samples)
        elif fault.kind == "late":
            self._held_back, self._held_until = fault.samples, now + fault.duration
        elif fault.kind == "overrange":
            self._saturated.update(dict.fromkeys(fault.inputs, now + fault.duration))
        elif fault.kind == "stream_fails":
            self._stream_status = pico.STREAMING_FAILED
        elif fault.kind == "stall":
            self._stream_status = pico.BUFFER_STALL
        elif fault.kind == "undervoltage":
            self._abort(pico.UNDERVOLTAGE)
        elif fault.kind == "supply_lost":
            self._supply = False
            self._abort(pico.SUPPLY_NOT_CONNECTED)
        elif fault.kind == "supply_connected":
            self._supply = True
            self._abort(pico.SUPPLY_CONNECTED)
        else:
            if fault.kind == "hang":
                self.clock.sleep_until(now + fault.duration)
            self.dead, self.silent = True, fault.kind == "silent"
            self.present = fault.kind == "reset"

    def _abort(self, power: int) -> None:
        self._streaming = None
        self._powers = [power]

    def open(self, serial: str | None) -> int:
        """Open the unit: OK or a power state; the handle is valid in both cases."""
        wrong = serial is not None and serial != self.make.serial
        if not self.present or self.is_open or self.make.taken or wrong:
            return pico.NOT_FOUND
        self.is_open, self.dead, self.silent = True, False, False
        self._streaming, self._stream_status = None, pico.OK
        self._powers = list(self.make.powers)
        self._supply = pico.SUPPLY_NOT_CONNECTED not in self._powers
        both = Input("", 5.0)
        self.settings = {i: both for i in range(self.make.inputs) if self._powered(i)}
        return self._powers[0] if self._powers else pico.OK

    def close(self) -> int:
        """Close the unit."""
        self.is_open, self._streaming = False, None
        return pico.OK

    def power(self) -> int:
        """What the unit is powered from."""
        return pico.SUPPLY_CONNECTED if self._supply else pico.SUPPLY_NOT_CONNECTED

    def acknowledge(self, power: int) -> int:
        """Acknowledge a power state; the answer may be another one."""
        if not self._powers:
            return pico.OK if power == self.power() else pico.REQUEST_INVALID
        if self._powers[0] == pico.UNDERVOLTAGE:
            return pico.UNDERVOLTAGE
        if power != self._powers[0]:
            return pico.REQUEST_INVALID
        self._powers.pop(0)
        return self._powers[0] if self._powers else pico.OK

    def _powered(self, number: int) -> bool:
        return self._supply or pico.INPUT_NAMES[number] in self.make.usb_powered_inputs

    def set_input(
        self, number: int, enabled: bool, coupling: int, scale: int, offset: float
    ) -> int:
        """Set one input."""
        if not 0 <= number < self.make.inputs:
            return pico.INVALID_CHANNEL
        if coupling not in pico.COUPLING_NAMES:
            return pico.INVALID_COUPLING
        if scale not in pico.RANGE_VOLTS:
            return pico.INVALID_VOLTAGE_RANGE
        if abs(offset) > pico.offset_limit(scale) * (1 + 1e-6):
            return pico.INVALID_PARAMETER
        name = pico.INPUT_NAMES[number]
        if not self._powered(number):
            return pico.CHANNEL_DISABLED
        self.settings.pop(number, None)
        if enabled:
            setting = Input(
                name, pico.RANGE_VOLTS[scale], offset, pico.COUPLING_NAMES[coupling]
            )
            self.settings[number] = setting
        return pico.OK

    def run(self, interval: float, ring: int) -> tuple[int, float]:
        """Start streaming; the status and the actual interval, s, on an 8 ns grid."""
        rows = tuple(sorted(self.settings))
        if not rows:
            return pico.INVALID_CHANNEL, interval
        ticks = max(1, round(interval / pico.GRID))
        if ticks < self._least_ticks(len(rows)):
            return pico.INVALID_SAMPLE_INTERVAL, interval
        now = self.clock.now()
        inputs = tuple(self.settings[row] for row in rows)
        actual = ticks * 8 / 1e9
        acquisition = Acquisition(inputs, actual, now, pico.FULL_SCALE, pico.SHIFT)
        self._streaming = _Streaming(acquisition, rows, ring, now)
        self._stream_status = pico.OK
        return pico.OK, actual

    def _least_ticks(self, inputs: int) -> int:
        power_of_two = 1 << (inputs - 1).bit_length()
        ticks = power_of_two * (1 if self.make.usb == "3.0" else 4)
        return max(1, ticks // self.make.beyond)

    def produced(self) -> int:
        """Samples a channel taken since the stream began."""
        if self._streaming is None:
            return 0
        elapsed = self.clock.now() - self._streaming.begun
        # a sample that is due at this very instant counts despite rounding
        interval = self._streaming.acquisition.interval * (1 + self.make.clock_error)
        return math.floor(elapsed / interval + 1e-6)

    def drop(self, samples: int) -> None:
        """Lose the oldest samples that were not read yet, as a full buffer does."""
        if self._streaming is not None:
            self._streaming.next += samples
            self.dropped += samples

    def read(self) -> tuple[int, RingPart | None]:
        """The next contiguous part, if there is one."""
        if self._stream_status != pico.OK:
            self._streaming = None
            return self._stream_status, None
        state = self._streaming
        if self.silent:
            return pico.OK, None
        if state is None:
            return pico.STREAMING_FAILED, None
        waiting = self.produced() - state.next
        if self.clock.now() < self._held_until:
            waiting -= self._held_back
        room = self.make.fifo or state.ring
        if waiting > room:
            self.drop(waiting - room)
            waiting = room
        samples = min(waiting, state.ring - state.place)
        if self.make.longest_part is not None:
            samples = min(samples, self.make.longest_part)
        if samples <= 0:
            return pico.OK, None
        codes, over = self.source.render(state.acquisition, state.next, samples)
        overflow = sum(1 << row for row, o in zip(state.rows, over, strict=True) if o)
        if self._saturated:
            codes, overflow = self._saturate(state, codes, overflow)
        part = RingPart(state.place, state.rows, codes, overflow)
        state.next += samples
        state.place = (state.place + samples) % state.ring
        return pico.OK, part

    def _saturate(
        self, state: _Streaming, codes: Codes, overflow: int
    ) -> tuple[Codes, int]:
        now = self.clock.now()
        codes = codes.copy()
        for row, number in enumerate(state.rows):
            if self._saturated.get(pico.INPUT_NAMES[number], -math.inf) >= now:
                codes[row] = np.int16(pico.FULL_SCALE)
                overflow |= 1 << number
        return codes, overflow

    def stop(self) -> int:
        """Stop streaming."""
        self._streaming = None
        return pico.OK
