"""What the model expects of the circuit's voltages, and whether their channels see it.

A channel with ``auto_range`` is given a wider range where it would not.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SolverError
from tactile_lab.planning.timeline import Timeline
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.scope import Channel
from tactile_lab.waveform import Waveform

NODES = ("V_C1", "V_C2", "V_K")
"""Voltages of the circuit between 0 V and its supply."""

GRID = 4000
"""Points at which the model is looked at, and those after each bend of the force."""

STEPS = 4
"""Into so many steps the time constant of node A is divided after a bend."""

AFTER = (0, 2, 4, 8, 16)
"""Steps after a bend at which the model is looked at: V_C1 has one extremum at most
between two bends, and not much later than the first."""

SPARE = 1 / 127
"""Part of a range, one code of 8 bits, that should be left at either end."""

PEAKS = 3.0
"""Standard deviations of noise that a range should hold."""


@dataclass(frozen=True, eq=False)
class Seen:
    """What the model gives a signal.

    Attributes:
        low, high: least and largest value, V.
        sampled: at even times of what is streamed, shape (n,), V.
        swing: how far a simulated bench's noise and hum take it beyond, V.
    """

    low: float
    high: float
    sampled: FloatArray
    swing: float = 0.0

    def outside(self, channel: Channel) -> float:
        """Part of the samples that lie beyond the range of their channel."""
        low, high = channel.span
        values = self.sampled
        return float(np.mean((values < low) | (values > high))) if values.size else 0.0


Expected = Mapping[str, Seen]
"""By the signal's name."""


def expected(scene: Scene, channels: Sequence[Channel], drive: Timeline) -> Expected:
    """What the model expects of V_C1 and V_C2 on DC-coupled channels, V.

    A sensor that fires where the model does not takes V_C2 from 0 V up to the voltage
    it fires at: that is always expected. Empty where the model cannot tell.
    """
    names = [
        channel.signal
        for channel in channels
        if channel.signal in ("V_C1", "V_C2") and channel.coupling == "DC"
    ]
    if not names or scene.protocol.moves_probes or scene.protocol.sets:
        return {}
    from tactile_lab.model.slices import Samples
    from tactile_lab.planning.preview import in_slices

    until = drive.duration
    time = _looked_at(drive.force, until, scene.circuit.tau_A)
    looked = [Samples(name, time, until) for name in names]
    try:
        for part in in_slices(scene, drive.force, until, names):
            for samples in looked:
                samples.take(part)
    except SolverError:
        return {}
    seen = zip(names, (samples.value for samples in looked), strict=True)
    even = np.linspace(0.0, until, GRID)
    streamed = drive.streams_at(even)
    swings = {one.signal: _swing(scene, one) for one in channels}
    told = {
        name: Seen(float(v.min()), float(v.max()), v[:GRID][streamed], swings[name])
        for name, v in seen
    }
    if (fires := told.get("V_C2")) is not None:
        high = max(fires.high, scene.circuit.fire_voltage)
        told["V_C2"] = replace(fires, low=min(fires.low, 0.0), high=high)
    return told


def _swing(scene: Scene, channel: Channel) -> float:
    """How far noise and hum at the scope's input take a signal beyond the model's."""
    if not scene.bench.simulated:
        return 0.0
    noise = scene.simulated.noise.get(channel.signal, 0.0)
    return abs(channel.scale) * (scene.simulated.hum + PEAKS * noise)


def _looked_at(force: Waveform, until: float, tau: float) -> FloatArray:
    """Where extremes may lie, s; a list bends more often than `tau`."""
    step = tau / STEPS
    bends = np.unique(np.rint(force.time / step))
    after = np.unique(np.add.outer(bends, AFTER)) * step
    even = np.linspace(0.0, until, GRID)
    return np.concatenate([even, after[(after >= 0.0) & (after <= until)]])


def fitted(channel: Channel, seen: Expected, ranges: Sequence[float]) -> Channel:
    """The channel, with the least wider range that sees what is expected of it.

    Args:
        channel: as the bench file has it; unchanged unless it says ``auto_range``.
        seen: what is expected.
        ranges: that the scope has, V.
    """
    if not channel.auto_range or channel.signal not in seen:
        return channel
    wider = (replace(channel, range=r) for r in sorted(ranges) if r > channel.range)
    choices = (channel, *wider)
    fits = (c for c in choices if _sees(c, seen[c.signal], SPARE * c.range))
    return next(fits, choices[-1])


def widened(channel: Channel, supply: float, ranges: Sequence[float]) -> Channel:
    """A voltage channel that sees all from 0 V to the supply, with a margin of 10 %."""
    if channel.signal not in NODES:
        return channel
    middle = supply / 2 / channel.scale
    enough = [r for r in ranges if r >= 1.2 * abs(middle)]
    chosen = min(enough) if enough else max(ranges)
    return replace(channel, range=chosen, offset=-middle, coupling="DC")


def beyond(channels: Sequence[Channel], seen: Expected) -> Iterator[str]:
    """A warning for each channel that is expected to leave its range."""
    for channel in channels:
        if channel.signal not in seen or _sees(channel, seen[channel.signal]):
            continue
        (low, high), one = channel.span, seen[channel.signal]
        and_more = f", noise and hum {show(one.swing, 'V')} more" if one.swing else ""
        yield (
            f"{channel.signal} will leave its channel's range, {show(low, 'V')} to "
            f"{show(high, 'V')}: the model has {show(one.low, 'V')} to "
            f"{show(one.high, 'V')}{and_more}. Change range or offset "
            "in the bench file, or let auto_range = true choose."
        )


def _sees(channel: Channel, seen: Seen, spare: float = 0.0) -> bool:
    low, high = channel.span
    spare = max(spare * abs(channel.scale), seen.swing)
    return low + spare <= seen.low and seen.high <= high - spare
