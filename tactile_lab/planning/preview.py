"""The model of a planned scene: only what the scene asks for."""

from __future__ import annotations

from collections.abc import Sequence

from tactile_lab.model.simulate import Result, Start, simulate
from tactile_lab.scene.scene import Scene
from tactile_lab.waveform import Waveform

DEFAULT_TOLERANCE = 1e-9


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
    start = scene.start
    return simulate(
        scene.circuit,
        force,
        keep=tuple(keep),
        until=duration,
        start=None
        if start is None
        else Start(V_P=start.V_P, V_C1=start.V_C1, V_C2=start.V_C2),
        tolerance=tolerance,
    )
