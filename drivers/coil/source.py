"""A serial current source that drives the electromagnet; its dialect is a row of data.

The limits live here, below every caller: current, slew, compliance before output-on,
heat budget, read-back, resistance. Every way out leads through `safe_off`.
"""

from __future__ import annotations

from collections.abc import Callable

from drivers.coil.guard import Guard, in_process
from drivers.coil.interlock import GENERATOR, Interlock, check_current, narrowed
from drivers.coil.list_mode import check_list, check_points, load
from drivers.coil.wire import CATCH_UP, UNKNOWN, CoilWire
from drivers.serial_line.instrument import SerialInstrument
from drivers.serial_line.link import SerialLink, Spy
from tactile_lab.bench import FOUND, CoilLimits, OffReport, Reading, SeenOutput
from tactile_lab.clock import Clock
from tactile_lab.current_list import CurrentList
from tactile_lab.errors import InstrumentError, InterlockError, LimitError, UnsafeError
from tactile_lab.instruments.serial_dialect import MARGIN, CoilDialect
from tactile_lab.quantity import show


class CoilSource(SerialInstrument[CoilWire]):
    """A current source behind a serial port.

    Args:
        dialect: how the model speaks.
        port: address for pyserial.
        limits: what coil and user allow; narrowed by what the model can do.
        clock: the bench's time.
        baud: instead of the row's.
        guard: armed while the output is on; None for the one that fits the port.
        guarded: False leaves a source without guard, for tests of something else.
        spy: told of every byte, or None.
        analogue: whether something is wired to its analogue input, so that more may
            flow than its set-point.
    """

    def __init__(
        self,
        dialect: CoilDialect,
        port: str,
        limits: CoilLimits,
        clock: Clock,
        *,
        baud: int | None = None,
        guard: Guard | None = None,
        guarded: bool = True,
        spy: Spy | None = None,
        analogue: bool = False,
    ) -> None:
        self.dialect = dialect
        self.warnings: list[str] = []
        setup = dialect.serial.at(baud)
        link = SerialLink(
            port,
            setup,
            clock,
            what="coil source",
            identify=dialect.identify,
            spy=spy,
            beat=self.beat,
        )
        self._limits = narrowed(limits, dialect)
        self._clock = clock
        if guard is None and guarded and not in_process(port):
            guard = Guard(port, dialect, setup)
        self._guard = guard
        super().__init__(CoilWire(link, dialect))
        self._promised = self._interval = dialect.promised_interval(baud)
        self._found: float | None = None
        """What flowed when it was opened, A; None where its output was off."""
        self._setpoint: float | None = None
        self._loaded: CurrentList | None = None
        self._analogue = analogue
        self._follows: CurrentList | None = None
        self._commanded = clock.now()
        self._energised = False
        self._reached = False
        self._halted: Callable[[], bool] = lambda: False
        self._on_way_out = True
        """Nothing is kept back: nothing is switched on, or it is being switched off."""
        self._wire.halted = lambda: not self._on_way_out and self._halted()
        self._given_up: OffReport | None = None
        """What could not be verified off and is the guard's from `close` on."""
        self._interlock = Interlock(self._limits, clock.now(), guard, self._warn)

    @property
    def limits(self) -> CoilLimits:
        """The narrowest of model, coil and user."""
        return self._limits

    @property
    def update_interval(self) -> float:
        """Time one verified set-point takes, s, with margin; measured while open."""
        return self._interval

    @property
    def acted(self) -> float:
        """When it is taken to have acted on the last command, clock time, s."""
        return self._wire.acted

    @property
    def setpoint(self) -> float | None:
        """Current last commanded, A; None while unknown."""
        return self._setpoint

    @property
    def grain(self) -> float:
        """Smallest step of the set-point that the wire carries, A."""
        return self.dialect.grain

    @property
    def tripped(self) -> str | None:
        """Why the interlock latched, or None."""
        return self._interlock.tripped

    def open(self) -> None:
        """Connect, identify, make safe, measure the update interval.

        Raises:
            NotFoundError, NoReplyError, LinkLostError: the port or what is behind it.
            BadReplyError: another instrument answers.
            UnsafeError: the output could not be verified off.
        """
        wire = self._wire
        try:
            wire.connect()
            self._reached = True
            if wire.output_is_on():
                self._found = wire.current()
                went = "" if self._analogue else "ramped to zero and "
                self.warnings.append(
                    f"The output was already on at {show(self._found, 'A')} when "
                    f"connected; it was {went}switched off."
                )
            else:
                self._found, self._setpoint = None, 0.0  # nothing flows or is to ramp
            report = self.safe_off()
            if not report.verified:
                why = report.text.removeprefix(UNKNOWN)
                raise UnsafeError(f"It could not be verified off when connected: {why}")
            wire.set_up("it might regulate a voltage instead of the current")
            self._interval = wire.measured_interval()
            if self._guard is not None:
                link = wire.link
                self._guard.start(link.names.every(link.port), link.identity)
        except BaseException:
            wire.link.close()
            raise

    def look(self) -> SeenOutput:
        """Whether the output is on, and what flows: asked and closed, nothing is set.

        Raises:
            InstrumentError: the port or what is behind it, as `open`.
        """
        with self._met() as wire:
            on = wire.output_is_on()
            return SeenOutput(
                self.identity, on, wire.current() if on else wire.current_when_off()
            )

    def heed(self, halted: Callable[[], bool]) -> None:
        """From `energise` to `safe_off` send nothing once `halted()` is true."""
        self._halted = halted

    def energise(self) -> None:
        """Set compliance and 0 A, verify both, then switch the output on.

        Raises:
            HaltedError: a stop came first; the output is off.
            InterlockError: tripped and not acknowledged.
            RefusedError: the source does not take a setting.
        """
        self._interlock.refuse_when_tripped()
        if self._energised:
            return
        self._on_way_out = False
        self._prepare()
        if self._guard is not None:
            self._guard.arm()
        self._energised = True
        try:
            self._trip_on(self._interlock.before_setting(self._clock.now()))
            self._wire.switch_on()
        except BaseException:
            self.safe_off()
            raise

    def rehearse(self) -> list[str]:
        """Say what a run says beyond `open`, with the output off: is a row understood?

        The set-point goes to 10 mA and back.

        Returns:
            What of the row can be tried with the output on alone.

        Raises:
            InstrumentError: a line is refused, or a question not answered.
        """
        row = self.dialect
        self._prepare()
        if row.measures_when_off:
            self._wire.voltage()
        untried = self._wire.rehearse()
        modes = {"[list]": row.list, "[analogue]": row.analogue}
        return untried + [name for name, mode in modes.items() if mode is not None]

    def set_current(self, current: float) -> float:
        """Step towards `current`, A, as far as slew allows; what was commanded, A.

        That is as the wire carries it: `grain` may part it from what was asked for.

        Raises:
            LimitError: not finite, beyond the limit, of a sign the source cannot
                give, or the output is off.
            InterlockError: the heat budget is spent or the guard is gone; the output
                is off by then.
            HaltedError: a stop came first.
        """
        check_current(current, self._limits, self.dialect)
        self._interlock.refuse_when_tripped()
        if not self._energised:
            raise LimitError("The output is off; energise the coil before setting it.")
        now = self._clock.now()
        self._trip_on(self._interlock.before_setting(now))
        if self._setpoint is None:  # the last answer was lost on the way
            self._setpoint = self._wire.standing()
        passed = min(now - self._commanded, max(2 * self._interval, CATCH_UP))
        step = self._limits.slew * passed + 0.5 * self.dialect.grain
        within = min(max(current, self._setpoint - step), self._setpoint + step)
        wanted = self.dialect.fixed(within)
        try:
            self._wire.set_current(wanted)
        except InstrumentError:
            self._commanded = now
            self._setpoint = None  # it may or may not have been taken
            raise
        # a late answer may mean that the step was taken late
        self._commanded = max(now, self._clock.now() - self._interval)
        self._took(wanted)
        return wanted

    def load_list(self, points: CurrentList) -> None:
        """Send a list to the source, which stands at 0 A; checked and verified.

        Raises:
            LimitError: a list the source, coil or heat budget does not allow.
            RefusedError: the source does not hold all of it.
            HaltedError: a stop came before its last line.
        """
        mode = check_list(points, self._limits, self.dialect)
        self._interlock.heat.refuse_list(points, self._clock.now())
        self._loaded = None
        load(self._wire, mode, points)
        self._loaded = points

    def start_list(self) -> None:
        """Have the source play the list loaded last, once, from now on.

        Returns once it has started. The set-point is unknown until `end_list`.

        Raises:
            LimitError: nothing is loaded, the heat budget no longer allows it, or the
                output is off or not at 0 A.
            InterlockError: the guard is gone; the output is off by then.
        """
        self._interlock.refuse_when_tripped()
        self._trip_on(self._interlock.before_setting(self._clock.now()))
        if not self._energised or self._setpoint != 0.0:
            raise LimitError("A list starts with the output on and at 0 A.")
        if self._loaded is None or self.dialect.list is None:
            raise LimitError("No list is loaded that could start.")
        asked = self._clock.now()
        self._interlock.heat.refuse_list(self._loaded, asked)
        self._setpoint = None
        for line in self.dialect.list.start:
            self._wire.command(line)
        self._interlock.plays(self._loaded, asked, self._clock.now())

    def end_list(self) -> None:
        """Go back to a set-point of 0 A, once the list has ended."""
        for line in self.dialect.stop_lines:
            self._wire.command(line)
        self._wire.set_zero()
        self._took(0.0)

    def follow(self, points: CurrentList, grain: float) -> None:
        """Follow the analogue input, on which `points` come soon; at 0 A until then.

        The set-point stays 0 A, and what flows is unknown until `end_follow`.

        Args:
            points: as the generator plays them, A.
            grain: step of the generator's converter, A.

        Raises:
            LimitError: nothing is wired to the input, a current, step or heat beyond
                a limit, or the output is off or not at 0 A.
            InterlockError: the guard is gone; the output is off by then.
        """
        self._interlock.refuse_when_tripped()
        mode, now = self.dialect.analogue, self._clock.now()
        if mode is None or not self._analogue:
            raise LimitError(
                "Nothing is wired to the source's analogue input; see [coil.generator] "
                "of the bench file."
            )
        check_points(points, self._limits, self.dialect, grain)
        self._trip_on(self._interlock.before_setting(now))
        if not self._energised or self._setpoint != 0.0:
            raise LimitError("A generator starts with the output on and at 0 A.")
        self._interlock.heat.refuse_list(points, now)
        self._follows, self._setpoint = points, None
        for line in mode.on:
            self._wire.command(line)

    def followed_from(self, earliest: float, latest: float) -> None:
        """The generator began between two clock times, s; what flows is watched."""
        if self._follows is not None:
            self._interlock.plays(self._follows, earliest, latest, GENERATOR)

    def end_follow(self) -> None:
        """Follow the set-point alone again, 0 A, once the generator has ended."""
        for line in self.dialect.analogue.off if self.dialect.analogue else ():
            self._wire.command(line)
        self._follows = None
        self._wire.set_zero()
        self._took(0.0)

    def read_current(self) -> Reading:
        """Measured output current, A; now and then the resistance is looked at too.

        Raises:
            InterlockError: the current keeps differing from the set-point, the heat
                budget is spent, or the coil is hot; the output is off by then.
        """
        if not self._energised:
            return Reading(self._clock.now(), self._wire.current_when_off())
        self._trip_on(self._interlock.before_setting(self._clock.now()))
        asked = self._clock.now()
        measured, voltage = self._wire.measured()
        now = self._clock.now()
        self._trip_on(self._interlock.after_reading(asked, now, measured))
        if self._interlock.resistance_due(now, measured):
            self._look_at_resistance(measured, voltage())
        return Reading(now, measured)

    @property
    def resistance_ratio(self) -> float | None:
        """Resistance over that of the cold coil; None until it was looked at."""
        return self._interlock.thermometer.ratio

    def settings(self) -> dict[str, str]:
        """Settings read back, for the run's record."""
        found = {} if self._found is None else {FOUND: f"{self._found:g}"}
        return (
            self._known
            | found
            | {
                "compliance_V": f"{self._wire.compliance():g}",
                "setpoint_A": f"{self._wire.setpoint():g}",
                "output": "on" if self._wire.output_is_on() else "off",
                "update_interval_s": f"{self._interval:.6g}",
            }
        )

    def beat(self) -> None:
        """Tell the guard that the owning thread is alive."""
        if self._guard is not None and self._energised:
            self._guard.beat()

    def acknowledge(self) -> None:
        """Unlatch the interlock after its cause was looked at; heat used remains."""
        self._interlock.acknowledge()

    def safe_off(self) -> OffReport:
        """Ramp to 0 A, output off, read back; idempotent, never raises."""
        if not self._reached:
            return OffReport(
                False,
                None,
                "The source was never reached: this program switched nothing on, and "
                "what its output does is unknown.",
            )
        self._on_way_out = True
        self._given_up = self._follows = None
        # with a voltage at the analogue input the set-point is not all that flows, and
        # a set-point of what flows would double it
        report = self._wire.switch_off(
            setpoint=self._setpoint,
            rested=self._clock.now() - self._commanded,
            slew=self._limits.slew,
            exchange=self._interval / MARGIN,
            ramp=not (self._analogue and self._setpoint is None),
        )
        self._commanded = self._clock.now()
        if report.verified:
            self._energised = False
            self._took(0.0)
            if self._guard is not None:
                self._guard.disarm()
        else:
            self._setpoint = None
            if self._guard is not None:
                self._given_up = report
        return report

    def close(self) -> None:
        """Make safe and let go of the port; idempotent.

        An output that cannot be verified off is told in `warnings`, and the guard
        takes the port over.
        """
        wire = self._wire
        if wire.link.is_open:
            report = self._given_up or self.safe_off()
            if report.verified:
                wire.offer(self.dialect.release)
            else:
                self._warn(report.text)
            wire.link.close()
        self._interval = self._promised  # whoever opens it next counts on that
        wire.link.end_record()
        if self._guard is not None:
            self._guard.stop()

    def _look_at_resistance(self, current: float, voltage: float) -> None:
        """Trip on a resistance that is wrong twice: a digit may be lost on the way.

        Raises:
            InterlockError: it is.
        """
        if self._interlock.after_look(self._clock.now(), voltage, current) is None:
            return
        self._wire.link.resynchronise()  # nor does an answer belong to another question
        current, again = self._wire.measured()
        now = self._clock.now()
        self._trip_on(self._interlock.after_look(now, again(), current))

    def _prepare(self) -> None:
        self._wire.set_compliance(self._limits.compliance)
        self._wire.set_zero()
        self._took(0.0)

    def _took(self, current: float) -> None:
        self._setpoint = current
        self._interlock.flows(self._clock.now(), current, on=self._energised)

    def _warn(self, text: str) -> None:
        if text not in self.warnings:
            self.warnings.append(text)

    def _trip_on(self, complaint: str | None) -> None:
        if complaint is None:
            return
        self._interlock.tripped = complaint
        report = self.safe_off()
        if report.verified:  # how the coil was left is told by whoever ends the run
            raise InterlockError(complaint)
        left = f"At once it could not be verified off: {report.text}"
        raise InterlockError(f"{complaint} {left.replace(UNKNOWN, '')}")
