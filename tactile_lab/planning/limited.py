"""What the coil makes of a current waveform it cannot follow."""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.quantity import show
from tactile_lab.waveform import Waveform

SHORT_OF = 0.01
"""Part of the peak by which the update grid may miss the waveform unmentioned."""


def limited(
    wave: Waveform, slew: float, update_interval: float, before: float | None = None
) -> tuple[Waveform, str | None]:
    """`wave` as the coil plays it, and a warning where that is not `wave` itself.

    The current follows as fast as the slew limit lets it; detail finer than the update
    grid is sampled on that grid. Corners of an otherwise slow waveform stay: they are
    off by at most one update.

    Args:
        wave: current, A, from time 0 s.
        slew: largest rate of change, A/s.
        update_interval: time between two set-points, s.
        before: current just before time 0, A; None for the wave's own first value.
    """
    before = float(wave.value[0]) if before is None else before
    warnings = []
    steepest = wave.steepest
    if wave.value[0] != before:
        steepest = math.inf
    if steepest > slew * (1 + 1e-9):
        asked = "a jump" if math.isinf(steepest) else f"{steepest:.3g} A/s"
        warnings.append(f"{asked} asked, {slew:g} A/s is the slew limit")
        wave = _slewed(wave, slew, before)
    sampled, missed = _on_grid(wave, update_interval)
    if missed > SHORT_OF * max(wave.peak, 1e-12):
        warnings.append(
            f"detail shorter than one update of {show(update_interval, 's')} is lost, "
            f"up to {show(missed, 'A')}"
        )
        wave = sampled
    return wave, "; ".join(warnings) or None


def _slewed(wave: Waveform, slew: float, before: float) -> Waveform:
    """The nearest waveform that starts at `before` and never exceeds the slew."""
    now, value = wave.start, before
    points = [(now, value)]
    for t0, t1, v0, v1 in wave.segments():
        if t1 == t0:
            continue
        slope = (v1 - v0) / (t1 - t0)
        behind = v0 + slope * (now - t0) - value
        if behind != 0:
            way = math.copysign(slew, behind)
            closing = abs(way - slope) if (way - slope) * behind > 0 else 0.0
            caught = now + abs(behind) / closing if closing > 0 else math.inf
            if caught >= t1:
                now, value = t1, value + way * (t1 - now)
                points.append((now, value))
                continue
            now, value = caught, v0 + slope * (caught - t0)
            points.append((now, value))
        if abs(slope) <= slew * (1 + 1e-9):
            now, value = t1, v1
        else:
            now, value = t1, value + math.copysign(slew, slope) * (t1 - now)
        points.append((now, value))
    # the last value holds for ever, so it is reached in the end
    behind = float(wave.value[-1]) - value
    if behind != 0:
        points.append((now + abs(behind) / slew, float(wave.value[-1])))
    return Waveform.through(points)


def _on_grid(wave: Waveform, interval: float) -> tuple[Waveform, float]:
    """`wave` with runs of points closer than `interval` sampled on the grid."""
    gaps = np.diff(wave.time)
    close = (gaps < interval) & (np.diff(wave.value) != 0)
    # a run is two or more short pieces in a row: one alone has nothing inside to lose
    inside = np.zeros(wave.time.size, dtype=bool)
    inside[1:-1] = close[1:] & close[:-1]
    if not inside.any():
        return wave, 0.0
    ticks = np.arange(
        math.ceil(wave.start / interval), math.floor(wave.end / interval) + 1
    )
    grid = ticks * interval
    left = np.clip(np.searchsorted(wave.time, grid, side="right") - 1, 0, gaps.size - 1)
    grid = grid[
        (close & (np.r_[False, inside[1:-1]] | np.r_[inside[1:-1], False]))[left]
    ]
    time = np.concatenate([wave.time[~inside], grid])
    order = np.argsort(time, kind="stable")
    value = np.concatenate([wave.value[~inside], wave.at(grid)])[order]
    time = time[order]
    keep = np.ones(time.size, dtype=bool)
    keep[1:] = (np.diff(time) > 0) | (np.diff(value) != 0)
    keep[1:-1] &= (time[2:] != time[1:-1]) | (time[1:-1] != time[:-2])
    sampled = Waveform(time[keep], value[keep])
    missed = np.abs(sampled.at(wave.time[inside]) - wave.value[inside])
    return sampled, float(missed.max())
