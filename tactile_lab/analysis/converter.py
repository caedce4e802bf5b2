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


def step_bias(mean: ArrayLike, code: float, samples: float) -> float:
    """How far the mean of a slow signal may be off by its converter's steps.

    Args:
        mean: of successive bins, shape (n,); its scatter tells the noise.
        code: one code of the converter, in the same unit.
        samples: number of samples in a bin.

    Returns:
        Half-width, at most half a code.
    """
    bins = np.asarray(mean, dtype=np.float64)
    if code <= 0:
        return 0.0
    if bins.size < 3:
        return code / 2
    # of second differences, so that a slope is no noise; the median, so that no edge is
    apart = np.abs(bins[2:] - 2 * bins[1:-1] + bins[:-2]) / math.sqrt(6)
    scatter = float(np.median(apart)) / 0.6745
    # noise that smooths little makes the steps' own scatter less or more than this
    noise = 0.8 * (samples * scatter**2 - code**2 / 12)
    left = math.exp(-2 * math.pi**2 * max(noise, 0.0) / code**2)
    return min(code / 2, code / math.pi * left) if noise > 0 else code / 2
