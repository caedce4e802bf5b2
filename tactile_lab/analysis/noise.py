"""The noise of a signal at rest: its density, and what the mains put into it.

The density is Welch's: the mean of the periodograms of half overlapping segments under
a Hann window, one-sided, so that its integral over frequency is the variance.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError

MAINS = (50.0, 60.0)
"""Frequencies of the mains, Hz."""

HARMONICS = 10
"""Of each that are looked for, the first included."""

SEGMENT = 1.0
"""Length of a segment, s: lines 1 Hz apart can be told apart."""

FEWEST = 3
"""Segments that a density is the mean of, at least."""

SIDE = 2
"""Bins on either side of a line that the window spreads it over."""

AROUND = 20
"""Bins on either side from which the noise below a line is told."""

CLEAR = 6.0
"""Standard deviations of the noise around it by which a line stands out."""


@dataclass(frozen=True)
class MainsLine:
    """A frequency of the mains that stands out of the noise.

    Attributes:
        mains: 50 or 60 Hz.
        frequency: it or a multiple of it, Hz.
        rms: of the sine alone, in the signal's unit.
    """

    mains: float
    frequency: float
    rms: float


@dataclass(frozen=True, eq=False)
class Noise:
    """What a stretch of a signal at rest is made of.

    Attributes:
        frequency: shape (n,), Hz, above 0.
        density: shape (n,), in the signal's unit per square root of Hz.
        rms: of the whole stretch less its mean, in the signal's unit.
        lines: of the mains, ascending.
        seconds: length of the stretch, s.
        segments: how many the density is the mean of.
        resolution: width of one bin, Hz.
    """

    frequency: FloatArray
    density: FloatArray
    rms: float
    lines: tuple[MainsLine, ...]
    seconds: float
    segments: int
    resolution: float

    def thinned(self, count: int) -> tuple[FloatArray, FloatArray]:
        """Frequency and density in about `count` bins even in the logarithm.

        Each is the root of the mean square density of the bins in it.
        """
        edges = np.geomspace(self.frequency[0], self.frequency[-1] * 1.001, count + 1)
        starts = np.unique(np.searchsorted(self.frequency, edges[:-1]))
        many = np.diff(starts, append=self.frequency.size)
        power = np.add.reduceat(self.density**2, starts) / many
        frequency = np.add.reduceat(self.frequency, starts) / many
        return frequency, np.sqrt(power)


def noise(values: FloatArray, interval: float) -> Noise:
    """Density and mains lines of evenly spaced values.

    Args:
        values: shape (n,), without a gap.
        interval: from one to the next, s.

    Raises:
        NotIdentifiableError: less than two seconds.
    """
    size = round(SEGMENT / interval)
    segments = (values.size - size // 2) // max(size - size // 2, 1)
    if segments < FEWEST:
        raise NotIdentifiableError(
            f"{values.size * interval:.2g} s were seen, "
            f"{SEGMENT * (FEWEST + 1) / 2:g} are needed for a spectrum"
        )
    frequency = np.arange(size // 2 + 1) / (size * interval)
    power = _welch(values, interval, size, segments)
    return Noise(
        frequency=frequency[1:],
        density=np.sqrt(power[1:]),
        rms=float(np.std(values)),
        lines=tuple(sorted(_lines(frequency, power), key=lambda one: one.frequency)),
        seconds=values.size * interval,
        segments=segments,
        resolution=float(frequency[1]),
    )


def _welch(values: FloatArray, interval: float, size: int, segments: int) -> FloatArray:
    """Power per Hz of the values, mean of segments of `size` each less its mean.

    As scipy.signal.welch has it, whose import took a third of a report's time.
    """
    window = 0.5 - 0.5 * np.cos(2 * np.pi / size * np.arange(size))
    power = np.zeros(size // 2 + 1)
    for begin in (size - size // 2) * np.arange(segments):
        part = values[begin : begin + size]
        power += np.abs(np.fft.rfft(window * (part - np.mean(part)))) ** 2
    power *= interval / (segments * np.sum(window**2))
    power[1 : (size + 1) // 2] *= 2.0  # 0 Hz and half the rate have no other side
    return power


def _lines(frequency: FloatArray, power: FloatArray) -> list[MainsLine]:
    """Lines of the mains: what a line has above the noise on either side of it.

    A multiple of both mains, such as 300 Hz, counts to the one whose own lines are
    larger.
    """
    width = float(frequency[1])
    summed = np.convolve(power * width, np.ones(2 * SIDE + 1), "same")
    found: dict[float, dict[float, float]] = {mains: {} for mains in MAINS}
    for mains, lines in found.items():
        for order in range(1, HARMONICS + 1):
            at = round(order * mains / width)
            if at + AROUND + SIDE >= power.size:
                break
            near = np.r_[
                summed[max(at - AROUND, 1 + SIDE) : at - 2 * SIDE],
                summed[at + 2 * SIDE + 1 : at + AROUND + 1],
            ]
            above = float(summed[at] - np.median(near))
            if above > CLEAR * float(np.std(near)):
                lines[order * mains] = above
    one, other = (sum(lines.values()) for lines in found.values())
    for shared in set(found[MAINS[0]]) & set(found[MAINS[1]]):
        del found[MAINS[1] if one > other else MAINS[0]][shared]
    return [
        MainsLine(mains, at, float(np.sqrt(above)))
        for mains, lines in found.items()
        for at, above in lines.items()
    ]
