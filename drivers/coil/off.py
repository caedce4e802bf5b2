"""The way out: ramp to 0 A, output off, read back; every step tried, nothing raised."""

from __future__ import annotations

import math

from drivers.coil.wire import CoilWire
from tactile_lab.bench import OffReport
from tactile_lab.clock import Clock
from tactile_lab.errors import TactileLabError
from tactile_lab.quantity import show

OFF_CURRENT = 0.005
"""Largest current that counts as none, A."""

LONGEST_RAMP = 0.5
"""Longest time the steps of a ramp may add up to, s; a larger current ramps faster."""

SHORTEST_REST, LONGEST_REST = 0.005, 0.2
"""Time from an answer to the next step of a ramp, s; the guard wants a heartbeat."""

VERIFICATIONS = 3
"""Times the safe state is commanded and read back before giving up."""

SETTLE = 0.02
"""Time the current has to die away before it is read back, s."""

RECONNECT = 1.0
"""How long to try to open a lost port again before each attempt, s."""

UNKNOWN = "OUTPUT STATE UNKNOWN: switch the coil source off at the instrument. "

DOUBT = (
    " It did not confirm every line, so its set-point may not be 0 A: look before you "
    "switch it on by hand."
)


def switch_off(
    wire: CoilWire,
    clock: Clock,
    *,
    setpoint: float | None,
    slew: float,
    exchange: float,
    ramp: bool,
) -> OffReport:
    """Bring the source to 0 A and output off, and say whether that was verified.

    Args:
        wire: the source, connected or not.
        clock: time the ramp is played in.
        setpoint: last known, A; None when unknown.
        slew: of the ramp, A/s.
        exchange: typical time of a verified set-point, s.
        ramp: False goes to 0 A at once.
    """
    trouble: list[str] = []
    if not wire.talk.reconnected(trouble, RECONNECT):
        return OffReport(False, None, UNKNOWN + " | ".join(trouble))
    if ramp and setpoint != 0.0:
        _ramp_down(wire, clock, setpoint, slew, exchange, trouble)
    steps = (*wire.row.stop_lines, wire.row.set_line(0.0), *wire.row.off)
    current: float | None = None
    for left in reversed(range(VERIFICATIONS)):
        if not wire.talk.reconnected(trouble, RECONNECT):
            break
        taken = wire.talk.insist(steps, trouble)
        wire.talk.link.pause(SETTLE)
        try:
            on = wire.output_is_on()
            current = wire.current_when_off()
            # a line may be refused for another reason than its set-point
            taken = taken or abs(wire.known_setpoint(current)) <= OFF_CURRENT
        except TactileLabError as reason:
            trouble.append(f"read-back: {reason}")
            continue
        if not on and abs(current) <= OFF_CURRENT:
            if left and not taken:
                continue  # off, but the set-point may be another than 0 A
            text = f"Output off, {show(current, 'A')} read back."
            return OffReport(True, current, text + ("" if taken else DOUBT))
        state = "on" if on else "off"
        trouble.append(f"read-back: output {state}, {show(current, 'A')}")
    return OffReport(False, current, UNKNOWN + " | ".join(dict.fromkeys(trouble)))


def _taken_over(wire: CoilWire) -> float:
    """Set-point to ramp down from, A, after a list that may be playing was ended."""
    if wire.row.list is None:
        return wire.setpoint()
    flowing = wire.current()
    wire.set_current(flowing)
    for line in wire.row.stop_lines:
        wire.talk.command(line)
    return flowing


def _ramp_down(
    wire: CoilWire,
    clock: Clock,
    setpoint: float | None,
    slew: float,
    exchange: float,
    trouble: list[str],
) -> None:
    """Steps until 0 A is one step away, at the slew limit; ended by a failure.

    A step is as large as the time since the last one was answered allows. The source
    took that one before it answered, so no delay on the way can bring two steps closer
    together at the source than the limit allows. Resting for two exchanges makes the
    whole ramp take one and a half times its nominal time.
    """
    try:
        current = _taken_over(wire) if setpoint is None else setpoint
        slew = max(slew, abs(current) / LONGEST_RAMP)
        answered = clock.now()
        while True:
            rest = min(max(2 * exchange, SHORTEST_REST), LONGEST_REST)
            clock.sleep_until(answered + min(rest, abs(current) / slew))
            sent = clock.now()
            left = abs(current) - slew * (sent - answered)
            if left < 10.0**-wire.row.digits:
                return  # 0 A is what comes next anyway
            current = math.copysign(left, current)
            wire.set_current(current)
            answered = clock.now()
            exchange = answered - sent
    except TactileLabError as reason:
        trouble.append(f"ramp: {reason}")
