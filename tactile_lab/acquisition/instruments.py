"""The threads of the instruments one run uses, opened together and closed together."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from tactile_lab.acquisition.coil_thread import CoilThread, Warmth
from tactile_lab.acquisition.generator_player import GeneratorPlayer
from tactile_lab.acquisition.instrument_thread import InstrumentThread
from tactile_lab.acquisition.meter_thread import (
    READ_FIELD,
    READ_TEMPERATURE,
    MeterThread,
)
from tactile_lab.acquisition.scope_thread import ScopeThread
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.acquisition.voltage_thread import VoltageThread
from tactile_lab.bench import Bench, Meter, OffReport
from tactile_lab.voltage_source import RestReport

CLOSING = 10.0
"""Seconds an instrument thread gets to close before it is given up."""

MOVED = frozenset({"output", "setpoint_A", "setpoint_V", "range", "temperature"})
"""What is read back and moves by itself in a run: the recorded current tells of the
coil's, and a teslameter picks its range as the field needs it."""

NO_COIL = OffReport(True, None, "This scene uses no coil.")
"""How a run that uses none leaves it: nobody looked."""

Wait = Callable[[Callable[[], bool]], None]


@dataclass
class Instruments:
    """Instrument threads of one run; None where the scene needs no such instrument."""

    coil: CoilThread | None
    scope: ScopeThread | None
    meter: MeterThread | None
    thermometer: MeterThread | None = None
    voltages: tuple[VoltageThread, ...] = ()

    @classmethod
    def of(
        cls,
        bench: Bench,
        stop: StopRequest,
        lease: Lease,
        heat: Warmth | None,
    ) -> Instruments:
        """Threads for what the bench has; none started, nothing opened."""
        clock, coil = bench.clock, None
        if bench.coil is not None:
            coil = CoilThread(bench.coil, clock, stop, lease, heat)
        scope = ScopeThread(bench.scope, clock) if bench.scope else None
        if coil is not None and scope is not None and bench.generator is not None:
            slew = coil.coil.limits.slew
            coil.generator = GeneratorPlayer(bench.generator, scope, slew)

        def read(name: str, meter: Meter | None, every: float) -> MeterThread | None:
            return MeterThread(name, meter, clock, every) if meter else None

        return cls(
            coil=coil,
            scope=scope,
            meter=read("field meter", bench.field_meter, READ_FIELD),
            thermometer=read("thermometer", bench.thermometer, READ_TEMPERATURE),
            voltages=tuple(
                VoltageThread(name, source, clock, stop)
                for name, source in bench.voltage_sources.items()
            ),
        )

    @property
    def threads(self) -> list[InstrumentThread]:
        """Those that exist, the coil first: it is the one that must be made safe."""
        meters = self.thermometer, self.meter
        every = (self.coil, self.scope, *meters, *self.voltages)
        return [thread for thread in every if thread is not None]

    def hold(self, voltages: Mapping[str, float]) -> list[VoltageThread]:
        """Have sources go to voltages, by name, V; those that must move, started."""
        moved = []
        for thread in self.voltages:
            wanted = voltages.get(thread.voltage)
            if wanted is not None and wanted != thread.wanted:
                thread.hold(wanted)
                moved.append(thread)
        return moved

    def open(self, until: Wait) -> None:
        """Open all side by side; `until(done)` waits and raises what goes wrong."""
        for thread in self.threads:
            thread.start()
        until(lambda: all(thread.settled for thread in self.threads))
        self.raise_failure()

    def raise_failure(self) -> None:
        """Raise the first failure any thread has met."""
        for thread in self.threads:
            thread.raise_failure()

    @property
    def settings(self) -> dict[str, dict[str, str]]:
        """Identity and settings read back as the run began, by instrument."""
        return {thread.name: thread.settings for thread in self.threads}

    @property
    def settings_after(self) -> dict[str, dict[str, str]]:
        """Settings read back as the run ended, by instrument."""
        return {thread.name: thread.settings_after for thread in self.threads}

    @property
    def changes(self) -> list[str]:
        """Settings that are at the end not as they were at the beginning, one a line.

        What was not read at both times is passed over, and so is what the run moves.
        """
        return [
            f"{thread.name}: {name} was {was} at the start, {value} at the end"
            for thread in self.threads
            for name, value in thread.settings_after.items()
            if (was := thread.settings.get(name, value)) != value and name not in MOVED
        ]

    @property
    def doubts(self) -> list[str]:
        """What is to be said of readings that were not kept, one a line."""
        meters = (one for one in (self.meter, self.thermometer) if one is not None)
        return [one.doubt for one in meters if one.doubt]

    @property
    def voltages_left(self) -> dict[str, RestReport]:
        """How the source of each voltage was left, once it is."""
        return {t.voltage: t.left for t in self.voltages if t.left is not None}

    @property
    def failed(self) -> bool:
        """Whether any thread has met a failure."""
        return any(thread.failure is not None for thread in self.threads)

    def close(self, meanwhile: Wait) -> OffReport:
        """Close all, the coil first, and report how that was left.

        Args:
            meanwhile: goes on with the record until the coil is off, as `open` waits.
        """
        coil = self.coil
        if coil is not None:
            coil.leave()
            meanwhile(lambda: coil.ended)
        for thread in self.threads:
            thread.leave()
        for thread in self.threads:
            until = thread.clock.now() + CLOSING
            thread.clock.wait_for(lambda t=thread: t.ended, until)  # type: ignore[misc]
        if self.coil is None:
            return NO_COIL
        if self.coil.off is None:
            return OffReport(
                False,
                None,
                f"The coil's thread did not end within {CLOSING:g} s: coil state "
                "unknown. Switch the source off at its front panel.",
            )
        return self.coil.off
