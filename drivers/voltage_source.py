"""A serial source meter that holds a voltage of the circuit; its dialect is a row.

The limits live here, below every caller: range, slew, compliance, read-back. A voltage
within them harms nothing, so no guard stands behind it: it stays where it is when the
program dies, and the next `open` takes it over from there.
"""

from __future__ import annotations

from collections.abc import Iterator

from drivers.serial_line.instrument import SerialInstrument
from drivers.serial_line.link import SerialLink
from drivers.serial_line.source_wire import RECONNECT, VERIFICATIONS, SourceWire
from tactile_lab.clock import Clock
from tactile_lab.errors import (
    InterlockError,
    LimitError,
    LinkLostError,
    RefusedError,
    TactileLabError,
)
from tactile_lab.instruments.voltage_dialect import VoltageDialect
from tactile_lab.quantity import show
from tactile_lab.voltage_source import HeldVoltage, RestReport, VoltageLimits, why_not

STEP_EVERY = 0.05
"""Time between two steps of a ramp, s."""

CATCH_UP = 0.1
"""Time after a late set-point, s, that one step may make up for at the slew limit."""

STEADY = 0.2
"""Time after a change of the set-point from which read-back must agree, s."""

SAME_RANGE = 0.1
"""Part of a range by which its name may differ from what it reaches: 2 V from 2.1 V."""

AT_COMPLIANCE = 0.9
"""Part of the compliance from which on a load may be what holds the voltage down."""

DEVIATING_READINGS = 3
"""Readings in a row that must differ before it counts."""


class SourceMeter(SerialInstrument[SourceWire[VoltageDialect]]):
    """A source meter behind a serial port, on one voltage of the circuit.

    Args:
        name: of the voltage: V_GS, V_S or V_th.
        dialect: how the model speaks.
        port: address for pyserial.
        limits: what may be asked of it.
        clock: the bench's time.
        baud: instead of the row's.

    Raises:
        SceneError: the limits are beyond the model.
    """

    def __init__(
        self,
        name: str,
        dialect: VoltageDialect,
        port: str,
        limits: VoltageLimits,
        clock: Clock,
        *,
        baud: int | None = None,
    ) -> None:
        self.name, self.dialect, self.limits = name, dialect, limits
        self.capability = dialect.capability(limits)
        wire = dialect.serial.at(baud)
        link = SerialLink(
            port,
            wire,
            clock,
            what=f"source of {name}",
            identify=dialect.identify,
        )
        self._clock = clock
        super().__init__(SourceWire(link, dialect))
        self._setpoint: float | None = None
        self._commanded = clock.now()
        self._on = False
        self._deviating = 0

    def open(self) -> None:
        """Connect and identify; set up what is off, take over what it holds.

        Raises:
            NotFoundError, NoReplyError, LinkLostError: the port or what is behind it.
            BadReplyError: another instrument answers, or it does not take its settings.
            RefusedError: its output is on and holds what may not be asked of it.
        """
        wire = self._wire
        try:
            wire.connect()
            if wire.output_is_surely_off():
                wire.set_up(f"{self.name} might be no voltage, or another one")
            else:
                self._take_over()
                self._on = True  # what is refused stays as it was
            self._choose_range()
            if not self._on:
                self._set(0.0)
            self._limit_current()
        except BaseException:
            wire.link.close()
            raise

    def look(self) -> str:
        """Who answers: asked and closed, nothing is set.

        Raises:
            InstrumentError: the port or what is behind it, as `open`.
        """
        with self._met():
            return self.identity

    def rehearse(self) -> list[str]:
        """Say what a run says beyond `open`: is a row understood?

        With the output off, the set-point goes to 10 mV and back. One that is on
        holds a sensor's voltage: it is measured, and not touched.

        Returns:
            What of the row could not be tried.

        Raises:
            InstrumentError: a line is refused, or a question not answered.
        """
        if not self._on:
            return self._wire.rehearse()
        _, voltage = self._wire.measured()
        voltage()
        return [self.dialect.set, *self.dialect.on]

    def step_to(self, volts: float) -> bool:
        """Step towards `volts`, V, as far as slew allows; whether it is there.

        Raises:
            LimitError: outside the limits.
            RefusedError: the source does not take it.
        """
        if (complaint := why_not(self.limits, volts, self.name)) is not None:
            raise LimitError(complaint)
        if not self._on:
            self._on = True  # even where the answer is lost
            self._wire.switch_on()
            self._commanded = self._clock.now()
        self._step(volts)
        return self._setpoint == self.dialect.fixed(volts)

    def read(self) -> HeldVoltage:
        """What it holds now, compared with the set-point once that stands.

        Raises:
            InterlockError: they differ by more than the tolerance, three times in a
                row.
        """
        wire, wanted = self._wire, self._known_setpoint()
        current, measured = wire.measured()
        voltage, now = measured(), self._clock.now()
        if now - self._commanded > STEADY:
            self._compare(wanted, voltage, current)
        return HeldVoltage(time=now, setpoint=wanted, voltage=voltage, current=current)

    def settings(self) -> dict[str, str]:
        """Settings read back, for the run's record."""
        can = self.capability
        return self._known | {
            "compliance_A": f"{self._wire.compliance():g}",
            "setpoint_V": f"{self._wire.setpoint():.6g}",
            "output": "on" if self._wire.output_is_on() else "off",
            "resolution_V": f"{can.resolution:g}",
            "error_V": f"{can.error:g}",
            "error_part": f"{can.error_part:g}",
            "rest_V": f"{self.limits.rest:g}",
        }

    def go_to_rest(self) -> RestReport:
        """Ramp to the rest voltage, read it back, and switch off where that is 0 V."""
        if not self._on and self._setpoint in (0.0, None):
            told = f"This program did not switch the source of {self.name} on."
            return RestReport(True, told)
        trouble: list[str] = []
        for _ in range(VERIFICATIONS):
            if not self._wire.reconnected(trouble, RECONNECT):
                break
            try:
                if self._wire.output_is_surely_off():
                    self._on = False
                    told = f"The output of {self.name} was off already."
                    return RestReport(not self.limits.rest, told)
                for _ in self._ramp(self.limits.rest):
                    self._clock.sleep_until(self._clock.now() + STEP_EVERY)
                told = f"{self._at_rest()} {self._wire.link.moved}".strip()
                return RestReport(True, told)
            except TactileLabError as reason:
                trouble.append(str(reason))
                if isinstance(reason, LinkLostError):
                    self._wire.link.close()  # to be opened anew
        told = " | ".join(dict.fromkeys(trouble))
        return RestReport(False, f"Whether {self.name} went to rest is unknown: {told}")

    def close(self) -> None:
        """Let go of the port, leaving the output as it is; idempotent."""
        self._let_go()

    def _take_over(self) -> None:
        """Go on from what an earlier run, or a person, left it holding."""
        held, other = self._wire.standing(), self._wire.not_taken()
        if abs(held) > self.limits.largest:
            other.append(f"it holds {show(held, 'V')}")
        if other:
            raise RefusedError(
                f"The output of the source of {self.name} is on, and not as this "
                f"program leaves it: {', '.join(other)}. Switch it off at its front "
                "panel."
            )
        self._setpoint = held

    def _choose_range(self) -> None:
        """The finest range that reaches the limits, read back where the row says how.

        Raises:
            RefusedError: it stays in another.
        """
        row, wire = self.dialect, self._wire
        full, found = row.range_for(self.limits).full, 0.0
        for _ in range(2):  # a line may have been lost on the way
            for line in row.range_lines(full):
                wire.command(line)
            if row.range_query is None:
                return
            found = wire.number(row.range_query) * row.voltage_unit
            if abs(found - full) <= SAME_RANGE * full:
                return
        raise RefusedError(
            f"The source of {self.name} stays in its range of {show(found, 'V')} where "
            f"that of {show(full, 'V')} was chosen: its steps and its error would not "
            "be those of this run. Choose that range at its front panel, or correct "
            "[[ranges]] of its row."
        )

    def _limit_current(self) -> None:
        wire, most = self._wire, self.limits.compliance
        wire.command(self.dialect.limit_line(most))
        wire.confirm("compliance", wire.compliance, most, 0.01 * most)

    def _ramp(self, volts: float) -> Iterator[None]:
        """Steps until `volts`, V, is commanded."""
        self._commanded = self._clock.now()
        while self._known_setpoint() != self.dialect.fixed(volts):
            yield
            self._step(volts)

    def _step(self, volts: float) -> None:
        now, before = self._clock.now(), self._known_setpoint()
        step = self.limits.slew * min(now - self._commanded, CATCH_UP)
        self._set(min(max(volts, before - step), before + step))

    def _set(self, volts: float) -> None:
        self._setpoint = None  # it may or may not be taken
        self._wire.command(self.dialect.set_line(volts))
        self._setpoint = self.dialect.fixed(volts)
        self._commanded = self._clock.now()

    def _known_setpoint(self) -> float:
        """The set-point, V; asked where the last answer was lost."""
        if self._setpoint is None:
            self._setpoint = self.dialect.fixed(self._wire.standing())
        return self._setpoint

    def _compare(self, wanted: float, voltage: float, current: float) -> None:
        if abs(voltage - wanted) <= self.limits.tolerance:
            self._deviating = 0
            return
        self._deviating += 1
        if self._deviating >= DEVIATING_READINGS:
            most = self.limits.compliance
            held = abs(current) > AT_COMPLIANCE * most
            raise InterlockError(
                f"{self.name} is set to {show(wanted, 'V', 6)} but "
                f"{show(voltage, 'V', 6)} is there, {self._deviating} readings in a "
                f"row; {show(current, 'A')} flows, the compliance is "
                f"{show(most, 'A')}. "
                f"{'A load or a short holds it down' if held else 'It was set by hand'}"
                f", or the tolerance of {show(self.limits.tolerance, 'V')} is too "
                "narrow for this source."
            )

    def _at_rest(self) -> str:
        """What was read back at rest.

        Raises:
            RefusedError: another voltage, or the output stays on.
        """
        self._clock.sleep_until(self._clock.now() + STEADY)
        voltage, rest = self._wire.voltage(), self.limits.rest
        told = f"{self.name} at {show(voltage, 'V')}"
        if abs(voltage - rest) > self.limits.tolerance:
            raise RefusedError(f"{told} where {show(rest, 'V')} is its rest")
        if rest:
            return f"{told}, its rest; the output stays on."
        for line in self.dialect.off:
            self._wire.command(line)
        if self._wire.output_is_on():
            raise RefusedError(f"{told}, but the output stays on")
        self._on = False
        return f"{told}, output off."
