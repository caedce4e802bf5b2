"""The simulated scope's waveform generator: a phase that grows with a 20 MHz clock."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np

from sim_backend.picoscope import codes as pico
from tactile_lab.clock import Clock

CLOCK = 20e6
"""Ticks of the converter a second."""
MEMORY = 1 << 15
"""Samples."""
PHASE = 1 << 32
AMPLITUDE = 2_000_000
"""Largest voltage of either sign, uV."""
STEP = 4.0 / (1 << 12)
"""Of the converter with its 12 bits, V."""
ACTS, ANSWERS = 0.6e-3, 1e-3
"""Time from a start to the first sample, and to the answer, s."""

Output = Callable[[Iterable[tuple[float, float]]], None]
"""Told which voltages (V) come from which times (s) on, instead of those before."""


def nowhere(voltages: Iterable[tuple[float, float]]) -> None:
    """Where the output is wired to nothing."""


@dataclass
class SimulatedGenerator:
    """The generator's state.

    Args:
        clock: the time it lives in.
        output: what it is wired to.
        clock_error: relative error of its clock, which is the scope's own.
    """

    clock: Clock
    output: Output = nowhere
    clock_error: float = 0.0
    _waiting: tuple[list[float], float] | None = field(default=None, init=False)

    def hold(self, microvolts: int) -> int:
        """Give one voltage from now on."""
        if abs(microvolts) > AMPLITUDE:
            return pico.SIGGEN_OFFSET_VOLTAGE
        self._waiting = None
        self.output([(self.clock.now(), _converted(microvolts * 1e-6))])
        return pico.OK

    def load(self, offset: int, peaks: int, phase: int, codes: list[int]) -> int:
        """Take samples to be played once at the software's trigger."""
        if abs(offset) + peaks // 2 > AMPLITUDE:
            return pico.SIGGEN_PK_TO_PK
        if not 1 <= len(codes) <= MEMORY or phase < 1:
            return pico.INVALID_PARAMETER
        volts = (offset + peaks / 2 * np.array(codes) / 32767) * 1e-6
        ticks = PHASE / MEMORY / phase
        each = ticks / CLOCK * (1 + self.clock_error)
        samples = [_converted(v) for v in volts.tolist()]
        self._waiting = samples, each
        self.output([(self.clock.now(), samples[0])])
        return pico.OK

    def trigger(self) -> int:
        """Play what was loaded, once; it rests on its last sample."""
        if self._waiting is None:
            return pico.SIGGEN_TRIGGER_SOURCE
        samples, each = self._waiting
        now = self.clock.now()
        times = itertools.count(now + ACTS, each)
        played = zip(times, samples, strict=False)
        # a voltage that stays as it is changes nothing
        steps = itertools.groupby(played, key=lambda one: one[1])
        self.output([next(same) for _, same in steps])
        self.clock.sleep_until(now + ANSWERS)
        return pico.OK


def _converted(volts: float) -> float:
    """The nearest voltage that the converter has."""
    return round(volts / STEP) * STEP
