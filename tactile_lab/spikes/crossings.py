"""The compiled loop of spike detection: a state machine that skips quiet blocks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.code_cache import kept

Codes = NDArray[np.int16]
Spikes = NDArray[Any]

COARSE, FINE = 1024, 64
"""Samples in the blocks whose extreme is looked at first."""

UNARMED, ARMED, INSIDE, IGNORED = 0, 1, 2, 3
"""Modes: waiting for release, waiting for a crossing, in a spike, in a refused one."""

MODE, PREVIOUS, PEAK = 0, 1, 2
"""Integer state kept between blocks."""

UP, DOWN, LAST = 0, 1, 2
"""Float state kept between blocks: crossings, and the last accepted spike."""


def _compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile without the GIL, so that detection runs beside the recorder."""
    compiled: Callable[..., Any] = kept(function, nogil=True)
    return compiled


@njit(inline="always")
def _largest(codes: Codes) -> Any:
    """Largest code.

    Plain loops over a slice of their own are what the compiler turns into SIMD: an
    iterator, the built-in `max` or a range of the parent array each cost a factor 5.
    """
    top = codes[0]
    for i in range(codes.size):
        if codes[i] > top:
            top = codes[i]
    return top


@njit(inline="always")
def _smallest(codes: Codes) -> Any:
    """Smallest code; see `_largest`."""
    low = codes[0]
    for i in range(codes.size):
        if codes[i] < low:
            low = codes[i]
    return low


@njit(inline="always")
def _quiet(codes: Codes, sign: int, threshold: int) -> bool:
    """Whether no code reaches the threshold."""
    if sign > 0:
        return bool(_largest(codes) < threshold)
    return bool(_smallest(codes) > -threshold)


@_compiled
def scan(
    codes: Codes,
    begin: int,
    first: int,
    sign: int,
    threshold: int,
    release: int,
    refractory: int,
    state: NDArray[np.int64],
    times: FloatArray,
    found: Spikes,
) -> tuple[int, int]:
    """Run the machine from `begin`; return (samples done, spikes found).

    Thresholds are for sign * code. Stops early when `found` is full.
    """
    n = codes.size
    count = 0
    i = coarse = fine = begin
    mode, previous, peak = state[MODE], state[PREVIOUS], state[PEAK]
    while i < n:
        if mode == ARMED:
            # nothing can happen in a block that stays below threshold: skip it whole
            if i >= coarse:
                while n - i >= COARSE and _quiet(
                    codes[i : i + COARSE], sign, threshold
                ):
                    i += COARSE
                    previous = sign * np.int64(codes[i - 1])
                coarse = i + COARSE
            if i >= fine:
                while (
                    i < coarse
                    and n - i >= FINE
                    and _quiet(codes[i : i + FINE], sign, threshold)
                ):
                    i += FINE
                    previous = sign * np.int64(codes[i - 1])
                fine = i + FINE
                if i >= coarse:
                    fine = i
                    continue
            if i == n:
                break
        code = sign * np.int64(codes[i])
        if mode == INSIDE:
            peak = max(peak, code)
            if code < threshold and previous >= threshold:
                part = (previous - threshold) / (previous - code)
                times[DOWN] = float(first + i - 1) + part
            if code <= release:
                found[count].sample = times[UP]
                found[count].amplitude = sign * peak
                found[count].width = times[DOWN] - times[UP]
                count += 1
                mode = ARMED
        elif mode == ARMED:
            if code >= threshold:
                up = float(first + i - 1) + (threshold - previous) / (code - previous)
                if up - times[LAST] >= refractory:
                    mode, peak = INSIDE, code
                    times[UP] = times[LAST] = up
                else:
                    mode = IGNORED
        elif code <= release:
            mode = ARMED
        previous = code
        i += 1
        if count == found.size:
            break
    state[MODE], state[PREVIOUS], state[PEAK] = mode, previous, peak
    return i, count
