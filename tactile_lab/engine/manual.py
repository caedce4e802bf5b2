"""Manual control of a bench between runs: hold a current, read the field.

The coil has the same thread, limits and safe ending as in a run::

    control = ManualControl(load("demo", bench="my bench.toml"), realtime=True)
    Thread(target=control.run).start()
    control.hold(0.1)                    # and control.renew() at least every 2 s
    print(read_field(control.bench))
    control.stop("done")
"""

from __future__ import annotations

import statistics
from dataclasses import dataclass
from functools import partial

import numpy as np

from tactile_lab.acquisition import events
from tactile_lab.acquisition.coil_thread import CoilThread
from tactile_lab.acquisition.ending import CoilState, Ending
from tactile_lab.acquisition.stop import Lease
from tactile_lab.bench import Bench, OffReport
from tactile_lab.engine.bench import open_bench
from tactile_lab.engine.coil_heat import CoilHeat
from tactile_lab.engine.task import Task
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.planning.heat import heat_along, heat_left
from tactile_lab.planning.needs import needs
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.waveform import Waveform

FOR_EVER = 1e9
EVERY = 0.02
"""Seconds between two looks at the coil."""


class ManualControl(Task[Ending]):
    """Holds the coil at a current until told otherwise; it begins with the output off.

    Whoever holds it calls `renew` at least every 2 s; else the coil's thread switches
    off. How warm a real coil is left is kept for whoever drives it next.

    Args:
        scene: names the bench.
        bench: instruments made elsewhere; those of the scene's bench unless given.
        realtime: pace a simulated bench by the wall clock.
        emit: told what the coil does, from the thread that calls `run`.

    Raises:
        SceneError: the bench has no coil.
        LimitError: how warm its coil is cannot be told or kept.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        bench: Bench | None = None,
        realtime: bool = False,
        emit: events.Emit = events.ignore,
    ) -> None:
        used = bench or open_bench(scene, needs(scene), realtime=realtime)
        super().__init__(scene, used, events.until_it_fails(emit))
        if self.bench.coil is None:
            raise SceneError("This bench has no coil source to drive by hand.")
        self._limits = self.bench.coil.limits
        self._heat = CoilHeat.of(scene, used)
        if self._heat is not None:
            self._heat.check()
        self._left = self._heat.left() if self._heat else 0.0
        self._began = self.bench.clock.now()
        self._steps = [(0.0, 0.0)]
        self._lease = Lease(
            self.bench.clock,
            holder=("Whoever drives the coil by hand", "a window or script that hangs"),
        )
        self.thread = CoilThread(
            self.bench.coil,
            self.bench.clock,
            self.stop,
            self._lease,
            self._heat,
        )
        self._energised = False

    @property
    def coil_state(self) -> CoilState:
        """What is known of the coil now."""
        return self.thread.state

    def renew(self) -> None:
        """Renew the lease."""
        self._lease.renew()

    def hold(self, current: float) -> None:
        """Go to `current`, A, as fast as the slew limit lets it, and stay.

        Raises:
            LimitError: it would heat a coil that is still warm from whoever drove it
                before: the driver counts the heat of this time alone.
        """
        warm = self._left - self._since(self.bench.clock.now())
        if warm > 0 and abs(current) > self._limits.continuous:
            raise LimitError(
                f"The coil is still warm: {show(current, 'A')} may flow in {warm:.0f} "
                f"s, until then {show(self._limits.continuous, 'A')} at most."
            )
        if not self._energised:
            self.thread.energise()
            self._energised = True
        self.thread.play(Waveform.constant(current), FOR_EVER)

    def run(self) -> Ending:
        """Open the source and follow the coil until `stop`, or until it fails."""
        if self._heat is None:
            return self._followed()
        try:
            return self._heat.kept_while(
                self._followed, partial(self._left_warm, self._heat), self._emit
            )
        except LimitError as reason:
            return Ending.refused(str(reason))

    def _left_warm(self, heat: CoilHeat, ending: Ending) -> float:
        """Time until the coil counts as cold, s."""
        limits, end = self._limits, self._since(self.bench.clock.now())
        flowed = Waveform.stairs(np.array(self._steps), end)
        used = heat_along(flowed, limits, heat_left(self._left, limits))[0]
        return heat.after(min(used, limits.heat))

    def _since(self, time: float) -> float:
        return time - self._began

    def _followed(self) -> Ending:
        coil, told = self.thread, False
        self._lease.renew()
        coil.start()
        over = False
        while not over:
            over = coil.join(EVERY)
            if coil.opened and not told:
                told = True
                self._emit(events.StateChanged(events.RunState.READY, "source opened"))
            for one in coil.take_applied():
                self._emit(events.CoilCurrent(one.time, one.setpoint, one.measured))
                if self._steps[-1][1] != one.setpoint:
                    self._steps.append((self._since(one.time), one.setpoint))
        off = coil.off or OffReport(False, None, "The coil's thread said nothing.")
        if (failure := coil.failure) is not None:
            return Ending(events.RunState.FAULTED, off, str(failure), failure)
        return Ending(
            events.RunState.ABORTED, off, self.stop.reason, signal=self.stop.signal
        )


READINGS = 5


@dataclass(frozen=True)
class FieldReading:
    """The field as read a few times in a row.

    Attributes:
        mean: T.
        spread: standard deviation of the readings, T.
    """

    mean: float
    spread: float


def read_field(bench: Bench) -> FieldReading:
    """Open the teslameter, read the field a few times, close it; takes about 1 s.

    Raises:
        SceneError: the bench has no teslameter.
        InstrumentError: it does not answer.
    """
    meter = bench.field_meter
    if meter is None:
        raise SceneError("This bench has no teslameter to read.")
    with bench.clock.taking_part("field by hand"):
        meter.open()
        try:
            values = [meter.read().value for _ in range(READINGS)]
        finally:
            meter.close()
    return FieldReading(statistics.fmean(values), statistics.stdev(values))
