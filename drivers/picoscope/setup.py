"""Input settings and memory for a PicoScope, checked before they reach it."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence

from drivers.picoscope import status
from drivers.picoscope.sdk import COUPLINGS, INPUTS, RANGES, TIME_UNITS
from drivers.picoscope.unit import ScopeUnit
from tactile_lab.errors import LimitError
from tactile_lab.quantity import show
from tactile_lab.scope import Channel

_LEAST_RING, _MOST_RING = 1 << 16, 1 << 23
_SHORTEST = 8e-9


def streaming_interval(interval: float) -> tuple[int, float]:
    """A sample interval as (number, per second) for the library: whole ns, us or ms.

    Raises:
        LimitError: not finite, shorter than 8 ns, or too long for the library.
    """
    if math.isfinite(interval) and interval >= _SHORTEST * (1 - 1e-9):
        for per_second in sorted(TIME_UNITS, reverse=True):
            if interval * per_second < (1 << 32) - 0.5:
                return round(interval * per_second), per_second
    raise LimitError(
        f"A sample interval of {show(interval, 's')} is impossible; this scope takes "
        "8 ns to 4.2 Ms. Change record.sample_rate."
    )


def ring_samples(interval: float) -> int:
    """Ring length for 2 s, a power of two from 64 Ki to 8 Mi samples."""
    wanted = 1 << math.ceil(math.log2(max(1.0, 2 / interval)))
    return min(max(wanted, _LEAST_RING), _MOST_RING)


def configure(
    unit: ScopeUnit, channels: Sequence[Channel], inputs: Sequence[str]
) -> None:
    """Set the used inputs, switch the others off, and the trigger too.

    Raises:
        LimitError: an analogue offset or input this scope does not offer now.
    """
    by_input = {channel.input: channel for channel in channels}
    for name in inputs:
        channel = by_input.get(name)
        if channel is None:
            _switch_off(unit, name)
            continue
        _check_offset(unit, channel)
        unit.do(
            f"Setting input {name} ({channel.signal})", "ps3000aSetChannel",
            INPUTS.index(name), 1, COUPLINGS[channel.coupling], RANGES[channel.range],
            channel.offset,
        )  # fmt: skip
    unit.do("Switching the trigger off", "ps3000aSetSimpleTrigger", 0, 0, 0, 2, 0, 0)


def _switch_off(unit: ScopeUnit, name: str) -> None:
    code = unit.call(
        "ps3000aSetChannel", INPUTS.index(name), 0, COUPLINGS["DC"], RANGES[5.0], 0.0
    )
    # an input that the power supply does not reach is off already
    if code not in (status.OK, status.CHANNEL_NEEDS_SUPPLY):
        raise status.failure(code, f"Switching input {name} off")


def _check_offset(unit: ScopeUnit, channel: Channel) -> None:
    if channel.offset == 0:
        return
    most, least = ctypes.c_float(), ctypes.c_float()
    unit.do(
        f"Reading offset limits of input {channel.input}", "ps3000aGetAnalogueOffset",
        RANGES[channel.range], COUPLINGS[channel.coupling],
        ctypes.byref(most), ctypes.byref(least),
    )  # fmt: skip
    if not least.value <= channel.offset <= most.value:
        raise LimitError(
            f"Offset {channel.offset:g} V of {channel.signal} is beyond what range "
            f"{channel.range:g} V allows: {least.value:g} to {most.value:g} V."
        )
