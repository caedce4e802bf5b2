"""Compiled kernels that turn piecewise-linear voltages into a converter's codes.

Every sample is computed from its own index alone, never from its neighbour, so a
block's edges cannot change a code. Values are in converter steps here: the caller has
folded range, attenuation and offset into the pieces.
"""

from __future__ import annotations

from functools import partial

import numba
import numpy as np
from numpy.typing import NDArray

from tactile_lab.code_cache import kept

TILE_BITS = 14
"""Noise is laid out in tiles of 2**14 samples, each at its own place in the table."""
TABLE_BITS = 17
"""The noise table has 2**17 different places for a tile to begin."""
NOISE_UNIT = 4096.0
"""Table entries per standard deviation."""

_TILE = 1 << TILE_BITS
_PLACES = (1 << TABLE_BITS) - 1
_FAR = 1.0e6


def noise_table(seed: int) -> NDArray[np.int16]:
    """Normal deviates times `NOISE_UNIT`, as many as the kernels can reach."""
    count = (1 << TABLE_BITS) + _TILE
    deviates = np.random.default_rng(seed).standard_normal(count)
    return np.rint(deviates * NOISE_UNIT).clip(-32768, 32767).astype(np.int16)


@numba.njit(nogil=True)
def _place(key, tile, which):  # type: ignore[no-untyped-def]
    """Where in the table a tile begins (splitmix64 of key, tile and which of two)."""
    z = np.uint64(key) + np.uint64(2 * tile + which + 1) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    z = z ^ (z >> np.uint64(31))
    return np.int64(z & np.uint64(_PLACES))


@numba.njit(nogil=True)
def _sine(turns):  # type: ignore[no-untyped-def]
    """sin(2 pi turns) to 6e-6, by a polynomial that vectorises."""
    x = turns - np.rint(turns)
    y = x * x
    z = 81.36681329 + y * (-74.4779924 + y * 32.78137662)
    return x * (6.2830558 + y * (-41.33121419 + y * z))


@numba.njit(nogil=True)
def _piece(start, t):  # type: ignore[no-untyped-def]
    """The last piece that starts at or before t, by bisection; at least the first."""
    low, high = 0, start.size
    while high - low > 1:
        middle = (low + high) >> 1
        if start[middle] <= t:
            low = middle
        else:
            high = middle
    return low


@numba.njit(nogil=True)
def _step(x):  # type: ignore[no-untyped-def]
    """Nearest converter step, bounded so that the integer always exists."""
    return np.int32(np.rint(min(max(x, -_FAR), _FAR)))


@numba.njit(nogil=True)
def _line(  # type: ignore[no-untyped-def]
    codes, k, started, interval, t0, v0, slope, noise1, noise2, scale, hum, mains,
    limit, shift,
):  # fmt: skip
    """Codes of samples k, k + 1, ... along one piece; the largest step magnitude."""
    highest = np.int32(0)
    for i in range(codes.size):
        t = started + (k + i) * interval
        x = v0 + (t - t0) * slope
        x += scale * (np.int32(noise1[i]) + np.int32(noise2[i]))
        if hum != 0.0:
            x += hum * _sine(t * mains)
        step = _step(x)
        highest = max(highest, abs(step))
        codes[i] = np.int16(min(max(step, -limit), limit) << shift)
    return highest


@partial(
    kept,
    signature="int64(int16[::1], int64, float64, float64, float64[::1], float64[::1],"
    "float64[::1], int16[::1], int64, float64, float64, float64, int32, int32)",
    nogil=True,
)
def digitise(  # type: ignore[no-untyped-def]
    codes, first, started, interval, start, value, slope, noise, key, scale, hum, mains,
    limit, shift,
):  # fmt: skip
    """Fill `codes` with samples first, first + 1, ... of a piecewise-linear input.

    Args:
        codes: shape (n,), written.
        first: index of the first sample; sample k is taken at started + k interval.
        started: s.
        interval: s.
        start: shape (m,), starts of the pieces, s, the first not after the first
            sample.
        value: shape (m,), converter steps at each start.
        slope: shape (m,), converter steps per s.
        noise: what `noise_table` made.
        key: selects this channel's sequence of places in the table.
        scale: converter steps per unit of the sum of two table entries.
        hum: amplitude of the mains hum, converter steps.
        mains: its frequency, Hz.
        limit: largest step; beyond it the converter clips.
        shift: low bits of a code that stay 0.

    Returns:
        The largest step magnitude before clipping.
    """
    n = codes.size
    pieces = start.size
    mask = _TILE - 1
    highest = np.int32(0)
    j = _piece(start, started + np.float64(first) * interval)
    k = 0
    while k < n:
        index = first + k
        tile = index >> TILE_BITS
        end = min(n, ((tile + 1) << TILE_BITS) - first)
        if j + 1 < pieces:
            until = start[j + 1]
            # the estimate may be off by rounding; what decides is the sample's time
            e = np.int64((until - started) / interval) - first
            e = min(max(e, k), end)
            while e > k and started + np.float64(first + e - 1) * interval >= until:
                e -= 1
            while e < end and started + np.float64(first + e) * interval < until:
                e += 1
            if e == k:
                j += 1
                continue
            end = e
        at = index & mask
        one, two = _place(key, tile, 0) + at, _place(key, tile, 1) + at
        count = end - k
        found = _line(
            codes[k:end], np.float64(index), started, interval, start[j], value[j],
            slope[j], noise[one : one + count], noise[two : two + count], scale, hum,
            mains, limit, shift,
        )  # fmt: skip
        highest = max(highest, found)
        k = end
    return highest


@partial(
    kept,
    signature="int64(int16[::1], int64, float64, float64, float64[::1], float64[::1],"
    "float64[::1], int16[::1], int64, float64, float64, float64, int32, int32,"
    "float64[::1], float64[::1], float64)",
    nogil=True,
)
def add_pulses(  # type: ignore[no-untyped-def]
    codes, first, started, interval, start, value, slope, noise, key, scale, hum, mains,
    limit, shift, pulse_times, pulse, pulse_step,
):  # fmt: skip
    """Write again the samples of `codes` that lie within a pulse.

    Args as `digitise`, and:
        pulse_times: shape (p,), ascending, s; all whose pulse reaches into `codes`.
        pulse: shape (q,), converter steps at pulse_step, 2 pulse_step, ... from 0 s.
        pulse_step: s.

    Returns:
        The largest step magnitude before clipping among these samples.
    """
    n = codes.size
    last = pulse.size - 1
    length = last * pulse_step
    highest = np.int32(0)
    oldest = 0
    done = 0
    for p in range(pulse_times.size):
        # one sample early and late: what decides is the sample's time
        k = max(done, np.int64((pulse_times[p] - started) / interval) - first - 1)
        k_end = np.int64((pulse_times[p] + length - started) / interval) - first + 2
        k_end = min(n, k_end)
        while k < k_end:
            index = first + k
            t = started + np.float64(index) * interval
            while oldest < p and pulse_times[oldest] + length <= t:
                oldest += 1
            x = 0.0
            for q in range(oldest, pulse_times.size):
                since = (t - pulse_times[q]) / pulse_step
                if since < 0.0:
                    break
                cell = np.int64(since)
                if cell < last:
                    part = since - cell
                    x += pulse[cell] + part * (pulse[cell + 1] - pulse[cell])
            j = _piece(start, t)
            x += value[j] + (t - start[j]) * slope[j]
            tile = index >> TILE_BITS
            at = index & (_TILE - 1)
            one, two = _place(key, tile, 0) + at, _place(key, tile, 1) + at
            x += scale * (np.int32(noise[one]) + np.int32(noise[two]))
            if hum != 0.0:
                x += hum * _sine(t * mains)
            step = _step(x)
            highest = max(highest, abs(step))
            codes[k] = np.int16(min(max(step, -limit), limit) << shift)
            k += 1
        done = max(done, k)
    return highest
