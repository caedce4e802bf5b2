"""Wiring of a scope, checked before it reaches the instrument."""

from __future__ import annotations

import math
from collections.abc import Sequence

from tactile_lab.errors import LimitError
from tactile_lab.quantity import show
from tactile_lab.scope import Channel, ScopeCapability

COUPLINGS = ("AC", "DC")


def check_channels(channels: Sequence[Channel], capability: ScopeCapability) -> None:
    """Refuse inputs, ranges, offsets and couplings that the scope does not have.

    Raises:
        LimitError: with what is wrong and what there is.
    """
    if not channels:
        raise LimitError("No scope input is enabled; enable at least one.")
    used: dict[str, str] = {}
    for channel in channels:
        if channel.input not in capability.inputs:
            raise LimitError(
                f"{channel.signal} is wired to scope input {channel.input}, but the "
                f"scope has {', '.join(capability.inputs)}."
            )
        if channel.input in used:
            raise LimitError(
                f"{used[channel.input]} and {channel.signal} are both wired to scope "
                f"input {channel.input}; give each its own."
            )
        used[channel.input] = channel.signal
        if channel.range not in capability.ranges:
            ladder = ", ".join(f"{r:g}" for r in capability.ranges)
            raise LimitError(
                f"{channel.signal} has range {channel.range:g} V, none of the scope's: "
                f"{ladder} V."
            )
        _check_offset(channel, capability)
        if channel.coupling not in COUPLINGS:
            raise LimitError(
                f"Coupling {channel.coupling!r} of {channel.signal} is none of "
                f"{', '.join(COUPLINGS)}."
            )


def _check_offset(channel: Channel, capability: ScopeCapability) -> None:
    most = dict(zip(capability.ranges, capability.offsets, strict=False))
    limit = most.get(channel.range, math.inf)
    if abs(channel.offset) <= limit:
        return
    enough = [
        r for r, v in most.items() if r > channel.range and v >= abs(channel.offset)
    ]
    wider = f", or take a range of {show(min(enough), 'V')} or more" if enough else ""
    raise LimitError(
        f"Offset {show(channel.offset, 'V')} of {channel.signal} is beyond "
        f"±{show(limit, 'V')}, the most that the scope adds at range "
        f"{show(channel.range, 'V')}. Lower the offset{wider}."
    )


def described(channels: Sequence[Channel]) -> dict[str, str]:
    """Settings of the inputs in words, for a run's record."""
    return {
        f"input_{channel.input}": (
            f"{channel.signal}: ±{channel.range:g} V, offset {channel.offset:g} V, "
            f"{channel.coupling}"
        )
        for channel in channels
    }
