"""Demagnetising the core: an alternating current that decays."""

from __future__ import annotations

import numpy as np

from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform

RATIO = 0.88
"""Amplitude of a cycle over that of the one before."""
PERIOD = 1.0
"""Of one cycle, s: slow enough for the field to reach the core's middle."""
SMALLEST = 5e-3
"""Amplitude at which it ends, A."""


def demagnetising_current(start: float = 1.0) -> Waveform:
    """A decaying alternation from `start` A to below 5 mA, A against s.

    Triangles, because a source set 20 times a second makes no better sine; the charge
    to the coil's heat budget is about 1.5 A^2 s from 1 A.
    """
    cycles = max(1, int(np.ceil(np.log(SMALLEST / start) / np.log(RATIO))))
    points = [(0.0, 0.0)]
    for cycle in range(cycles):
        amplitude, begin = start * RATIO**cycle, cycle * PERIOD
        points.append((begin + PERIOD / 4, amplitude))
        points.append((begin + 3 * PERIOD / 4, -amplitude * RATIO**0.5))
    points.append((cycles * PERIOD, 0.0))
    return Waveform.through(points)


def demagnetising(start: float) -> Trial:
    """A planned pause in which the core is demagnetised from `start` A on."""
    return Trial(
        force=Waveform.constant(0.0),
        current=demagnetising_current(start),
        label="demagnetise",
        pause=True,
    )
