"""The one loop: protocol generator -> trials -> coil and scope -> outcome -> generator.

It decides everything in one synchronous loop and is the only one that talks to the
recorder, the watchers and the protocol. Every way out passes through a verified safe
state of the coil.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import suppress

import numpy as np

from tactile_lab.acquisition import events
from tactile_lab.acquisition.account import Account
from tactile_lab.acquisition.asked_field import AskedField
from tactile_lab.acquisition.coil_thread import CoilThread
from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.generator_player import GeneratorPlayer
from tactile_lab.acquisition.instruments import Instruments
from tactile_lab.acquisition.intake import Intake
from tactile_lab.acquisition.journal import Journal
from tactile_lab.acquisition.live import LiveBins
from tactile_lab.acquisition.person import PLACES
from tactile_lab.acquisition.program import Program
from tactile_lab.acquisition.pump import GRACE, Pump, StopAskedError
from tactile_lab.acquisition.stop import Lease, StopRequest
from tactile_lab.arrays import FloatArray
from tactile_lab.bench import Bench
from tactile_lab.current_list import CurrentList
from tactile_lab.drive import Drive, Way
from tactile_lab.errors import (
    InstrumentError,
    RecordingError,
    RefusedError,
    SamplesLostError,
    SurplusError,
    TactileLabError,
)
from tactile_lab.scope import Stream
from tactile_lab.trace import Trace
from tactile_lab.trial import BASELINE, Outcome, Trial, playable
from tactile_lab.waveform import Waveform

LATE = 0.75
"""Part of a hold after which a person's reading is taken to be made."""


class Runner:
    """Carries out one program on one bench, once.

    Args:
        program: what to do.
        bench: with what; nothing of it is open.
        journal: starts the record, told how the samples are scaled (None: no scope).
        stop: asks for the end.
        live: gets the newest samples.
        emits: are told what happens, each for as long as it works.

    Attributes:
        missing: what found that samples are missing from a stream without gaps; None
            where nothing did.
        surplus: what found that there are more samples than time went by for.
        duration: of the experiment, planned pauses included, until the coil began to be
            made safe, s.
    """

    def __init__(
        self,
        program: Program,
        bench: Bench,
        journal: Callable[[Stream | None], Journal],
        stop: StopRequest,
        live: LiveBins,
        *emits: events.Emit,
    ) -> None:
        self.intake = Intake(live)
        self._live = live
        self._program = program
        self._clock = bench.clock
        guarded = [events.until_it_fails(one, self._note_watcher) for one in emits]

        def emit(event: events.Event) -> None:
            for one in guarded:
                one(event)

        self._account = Account(bench.clock, journal, emit)
        self._stop = stop
        self._lease = Lease(bench.clock)
        self.instruments = Instruments.of(bench, stop, self._lease, program.heat)
        self._pump = Pump(
            program,
            bench.clock,
            self.instruments,
            self.intake,
            self._account,
            stop,
            self._lease,
            emit,
        )
        self.missing: str | None = None
        self.surplus: str | None = None
        self.duration = 0.0
        self._place_probes = bench.place_probes
        self._probes = "circuit"

    def run(self) -> Ending:
        """Run to the end, however it comes; the coil is safe when this returns."""
        with self._clock.taking_part("runner"):
            state, reason = events.RunState.COMPLETE, None
            failure: BaseException | None = None
            try:
                self._connect()
                self._play_all()
            except StopAskedError:
                state, reason = events.RunState.ABORTED, self._stop.reason
            except TactileLabError as error:
                state, reason, failure = events.RunState.FAULTED, str(error), error
            except BaseException as error:
                state, failure = events.RunState.FAULTED, error
                reason = self._program.fault(error)
            self.duration = self._account.now
            try:
                self._account.state(events.RunState.STOPPING, "making the coil safe")
            finally:  # whatever the record does
                self._lease.end()
                off = self.instruments.close(self._pump.follow)
            ending = Ending(state, off, reason, failure, self._stop.signal)
            try:
                last = self._pump.last_words(failure, self._note_cut_off)
                self.missing = _told(SamplesLostError, failure, *last)
                self.surplus = _told(SurplusError, failure, *last)
                self._account.state(state, reason or off.text)
            except Exception as error:  # whatever it is, the coil's state is told
                ending = ending.faulted_by(error)
        return ending

    def _connect(self) -> None:
        self._account.state(events.RunState.CONNECTING, "opening instruments")
        self.instruments.open(self._pump.until)
        coil = self.instruments.coil
        if coil is not None and (generator := coil.generator) is not None:
            generator.silence()  # before anything can follow it
            self._pump.until(lambda: generator.quiet)
        for text in self._program.doubts(self.instruments.settings):
            self._account.warn(text)
        self._hold(self._program.voltages)
        self._pump.start_stream()
        if coil is not None:
            coil.energise()
            self._pump.until(lambda: coil.live)
        self._account.state(events.RunState.RUNNING, "running")

    def _play_all(self) -> None:
        self._rest(BASELINE)
        trials = self._program.trials()
        outcome: Outcome | None = None
        try:
            while True:
                trial = next(trials) if outcome is None else trials.send(outcome)
                index = 0 if outcome is None else outcome.index + 1
                play = self._pause if playable(trial).pause else self._play
                outcome = play(index, trial)
                self._account.outcome(outcome)
        except StopIteration:
            pass
        finally:
            trials.close()
        self._pump.stop_stream()
        if (coil := self.instruments.coil) is not None:
            self._pump.until(lambda: coil.answered)

    def _play(self, index: int, trial: Trial) -> Outcome:
        """Play one trial while everything streams."""
        if trial.probes != self._probes:
            self._move_probes(trial.probes)
        self._hold(trial.voltages)
        drive = self._prepared(trial)  # the film forgets while a list is loaded
        since = self.intake.reached - BASELINE
        rest = self._live.levels(since, self.intake.reached)
        cut_off = self.intake.cut_off(since)
        drift = self._drifted(rest, cut_off="V_C1" in cut_off)
        rest.update(dict.fromkeys(cut_off, math.nan))
        asked = self._program.asked_field if trial.hold is not None else None
        coil = self.instruments.coil
        if coil is not None and drive is not None and drive.points is not None:
            self._start(coil, drive.points, drive.way)
        begin, start = self._begin(index, trial)
        shown = self.intake.sampled(start)  # by the clock of the samples
        end = begin + trial.length
        # a current that waits for a person is watched as long as that takes
        skipped = self._play_current(drive, begin, math.inf if asked else end)
        scope = self.instruments.scope
        if scope is None:
            self._pump.rest_until(end)
        else:
            scope.poll_at(end)
            last = start + trial.length - 2 * self._program.interval
            grace = GRACE + 2 * self._record
            self._pump.until(lambda: self.intake.lacks(last) <= 0, end + grace)
            if (behind := self.intake.lacks(last)) > 0:
                raise InstrumentError(
                    f"The scope is {behind:.3g} s of samples behind at the end of a "
                    f"trial (limit {grace:g} s). Lower the sample rate or use a faster "
                    "USB port."
                )
        if asked is not None:
            self._ask_field(asked, trial, start)
        if coil is not None:  # its last point is 0 A and may outlast the trial
            self._pump.until(lambda: not (coil.plays_list or coil.overdue))
        self._note_edges(shown)
        current = self._account.applied_since(begin)
        asks = None if drive is None else drive.current
        self._compare(trial, asks, start, shown, current)
        ended = self.intake.sampled(start + trial.length)
        spikes = self.intake.spikes_between(shown, ended)
        return Outcome(
            trial=trial,
            index=index,
            start=start,
            spike_times=spikes - shown,
            current=current,
            rest=rest,
            traces=self._live.traces(shown, ended),
            skipped=0 if coil is None else coil.skipped - skipped,
            source_late=coil is not None and coil.source_late,
            codes=self._codes(),
            drift=drift,
            cut_off=self.intake.cut_off(shown),
        )

    def _compare(
        self,
        trial: Trial,
        asks: Waveform | None,
        start: float,
        shown: float,
        current: FloatArray,
    ) -> None:
        """Warn where what a trial asks for, current, shunt and field do not fit."""
        readings = self._account.fields_since(start)
        check = self._program.drive_check
        if check is None:
            return
        if self._program.asked_field is not None:
            readings = []  # what a person types is doubted as it is typed

        def shunt(begin: float, end: float) -> tuple[float, float] | None:
            seen = self._live.mean("coil_current", shown + begin, shown + end)
            return None if seen is None else (seen[0] - shown, seen[1])

        for text in check.doubts(trial, asks, current, shunt, readings):
            self._account.warn(text)

    @property
    def _record(self) -> float:
        """How long a scope with gaps takes for a record, s; 0 for one without."""
        stream = (
            None if self.instruments.scope is None else self.instruments.scope.stream
        )
        if stream is None or stream.record is None:
            return 0.0
        return stream.record * stream.interval

    def _codes(self) -> dict[str, float]:
        """One code of each measured signal, SI."""
        scope = self.instruments.scope
        stream = None if scope is None else scope.stream
        if stream is None:
            return {}
        return {
            channel.signal: abs(stream.volts_per_code(row)[0]) * (1 << stream.shift)
            for row, channel in enumerate(stream.channels)
        }

    def _ask_field(self, asked: AskedField, trial: Trial, start: float) -> None:
        """Have a person read the field of the trial that began at `start` s."""
        coil = self.instruments.coil
        current = 0.0 if coil is None or coil.last is None else coil.last.setpoint
        field, doubt = self._pump.ask(lambda: asked.read(current))
        if doubt is not None:
            self._account.warn(doubt)
        held_from, held_to = trial.hold or (0.0, trial.length)
        self._account.field(start + held_from + LATE * (held_to - held_from), field)

    def _drifted(self, rest: dict[str, float], *, cut_off: bool) -> float | None:
        """Drift of V_C1 at rest, V; None where it is not measured or does not matter.

        Raises:
            LimitError: beyond the protocol's limit.
        """
        watch = self._program.drift
        if watch is None or "V_C1" not in rest:
            return None
        seen = self.intake.reached if self._record else self._account.now
        return watch.before(rest["V_C1"], seen, cut_off=cut_off)

    def _pause(self, index: int, trial: Trial) -> Outcome:
        """A planned recovery: the coil holds, nothing is streamed or stored."""
        drive = self._prepared(trial)
        begin, start = self._begin(index, trial)
        self._pump.stop_stream()
        self._play_current(drive, begin, begin + trial.length)
        self._hold(trial.voltages)
        self._pump.rest_until(begin + trial.length)
        self._account.pause(start, self._account.now)
        self._pump.start_stream()
        self._rest(BASELINE)
        return Outcome(
            trial=trial,
            index=index,
            start=start,
            spike_times=np.empty(0),
            current=self._account.applied_since(begin),
        )

    def _move_probes(self, where: str) -> None:
        """Have the probes put elsewhere; nothing is streamed meanwhile."""
        start = self._account.now
        self._pump.stop_stream()
        if self._place_probes is not None:
            self._place_probes(where)
        elif self._program.ask is not None:
            ask = self._program.ask
            self._pump.ask(lambda: ask(PLACES[where]))
        else:
            raise RefusedError(f"Nobody is there to ask: {PLACES[where]}")
        self._probes = where
        self._account.pause(start, self._account.now)
        self._pump.start_stream()
        # the newest samples lag by a poll: none from before the move count as rest
        self._rest(2 * BASELINE)

    def _hold(self, voltages: Mapping[str, float]) -> None:
        """Have sources hold voltages, by name, V, and the circuit settle with them."""
        moved = self.instruments.hold(voltages)
        if not moved:
            return
        self._pump.until(lambda: all(thread.stands for thread in moved))
        self._pump.rest_until(self._clock.now() + self._program.settling)

    def _rest(self, length: float) -> None:
        """Record the sensor at rest for `length` s, and for one record at least."""
        began = self._account.now
        until = self._clock.now() + length
        self._pump.rest_until(until)
        if self._record:
            grace = until + GRACE + 2 * self._record
            self._pump.until(lambda: self.intake.reached > began, grace)

    def _begin(self, index: int, trial: Trial) -> tuple[float, float]:
        """Begin a trial now: its start in clock time and in run time, s.

        A trial whose list has just begun is taken to have begun with it.
        """
        coil, begin = self.instruments.coil, self._clock.now()
        if coil is not None and coil.plays_list and coil.list is not None:
            begin = coil.list.began
        start = self._account.axis(begin)
        self.intake.forget_spikes_before(self.intake.sampled(start))
        self._account.begun(index, trial, start)
        return begin, start

    def _prepared(self, trial: Trial) -> Drive | None:
        """How the coil gives the trial; None where there is none."""
        coil = self.instruments.coil
        if coil is None:
            return None
        before = coil.last.setpoint if coil.last is not None else 0.0
        drive = self._program.drive_for(trial, coil.coil.update_interval, before)
        holder = coil if drive.gain is None else coil.generator
        if drive.points is not None and holder is not None:
            if not drive.points.same_as(holder.loaded):
                self._load(holder, drive)
        return drive

    def _load(self, holder: CoilThread | GeneratorPlayer, drive: Drive) -> None:
        """Have the drive's list loaded; nothing is streamed meanwhile."""
        start = self._account.now
        self._pump.stop_stream()
        holder.load_list(drive)
        self._pump.until(lambda: holder.loaded is drive.points)
        self._account.pause(start, self._account.now)
        self._pump.start_stream()
        self._rest(2 * BASELINE)

    def _start(self, coil: CoilThread, points: CurrentList, way: Way) -> None:
        """Have the loaded list played, and wait until it has begun."""
        if way == "generator":
            coil.play_generated(points)
        else:
            coil.play_list()
        self._pump.until(lambda: coil.list is not None)

    def _play_current(self, drive: Drive | None, begin: float, end: float) -> int:
        """Have the coil play a trial; set-points it had skipped before."""
        coil = self.instruments.coil
        if coil is None or drive is None:
            return 0
        if self._program.drift is not None:
            self._program.drift.plays(drive.current, self._account.axis(begin))
        if drive.points is None:
            coil.play(drive.current.shifted(begin), end)
        return coil.skipped

    def _note_watcher(self, text: str) -> None:
        """Keep with the run that nobody watches it any more."""
        with suppress(RecordingError):
            self._account.note("warning", text)

    def _note_edges(self, start: float) -> None:
        """Let the trial, in the samples from `start` s on, tell where clocks lie."""
        shunt = self._shunt(start)
        if shunt is not None:
            self._account.note_edges(shunt)
        coil = self.instruments.coil
        if coil is not None and coil.list is not None:
            code = self._codes().get("coil_current", 0.0)
            self._account.note_list(coil.list, shunt, self._program.coil_lag, code)

    def _note_cut_off(self) -> None:
        """Let the samples tell when a list began that the end of the run cut off."""
        coil = self.instruments.coil
        played = None if coil is None else coil.cut_off
        if played is not None:
            shunt = self._shunt(self._account.axis(played.earliest))
            self._account.note_list(played, shunt, self._program.coil_lag)

    def _shunt(self, start: float) -> Trace | None:
        """The coil current in the samples from before `start` s on; None without."""
        if "coil_current" not in self._live.signals or not self._live.gapless:
            return None
        return self._live.between(start - BASELINE, self.intake.reached, "coil_current")


def _told(kind: type[InstrumentError], *failures: BaseException | None) -> str | None:
    """What the first of `failures` of this kind says."""
    return next((str(one) for one in failures if isinstance(one, kind)), None)
