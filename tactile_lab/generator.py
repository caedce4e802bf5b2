"""A current by a waveform generator: a scope's, into a source's analogue input.

What the generator can and what the input makes of it together say which currents can be
played so; each is a list of equal dwells that the generator plays by its own clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.current_list import FINEST, CurrentList
from tactile_lab.errors import LimitError
from tactile_lab.quantity import show
from tactile_lab.waveform import Waveform

SHORTEST = 0.2e-3
"""Time of a sample that is short enough beside the lags of any coil with a core, s."""


@dataclass(frozen=True, kw_only=True)
class GeneratorCapability:
    """What an arbitrary waveform generator can.

    Attributes:
        amplitude: largest magnitude of its output, V.
        step: of its converter, V.
        samples: its memory holds.
        slowest: longest time of one sample, s; it can be any whole part of that.
        load: time to load a waveform, s.
    """

    amplitude: float
    step: float
    samples: int
    slowest: float
    load: float


@dataclass(frozen=True, kw_only=True)
class AnalogueInput:
    """What a source makes of a voltage at its analogue input.

    Attributes:
        gain: A/V, added to the set-point.
        range: largest voltage it takes, V.
        bandwidth: Hz.
    """

    gain: float
    range: float
    bandwidth: float

    @property
    def lag(self) -> float:
        """By which the source follows the voltage, s."""
        return 1 / (2 * math.pi * self.bandwidth)


@dataclass(frozen=True, kw_only=True)
class GeneratedCurrent:
    """What currents a generator gives through a source's analogue input."""

    generator: GeneratorCapability
    input: AnalogueInput

    @property
    def shortest(self) -> float:
        """Shortest time of one sample that is of use, s."""
        return self.generator.slowest / self._parts

    @property
    def step(self) -> float:
        """Step of the current, A."""
        return self.generator.step * abs(self.input.gain)

    @property
    def most(self) -> float:
        """Largest current, A."""
        reach = min(self.generator.amplitude, self.input.range)
        return reach * abs(self.input.gain)

    @property
    def _parts(self) -> int:
        return max(1, math.floor(self.generator.slowest / SHORTEST))

    def load_time(self, points: int) -> float:
        """Time to load so many samples, s; hardly depends on them."""
        return self.generator.load

    def following(self, wave: Waveform) -> CurrentList:
        """The samples that follow `wave`: its values, one each equal time.

        That is as long as a step stays small, and the memory sets how short it can be.
        The first and the last are 0 A: between shots the generator rests on one of
        them.

        Args:
            wave: A against s from 0, without jumps; it begins and ends at 0 A.

        Raises:
            LimitError: it is longer, or larger, than the generator can play.
        """
        if wave.peak > self.most + self.step:
            raise LimitError(
                f"the generator reaches {show(self.most, 'A')} "
                f"({show(self.input.gain, 'A/V')}), less than "
                f"{show(wave.peak, 'A')}. Ask for less force."
            )
        slowest, room = self.generator.slowest, self.generator.samples - 1
        longest = slowest * room
        if wave.end > longest:
            raise LimitError(
                f"{show(wave.end, 's')} are longer than {room} samples of "
                f"{show(slowest, 's', 3)} each. Ask for a shorter trial."
            )
        range_ = float(np.ptp(np.append(wave.value, 0.0)))
        small = max(FINEST * range_, self.step)
        parts = max(1, math.ceil(slowest * wave.steepest / small))
        parts = min(parts, self._parts, math.floor(longest / wave.end))
        each = slowest / parts
        samples = math.ceil(wave.end / each * (1 - 1e-12))
        value = wave.at(each * np.arange(samples + 1))
        value[[0, -1]] = 0.0
        currents = np.clip(np.round(value / self.step) * self.step, -self.most, None)
        currents = np.minimum(currents, self.most) + 0.0
        return CurrentList(currents, np.full(samples + 1, each))


class Generator(Protocol):
    """An arbitrary waveform generator. It belongs to its instrument's thread."""

    @property
    def step(self) -> float:
        """Step of its converter, V."""
        ...

    def hold(self, volts: float) -> None:
        """Give `volts` V from now on, whatever it gave before; no stream may run."""
        ...

    def load(self, volts: FloatArray, each: float) -> None:
        """Take a waveform, to be played once; no stream may run.

        Args:
            volts: shape (n,), V; begins and ends at 0 V.
            each: time of one sample, s.

        Raises:
            LimitError: the generator cannot play it.
        """
        ...

    def start(self) -> None:
        """Play the waveform loaded last once, from now on; a stream may run."""
        ...
