"""What is asked for, and what that needs: stages nothing depends on are left out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

from tactile_lab.errors import ParameterError

DEPENDS = {
    "force": (),
    "V_P": (),
    "V_C1": ("V_P",),
    "I_DS": ("V_P", "V_C1"),
    "I_C": ("V_C1",),
    "V_C2": ("I_C", "spikes"),
    "spikes": ("I_C",),
    "V_K": ("spikes",),
    "rate": ("spikes",),
    "statistics": ("I_C",),
}
"""What each signal is computed from; "statistics" is spikes counted, not kept."""

EVENTS = frozenset({"spikes", "V_K", "rate", "statistics"})
"""Signals that are known from the spikes alone, in as much memory as those take."""

NODE_A, INTEGRATOR, SPIKES, DENSE, DENSE_V_C2 = 1, 2, 4, 8, 16
"""What compiled code is asked for, one bit each: V_C1 and V_C2 to be solved, spikes to
be kept, steps of V_P and V_C1 to be stored, and of V_C2."""

STAGES = ("V_P", "V_C1", "I_C", "V_C2", "spikes", "V_K")
"""Stages of the cascade with a counter each."""


def _closure(names: Sequence[str]) -> frozenset[str]:
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(DEPENDS[name])
    return frozenset(found)


@dataclass(frozen=True)
class Need:
    """The closure of what is kept.

    Attributes:
        signals: kept signals and all they depend on.
        sampled: those that can be sampled; spikes alone store no waveform.
        left_out: signals that nothing kept depends on.
        coupled: whether V_C2 acts back on V_C1.
    """

    signals: frozenset[str]
    sampled: frozenset[str]
    left_out: tuple[str, ...]
    coupled: bool = False

    @classmethod
    def of(cls, keep: Sequence[str], coupled: bool = False) -> Need:
        """What `keep` needs.

        Where T1 saturates V_C2 acts back on V_C1 (`coupled`): neither goes without the
        other.

        Raises:
            ParameterError: a name that is no signal of the model.
        """
        return _need((keep,) if isinstance(keep, str) else tuple(keep), coupled)

    @cached_property
    def dense(self) -> bool:
        """Whether steps of V_P or V_C1 are stored to be sampled."""
        return bool(self.sampled & {"V_P", "V_C1", "V_C2"})

    @cached_property
    def dense_V_C2(self) -> bool:
        """Whether V_C2 is stored too."""
        from_both = self.coupled and "I_C" in self.sampled
        return self.dense and ("V_C2" in self.sampled or from_both)

    @cached_property
    def integrator(self) -> bool:
        """Whether V_C2 and its spikes must be solved."""
        asked = bool(self.signals & {"V_C2", "spikes", "statistics"})
        return asked or (self.coupled and self.node_a)

    @cached_property
    def asked(self) -> int:
        """All this for compiled code: a sum of the bits above."""
        return (
            (NODE_A if self.node_a else 0)
            + (INTEGRATOR if self.integrator else 0)
            + (SPIKES if "spikes" in self.signals else 0)
            + (DENSE if self.dense else 0)
            + (DENSE_V_C2 if self.dense_V_C2 else 0)
        )

    @cached_property
    def stale(self) -> tuple[str, ...]:
        """Voltages that are not solved, and so not known at the end."""
        solved = (("V_C1", self.node_a), ("V_C2", self.integrator))
        return tuple(name for name, known in solved if not known)

    @cached_property
    def node_a(self) -> bool:
        """Whether V_C1 must be solved."""
        return "V_C1" in self.signals


@lru_cache(maxsize=256)
def _need(keep: tuple[str, ...], coupled: bool) -> Need:
    unknown = [name for name in keep if name not in DEPENDS]
    if unknown:
        raise ParameterError(
            f"{unknown[0]!r} is no signal of the model; "
            f"choose from {', '.join(DEPENDS)}."
        )
    signals = _closure(keep)
    waveforms = [name for name in keep if name not in EVENTS]
    sampled = _closure(waveforms) | frozenset(keep)
    # spikes are found in V_C2, whether its waveform is kept or not
    counted = signals & {"spikes", "statistics"}
    solved = signals | {"V_C2"} if counted else signals
    if coupled and "V_C1" in signals:
        solved = solved | {"I_C", "V_C2", "spikes"}
    left_out = tuple(
        name for name in DEPENDS if name not in solved and name != "statistics"
    )
    return Need(signals, sampled, left_out, coupled)


SMALLEST_TOLERANCE = 1e-14
LARGEST_TOLERANCE = 1e-2


def checked_tolerance(tolerance: float) -> float:
    """The tolerance (s of spike time, V of V_C1) if it can be asked for.

    Raises:
        ParameterError: below machine precision, too coarse, or not a number.
    """
    if not (
        math.isfinite(tolerance)
        and SMALLEST_TOLERANCE <= tolerance <= LARGEST_TOLERANCE
    ):
        raise ParameterError(
            f"tolerance = {tolerance} s must lie between {SMALLEST_TOLERANCE:g} s "
            f"(machine precision) and {LARGEST_TOLERANCE:g} s."
        )
    return float(tolerance)
