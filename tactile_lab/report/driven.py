"""What drove the sensor in a run on disk: the coil current, and the force it gives."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.applied import AppliedCurrent, applied_current
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.store.layout import BIN
from tactile_lab.store.run import Run
from tactile_lab.waveform import Waveform

FloatArray = NDArray[np.float64]

EDGE = 5e-4
"""Bins of the shunt to find edges in, s."""


def applied_in(run: Run) -> AppliedCurrent:
    """The coil current: levels as read back, edges where the shunt saw them."""
    rows, shunt = run.current, None
    if "coil_current" in run.signals:
        signal = run.signal("coil_current")
        # whole bins of the run's pyramid where they are fine enough
        together = min(BIN, max(1, round(EDGE / signal.interval)))

        def shunt(start: float, end: float) -> tuple[FloatArray, FloatArray]:
            part = signal.between(start, end)
            cells = max(1, (part.stop - part.start) // together)
            seen = signal.envelope(part.start, part.stop, cells=cells)
            step = np.diff(seen.time[-2:]) if seen.time.size > 1 else 0.0
            return seen.time[:-1] + step / 2, seen.mean[:-1]  # the last may be short

    return applied_current(rows["time"], rows["setpoint"], rows["measured"], shunt)


def told(applied: AppliedCurrent) -> tuple[str, ...]:
    """Where the coil current came from, and whether shunt and source agree."""
    steps = len(applied.steps)
    if steps < 2:
        return ()
    said = (
        f"coil current: levels as the source read them back, {applied.edges} of "
        f"{steps - 1} steps timed by the shunt"
    )
    if applied.lead and applied.edges < steps - 1:
        said += f", the others moved alike ({show(applied.lead, 's', 2)} earlier)"
    ratio = applied.shunt_over_source
    if ratio is not None:
        said += (
            f"; averaged over each level the shunt reads {ratio.value:.4g} "
            f"({ratio.low:.4g} to {ratio.high:.4g}) of the source"
        )
    return (said,)


def force_of(scene: Scene, current: NDArray[np.float64], end: float) -> Waveform:
    """Force the applied current gives: each set-point holds until the next.

    Before the first one the coil carries nothing: a run begins with the coil off.
    """
    if len(current) == 0:
        return Waveform.constant(0.0)
    if current[0, 0] > 0:  # the first may come late, and be no small one
        current = np.concatenate([[[0.0, 0.0]], current])
    time, amperes = current[:, 0], current[:, 1]
    steps = np.repeat(time, 2)[1:]
    held = np.repeat(amperes, 2)[:-1]
    steps, held = np.append(steps, max(end, steps[-1])), np.append(held, held[-1])
    distinct = np.ones(steps.size, dtype=bool)
    distinct[1:-1] = (steps[2:] != steps[1:-1]) | (steps[1:-1] != steps[:-2])
    wave = Waveform(steps[distinct], held[distinct])
    return scene.bench.magnet.force_for(wave, beyond="hold")
