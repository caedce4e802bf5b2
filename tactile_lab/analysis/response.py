"""Gain and phase of a signal that follows a sine."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.estimate import Estimate, correlated
from tactile_lab.errors import NotIdentifiableError

HARMONICS = 3
"""So many harmonics of the answer are told apart from noise."""


@dataclass(frozen=True)
class Gain:
    """Response to a sine of one frequency.

    Attributes:
        frequency: Hz.
        gain: amplitude of the answer over that of the cause, in their units.
        phase: of the answer against the cause, rad, -pi to pi.
        amplitude: of the cause, in its unit.
    """

    frequency: float
    gain: Estimate
    phase: Estimate
    amplitude: float


def gain(
    time: ArrayLike,
    cause: ArrayLike,
    answer: ArrayLike,
    frequency: float,
    step_bias: float = 0.0,
    leak: float | None = None,
) -> Gain:
    """Gain and phase at `frequency`, the answer's harmonics and slow drift allowed for.

    Args:
        time: s, at least one cycle.
        cause: such as the force, N.
        answer: such as V_C1, V.
        frequency: Hz.
        step_bias: how far means of the answer may be off by a converter's steps, in its
            unit (`tactile_lab.analysis.converter`). They move a sine's amplitude A by
            2/pi b sqrt(step/A), b = step/pi where no noise smooths them (the first of a
            sum of Bessel functions), and its phase not at all.
        leak: time constant with which a transient dies away, s; fitted if given.

    Intervals hold the scatter of the answer, correlated as it is, and the steps. What
    answers the cause beside its sine, such as steps of a source, is no scatter.

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
    waves = [f(n * phase) for n in range(1, HARMONICS + 1) for f in (np.sin, np.cos)]
    drift = [np.ones_like(t), slow, slow**2]
    if leak is not None:
        drift.append(np.exp((t[0] - t) / leak))
    design = np.column_stack([*waves, *drift])
    inverse = np.linalg.pinv(design)
    into, out = inverse @ np.asarray(cause), inverse @ np.asarray(answer)
    given, got = complex(into[0], into[1]), complex(out[0], out[1])
    if abs(given) < 1e-12:
        raise NotIdentifiableError(f"there is no cause at {frequency:g} Hz")
    left = np.asarray(answer) - design @ out
    # what the cause does beside its sine, such as a source's steps, is no scatter: the
    # answer follows it, a little late
    steps = np.asarray(cause) - design @ into
    late = np.gradient(steps)
    beside = np.column_stack([steps, late - design @ (inverse @ late)])
    if np.abs(beside).max() > 1e-9 * abs(given):
        left -= beside @ (np.linalg.pinv(beside) @ left)
    freedom = t.size - design.shape[1] - beside.shape[1]
    alike = correlated(left)
    scatter = math.sqrt(float(np.sum(left**2)) / max(freedom, 1))
    error = scatter * math.sqrt(alike * float(np.sum(inverse[0] ** 2)))
    free = max(1, int(freedom / alike))
    size = max(abs(got), 1e-300)
    first = 2 / math.pi * step_bias
    codes = 2 / math.pi * first * min(1.0, math.sqrt(math.pi * first / size))
    ratio = got / given
    return Gain(
        frequency,
        Estimate.of(abs(ratio), error / abs(given), free).widened(codes / abs(given)),
        Estimate.of(float(np.angle(ratio)), error / size, free),
        abs(given),
    )
