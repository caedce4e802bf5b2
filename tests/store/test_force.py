"""What drove a run, from what was recorded of its coil."""

import numpy as np

from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform


def test_before_the_first_set_point_the_coil_carries_nothing() -> None:
    """Even where the first ones came late and were skipped."""
    scene = load("demo")
    steps = np.array([[0.44, 0.157], [0.5, 0.246], [2.6, 0.0]])
    force = scene.bench.magnet.force_for(Waveform.stairs(steps, 3.0), beyond="hold")
    full = scene.bench.magnet.newtons_per_ampere
    seen = force.at(np.array([0.0, 0.43, 0.45, 1.0, 2.9]))
    assert np.allclose(seen, full * np.array([0, 0, 0.157, 0.246, 0]), atol=1e-4)


def test_without_any_set_point_there_is_no_force() -> None:
    current = Waveform.stairs(np.empty((0, 2)), 3.0)
    force = load("demo").bench.magnet.force_for(current, beyond="hold")
    assert force.at(np.array([1.0])) == 0.0
