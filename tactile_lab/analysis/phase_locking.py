"""Phase locking of spikes to a periodic force: vector strength and mean phase.

Vector strength (Goldberg and Brown 1969) is the length of the mean of exp(i phase): 1
where every spike has the same phase, near 0 where phases are spread evenly.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from tactile_lab.analysis.estimate import Estimate, student_95
from tactile_lab.analysis.noise import MAINS
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError

FEWEST = 5
"""Spikes, and presentations of which each is left out in turn for the interval."""

FEWEST_OF_MAINS = 20
"""Spikes from which on the mains are looked for in them."""
MOST_OF_MAINS = 1000
"""Only so many are looked at, the first."""
WANDER = 0.1
"""How far the mains are from their frequency at most, Hz."""
HELD = 0.5
"""Vector strength at the mains' frequency from which on they are called the cause."""
IRREGULAR = 0.3
"""Distance of the quartiles of intervals, in medians, from which on they vary."""

LOCKED = 0.01
"""Probability of chance below which spikes are called locked."""


@dataclass(frozen=True)
class PhaseLocking:
    """How spikes lie in the cycles of a force.

    Attributes:
        strength: vector strength, 0 to 1.
        phase: of the mean vector, rad, -pi to pi; 0 where the force is largest.
        phase_half: half of its 95 % interval by the scatter of the spikes, rad.
        spikes: how many.
        chance: probability of so large a strength from evenly spread phases
            (Rayleigh; it takes spikes as independent).
    """

    strength: Estimate
    phase: float
    phase_half: float
    spikes: int
    chance: float

    @property
    def locked(self) -> bool:
        """Whether chance is an unlikely account."""
        return self.chance < LOCKED


def phase_locking(presentations: Sequence[FloatArray]) -> PhaseLocking:
    """Vector strength of the phases (rad) in each of some equal presentations.

    Intervals are a jackknife's, the strength's on its atanh: over presentations where
    there are enough of them (the spikes of one are not independent), else over spikes.

    Raises:
        NotIdentifiableError: fewer than five spikes.
    """
    filled = [np.asarray(p, dtype=np.float64) for p in presentations if len(p)]
    phases = np.concatenate(filled) if filled else np.empty(0)
    if phases.size < FEWEST:
        raise NotIdentifiableError(
            f"{phases.size} spikes, {FEWEST} are needed for a vector strength"
        )
    sums = np.array([np.exp(1j * p).sum() for p in filled])
    counts = np.array([p.size for p in filled])
    if sums.size < FEWEST:
        sums, counts = np.exp(1j * phases), np.ones(phases.size)
    total = complex(sums.sum())
    strength = min(abs(total) / phases.size, 1.0)
    left_out = np.abs(total - sums) / (phases.size - counts)
    known = np.arctanh(np.clip([strength, *left_out], 0.0, 1 - 1e-9))
    n = sums.size
    error = _jackknifed(known[1:])
    wide = Estimate.of(float(known[0]), error, n - 1)
    turned = _jackknifed(np.angle((total - sums) * total.conjugate())) * student_95(
        n - 1
    )
    low, high = math.tanh(max(wide.low, 0.0)), math.tanh(wide.high)
    slope = 1 - strength**2
    estimate = Estimate(strength, slope * error, low, high)
    return PhaseLocking(
        strength=estimate,
        phase=float(np.angle(total)),
        phase_half=min(turned, math.pi),
        spikes=phases.size,
        chance=rayleigh(strength, phases.size),
    )


def _jackknifed(left_out: FloatArray) -> float:
    """Standard error of what was found with each of n left out, shape (n,)."""
    apart = left_out - left_out.mean()
    return math.sqrt((apart.size - 1) / apart.size * float(np.sum(apart**2)))


def rayleigh(strength: float, spikes: int) -> float:
    """Probability of at least that vector strength by chance (Zar 1999, Eq. 27.4)."""
    n, length = spikes, spikes * strength
    return min(1.0, math.exp(math.sqrt(1 + 4 * n + 4 * (n**2 - length**2)) - 1 - 2 * n))


def phases_of(
    spikes: FloatArray,
    force: Callable[[FloatArray], FloatArray],
    frequency: float,
    window: tuple[float, float],
) -> FloatArray:
    """Phase of each spike in the force's own cycle, rad; 0 where it is largest.

    Args:
        spikes: times, s, within the window.
        force: N at given times, s; a slow drift of it is allowed for.
        frequency: Hz.
        window: start and end, s: at least one cycle.

    Raises:
        NotIdentifiableError: the force has nothing of that frequency.
    """
    start, end = window
    cycles = (end - start) * frequency
    if cycles < 0.99:
        raise NotIdentifiableError(f"less than one cycle of {frequency:g} Hz")
    time = np.linspace(start, end, max(64, math.ceil(32 * cycles)))
    turn = 2 * np.pi * frequency * (time - start)
    slow = np.linspace(-1, 1, time.size)
    design = np.column_stack([np.cos(turn), np.sin(turn), np.ones_like(slow), slow])
    found = np.linalg.lstsq(design, np.asarray(force(time)), rcond=None)[0]
    if math.hypot(found[0], found[1]) < 1e-9:
        raise NotIdentifiableError(f"the force has nothing of {frequency:g} Hz")
    largest = math.atan2(found[1], found[0])
    phase = 2 * np.pi * frequency * (spikes - start) - largest
    return np.asarray((phase + np.pi) % (2 * np.pi) - np.pi)


def strongest_frequency(
    presentations: Sequence[FloatArray], low: float, high: float, length: float
) -> tuple[float, float]:
    """Frequency at which the spikes of all presentations repeat themselves most.

    All are taken together, so that a rhythm of the sensor's own is not taken for one of
    the stimulus where presentations begin at several phases of it.

    Args:
        presentations: spike times of each, s from the same instant of its stimulus.
        low: Hz.
        high: Hz.
        length: of each presentation, s: its inverse is the resolution.

    Returns:
        The frequency, Hz; and the probability of so strong a one by chance anywhere
        between `low` and `high` (Rayleigh, for each of the frequencies resolved).

    Raises:
        NotIdentifiableError: too few spikes.
    """
    spikes = np.concatenate([np.empty(0), *presentations])
    if spikes.size < FEWEST:
        raise NotIdentifiableError(f"{spikes.size} spikes, {FEWEST} are needed")
    resolved = max(1.0, (high - low) * length)
    tried = np.linspace(low, high, max(64, math.ceil(16 * resolved)))
    turns = np.exp(2j * np.pi * np.outer(tried, spikes))
    strength = np.abs(turns.mean(axis=1))
    best = int(np.argmax(strength))
    chance = resolved * rayleigh(min(float(strength[best]), 1.0), spikes.size)
    return float(tried[best]), min(1.0, chance)


@dataclass(frozen=True)
class MainsLocking:
    """Spikes that come at one phase of the mains.

    Attributes:
        mains: 50 or 60 Hz.
        strength: vector strength at it.
        spikes: of how many.
    """

    mains: float
    strength: float
    spikes: int


def mains_locking(spikes: FloatArray) -> MainsLocking | None:
    """Whether spikes of a run keep to the phase of the mains; None if they do not.

    A sensor that fires regularly repeats itself at multiples of its rate, which may lie
    there by chance. So more is asked for than an unlikely strength: none around may be
    as large, and intervals are those of the mains or shorter, or else irregular.

    Args:
        spikes: all of the run, s, ascending.
    """
    spikes = spikes[:MOST_OF_MAINS]
    n = spikes.size
    if n < FEWEST_OF_MAINS:
        return None
    length = max(float(spikes[-1] - spikes[0]), 1.0)
    low, middle, high = np.quantile(np.diff(spikes), [0.25, 0.5, 0.75])
    irregular = high - low > IRREGULAR * middle
    for mains in MAINS:
        near = _strengths(spikes, mains - WANDER, mains + WANDER, length)
        apart = np.concatenate([
            _strengths(spikes, mains - 5.0, mains - 2 * WANDER - 2 / length, length),
            _strengths(spikes, mains + 2 * WANDER + 2 / length, mains + 5.0, length),
        ])  # fmt: skip
        strength = float(near.max())
        own = irregular or middle < 1.05 / mains
        if own and strength > max(HELD, 1.5 * float(apart.max())):
            return MainsLocking(mains, strength, n)
    return None


def _strengths(
    spikes: FloatArray, low: float, high: float, length: float
) -> FloatArray:
    """Vector strengths at frequencies as close as `length`, s, tells apart."""
    count = max(16, min(4000, math.ceil(4 * (high - low) * length)))
    strengths = [
        abs(np.exp(2j * np.pi * f * spikes).mean())
        for f in np.linspace(low, high, count)
    ]
    return np.array(strengths)
