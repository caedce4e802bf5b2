"""The coil's thread: plays a current waveform by host time, and always ends at 0 A."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Protocol, cast

import numpy as np

from tactile_lab.acquisition.ending import CoilState
from tactile_lab.acquisition.generator_player import GeneratorPlayer
from tactile_lab.acquisition.instrument_thread import InstrumentThread, drained
from tactile_lab.acquisition.stop import LEASE, Lease, StopRequest
from tactile_lab.bench import AnalogueCoil, Coil, ListCoil, OffReport
from tactile_lab.clock import Clock
from tactile_lab.current_list import CurrentList
from tactile_lab.drive import Drive
from tactile_lab.errors import HaltedError, InstrumentError, InterlockError
from tactile_lab.quantity import show
from tactile_lab.waveform import Waveform

READ_BACK_EVERY = 0.25
"""Seconds between read-backs while the set-point rests."""

READ_BACK_PLAYED = 0.1
"""Seconds between read-backs while a list plays, which needs nothing sent."""

READ_BACK_AT_LEAST = 1.0
"""Seconds between read-backs while it moves: each costs a part of an update."""


RESOLUTION = 2e-5
"""Set-points closer than this are the same to any source here, A."""


ROUNDED = 0.6
"""Of a source's smallest step: what it rounds to lies no farther."""


OVERDUE = 2
"""Promised exchanges after which an answer is waited for before a trial is judged."""


ACTS = 0.76
"""Part of an exchange after which a source acts: a line is longer than its answer."""


@dataclass(frozen=True)
class Applied:
    """One set-point as it was applied.

    Attributes:
        asked: clock time at which the source was addressed, s.
        time: clock time at which it had acted, s; of a list's point, when its turn
            came.
        setpoint: A.
        measured: current read back, A; None where only the set-point was sent.
        ratio: resistance over that of the cold coil, as last looked at, or None.
        listed: it is a point of a list that the source played.
        answered: clock time at which the source's answer set out, s; None where it
            was not asked, or knew the time better.
    """

    asked: float
    time: float
    setpoint: float
    measured: float | None
    ratio: float | None = None
    listed: bool = False
    answered: float | None = None

    @property
    def acted(self) -> float:
        """When the source is taken to have acted, clock time, s."""
        return self.time if self.answered is None else self.answered


@dataclass(frozen=True)
class PlayedList:
    """A list of currents that source or generator plays by its own clock.

    Attributes:
        points: the list.
        earliest, latest: between which clock times it began, s.
        generated: whether the scope's generator plays it.
        whole: whether it was played to its end.
    """

    points: CurrentList
    earliest: float
    latest: float
    generated: bool = False
    whole: bool = True

    @property
    def began(self) -> float:
        """When it is taken to have begun, clock time, s; the samples tell better."""
        return self.earliest + ACTS * (self.latest - self.earliest)

    @property
    def end(self) -> float:
        """When it has surely ended, clock time, s."""
        return self.latest + self.points.duration


class Warmth(Protocol):
    """Keeps how warm the coil is; either call may raise to leave it off."""

    def refuse_found(self, settings: Mapping[str, str]) -> None:
        """Its source was opened, made safe, and has these settings."""

    def begin(self) -> None:
        """It is about to be switched on."""


class CoilThread(InstrumentThread):
    """Owns the current source.

    Each set-point is the waveform's value at the time it is sent, so a late one is
    never queued: the latest value wins and slots that passed unused are counted. A
    list is loaded, started and watched; the source, or the scope's generator at its
    analogue input, keeps its time.

    Args:
        coil: the source.
        clock: the bench's time.
        stop: asks for the end.
        lease: ends it where nobody renews that.
        heat: is told as it is opened and switched on; None where nobody keeps it.

    Attributes:
        switched_on: the source was told to switch on and not yet off again; until
            `live`, too, nobody knows whether it is.
        live: the output is on, as it was read back.
        loaded: the list that the source holds, or None.
        list: the list of this trial, playing or played, or None.
        plays_list: whether it plays.
        generator: plays lists into the source's analogue input; None where it is not
            wired.
        skipped: set-points that came so late that the next was due by what the source
            promises, which is what a plan counts on, until now.
        source_late: whether the source's answers held them up since `play`, more than
            this computer.
    """

    def __init__(
        self,
        coil: Coil,
        clock: Clock,
        stop: StopRequest,
        lease: Lease,
        heat: Warmth | None = None,
    ) -> None:
        super().__init__("coil", clock)
        self.coil = coil
        self.off: OffReport | None = None
        self.switched_on = self.live = False
        self.skipped, self.source_late = 0, False
        self._promised = coil.update_interval  # it is measured as it is opened
        self.last: Applied | None = None
        self.measured: float | None = None
        self._stop = stop
        self._lease = lease
        self._heat = heat
        self._applied: deque[Applied] = deque()
        self._warned = 0
        self._read = float("-inf")
        self._energise = False
        self._waveform: Waveform | None = None
        self._until = 0.0
        self._next = 0.0
        self.loaded: CurrentList | None = None
        self.list: PlayedList | None = None
        self._load: CurrentList | None = None
        self._start_list = False
        self._generated: CurrentList | None = None
        self.generator: GeneratorPlayer | None = None
        self.plays_list = False
        self._passed = 0
        self._asked: float | None = None
        """When it began what the source has not answered yet, clock time, s."""

    @property
    def answered(self) -> bool:
        """Whether the source owes no answer."""
        return self._asked is None

    @property
    def overdue(self) -> bool:
        """Whether the source owes an answer for so long that it may be gone."""
        asked = self._asked
        longest = OVERDUE * max(self.coil.update_interval, self._promised)
        return asked is not None and self.clock.now() - asked > longest

    @property
    def state(self) -> CoilState:
        """What is known of the coil now."""
        sent = None if self.last is None else self.last.setpoint
        read = None if self.measured is None else self._read
        return CoilState(self.switched_on, sent, self.measured, self.off, read)

    def energise(self) -> None:
        """Ask for the output to be switched on at 0 A; `live` tells when it is."""
        self._energise = True
        self.clock.notify()

    def play(self, current: Waveform, until: float) -> None:
        """Play `current` (A against clock time, s) from now until `until` s."""
        self._waveform, self._until, self.list = current, until, None
        self.source_late = False
        self._next = self.clock.now()
        self.clock.notify()

    def load_list(self, drive: Drive) -> None:
        """Ask for a drive's list to be loaded; it is once `loaded` is this one."""
        self._load = drive.points
        self.clock.notify()

    def play_list(self) -> None:
        """Ask for the loaded list to be played; `list` tells when it began."""
        self.list, self._start_list = None, True
        self.clock.notify()

    def play_generated(self, points: CurrentList) -> None:
        """Ask for what the generator holds to be played; `list` tells when it began."""
        self.list, self._generated = None, points
        self.clock.notify()

    @property
    def cut_off(self) -> PlayedList | None:
        """Of a list that was ended while it played what flowed; None: there is none."""
        whole = self._passed - 1  # the last point that began may not have lasted
        if self.list is None or not self.plays_list or whole < 1:
            return None
        points = self.list.points
        part = CurrentList(points.currents[:whole], points.dwells[:whole])
        return replace(self.list, points=part, whole=False)

    def take_warnings(self) -> list[str]:
        """Warnings of the source since this was last asked."""
        new = list(self.coil.warnings[self._warned :])
        self._warned += len(new)
        return new

    def take_applied(self) -> list[Applied]:
        """Set-points applied since this was last asked."""
        return drained(self._applied)

    def open(self) -> None:
        """Open the source; it makes itself safe on the way."""
        self.coil.heed(self._is_halted)
        self.coil.open()
        self.settings = {"identity": self.coil.identity, **self.coil.settings()}
        if self._heat is not None:
            self._heat.refuse_found(self.settings)

    def work(self) -> None:
        """Play what is asked for until told to leave, to stop, or left alone."""
        with suppress(HaltedError):
            while not self._is_halted():
                self._turn()

    def make_safe_and_close(self) -> None:
        """Switch off, verify by read-back, close."""
        ended = self.clock.now()
        if self.generator is not None and self.plays_list:
            self.generator.ramp_down(self.coil.beat)
        asked = self.clock.now()
        self.off = self.coil.safe_off()
        if self.list is not None and self.plays_list:
            if not self.list.generated and self.off.fall:
                ended = self.off.fall[0].acted
            self._pass(self.list, ended)
        last = self.last
        if last is not None and abs(last.setpoint) > RESOLUTION:  # it fell from there
            for one in self.off.fall:
                asked, acted = one.asked, one.acted
                self._note(
                    Applied(asked, one.heard, one.setpoint, None, answered=acted)
                )
            if self.off.verified:
                self._note(Applied(asked, self.clock.now(), 0.0, self.off.current))
        half_way = self.switched_on and not self.live  # its settings were being sent
        self.switched_on = self.live = False
        try:
            if self.off.verified and self.opened and not half_way:
                self.settings_after = self.coil.settings()
            self.coil.close()
        except InstrumentError as failure:
            self.failure = self.failure or failure

    def _is_halted(self) -> bool:
        return self._leaving or self._stop.requested

    def _turn(self) -> None:
        """Do what is due, and wait until something is."""
        self.coil.beat()
        self._lease.check()
        if self._energise:
            if self._heat is not None:
                self._heat.begin()
            self.switched_on = True  # before it is: its answers may come late
            self.coil.energise()
            self.settings.update(self.coil.settings())
            # before the first trial: its ramp would lose set-points to this
            self._note(self._read_back(self.clock.now(), 0.0))
            self._energise, self.live = False, True
            self.clock.notify()
        if self._load is not None or self._start_list:
            self._begin_list(cast("ListCoil", self.coil))
        if self._generated is not None and self.generator is not None:
            self._begin_generated(self._generated, self.generator)
        if self.list is not None and self.plays_list:
            self._watch(self.list, self.clock.now())
        now = self.clock.now()
        if self._waveform is not None and now >= self._next:
            self._asked = now
            self._update(self._waveform, now)
            self._asked = None
        wake = self._wake()
        self.clock.wait_for(self._called, wake)
        self._woke(self.clock.now() - wake)

    def _woke(self, late: float) -> None:
        """Look at how late, s, this thread woke: nobody moved the coil meanwhile.

        Raises:
            InterlockError: for longer than a lease lasts. Who holds one stood still,
                too, and may renew it before it is looked at.
        """
        if late <= LEASE or not self.live or self._is_halted():
            return
        kept = 0.0 if self.last is None else self.last.setpoint
        raise InterlockError(
            f"This program stood still for {late:.1f} s, and the coil kept "
            f"{show(kept, 'A')} meanwhile (limit {LEASE:g} s); it was switched off. "
            "Keep the computer from sleeping, and other work away from it."
        )

    def _called(self) -> bool:
        due = self._waveform is not None and self.clock.now() >= self._next
        asked = self._energise or self._load is not None or self._start_list
        asked = asked or self._generated is not None
        return due or asked or self._is_halted()

    def _wake(self) -> float:
        pulse = self.clock.now() + 0.1
        return min(self._next, pulse) if self._waveform is not None else pulse

    def _update(self, waveform: Waveform, now: float) -> None:
        """Send the value of now if it changed, else read back now and then."""
        setpoint = float(waveform.at(min(now, self._until)))
        last = self.last
        same = max(RESOLUTION, ROUNDED * self.coil.grain)
        if last is None or abs(setpoint - last.setpoint) > same:
            commanded = self.coil.set_current(setpoint)
            heard, acted = self.clock.now(), self.coil.acted
            measured = None
            if now - self._read >= READ_BACK_AT_LEAST:
                measured = self.coil.read_current().value
            ratio = self.coil.resistance_ratio
            self._note(Applied(now, heard, commanded, measured, ratio, answered=acted))
        elif now - last.time >= READ_BACK_EVERY and self._rests(waveform, now):
            self._note(self._read_back(now, last.setpoint))
        interval, done, due = self.coil.update_interval, self.clock.now(), self._next
        if (late := int((done - due) / max(interval, self._promised)) - 1) > 0:
            self.skipped += late
            self.source_late |= bool(done - now > now - due)
        self._next += interval * max(1, int((done - due) / interval))
        arrived = self.last and abs(self.last.setpoint - setpoint) <= same
        if now >= self._until and arrived:
            self._waveform = None

    def _begin_list(self, coil: ListCoil) -> None:
        """Load a list, or start the one that is loaded."""
        if self._load is not None:
            if not self._load.same_as(self.loaded):
                coil.load_list(self._load)
            self.loaded, self._load = self._load, None
        if self._start_list and self.loaded is not None:
            asked = self.clock.now()
            coil.start_list()
            self.list = PlayedList(self.loaded, asked, self.clock.now())
            self._start_list, self.plays_list, self._passed = False, True, 0
            self._read = asked
        self.clock.notify()

    def _begin_generated(self, points: CurrentList, player: GeneratorPlayer) -> None:
        """Have the source follow the generator, and start that."""
        coil = cast("AnalogueCoil", self.coil)
        self._generated = None
        coil.follow(points, player.grain)
        self.plays_list = True
        began = player.start(coil.beat, self._is_halted)
        coil.followed_from(*began)
        self.list = PlayedList(points, *began, generated=True)
        self._passed, self._read = 0, began[0]
        self.clock.notify()

    def _pass(self, played: PlayedList, now: float) -> None:
        """Note the points that have passed."""
        points = played.points
        passed = int(np.searchsorted(points.starts, now - played.latest, side="right"))
        for k in range(self._passed, passed):
            at, current = float(points.starts[k]), float(points.currents[k])
            if k > 0 and current == points.currents[k - 1]:
                continue  # a generator repeats what stands still
            point = Applied(
                played.earliest + at, played.began + at, current, None, listed=True
            )
            self.last = point
            self._applied.append(point)
        self._passed = max(passed, self._passed)

    def _watch(self, played: PlayedList, now: float) -> None:
        """Note the points that have passed, read back now and then, end the list."""
        coil = self.coil
        self._pass(played, now)
        if now >= played.end:
            if played.generated:
                cast("AnalogueCoil", coil).end_follow()
                cast("GeneratorPlayer", self.generator).ended()
            else:
                cast("ListCoil", coil).end_list()
            self.plays_list = False
            self._note(self._read_back(now, 0.0))
            self.clock.notify()
        elif now - self._read >= READ_BACK_PLAYED:
            # judged by the driver; it belongs to no one point, so it is no `Applied`
            reading = coil.read_current()
            self.measured, self._read = reading.value, reading.time

    def _rests(self, waveform: Waveform, now: float) -> bool:
        """Whether a read-back delays no set-point: it takes about an update."""
        soon = min(now + 2 * self.coil.update_interval, self._until)
        ahead = waveform.at(soon) - waveform.at(min(now, self._until))
        return abs(float(ahead)) <= RESOLUTION

    def _read_back(self, now: float, setpoint: float) -> Applied:
        """The current under a set-point that stands."""
        reading = self.coil.read_current()
        ratio = self.coil.resistance_ratio
        return Applied(now, reading.time, setpoint, reading.value, ratio)

    def _note(self, applied: Applied) -> None:
        self.last = applied
        if applied.measured is not None:
            self.measured, self._read = applied.measured, applied.time
        self._applied.append(applied)
