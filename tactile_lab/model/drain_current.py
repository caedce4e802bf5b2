"""I_DS from a measured V_C1: Eq. (16) solved for the drain current."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit

BOXCAR_3DB = 0.4429
"""-3 dB frequency of a mean over a window, times the window's length."""
EVEN = 0.01
"""Part of a step by which even steps may differ from their mean."""


@dataclass(frozen=True, eq=False)
class DrainCurrent:
    """A derived I_DS.

    Attributes:
        time: shape (n,), s.
        current: shape (n,), A.
        bandwidth: -3 dB frequency up to which it follows, Hz.
        averaged: length of the window V_C1 was averaged and differentiated over, s.
    """

    time: FloatArray
    current: FloatArray
    bandwidth: float
    averaged: float


def drain_current(
    time: ArrayLike,
    V_C1: ArrayLike,
    circuit: Circuit | None = None,
    *,
    window: float = 0.02,
) -> DrainCurrent:
    """I_DS = (V_S - V_C1)/R1 - V_C1/R2 - C1 dV_C1/dt, Eq. (16).

    V_C1 and its slope come from a straight line fitted over a sliding window, which
    averages away converter steps and sets the bandwidth.

    Args:
        time: evenly spaced, shape (n,), n >= 3, s.
        V_C1: bin means or samples, shape (n,), V.
        circuit: V_S, R1, R2 and C1 around node A; Table 1's where None.
        window: wanted length of the window, s; made at least three points long.

    Raises:
        ParameterError: too few points, unequal shapes or uneven spacing.
    """
    parts = circuit or Circuit()
    t = np.asarray(time, dtype=np.float64)
    v = np.asarray(V_C1, dtype=np.float64)
    if t.ndim != 1 or t.shape != v.shape or t.size < 3:
        raise ParameterError(
            f"I_DS from V_C1 needs at least 3 points, as many values as times; got "
            f"shapes {t.shape} and {v.shape}."
        )
    step = (t[-1] - t[0]) / (t.size - 1)
    if step <= 0 or np.max(np.abs(np.diff(t) - step)) > EVEN * step:
        raise ParameterError(
            "I_DS from V_C1 needs evenly spaced, increasing times; split the trace at "
            "its gaps."
        )
    half = max(1, round((window / step - 1) / 2))
    half = min(half, (t.size - 1) // 2)
    mean, slope = _sliding_line(v, step, half)
    current = (parts.V_S - mean) / parts.R1 - mean / parts.R2 - parts.C1 * slope
    averaged = (2 * half + 1) * step
    return DrainCurrent(t, current, BOXCAR_3DB / averaged, averaged)


def drain_currents(
    time: FloatArray, V_C1: FloatArray, circuit: Circuit | None = None
) -> list[DrainCurrent]:
    """I_DS of each stretch of three points and more that are evenly spaced.

    A trace is uneven where samples are missing, and beside that: the mean next to a
    gap is of fewer samples.
    """
    steps = np.diff(time)
    usual = np.median(steps) if steps.size else 0.0
    # half of what their mean may differ by, which need not be the usual one
    uneven = np.abs(steps - usual) > EVEN / 2 * usual
    edges = np.flatnonzero(uneven) + 1
    return [
        drain_current(t, v, circuit)
        for t, v in zip(np.split(time, edges), np.split(V_C1, edges), strict=True)
        if t.size >= 3
    ]


def _sliding_line(
    v: FloatArray, step: float, half: int
) -> tuple[FloatArray, FloatArray]:
    """Value and slope of the least-squares line over 2 `half` + 1 points.

    The ends use the line through the first and the last full window.
    """
    offsets = np.arange(-half, half + 1)
    mean_kernel = np.full(offsets.size, 1.0 / offsets.size)
    slope_kernel = offsets / (step * np.sum(offsets**2))
    inner_mean = np.convolve(v, mean_kernel, mode="valid")
    inner_slope = np.convolve(v, slope_kernel[::-1], mode="valid")
    slope = np.pad(inner_slope, half, mode="edge")
    mean = np.pad(inner_mean, half, mode="edge")
    ends = np.arange(1, half + 1) * step
    mean[:half] -= ends[::-1] * inner_slope[0]
    mean[v.size - half :] += ends * inner_slope[-1]
    return mean, slope
