"""A source meter that holds one voltage of the circuit: V_GS, V_S or V_th."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Protocol

from tactile_lab.quantity import Unit, show
from tactile_lab.table import SceneTable

SOURCED = ("V_GS", "V_S", "V_th")
"""Voltages of the circuit that a source meter may hold."""

SETTLED = 10.0
"""Time constants of the integrator after which a changed voltage has settled."""

Volts = Annotated[float, Unit("V")]


@dataclass(frozen=True, kw_only=True)
class VoltageLimits(SceneTable):
    """What a voltage source may be asked for: ``[voltage_source.V_GS.limits]``.

    Attributes:
        lowest, highest: what may be set, V.
        slew: largest rate of change from one set-point to the next, V/s.
        compliance: largest current it may give, A.
        tolerance: by how much the voltage read back may differ from the set-point, V.
        rest: where it is left when a run has ended, V; at 0 V the output is off.

    Raises:
        ValueError: `lowest` is not below `highest`, or `rest` is neither between them
            nor 0 V.
    """

    lowest: Volts = 0.0
    highest: Volts
    slew: Annotated[float, Unit("V/s", above=0.0)] = 1.0
    compliance: Annotated[float, Unit("A", above=0.0)] = 100e-6
    tolerance: Annotated[float, Unit("V", above=0.0)] = 2e-3
    rest: Volts = 0.0

    def __post_init__(self) -> None:
        if self.lowest >= self.highest:
            raise ValueError(f"lowest must be below highest, {show(self.highest, 'V')}")
        if self.rest and not self.allow(self.rest):
            raise ValueError(f"rest must be 0 V or lie within {self.span}")

    def allow(self, volts: float) -> bool:
        """Whether `volts`, V, may be set."""
        return self.lowest <= volts <= self.highest

    def nearest(self, volts: float) -> float:
        """What may be set and lies nearest to `volts`, V."""
        return min(max(volts, self.lowest), self.highest)

    @property
    def span(self) -> str:
        """The allowed range for a person."""
        return f"{show(self.lowest, 'V')} to {show(self.highest, 'V')}"

    @property
    def largest(self) -> float:
        """Largest magnitude that may be set, V."""
        return max(abs(self.lowest), abs(self.highest))


@dataclass(frozen=True, kw_only=True)
class VoltageSourceCapability:
    """What a voltage source can do in the range that its limits choose.

    Attributes:
        title: for people.
        resolution: smallest step of the set-point, V.
        error, error_part: bound on the error of a voltage read back: a constant part,
            V, and a part of the voltage.
    """

    title: str
    resolution: float
    error: float
    error_part: float

    def uncertainty(self, volts: float) -> float:
        """Bound on the error of `volts`, V, as read back, V."""
        return self.error + self.error_part * abs(volts)


@dataclass(frozen=True, kw_only=True)
class HeldVoltage:
    """One look at what a source holds.

    Attributes:
        time: the clock's, of its arrival, s.
        setpoint: last commanded, V.
        voltage: as measured, V.
        current: that it gives, A.
    """

    time: float
    setpoint: float
    voltage: float
    current: float


@dataclass(frozen=True)
class RestReport:
    """How a voltage source was left.

    Attributes:
        verified: it was read back at rest.
        text: what happened, for a person.
    """

    verified: bool
    text: str


class VoltageSource(Protocol):
    """A source meter on one voltage of the circuit; used by one thread only."""

    @property
    def identity(self) -> str:
        """What the source answered when asked who it is."""
        ...

    def open(self) -> None:
        """Connect, identify, set up; what it held before it goes on holding."""
        ...

    def step_to(self, volts: float) -> bool:
        """Step towards `volts`, V, as far as slew allows; whether it is there.

        The first step switches the output on.

        Raises:
            LimitError: outside the limits.
        """
        ...

    def read(self) -> HeldVoltage:
        """What it holds now, compared with the set-point.

        Raises:
            InterlockError: they keep differing.
        """
        ...

    def settings(self) -> dict[str, str]:
        """Settings read back, for the run's record."""
        ...

    def go_to_rest(self) -> RestReport:
        """Ramp to the rest voltage and read it back; idempotent, never raises."""
        ...

    def close(self) -> None:
        """Let go of the port, leaving the output as it is; idempotent."""
        ...


def why_not(limits: VoltageLimits, volts: float, name: str) -> str | None:
    """Why `volts`, V, of the voltage called `name` may not be set, or None."""
    if limits.allow(volts):
        return None
    return (
        f"{name} = {show(volts, 'V', 6)} lies beyond the {limits.span} that "
        f"[voltage_source.{name}.limits] allows. Ask for less, or change lowest and "
        "highest there."
    )
