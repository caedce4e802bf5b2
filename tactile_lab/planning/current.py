"""The current that plays a trial's force, and what the coil can follow of it.

The force becomes a current by the magnet's calibration, within what coil and source
can; that is then limited to what the coil can follow.
"""

from __future__ import annotations

import math

import numpy as np

from tactile_lab.bench import CoilLimits
from tactile_lab.errors import LimitError
from tactile_lab.instruments.registry import coil_capability
from tactile_lab.magnetics import Magnet
from tactile_lab.quantity import show
from tactile_lab.scene.bench_file import CoilSpec
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform

SHORT_OF = 0.01
"""Part of the peak by which the update grid may miss the waveform unmentioned."""

REVERSED = 1e-9
"""Current that counts as reversed, A."""


def wanted_current(trial: Trial, magnet: Magnet, coil: CoilSpec) -> Waveform:
    """The current that would play `trial` exactly, A against s from 0 to its length.

    Args:
        trial: its force, or its current where it asks for one.
        magnet: what force a current gives.
        coil: limits, and the source that plays it.

    Raises:
        LimitError: beyond the coil's limit, the compliance where the coil's resistance
            is given, the calibration, or a source that gives current of one sign.
        SceneError: there is no such source.
    """
    length, limit = trial.length, coil.limits.current
    source = coil_capability(coil)
    if trial.current is None:
        try:
            wanted = magnet.current_for(cut(trial.force, length), limit)
        except LimitError as reason:
            raise LimitError(f'trial "{trial.label}": {reason}') from reason
    else:
        wanted = cut(trial.current, length)
        if wanted.peak > limit * (1 + 1e-12):
            raise LimitError(
                f'trial "{trial.label}": current {show(wanted.peak, "A")} is '
                f"beyond the coil's limit of {show(limit, 'A')}."
            )
    if (told := _too_little_voltage(wanted.peak, coil.limits)) is not None:
        raise LimitError(f'trial "{trial.label}": {told}')
    if not source.bipolar and wanted.value.min() < -REVERSED:
        told = _one_sign(wanted, magnet, limit, source.title)
        raise LimitError(f'trial "{trial.label}": {told}')
    return wanted


def _too_little_voltage(peak: float, limits: CoilLimits) -> str | None:
    """Why `peak` A does not flow through the cold coil, or None."""
    if limits.resistance is None:
        return None
    needed = peak * limits.resistance
    if needed <= limits.compliance * (1 + 1e-9):
        return None
    most = limits.compliance / limits.resistance
    return (
        f"{show(peak, 'A')} through the coil's {show(limits.resistance, 'Ohm')} need "
        f"{show(needed, 'V')}, the compliance is {show(limits.compliance, 'V')}: at "
        f"most {show(most, 'A')} flow. Ask for less, or correct compliance or "
        "resistance in [coil.limits]."
    )


def _one_sign(wanted: Waveform, magnet: Magnet, limit: float, title: str) -> str:
    """Why a source that cannot reverse does not play `wanted`, A."""
    least = float(wanted.value.min())
    reach = sorted((0.0, *magnet.force([limit])))
    return (
        f"{show(float(magnet.force([least])[0]), 'N')} needs {show(least, 'A')}, and "
        f"{title} gives current of one sign only: forces from {show(reach[0], 'N')} to "
        f"{show(reach[-1], 'N')}. Ask for those, or use a four-quadrant source."
    )


def cut(wave: Waveform, length: float) -> Waveform:
    """`wave` from 0 to `length` s: held outside its points, jumps at both ends kept."""
    inside = (wave.time >= 0) & (wave.time <= length)
    time, value = wave.time[inside], wave.value[inside]
    if not time.size or time[0] > 0:
        time, value = np.r_[0.0, time], np.r_[wave.at(0.0), value]
    if time[-1] < length:
        time, value = np.r_[time, length], np.r_[value, wave.at(length)]
    return Waveform(time, value)


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
        wave = slewed(wave, slew, before)
    sampled, missed = _on_grid(wave, update_interval)
    if missed > SHORT_OF * max(wave.peak, 1e-12):
        warnings.append(
            f"detail shorter than one update of {show(update_interval, 's')} is lost, "
            f"up to {show(missed, 'A')}"
        )
        wave = sampled
    return wave, "; ".join(warnings) or None


def slewed(wave: Waveform, slew: float, before: float) -> Waveform:
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
    value = np.concatenate([wave.value[~inside], wave.at(grid)])
    sampled = Waveform.tidied(time[order], value[order])
    missed = np.abs(sampled.at(wave.time[inside]) - wave.value[inside])
    return sampled, float(missed.max())
