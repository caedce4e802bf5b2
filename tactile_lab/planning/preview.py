"""The model of a planned scene: only what the scene asks for."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_lab.model.simulate import Result, simulate
from tactile_lab.scene.scene import Scene
from tactile_lab.signals import BENCH_ONLY
from tactile_lab.waveform import Waveform

DEFAULT_TOLERANCE = 1e-9


def modelled(scene: Scene) -> list[str]:
    """Recorded signals that the model knows."""
    return [name for name in scene.record.signals if name not in BENCH_ONLY]


def model(
    scene: Scene,
    force: Waveform,
    duration: float,
    keep: Sequence[str],
    tolerance: float = DEFAULT_TOLERANCE,
) -> Result:
    """The scene's circuit under `force` (N), from the scene's start, for `duration` s.

    Raises:
        ParameterError: the tolerance cannot be asked for.
        SolverError: the model cannot answer to that tolerance.
    """
    return simulate(
        scene.circuit,
        force,
        keep=tuple(keep),
        until=duration,
        start=scene.start,
        tolerance=tolerance,
    )
