"""How well a run's samples will be dated against the force."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from tactile_lab.analysis.estimate import Z95
from tactile_lab.arrays import FloatArray
from tactile_lab.instruments.registry import coil_capability
from tactile_lab.planning.estimate import resolution
from tactile_lab.planning.needs import Needs
from tactile_lab.planning.timeline import Timeline
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.store.applied import (
    ENOUGH,
    TOO_NOISY,
    VISIBLE,
    VISIBLE_CODES,
    edge_band,
)
from tactile_lab.store.shunt import BIN_TIME


def clocks(scene: Scene, needed: Needs, drive: Timeline) -> Iterator[str]:
    """Where the shunt does not date the coil's set-points to a bin, and what then does.

    Of a real bench neither hum nor noise is known beforehand.
    """
    source = scene.bench.coil
    seen = {channel.signal: channel for channel in needed.channels}
    if source is None or not needed.coil or not seen or not drive.drives:
        return
    exchange = coil_capability(source).update_interval
    by_host = (
        "spikes and voltages are dated against the force within "
        f"{show(exchange, 's')}, an exchange with the source"
    )
    finest = max(BIN_TIME, 1 / scene.record.sample_rate)
    shunt = seen.get("coil_current")
    if shunt is None:
        yield (
            f"clocks: without coil_current in record.signals, {by_host}; with it "
            f"within {show(finest, 's', 2)}, or as well as its edges agree"
        )
        return
    if any(s.drive is not None and s.drive.points is not None for s in drive.steps):
        return
    sizes = _set_points(drive, exchange)
    noise = _noise(scene, abs(shunt.scale))
    codes = VISIBLE_CODES * resolution(scene, shunt)
    visible = max(VISIBLE, codes)
    lag = scene.bench.magnet.coil_lag
    bands = [
        band
        for size in sizes[sizes >= visible]
        if (band := edge_band(noise, size, lag)) is not None
    ]
    if len(bands) < ENOUGH:
        least = max(visible, Z95 * noise / TOO_NOISY)
        yield (
            f"clocks: the shunt shows {len(bands)} of the source's steps, which are "
            f"{show(float(sizes.max(initial=0.0)), 'A', 3)} at most: it shows those "
            f"above {show(least, 'A', 2)}"
            + (", by its noise and hum" if least > visible else "")
            + (", two of its codes" if least == codes else "")
            + f", and {ENOUGH} are needed. So {by_host}"
        )
    elif (band := math.sqrt(float(np.mean(np.square(bands))))) > finest:
        yield (
            "clocks: noise and hum of the shunt date spikes and voltages against the "
            f"force within {show(band, 's', 2)}, not {show(finest, 's', 2)}"
        )


def _set_points(drive: Timeline, exchange: float) -> FloatArray:
    """Sizes of the steps that a source gives which is set every `exchange` s, A."""
    found = [np.empty(0)]
    for step in drive.steps:
        if step.current is not None:
            end = step.trial.length + exchange
            found.append(np.diff(step.current.at(np.arange(0, end, exchange))))
    sizes = np.abs(np.concatenate(found))
    return sizes[sizes > 0]


def _noise(scene: Scene, scale: float) -> float:
    """Standard deviation of a bin of the simulated coil current, A; 0 on a real one."""
    if not scene.bench.simulated:
        return 0.0
    world, rate = scene.simulated, scene.record.sample_rate
    white = world.noise.get("coil_current", 0.0) / math.sqrt(max(1, rate * BIN_TIME))
    return scale * math.hypot(white, world.hum / math.sqrt(2))
