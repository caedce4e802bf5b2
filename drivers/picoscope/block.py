"""Block mode of a PicoScope: one record at up to the full rate, from its own memory."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.picoscope import status
from drivers.picoscope.sdk import BLOCK_READY, INPUTS
from drivers.picoscope.setup import configure
from drivers.picoscope.unit import Unit
from tactile_lab.bench import Block, Channel, ScopeCapability, Stream
from tactile_lab.clock import Clock
from tactile_lab.errors import LimitError, NoReplyError, ParameterError
from tactile_lab.instruments.channels import check_channels

_PAUSE = 0.002
_RISING, _FALLING = 2, 3


@dataclass(frozen=True, kw_only=True)
class Trigger:
    """An edge to wait for.

    Attributes:
        input: the scope's name for the input.
        level: V at the input.
        rising: direction of the edge.
        patience: longest wait, s; then the record is taken without an edge.
    """

    input: str
    level: float
    rising: bool = True
    patience: float = 1.0


def timebase(interval: float) -> int:
    """The timebase number nearest to a sample interval, s.

    0 to 2 are 1, 2 and 4 ns; from 3 on it is (n - 2) / 125 MHz (ps3000a Programmer's
    Guide, "Timebases").
    """
    if interval < 6e-9:
        return 0 if interval < 1.5e-9 else 1 if interval < 3e-9 else 2
    return min(max(3, round(interval * 125e6) + 2), (1 << 32) - 1)


def capture(
    unit: Unit,
    clock: Clock,
    capability: ScopeCapability,
    channels: Sequence[Channel],
    interval: float,
    samples: int,
    *,
    before: int = 0,
    trigger: Trigger | None = None,
) -> tuple[Stream, Block]:
    """Capture one record.

    Args:
        unit: the open scope.
        clock: host time.
        capability: the scope's.
        channels: enabled inputs, the rows of the record.
        interval: wanted time between samples, s.
        samples: per input.
        before: how many of them lie before the trigger.
        trigger: what to wait for; None captures at once.

    Returns:
        How it is scaled, with the actual interval, and the record. `Stream.started` is
        known to the wait for the trigger only, which `uncertainty` says.

    Raises:
        LimitError: input, range, rate or length the scope does not have.
        LinkLostError: unplugged.
        NoReplyError: the scope never became ready.
    """
    if samples < 1 or not 0 <= before <= samples:
        raise ParameterError(
            f"A record of {samples} samples with {before} before the trigger is "
            "impossible; ask for at least 1, and at most all of them before it."
        )
    check_channels(channels, capability)
    configure(unit, channels, capability.inputs)
    if trigger is not None:
        _set_trigger(unit, channels, trigger)
    number, actual = _timebase(unit, len(channels), interval, samples)
    codes = np.zeros((len(channels), samples), dtype=np.int16)
    for row, channel in enumerate(channels):
        unit.register(channel, codes[row])
    began = clock.now()
    busy_ms = ctypes.c_int32()
    unit.do(
        "Starting a block", "ps3000aRunBlock", before, samples - before, number, 0,
        ctypes.byref(busy_ms), 0, BLOCK_READY(), None,
    )  # fmt: skip
    patience = 0.0 if trigger is None else trigger.patience
    _wait(unit, clock, began + patience + 2 * samples * actual + 1.0)
    ended = clock.now()
    count, overflow = ctypes.c_uint32(samples), ctypes.c_int16()
    unit.do(
        "Reading a block", "ps3000aGetValues", 0, ctypes.byref(count), 1, 0, 0,
        ctypes.byref(overflow),
    )  # fmt: skip
    unit.do("Stopping the scope", "ps3000aStop")
    over = tuple(bool(overflow.value >> INPUTS.index(c.input) & 1) for c in channels)
    spare = max(0.0, ended - began - samples * actual)
    stream = Stream(
        channels=tuple(channels),
        interval=actual,
        full_scale=unit.full_scale,
        shift=unit.shift,
        started=began + spare / 2,
        uncertainty=spare / 2,
    )
    kept = codes if count.value == samples else codes[:, : count.value].copy()
    return stream, Block(0, kept, over, ended)


def _set_trigger(unit: Unit, channels: Sequence[Channel], trigger: Trigger) -> None:
    wired = {channel.input: channel for channel in channels}
    channel = wired.get(trigger.input)
    if channel is None:
        raise LimitError(
            f"The trigger is on input {trigger.input}, which is not enabled; enable it."
        )
    if abs(trigger.level + channel.offset) > channel.range:
        raise LimitError(
            f"Trigger level {trigger.level:g} V is outside the range of input "
            f"{trigger.input}: ±{channel.range:g} V around {-channel.offset:g} V."
        )
    source = INPUTS.index(trigger.input)
    code = round((trigger.level + channel.offset) / channel.range * unit.full_scale)
    # 0 would wait for ever
    patience_ms = min(max(1, round(trigger.patience * 1e3)), (1 << 15) - 1)
    unit.do(
        "Setting the trigger", "ps3000aSetSimpleTrigger", 1, source, code,
        _RISING if trigger.rising else _FALLING, 0, patience_ms,
    )  # fmt: skip


def _timebase(
    unit: Unit, inputs: int, interval: float, samples: int
) -> tuple[int, float]:
    most = ctypes.c_int32()
    unit.do("Arranging memory", "ps3000aMemorySegments", 1, ctypes.byref(most))
    number, actual_ns = timebase(interval), ctypes.c_float()
    code = unit.call(
        "ps3000aGetTimebase2", number, samples, ctypes.byref(actual_ns), 0,
        ctypes.byref(most), 0,
    )  # fmt: skip
    if code != status.OK:
        what = f"A block of {samples} samples every {interval:g} s, {inputs} inputs"
        raise status.failure(code, what)
    if samples > most.value:
        raise LimitError(
            f"A block of {samples} samples of {inputs} inputs does not fit the scope's "
            f"memory; it takes {most.value}."
        )
    return number, actual_ns.value * 1e-9


def _wait(unit: Unit, clock: Clock, until: float) -> None:
    ready = ctypes.c_int16()
    while True:
        unit.do("Waiting for a block", "ps3000aIsReady", ctypes.byref(ready))
        if ready.value:
            return
        now = clock.now()
        if now >= until:
            unit.call("ps3000aStop")
            raise NoReplyError(
                "The scope did not finish a block in time; it was stopped. Plug it in "
                "anew if this comes back."
            )
        clock.sleep_until(now + _PAUSE)
