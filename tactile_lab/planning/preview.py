"""The model of a planned scene: only what the scene asks for."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from tactile_lab.errors import SceneError
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.scene.scene import Scene
from tactile_lab.signals import BENCH_ONLY
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.model.solution import Solution

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

    Args:
        scene: whose circuit.
        force: N.
        duration: s.
        keep: what is wanted.
        tolerance: of spike times, s, and V_C1, V.

    Raises:
        SceneError: its protocol sets voltages from trial to trial.
        ParameterError: the tolerance cannot be asked for.
        SolverError: the model cannot answer to that tolerance.
    """
    _only_one(scene)
    return simulate(
        scene.circuit,
        force,
        keep=tuple(keep),
        until=duration,
        start=scene.start,
        tolerance=tolerance,
    )


def in_slices(
    scene: Scene, force: Waveform, duration: float, keep: Sequence[str]
) -> Iterator[Solution]:
    """As `model`, slice by slice, none of which is held.

    Raises:
        SceneError: its protocol sets voltages from trial to trial.
        SolverError: the model cannot answer to the tolerance.
    """
    from tactile_lab.model.slices import slices

    _only_one(scene)
    return slices(
        scene.circuit, force, keep=tuple(keep), until=duration, start=scene.start,
        tolerance=DEFAULT_TOLERANCE,
    )  # fmt: skip


def _only_one(scene: Scene) -> None:
    if scene.protocol.sets:
        raise SceneError(
            f"protocol {scene.protocol.name} sets {', '.join(scene.protocol.sets)} "
            "from trial to trial; the model alone has one for all. `tactile-lab run` "
            "plays it on the simulated bench."
        )
