"""Wiring of a scope, checked before it reaches the instrument."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_lab.errors import LimitError
from tactile_lab.scope import Channel, ScopeCapability

COUPLINGS = ("AC", "DC")


def check_channels(channels: Sequence[Channel], capability: ScopeCapability) -> None:
    """Refuse inputs, ranges and couplings that the scope does not have.

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
        if channel.coupling not in COUPLINGS:
            raise LimitError(
                f"Coupling {channel.coupling!r} of {channel.signal} is none of "
                f"{', '.join(COUPLINGS)}."
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
