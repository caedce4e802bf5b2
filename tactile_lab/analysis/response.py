"""Gain and phase of a signal that follows a sine."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.errors import NotIdentifiableError


@dataclass(frozen=True)
class Gain:
    """Response to a sine of one frequency.

    Attributes:
        frequency: Hz.
        gain: amplitude of the answer over that of the cause, in their units.
        phase: of the answer against the cause, rad, -pi to pi.
        error: standard error of the gain.
        amplitude: of the cause, in its unit.
    """

    frequency: float
    gain: float
    phase: float
    error: float
    amplitude: float


def gain(
    time: ArrayLike, cause: ArrayLike, answer: ArrayLike, frequency: float
) -> Gain:
    """Gain and phase at `frequency`, a slow drift of the answer allowed for.

    Args:
        time: s, at least one cycle.
        cause: such as the force, N.
        answer: such as V_C1, V.
        frequency: Hz.

    Raises:
        NotIdentifiableError: less than a cycle, too few points, or no cause.
    """
    t = np.asarray(time, dtype=np.float64)
    if t.size < 12 or (t[-1] - t[0]) * frequency < 0.9:
        raise NotIdentifiableError(
            f"less than one cycle or too few points at {frequency:g} Hz"
        )
    phase = 2 * np.pi * frequency * t
    slow = (t - t.mean()) / (t[-1] - t[0])
    design = np.column_stack(
        [np.sin(phase), np.cos(phase), np.ones_like(t), slow, slow**2]
    )
    inverse = np.linalg.pinv(design)
    into, out = inverse @ np.asarray(cause), inverse @ np.asarray(answer)
    given, got = complex(into[0], into[1]), complex(out[0], out[1])
    if abs(given) < 1e-12:
        raise NotIdentifiableError(f"there is no cause at {frequency:g} Hz")
    left = np.asarray(answer) - design @ out
    scatter = np.sqrt(np.sum(left**2) / (t.size - design.shape[1]))
    error = scatter * np.sqrt(2 / t.size) / abs(given)
    ratio = got / given
    return Gain(frequency, abs(ratio), float(np.angle(ratio)), float(error), abs(given))
