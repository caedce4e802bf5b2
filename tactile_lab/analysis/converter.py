"""What a converter's steps leave open in a mean of many samples.

Noise much larger than a step smooths the steps away; without noise a mean may be off by
half a step. What remains under Gaussian noise of standard deviation s is a sine of the
voltage with amplitude step/pi exp(-2 (pi s/step)^2), the first term of the staircase's
Fourier series.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray

POOL, POOLS = 64, 8
"""Bins whose scatter is taken together, and fewest of such pools that tell more."""
TOGGLING = 1.5
"""Codes that a bin reaches over where it holds but two."""
STILL = 0.05
"""Variance, of a code squared, of noise too small to smooth steps, not near an edge."""


def step_bias(
    mean: ArrayLike, code: float, samples: float, extent: ArrayLike | None = None
) -> float:
    """How far the mean of a slow signal may be off by its converter's steps.

    Args:
        mean: of successive bins, shape (n,); its scatter tells the noise.
        code: one code of the converter, in the same unit.
        samples: number of samples in a bin.
        extent: highest less lowest sample of each bin, in the same unit, shape (n,).
            Two codes that a level toggles between are no noise that smooths them,
            however much they scatter: at an edge any noise makes it, and the level
            may lie by most of half a code beside the mean.

    Returns:
        Half-width, at most half a code.
    """
    bins = np.asarray(mean, dtype=np.float64)
    if code <= 0:
        return 0.0
    if bins.size < 3:
        return code / 2
    if extent is not None and np.median(np.asarray(extent)) < TOGGLING * code:
        return code / 2
    # of second differences, so that a slope is no noise; the median, so that no edge is
    apart = np.abs(bins[2:] - 2 * bins[1:-1] + bins[:-2]) / math.sqrt(6)
    scatter = float(np.median(apart)) / 0.6745
    # noise that smooths little makes the steps' own scatter less or more than this
    noise = 0.8 * (samples * scatter**2 - code**2 / 12)
    if _still(apart, samples) < STILL * code**2:
        noise = 0.0  # what was seen elsewhere is toggling at the edge of a code
    left = math.exp(-2 * math.pi**2 * max(noise, 0.0) / code**2)
    return min(code / 2, code / math.pi * left) if noise > 0 else code / 2


def _still(apart: FloatArray, samples: float) -> float:
    """Variance of a sample where the signal is quietest, a tenth of the time.

    Where it does not move at all it may be cut off, and tells nothing.
    """
    pools = apart[: apart.size // POOL * POOL].reshape(-1, POOL)
    pools = pools[np.any(pools > 0, axis=1)]
    if len(pools) < POOLS:
        return math.inf
    variance = samples * (np.median(pools, axis=1) / 0.6745) ** 2
    return float(np.quantile(variance, 0.1))
