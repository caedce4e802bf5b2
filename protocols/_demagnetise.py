"""Demagnetising the core: an alternating current that decays."""

from __future__ import annotations

import numpy as np

from protocols._recovery import Steps
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform

START = 1.0
"""First amplitude, A."""
RATIO = 0.88
"""Amplitude of a cycle over that of the one before."""
PERIOD = 1.0
"""Of one cycle, s: slow enough for the field to reach the core's middle."""
SMALLEST = 5e-3
"""Amplitude at which it ends, A."""


def demagnetising_current(
    start: float = START, ratio: float = RATIO, period: float = PERIOD
) -> Waveform:
    """A decaying alternation from `start` A to below 5 mA, A against s.

    Triangles, because a source set 20 times a second makes no better sine; the charge
    to the coil's heat budget is about 1.5 A^2 s from 1 A.
    """
    cycles = int(np.ceil(np.log(SMALLEST / start) / np.log(ratio)))
    points = [(0.0, 0.0)]
    for cycle in range(cycles):
        amplitude, begin = start * ratio**cycle, cycle * period
        points.append((begin + period / 4, amplitude))
        points.append((begin + 3 * period / 4, -amplitude * ratio**0.5))
    points.append((cycles * period, 0.0))
    return Waveform.through(points)


def demagnetised() -> Steps:
    """One planned pause in which the core is demagnetised; nothing is streamed."""
    current = demagnetising_current()
    yield Trial(
        force=Waveform.constant(0.0),
        current=current,
        label="demagnetise",
        pause=True,
    )
