"""What a run will cost: time, samples, disk, current, heat, and how finely it sees."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.bench import CoilLimits
from tactile_lab.instruments.registry import coil_capability, scope_capability
from tactile_lab.planning.heat import cool_down, heat_along
from tactile_lab.planning.needs import Needs
from tactile_lab.planning.outcome import Step
from tactile_lab.planning.ranges import Expected
from tactile_lab.planning.timeline import Timeline
from tactile_lab.scene.scene import Scene
from tactile_lab.scope import Channel, ScopeCapability
from tactile_lab.trial import BASELINE
from tactile_lab.waveform import Waveform

OF_NOISE, FALLS, GROWS = 0.46, 0.7, 1 / 8
"""Bytes that a code takes once compressed: 0.46 with one code of noise, which fall with
the noise as its power of 0.7, and grow by a bit as it doubles (measured from 0.05 codes
to 40, within a quarter)."""
OF_BLOCKS = 0.009
"""Bytes of it that take the blocks of codes that are all alike (measured)."""
UNKNOWN_NOISE = 1.0
"""Codes, of a channel on a real bench."""
REPORT = 0.5e6, 3.5e6
"""Bytes that tables, figures and report take in a short run, least and most (measured:
0.6 MB of one trial without spikes, 3.4 MB of `bipolar`)."""
PYRAMID = 6 / 512
"""Bytes of extremes and sums for each stored sample."""
REWRITTEN = 0.5
"""Time whose samples are written again, s, where streaming stops and goes on: chunks of
0.25 s that were not full (measured: 140 kB a channel at 1 MS/s)."""
SWITCHED_ON = 4.5
"""Intervals between two set-points that it takes to switch the coil on as samples are
taken already (measured: 4.5 of a Kepco)."""
BLIND = 0.03
"""Time from one record to the next of a scope with gaps, s (measured: 0.02 to 0.04)."""
NARROW = 8
"""Bits of a converter up to which a code is stored in one byte, else in two."""


@dataclass(frozen=True, kw_only=True)
class Cost:
    """What running a scene takes; SI units.

    Attributes:
        duration: of the experiment, s, from the first sample on.
        streamed: part of it during which samples are taken, s.
        trials: how many.
        samples_per_channel: taken of each enabled channel.
        samples_stored: of all stored channels together.
        disk_raw: bytes of samples before compression.
        packed: bytes of the samples of each stored channel, compressed.
        disk_beside: bytes that the rest takes, least and most.
        peak_force, peak_current: largest magnitudes, N and A.
        heat, heat_budget: largest leaky I^2 t and what is allowed, A^2 s.
        cool_down: time after the run until the coil counts as cold, s.
        update_interval: time between two set-points of the coil, s; None where no
            coil is opened.
        step_current, step_force: largest change from one set-point to the next, A, N.
        resolution: one code of each enabled channel, in the signal's unit.
    """

    duration: float
    streamed: float
    trials: int
    samples_per_channel: int
    samples_stored: int
    disk_raw: int
    packed: dict[str, float]
    disk_beside: tuple[int, int]
    peak_force: float
    peak_current: float
    heat: float
    heat_budget: float
    cool_down: float
    update_interval: float | None
    step_current: float
    step_force: float
    resolution: dict[str, float]

    @property
    def disk(self) -> int:
        """Bytes of all samples, compressed."""
        return round(sum(self.packed.values()))


def estimate(scene: Scene, needed: Needs, drive: Timeline) -> Cost:
    """What running `scene` takes."""
    coil, current = scene.bench.coil, drive.current
    assert current is not None
    interval = None
    if needed.coil and coil is not None:
        interval = coil_capability(coil).update_interval
    limits = CoilLimits() if coil is None else coil.limits
    left, heat, _ = heat_along(current, limits)
    first = BASELINE + (0.0 if interval is None else SWITCHED_ON * interval)
    rests = [first] + [BASELINE] * (round(drive.rests / BASELINE) - 1)
    trials = [s.trial.length for s in drive.steps if not s.trial.pause]
    streamed, samples = _sampled(scene, needed, np.array(rests + trials))
    stored = samples * len(needed.stored)
    each = {c.signal: packed(scene, c, needed.expected) for c in needed.channels}
    each = {name: each[name] for name in needed.stored}
    breaks = sum(_stops_stream(step) for step in drive.steps) if stored else 0
    again = REWRITTEN * scene.record.sample_rate * sum(each.values())
    most = REPORT[1] + PYRAMID * stored + breaks * again
    step = 0.0 if interval is None else largest_step(current, interval)
    return Cost(
        duration=drive.duration - drive.streamed + streamed,
        streamed=streamed,
        trials=len(drive.steps),
        samples_per_channel=samples,
        samples_stored=stored,
        disk_raw=stored * _width(scene) if stored else 0,
        packed={name: samples * size for name, size in each.items()},
        disk_beside=(round(REPORT[0] + PYRAMID * stored), round(most)),
        peak_force=drive.force.peak,
        peak_current=current.peak,
        heat=heat,
        heat_budget=limits.heat,
        cool_down=cool_down(left, limits),
        update_interval=interval,
        step_current=step,
        step_force=step * abs(scene.bench.magnet.newtons_per_ampere),
        resolution={c.signal: resolution(scene, c) for c in needed.channels},
    )


def _stops_stream(step: Step) -> bool:
    """Whether nothing is streamed in a step, or before it while a list is loaded."""
    return step.trial.pause or (step.drive is not None and step.drive.load > 0)


def resolution(scene: Scene, channel: Channel) -> float:
    """One code of the scope's converter on that channel, in the signal's unit."""
    return channel.range / _scope(scene).codes * abs(channel.scale)


def _sampled(scene: Scene, needed: Needs, stretches: FloatArray) -> tuple[float, int]:
    """Time that samples are taken for stretches of a run, s, and those of a channel.

    Where a scope takes records with gaps between them, each stretch lasts until the
    record is there that has its end.
    """
    rate, number = scene.record.sample_rate, len(needed.channels)
    time = float(stretches.sum())
    if not number:
        return time, 0
    record = _scope(scene).record
    if record is None:
        return time, round(time * rate)
    lasts, samples = record(1 / rate, number)
    records = int(np.ceil(stretches / (lasts + BLIND)).sum())
    return records * (lasts + BLIND), records * samples


def packed(scene: Scene, channel: Channel, expected: Expected) -> float:
    """Bytes of one code of a channel, compressed: what its noise leaves of them.

    Beyond the channel's range all codes are alike.
    """
    noise = UNKNOWN_NOISE
    if scene.bench.simulated:
        volts = scene.simulated.noise.get(channel.signal, 0.0)
        noise = volts / channel.range * _scope(scene).codes
    more = GROWS * math.log2(max(1.0, noise))
    size = OF_NOISE * math.pow(min(1.0, noise), FALLS) + more
    if (seen := expected.get(channel.signal)) is not None:
        size *= 1 - seen.outside(channel)
    return min(float(_width(scene)), OF_BLOCKS + size)


def _width(scene: Scene) -> int:
    """Bytes of one code as it is stored."""
    return 1 if _scope(scene).bits <= NARROW else 2


def _scope(scene: Scene) -> ScopeCapability:
    """What the scope can of a scene that has a channel."""
    assert scene.bench.scope is not None
    return scope_capability(scene.bench.scope)


def largest_step(wave: Waveform, interval: float) -> float:
    """Largest change of `wave` within `interval` s, wherever the update grid lies.

    A piecewise-linear wave changes most between two instants of which one is a point
    of it.
    """
    before = np.concatenate([wave.time, wave.time - interval])
    left = np.nextafter(wave.time, -np.inf)  # the value just before a jump
    before = np.concatenate([before, left])
    change = np.abs(wave.at(before + interval) - wave.at(before))
    return float(change.max(initial=0.0))
