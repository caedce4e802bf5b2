"""The bench as the rest of the program sees it: coil, meters, and all of a run's.

Drivers implement these interfaces and that of `tactile_lab.scope`; nothing here knows a
wire. Each instrument is used by one thread only, the one that opened it. All values are
SI.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Protocol

from tactile_lab.clock import Clock
from tactile_lab.current_list import CurrentList, ListCapability
from tactile_lab.follower import Follower
from tactile_lab.generator import AnalogueInput, Generator
from tactile_lab.quantity import Unit, show
from tactile_lab.scope import Scope
from tactile_lab.table import SceneTable
from tactile_lab.voltage_source import VoltageSource

COPPER = 0.00393
"""Temperature coefficient of copper's resistance at 20 C, 1/K."""

FOUND = "found_A"
"""What a source's settings call the current that flowed when it was opened, A; they
lack it where its output was off."""


@dataclass(frozen=True, kw_only=True)
class CoilLimits(SceneTable):
    """What the coil and its source may be asked to do: ``[coil.limits]``.

    Attributes:
        current: largest magnitude, A.
        slew: largest rate of change from one set-point to the next, A/s.
        list_slew: the same in a list or of a generator, which keep time by themselves,
            A/s; `slew` where it is not given.
        compliance: voltage limit of the source, V.
        continuous: current that may flow for ever, A.
        heat: budget of the leaky integral of I^2 above `continuous`^2, A^2 s.
        recovery: time constant with which the heat integral falls, s.
        resistance: coil resistance at 20 C, Ohm; None until measured.
    """

    current: Annotated[float, Unit("A", above=0.0)] = 2.0
    slew: Annotated[float, Unit("A/s", above=0.0)] = 5.0
    list_slew: Annotated[float, Unit("A/s", above=0.0)] | None = None
    compliance: Annotated[float, Unit("V", above=0.0)] = 14.0
    continuous: Annotated[float, Unit("A", above=0.0)] = 0.6
    heat: Annotated[float, Unit("A^2 s", above=0.0)] = 30.0
    recovery: Annotated[float, Unit("s", above=0.0)] = 60.0
    resistance: Annotated[float, Unit("Ohm", above=0.0)] | None = None

    @property
    def fastest(self) -> float:
        """Largest rate of change where the instruments keep time themselves, A/s."""
        return self.slew if self.list_slew is None else self.list_slew


@dataclass(frozen=True, kw_only=True)
class Followers(SceneTable):
    """The voltage followers between the circuit's nodes and the scope: ``[followers]``.

    A TL074: 65 pA typical and 200 pA at most, 3 mV and 10 mV, 3 MHz, 13 V/us.

    Attributes:
        input_bias: current of the follower at V_C2 into that node, A; 65 pA through
            R_L is 32 mV.
        input_bias_uncertainty: half of its 95 % band, A.
        offset_uncertainty: half of the 95 % band of an output's offset, V.
        bandwidth: Hz; 0 for infinitely fast ones.
        slew: largest rate of the output, V/s.
    """

    input_bias: Annotated[float, Unit("A")] = 65e-12
    input_bias_uncertainty: Annotated[float, Unit("A", least=0.0)] = 0.0
    offset_uncertainty: Annotated[float, Unit("V", least=0.0)] = 0.0
    bandwidth: Annotated[float, Unit("Hz", least=0.0)] = 3e6
    slew: Annotated[float, Unit("V/s", above=0.0)] = 13e6

    @property
    def speed(self) -> Follower:
        """Pole and slew; ideal where they are infinitely fast."""
        return Follower.of(self.bandwidth, self.slew)


@dataclass(frozen=True)
class Reading:
    """One value an instrument reported, with the clock's time of its arrival, s."""

    time: float
    value: float


@dataclass(frozen=True)
class Lowered:
    """One set-point that a source took on its way to 0 A.

    Attributes:
        asked: clock time at which the source was addressed, s.
        heard: clock time at which it had answered, s.
        acted: clock time at which its answer set out, s.
        setpoint: A.
    """

    asked: float
    heard: float
    acted: float
    setpoint: float


@dataclass(frozen=True)
class OffReport:
    """How a `safe_off` ended.

    Attributes:
        verified: the read-back showed 0 A and the output off.
        current: current read back, A; None if it could not be read.
        text: what happened, for a person.
        fall: set-points on the way, the last of them 0 A where that was taken.
    """

    verified: bool
    current: float | None
    text: str
    fall: tuple[Lowered, ...] = ()


@dataclass(frozen=True)
class SeenOutput:
    """A current source's output as a look found it.

    Attributes:
        identity: of the source.
        on: whether the output is on.
        current: that flows, A.
    """

    identity: str
    on: bool
    current: float

    @property
    def report(self) -> OffReport:
        """The same as of a coil that should be off."""
        flows = show(self.current, "A")
        if not self.on:
            return OffReport(True, self.current, f"Output off, {flows} read back.")
        return OffReport(
            False,
            self.current,
            f"The output is on at {flows}, and this program has not switched it on. "
            "Nothing was touched. Whoever drives it by hand may go on; connecting "
            "again ramps it down and switches it off.",
        )


class Coil(Protocol):
    """A current source that drives the electromagnet."""

    @property
    def identity(self) -> str:
        """What the source answered when asked who it is."""
        ...

    @property
    def limits(self) -> CoilLimits:
        """Limits in force: the narrowest of model, coil and user."""
        ...

    @property
    def update_interval(self) -> float:
        """Time one verified set-point takes, s; measured when opened."""
        ...

    @property
    def grain(self) -> float:
        """Smallest step of the set-point, A."""
        ...

    @property
    def acted(self) -> float:
        """When the source is taken to have acted on the last command, clock time, s."""
        ...

    def open(self) -> None:
        """Connect, identify, make safe, measure the update interval."""
        ...

    def heed(self, halted: Callable[[], bool]) -> None:
        """From `energise` on look at `halted` last thing before whatever is sent.

        Once it is true only `safe_off` and `close` still send; all else, a list half
        loaded too, ends with a `HaltedError`.
        """
        ...

    def energise(self) -> None:
        """Set compliance and 0 A, verify both, then switch the output on."""
        ...

    def set_current(self, current: float) -> float:
        """Step towards `current`, A, as far as slew allows; what was commanded, A."""
        ...

    def read_current(self) -> Reading:
        """Measured output current, A."""
        ...

    @property
    def resistance_ratio(self) -> float | None:
        """Resistance over that of the cold coil, a thermometer; None if not known."""
        ...

    def beat(self) -> None:
        """Tell a guard, if there is one, that the owning thread is alive."""
        ...

    @property
    def warnings(self) -> Sequence[str]:
        """What a person should know, in the order it was noticed; only grows."""
        ...

    def settings(self) -> dict[str, str]:
        """Settings read back, for the run's record."""
        ...

    def safe_off(self) -> OffReport:
        """Ramp to 0 A, output off, read back; idempotent, never raises."""
        ...

    def close(self) -> None:
        """Make safe and let go of the port; idempotent."""
        ...


class ListCoil(Coil, Protocol):
    """A current source that also plays lists of currents by its own clock."""

    def load_list(self, points: CurrentList) -> None:
        """Send a list to the source, which stands at 0 A; checked and verified.

        Raises:
            LimitError: a list that source, coil or heat budget do not allow.
            RefusedError: the source does not hold all of it.
        """
        ...

    def start_list(self) -> None:
        """Have the list that was loaded last played once, from now on."""
        ...

    def end_list(self) -> None:
        """Go back to a set-point of 0 A once the list has ended."""
        ...


class AnalogueCoil(Coil, Protocol):
    """A current source that also follows a generator at its analogue input."""

    def follow(self, points: CurrentList, grain: float) -> None:
        """Follow the analogue input, on which `points` come soon; at 0 A until then.

        Args:
            points: as the generator plays them, A.
            grain: step of the generator's converter, A.

        Raises:
            LimitError: what source, coil or heat budget do not allow.
        """
        ...

    def followed_from(self, earliest: float, latest: float) -> None:
        """The generator began between two clock times, s; what flows is watched."""
        ...

    def end_follow(self) -> None:
        """Follow the set-point alone again, 0 A, once the generator has ended."""
        ...


@dataclass(frozen=True, kw_only=True)
class CoilCapability:
    """What a source can do, as far as is known before it is opened.

    Attributes:
        title: of the model, for people.
        bipolar: gives current of both signs.
        update_interval: time between two set-points to plan with, s.
        lists: what lists it plays by its own clock (a `ListCoil`), or None.
        analogue: its analogue input, where the scope's generator is wired to it (an
            `AnalogueCoil`), or None.
    """

    title: str
    bipolar: bool
    update_interval: float
    lists: ListCapability | None = None
    analogue: AnalogueInput | None = None


class Meter(Protocol):
    """What reads one quantity: a teslameter, a thermometer."""

    @property
    def identity(self) -> str:
        """What the meter answered when asked who it is."""
        ...

    def open(self) -> None:
        """Connect, identify, set the unit."""
        ...

    def read(self) -> Reading:
        """Magnetic flux density, T; temperature, K."""
        ...

    def settings(self) -> dict[str, str]:
        """Settings read back, for the run's record."""
        ...

    def close(self) -> None:
        """Let go of the port; idempotent."""
        ...


@dataclass(frozen=True, kw_only=True)
class Bench:
    """The instruments one run opened nothing of yet; None where the run needs none.

    Attributes:
        name: for people.
        simulated: whether physics is computed.
        clock: the time all of it lives in.
        generator: the scope's, where it is wired to the source's analogue input.
        voltage_sources: by the circuit's voltage that each holds.
        place_probes: puts the probes of the circuit's voltages on "ground", "supply"
            or back on the "circuit"; None where a person must.
        accuracy: says, after a run, how accurate the computed physics was.
    """

    name: str
    simulated: bool
    clock: Clock
    coil: Coil | None = None
    scope: Scope | None = None
    field_meter: Meter | None = None
    thermometer: Meter | None = None
    generator: Generator | None = None
    voltage_sources: Mapping[str, VoltageSource] = field(default_factory=dict)
    place_probes: Callable[[str], None] | None = None
    accuracy: Callable[[], str] | None = None
