"""The account of a run: what happened goes to the record and to whoever watches."""

from __future__ import annotations

from array import array
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace

import numpy as np

from tactile_lab.acquisition import events
from tactile_lab.acquisition.alignment import (
    CLUSTER,
    Clocks,
    Edge,
    align,
    find_edges,
    find_list,
)
from tactile_lab.acquisition.coil_thread import Applied, PlayedList
from tactile_lab.acquisition.instruments import Instruments
from tactile_lab.acquisition.intake import FoundSpikes
from tactile_lab.acquisition.journal import Journal
from tactile_lab.arrays import FloatArray
from tactile_lab.bench import Reading
from tactile_lab.clock import Clock
from tactile_lab.errors import RecordingError
from tactile_lab.quantity import plus_minus, show
from tactile_lab.scope import Stream
from tactile_lab.store.applied import BY_HOST, BY_SAMPLES
from tactile_lab.trace import Trace
from tactile_lab.trial import Outcome, Trial
from tactile_lab.voltage_source import HeldVoltage

MOST_UNLIKE = 0.25
"""Part of the sampled current's variance that a list may leave open."""

MOST_SCALED = 0.03
"""Part by which the current that a generator asks for may be another."""

MOST_LONGER = 3e-3
"""Time by which a list may come too late half-way, s."""


class RunningRate:
    """Instantaneous rate on the fly: 1/ISI of the last two spikes, 0 before the second.

    Attributes:
        value: Hz, after the last spike fed.
    """

    def __init__(self) -> None:
        self.value = 0.0
        self._last: float | None = None

    def feed(self, times: FloatArray) -> FloatArray:
        """Rate right after each spike, Hz, for spike times in s, increasing."""
        if times.size == 0:
            return np.empty(0)
        before = times[:1] if self._last is None else np.array([self._last])
        intervals = np.diff(times, prepend=before)
        rates = np.zeros(times.size)
        np.divide(1.0, intervals, out=rates, where=intervals > 0)
        self._last, self.value = float(times[-1]), float(rates[-1])
        return rates


class Account:
    """Writes events, set-points, readings and outcomes down, on the run's time axis.

    The record begins with the first stream, which fixes the axis's zero; what is said
    before waits for it.

    Args:
        clock: the bench's time.
        open_journal: starts the record, told how samples are scaled (None: no scope).
        emit: told of everything.
    """

    def __init__(
        self,
        clock: Clock,
        open_journal: Callable[[Stream | None], Journal],
        emit: events.Emit,
    ) -> None:
        self.emit = emit
        self.journal: Journal | None = None
        self._clock = clock
        self._open_journal = open_journal
        self._origin: float | None = None
        self._rate = RunningRate()
        self._waiting: list[tuple[str, str]] = []
        self.edges: list[Edge] = []
        self._clocks = Clocks()
        self._steps: list[Applied] = []
        self._applied = array("d")  # clock time, A; read back for hours, it stays small
        self._unwritten: list[Applied] = []
        self._written = float("-inf")
        self._fields: list[Reading] = []

    @property
    def now(self) -> float:
        """Run time, s; 0 before the record begins."""
        return self.axis(self._clock.now())

    def axis(self, clock_time: float) -> float:
        """Run time at `clock_time`, s."""
        return 0.0 if self._origin is None else clock_time - self._origin

    def begin(self, stream: Stream | None) -> Journal:
        """Start the record at the stream's first sample, or now without a scope."""
        self._origin = self._clock.now() if stream is None else stream.started
        self.journal = self._open_journal(stream)
        for kind, text in self._waiting:
            self.journal.event(0.0, kind, text)
        uncertainty = 0.0 if stream is None else stream.uncertainty
        self.emit(events.RecordBegun(self._origin, uncertainty))
        return self.journal

    def state(self, state: events.RunState, text: str) -> None:
        """The run entered a state; that is told even where it cannot be stored."""
        # a record that fails is told by what fails in it, and must not hold up a stop
        with suppress(RecordingError):
            self.note(str(state), text)
        self.emit(events.StateChanged(state, text))

    def note(self, kind: str, text: str) -> None:
        """Something happened."""
        if self.journal is None:
            self._waiting.append((kind, text))
        else:
            self.journal.event(self.now, kind, text)

    def warn(self, text: str) -> None:
        """Something a person should know."""
        self.note("warning", text)
        self.emit(events.Message("warning", text))

    def begun(self, index: int, trial: Trial, start: float) -> None:
        """A trial begins at `start` s of run time."""
        if self.journal is not None:
            self.journal.begun(index, trial, start)
        self.emit(events.TrialStarted(index, trial, start))

    def outcome(self, outcome: Outcome) -> None:
        """A trial ended."""
        if self.journal is not None:
            self.journal.outcome(outcome)
        self.emit(events.TrialEnded(outcome))
        if outcome.skipped:
            why = (
                "the source answered late. Check the link to it."
                if outcome.source_late
                else "this computer was busy. Relieve it."
            )
            self.warn(
                f"{outcome.trial.label}: {outcome.skipped} coil set-points came too "
                f"late and were skipped. The run holds what was applied. Why: {why}"
            )

    def pause(self, start: float, end: float) -> None:
        """Nothing was streamed from `start` to `end` s of run time, as planned."""
        if self.journal is not None:
            self.journal.pause(start, end)

    def spikes(self, found: FoundSpikes) -> None:
        """Spikes were found."""
        times, amplitudes = found
        if times:
            rates = self._rate.feed(np.array(times))
            self.emit(events.SpikesSeen(times, tuple(rates.tolist()), amplitudes))

    def readings(self, instruments: Instruments) -> None:
        """Take what the instruments but the scope have told since last time."""
        if self.journal is None:
            return
        coil = instruments.coil
        if coil is not None:
            for text in coil.take_warnings():
                self.warn(text)
            for applied in coil.take_applied():
                if not self._steps or self._steps[-1].setpoint != applied.setpoint:
                    self._steps.append(applied)
                seen = applied.measured
                flows = applied.setpoint if seen is None else seen
                self._applied.extend((applied.time, flows))
                self._unwritten.append(applied)
                row = (self.axis(applied.time), applied.setpoint, applied.measured)
                between = self.axis(applied.asked), self.axis(applied.acted)
                self.emit(events.CoilCurrent(*row, *between))
            if not any(one.listed for one in self._unwritten):
                self.write_current()
        for meter, tell in (
            (instruments.meter, self.field),
            (instruments.thermometer, self.temperature),
        ):
            for reading in meter.take_readings() if meter is not None else ():
                tell(self.axis(reading.time), reading.value)
        for thread in instruments.voltages:
            for held in thread.take_readings():
                self._held(thread.voltage, replace(held, time=self.axis(held.time)))

    def write_current(self, later: float | None = None) -> None:
        """Write down what was applied; points of a list came `later`, s, than thought.

        They wait for this until the samples have shown when the list began; None where
        they did not.
        """
        if self.journal is None:
            return
        told = BY_HOST if later is None else BY_SAMPLES
        for one in self._unwritten:
            time = self.axis(one.time) + ((later or 0.0) if one.listed else 0.0)
            self._written = max(time, self._written)
            row = self._written, one.setpoint, one.measured, one.ratio
            if one.listed:
                self.journal.current(*row, listed=told)
            else:
                sent, acted = self.axis(one.asked), self.axis(one.acted)
                self.journal.current(*row, asked=sent, acted=acted)
        self._unwritten = []

    def field(self, time: float, tesla: float) -> None:
        """The field was read at run time `time` s."""
        self._fields.append(Reading(time, tesla))
        if self.journal is not None:
            self.journal.field(time, tesla)
        self.emit(events.FieldRead(time, tesla))

    def temperature(self, time: float, kelvin: float) -> None:
        """The sensor's temperature was read at run time `time` s, K."""
        if self.journal is not None:
            self.journal.temperature(time, kelvin)
        self.emit(events.TemperatureRead(time, kelvin))

    def _held(self, name: str, held: HeldVoltage) -> None:
        """A source was read back; what was before the run began is not kept."""
        if held.time < 0:
            return
        if self.journal is not None:
            self.journal.voltage(name, held)
        self.emit(events.VoltageRead(name, held))

    def note_edges(self, shunt: Trace) -> None:
        """Find the newest set-points' edges in the binned coil current."""
        if self._origin is not None:
            found = find_edges(self._steps, self._origin, shunt, self._clocks)
            # the first and the newest fix the clocks; those between add nothing
            del self.edges[CLUSTER:-CLUSTER]
            self.edges.extend(found)

    def note_list(
        self,
        played: PlayedList,
        shunt: Trace | None,
        coil_lag: float,
        code: float = 0.0,
    ) -> None:
        """A list has been played: find it in the binned coil current, where there is.

        Its points are written down as the samples show them behind L/R of the coil,
        `coil_lag` s. One code of that current is `code` A.
        """
        seen = None
        if self._origin is not None and shunt is not None:
            seen = find_list(played, self._origin, shunt, coil_lag)
        if seen is None:
            self.write_current()
        elif seen.unlike > MOST_UNLIKE:
            self.write_current()
            self.warn(
                "The coil current that was sampled is not that of the list: "
                f"{100 * seen.unlike:.0f} % of it differs. What was sampled is kept. "
                "Check the shunt's wiring, and the source's list mode."
            )
        else:
            self.write_current(seen.edge.sampled - self.axis(played.began))
            self.edges.append(seen.edge)
            if not played.whole:
                return
            sure = code / 2 / float(np.ptp(played.points.currents))
            if played.generated and abs(seen.scale - 1) > MOST_SCALED + sure:
                self.warn(
                    "The coil current that was sampled is "
                    f"{plus_minus(seen.scale, sure, digits=1)} (half a code) of the "
                    "one that the generator was to give. What was sampled is kept. "
                    "Multiply gain in [coil.generator] by that, or check the shunt's "
                    "resistance."
                )
            if abs(seen.longer) > MOST_LONGER:
                self.warn(
                    f"The source took {show(seen.longer, 's', 2)} longer than asked "
                    "for half of a list: it rounds the dwells. What was sampled is "
                    "kept."
                )

    def align(self, start: float, stop: float, uncertainty: float) -> None:
        """Correct the segment from `start` to `stop` s of run time by its edges."""
        if self.journal is not None:
            told = align(self.edges, start, stop, uncertainty)
            self.journal.align(
                offset=told.offset, drift=told.drift, uncertainty=told.uncertainty
            )
        self.edges, self._clocks = [], Clocks(stop)

    def fields_since(self, start: float) -> list[Reading]:
        """Readings of the field since run time `start` s, with times after it."""
        fields, self._fields = self._fields, []
        return [Reading(one.time - start, one.value) for one in fields]

    def applied_since(self, begin: float) -> FloatArray:
        """Current applied since clock time `begin`: shape (n, 2), s after it and A."""
        rows = np.array(self._applied).reshape(-1, 2)
        self._steps, self._applied = [], array("d")
        return rows[rows[:, 0] >= begin] - (begin, 0.0)
