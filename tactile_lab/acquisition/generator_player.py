"""Plays currents by the scope's generator, which its scope's thread alone touches."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tactile_lab.acquisition.scope_thread import ScopeThread
from tactile_lab.clock import Clock
from tactile_lab.current_list import CurrentList
from tactile_lab.drive import Drive
from tactile_lab.errors import HaltedError, NoReplyError
from tactile_lab.generator import Generator

ANSWERS = 1.0
"""Longest wait until the scope's thread has started the generator, s."""

LONGEST_RAMP = 0.5
"""Longest time of a ramp to 0 V, s; a larger current ramps faster."""

BEAT = 0.1
"""Time between two signs of life while the scope's thread is waited for, s."""

STEP = 2e-3
"""Time between two steps of that ramp, s."""


class GeneratorPlayer:
    """Loads, starts and quiets the generator.

    Args:
        generator: of the scope.
        scope: its thread.
        slew: with which the current is taken back when a run is stopped, A/s.

    Attributes:
        loaded: what the generator holds, or None.
        quiet: whether it is at 0 V, or was asked to be and no longer answers.
    """

    def __init__(self, generator: Generator, scope: ScopeThread, slew: float) -> None:
        self.loaded: CurrentList | None = None
        self.quiet = False
        self._generator = generator
        self._scope = scope
        self._slew = slew
        self._gain = 1.0
        self._began: tuple[float, float] | None = None
        scope.before_close = self._ramp_down

    @property
    def grain(self) -> float:
        """Step of the current, A."""
        return self._generator.step * self._gain

    @property
    def _clock(self) -> Clock:
        return self._scope.clock

    def silence(self) -> None:
        """Ask for 0 V; `quiet` tells when it is. No stream may run."""
        self._scope.do(self._zero)

    def load_list(self, drive: Drive) -> None:
        """Ask for a drive's list to be loaded; it is once `loaded` is this one.

        No stream may run.
        """
        points, gain = drive.points, drive.gain
        assert points is not None and gain is not None

        def load() -> None:
            self._generator.load(points.currents / gain, float(points.dwells[0]))
            self.loaded, self._gain = points, gain

        self.loaded = None
        self._scope.do(load)

    def start(
        self, beat: Callable[[], None], halted: Callable[[], bool]
    ) -> tuple[float, float]:
        """Have the points played; between which clock times they began, s.

        Args:
            beat: a sign of life, given while the scope's thread is waited for.
            halted: asked last thing before; once it is true they are not played.

        Raises:
            NoReplyError: the scope's thread does not start them.
            HaltedError: a stop came first.
        """
        self._began = None

        def begin() -> None:
            if not halted():
                self._start()

        self._scope.do(begin)
        self._wait(lambda: self._began is not None or halted(), ANSWERS, beat)
        if self._began is None and halted():
            raise HaltedError(
                "A stop came before the generator, which was not started."
            )
        if self._began is None:
            raise NoReplyError(
                f"The scope's generator did not start within {ANSWERS:g} s."
            )
        return self._began

    def ended(self) -> None:
        """What was started has ended by itself, at 0 V."""
        self._began, self.quiet = None, True

    def ramp_down(self, beat: Callable[[], None]) -> None:
        """Take the current back to 0 A, as far as the scope still answers."""
        self._scope.do(self._ramp_down)
        self._wait(lambda: self.quiet, LONGEST_RAMP + BEAT, beat)

    def _wait(
        self, done: Callable[[], bool], longest: float, beat: Callable[[], None]
    ) -> None:
        """Wait until the scope's thread is done, has ended, or `longest` s went by."""
        until = self._clock.now() + longest
        while not (done() or self._scope.ended) and self._clock.now() < until:
            beat()
            self._clock.wait_for(
                lambda: done() or self._scope.ended, self._clock.now() + BEAT
            )

    def _start(self) -> None:
        self.quiet = False
        asked = self._clock.now()
        self._began = asked, asked  # whatever happens now, it may play
        self._generator.start()
        self._began = asked, self._clock.now()

    def _zero(self) -> None:
        self._generator.hold(0.0)
        self.quiet, self.loaded = True, None

    def _ramp_down(self) -> None:
        """From what plays now to 0 V, in steps; the stream must end for that."""
        try:
            if self._began is None or self.loaded is None:
                return
            self._scope.end_stream(at_once=True)
            flowing = float(self.loaded.at(self._clock.now() - self._began[0]))
            begun, slew = (
                self._clock.now(),
                max(self._slew, abs(flowing) / LONGEST_RAMP),
            )
            while (left := abs(flowing) - slew * (self._clock.now() - begun)) > 0:
                self._generator.hold(float(np.copysign(left, flowing)) / self._gain)
                self._clock.sleep_until(self._clock.now() + STEP)
            self._zero()
        finally:
            self._began, self.quiet = None, True
            self._clock.notify()
