"""What every simulated current source has inside: set-point, compliance, output.

The commands that move them differ by model: `sim_backend.coil.kepco` and others.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

from sim_backend.coil.list_mode import ListPlayer
from sim_backend.plant.driven_coil import DrivenCoil
from sim_backend.serial_line.scpi import Handler
from tactile_lab.clock import Clock


@dataclass(frozen=True)
class PanelChange:
    """One change of state, for tests: what (`set`, `limit`, `output`), when, value."""

    what: str
    time: float
    value: float


class CoilPanel:
    """State of a simulated current source.

    Args:
        plant: the physics behind its terminals.
        clock: the bench's time.
        rating: largest current A and voltage V.
        analogue: A/V and bandwidth, Hz, of its analogue input.
    """

    def __init__(
        self,
        plant: DrivenCoil,
        clock: Clock,
        rating: tuple[float, float],
        analogue: tuple[float, float] | None = None,
    ) -> None:
        self.analogue = analogue
        self._plant = plant
        self._clock = clock
        self.rating = rating
        self.changes: list[PanelChange] = []
        self.on_change: Callable[[PanelChange], None] = self.changes.append
        self.setpoint = 0.0
        self.compliance = 1.0
        self.output_on = False
        self.current_mode = True
        self.remote = False
        self.local = False
        """A person took it to its front panel: the wire may not set it."""
        self.gap = 0.0
        """Rest it wants before a line, s."""
        self.errors: deque[tuple[int, str]] = deque()
        self.list = ListPlayer(clock, self.drive)

    def set_current(self, current: float) -> None:
        """Set-point from the panel or the wire, A."""
        self.setpoint = current
        if not self.list.playing:
            self.drive(current)

    def drive(self, current: float, time: float | None = None) -> None:
        """Regulate to `current`, A, from clock time `time` s on; now unless given."""
        time = self._clock.now() if time is None else time
        self.on_change(PanelChange("set", time, current))
        if self.current_mode:
            self._plant.set_current(time, current)

    def wire_analogue_input(self) -> None:
        """Wire a generator to the analogue input, if there is one."""
        if self.analogue is not None:
            self._plant.gain, bandwidth = self.analogue
            self._plant.lag = 1 / (2 * math.pi * bandwidth)

    def play_list(self, yes: bool) -> None:
        """Play the list, or go back to the set-point."""
        if yes:
            self.list.start()
        elif self.list.stop():
            self.drive(self.setpoint)

    def set_compliance(self, voltage: float) -> None:
        """Compliance from the panel or the wire, V."""
        self.compliance = voltage
        self._note("limit", voltage)

    def switch(self, on: bool) -> None:
        """Switch the output, from the panel or the wire."""
        self.output_on = on
        self._note("output", float(on))
        self._plant.output(self._clock.now(), on)

    def regulate_current(self, yes: bool) -> None:
        """Choose what is regulated: current or voltage."""
        self.current_mode = yes

    def reset(self) -> None:
        """`*RST`: output off, 0 A, voltage regulation."""
        self.switch(False)
        self.set_current(0.0)
        self.current_mode = False
        self.compliance = 1.0

    def measured_current(self) -> float:
        """Output current, A."""
        return self._plant.coil_current(self._clock.now())

    def measured_voltage(self) -> float:
        """Output voltage, V."""
        return self._plant.coil_voltage(self._clock.now())

    def _note(self, what: str, value: float) -> None:
        self.on_change(PanelChange(what, self._clock.now(), value))


@dataclass(frozen=True, kw_only=True)
class SourceModel:
    """How one model differs from the others.

    Attributes:
        rating: largest current A and voltage V.
        commands: makes the command table.
        reply_end: terminator of answers.
        clearing: characters that clear the input buffer.
        max_line, max_queries: what one message may hold.
        rewrite: what its number parser makes of a line.
        standard: has SCPI's error queue.
        analogue: A/V and bandwidth, Hz, of its analogue input; None where it has none.
    """

    rating: tuple[float, float]
    commands: Callable[[CoilPanel], dict[str, Handler]]
    reply_end: bytes = b"\n"
    clearing: bytes = b""
    max_line: int | None = None
    max_queries: int | None = None
    rewrite: Callable[[bytes], bytes] = bytes
    standard: bool = True
    analogue: tuple[float, float] | None = None
