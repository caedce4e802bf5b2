"""What goes on while the deciding loop waits: samples, readings, failures, a stop."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from tactile_lab.acquisition import events
from tactile_lab.acquisition.account import Account
from tactile_lab.acquisition.instruments import CLOSING, Instruments
from tactile_lab.acquisition.intake import Intake
from tactile_lab.acquisition.person import Prompt
from tactile_lab.acquisition.program import Program
from tactile_lab.acquisition.scope_thread import ScopeThread
from tactile_lab.acquisition.search import REST, SpikeSearch
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.clock import Clock
from tactile_lab.errors import (
    InstrumentError,
    RecordingError,
    RefusedError,
    TactileLabError,
)
from tactile_lab.scope import Stream

PULSE = 0.25
"""Longest time between two signs of life of the loop, s."""

GRACE = 2.0
"""Seconds samples may be late before the scope is given up."""

T = TypeVar("T")


class StopAskedError(Exception):
    """Somebody asked the run to stop."""


class Pump:
    """Moves what instruments deliver whenever the loop of a run waits for something."""

    def __init__(
        self,
        program: Program,
        clock: Clock,
        instruments: Instruments,
        intake: Intake,
        account: Account,
        stop: StopRequest,
        lease: Lease,
        emit: events.Emit,
    ) -> None:
        self._program = program
        self._clock = clock
        self._instruments = instruments
        self._intake = intake
        self._account = account
        self._stop = stop
        self._lease = lease
        self._emit = emit
        self._told = 0.0
        self._hung: float | None = None

    def until(self, done: Callable[[], bool], until: float | None = None) -> None:
        """Do all that comes up until `done()`, or until clock time `until`, s.

        Raises:
            StopAskedError: somebody asked to stop.
            TactileLabError: an instrument or the recorder failed.
        """
        scope = self._instruments.scope
        while True:
            self._lease.renew()
            self._take_blocks()
            self._account.readings(self._instruments)
            self._tell_progress()
            if self._stop.requested:
                raise StopAskedError
            self._instruments.raise_failure()
            self._check_driver()
            if done():
                return
            wake = self._clock.now() + PULSE
            if until is not None:
                if self._clock.now() >= until:
                    return
                wake = min(wake, until)
            self._clock.wait_for(
                lambda: bool(
                    done()
                    or self._stop.requested
                    or self._instruments.failed
                    or (scope and self._intake.streaming and scope.waiting > 0)
                ),
                wake,
            )

    def _check_driver(self) -> None:
        """Give up a scope whose driver has not come back, by two looks apart.

        By one alone a computer that stood still would have done it: nobody ran.

        Raises:
            InstrumentError: it hangs.
        """
        scope, now = self._instruments.scope, self._clock.now()
        if scope is None or scope.silent <= GRACE:
            self._hung = None
            return
        self._hung = now if self._hung is None else self._hung
        if now - self._hung >= PULSE / 2:
            raise InstrumentError(
                f"The scope's driver has not come back for {scope.silent:.1f} s "
                f"(limit {GRACE:g} s): it hangs, as when the scope is unplugged. "
                "Check its cable and power, then start again."
            )

    def rest_until(self, when: float) -> None:
        """Wait until clock time `when`, s."""
        self.until(lambda: self._clock.now() >= when, when)

    def ask(self, work: Callable[[], T]) -> T:
        """What a person comes back with; simulated time stands still meanwhile."""
        scope = self._instruments.scope
        streams = scope is not None and scope.stream is not None
        stands = streams and self._clock.simulated
        if stands:
            self._account.emit(events.Streaming(False))
        prompt = Prompt(work)
        if not self._clock.simulated:
            self.until(lambda: prompt.ended)
        while not prompt.ended_within(PULSE):
            if self._stop.requested:
                raise StopAskedError
        if stands:
            self._account.emit(events.Streaming(True))
        return prompt.result()

    def start_stream(self) -> None:
        """Have the scope stream, if there is one, and begin the record with it.

        Raises:
            RefusedError: the scope did not start.
        """
        scope = self._instruments.scope
        if scope is None:
            if self._account.journal is None:
                self._account.begin(None)
            return
        scope.stream_from(self._program.channels, self._program.interval)
        self.until(lambda: scope.stream is not None)
        stream = scope.stream
        if stream is None:
            raise RefusedError("The scope did not start its stream.")
        search = self._program.search
        if search is not None and search.must_learn:
            self._learn(search, scope, stream)
        journal = self._account.journal or self._account.begin(stream)
        start = self._account.axis(stream.started)
        self._account.emit(events.Streaming(True))
        if search is None:
            self._intake.begin(stream, start, journal)
            return
        detector, row = search.detector(stream), search.row(stream)
        scale = search.amplitude_scale(stream)
        self._intake.begin(stream, start, journal, detector, row, scale)

    def stop_stream(self) -> None:
        """Have the stream end, take the last of it, and align it in time."""
        scope = self._instruments.scope
        if scope is None:
            return
        stream = scope.stream
        self._account.emit(events.Streaming(False))
        scope.halt()
        self.until(lambda: scope.stream is None)
        # records with gaps are each dated by host time: there is nothing to align
        if stream is not None and stream.gapless:
            start = self._account.axis(stream.started)
            self._account.align(start, self._intake.reached, stream.uncertainty)
        self._end_intake(scope)

    def follow(self, done: Callable[[], bool]) -> None:
        """Go on taking samples until `done()`: how the force falls is told, too.

        What fails ends it, and is met again by `last_words`.
        """
        scope, until = self._instruments.scope, self._clock.now() + CLOSING
        with suppress(Exception):
            while not done() and self._clock.now() < until:
                self._take_blocks()
                self._clock.wait_for(
                    lambda: bool(
                        done()
                        or (scope and self._intake.streaming and scope.waiting > 0)
                    ),
                    min(until, self._clock.now() + PULSE),
                )

    def last_words(
        self, known: BaseException | None, dated: Callable[[], None]
    ) -> list[BaseException]:
        """Store what the instruments still delivered while they were closed.

        Args:
            known: what ended the run, which is told elsewhere.
            dated: lets what was stored tell when the last currents came.

        Returns:
            What failed in closing and was not known; it has been told.
        """
        threads = self._instruments.threads
        failures = [one.failure for one in threads if one.failure is not None]
        try:
            self._tell_changes()
            self._tell_left()
            self._take_blocks()
            self._account.readings(self._instruments)
            dated()
            self._account.write_current()
            if self._instruments.scope is not None:
                self._end_intake(self._instruments.scope)
        except TactileLabError as failure:
            failures.append(failure)
        new = [one for one in failures if one is not known]
        for one in new:
            self._tell(one)
        return new

    def _learn(self, search: SpikeSearch, scope: ScopeThread, stream: Stream) -> None:
        """Have the search learn from the first samples while they wait.

        The record names the threshold from its first byte on, so it begins after
        this; no sample is lost, for none is taken.
        """
        wanted = max(1, round(REST / stream.interval))
        until = self._clock.now() + REST + GRACE
        self.until(lambda: scope.ahead >= wanted, until)
        if scope.ahead == 0:
            raise InstrumentError(
                f"The scope has sent no samples for {REST + GRACE:g} s, so no spike "
                "threshold could be estimated. Set detect.threshold."
            )
        search.learn(stream, scope.look_ahead(search.row(stream)))
        text = search.told(stream)
        self._account.note("detection", text)
        self._emit(events.Message("info", text))

    def _take_blocks(self) -> None:
        scope = self._instruments.scope
        if not self._intake.streaming:
            return
        while scope is not None and (block := scope.take()) is not None:
            self._account.spikes(self._intake.add(block))
            for signal, reading in self._intake.take_readings():
                if signal == "field":
                    self._account.field(reading.time, reading.value)
                else:
                    self._account.temperature(reading.time, reading.value)
            self._lease.renew()

    def _tell_progress(self) -> None:
        """Tell how far the run is by the clock, whether or not samples come."""
        reached = self._account.axis(self._clock.now())
        if reached - self._told >= PULSE:
            self._told = reached
            self._emit(events.Progress(reached, self._program.expected))

    def _end_intake(self, scope: ScopeThread) -> None:
        seen_until = self._account.axis(scope.polled_until)
        self._account.spikes(self._intake.end(seen_until))

    def _tell(self, failure: BaseException) -> None:
        """Say what failed as the run was closed, where that can be stored, too."""
        text = f"As the run was closed: {failure}"
        with suppress(RecordingError):
            self._account.note("error", text)
        self._emit(events.Message("error", text))

    def _tell_left(self) -> None:
        """Say how the sources of voltages were left."""
        for left in self._instruments.voltages_left.values():
            self._account.note("voltage" if left.verified else "error", left.text)
            if not left.verified:
                self._emit(events.Message("error", left.text))

    def _tell_changes(self) -> None:
        """Say which settings are not as they were, and which answers were not kept."""
        for text in (*self._instruments.changes, *self._instruments.doubts):
            self._account.warn(text)
