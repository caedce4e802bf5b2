"""A skin: an array of sensors, what presses on it, and for how long."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from tactile_lab.arrays import FloatArray
from tactile_lab.complaint import validated
from tactile_lab.errors import ParameterError, SceneError, choices
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.need import checked_tolerance
from tactile_lab.model.specimen import specimen
from tactile_lab.quantity import Duration, Unit
from tactile_lab.scene.load import read_toml, tuples
from tactile_lab.scene.sensor import Sensor, with_preset
from tactile_lab.skin.frames import Frames
from tactile_lab.skin.layout import Array
from tactile_lab.skin.stimulus import KINDS, Stimulus
from tactile_lab.table import SceneTable

MOST_STUCK = 1e8
"""Most spikes of stuck taxels, which nothing else bounds."""


@dataclass(frozen=True, kw_only=True)
class SkinFile(SceneTable):
    """What a skin's TOML file holds; see docs/skin.md."""

    duration: Duration
    array: Array
    stimulus: Annotated[tuple[dict[str, Any], ...], Field(min_length=1)]
    title: str = ""
    sensor: dict[str, Any] = field(default_factory=dict)
    tolerance: Annotated[float, Unit("s", above=0.0)] = 1e-9
    force_error: Annotated[float, Unit("N", least=0.0)] = 10e-6
    seed: Annotated[int, Field(ge=0, le=2**31)] = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Skin:
    """An array under a load, validated; nothing is computed yet.

    Attributes:
        name: of its folder.
        title: for people.
        circuit: of every taxel, its parts as marked.
        array: where the taxels are.
        stimuli: what presses on them.
        frames: forces from files, added to these.
        duration: s, from 0.
        tolerance: of spike times, s.
        force_error: by how much the force on a taxel, straight between few points, may
            differ from the computed one, N.
        seed: of the spread between taxels.
        source: the file's contents, kept with the events.
    """

    name: str
    title: str
    circuit: Circuit
    array: Array
    stimuli: tuple[Stimulus, ...]
    frames: tuple[Frames, ...]
    duration: float
    tolerance: float
    force_error: float
    seed: int
    source: Mapping[str, Any]

    @property
    def times(self) -> FloatArray:
        """When the forces are computed, ascending from 0 to the duration, s."""
        ends = [np.array([0.0, self.duration])]
        found = [one.points(self.array.depth, self.duration) for one in self.stimuli]
        found += [one.times for one in self.frames]
        times = np.unique(np.concatenate([*ends, *found]))
        return times[(times >= 0) & (times <= self.duration)]

    @property
    def first_specimen(self) -> int:
        """The number of the specimen that taxel 0 is; 0 where all are as marked."""
        return 1 + self.seed * (1 << 24) if self.array.spread else 0

    def circuit_of(self, taxel: int) -> Circuit:
        """The circuit of one taxel, a specimen of its own where the array is spread.

        Raises:
            ParameterError: there is no such taxel, or its parts make no circuit.
        """
        if not 0 <= taxel < self.array.size:
            raise ParameterError(
                f"Taxel {taxel} does not exist; they are numbered 0 to "
                f"{self.array.size - 1}."
            )
        first = self.first_specimen
        return specimen(self.circuit, first + taxel if first else 0)


def load_skin(
    skin: str | Path | Mapping[str, Any],
    name: str = "skin",
    *,
    folder: Path | None = None,
) -> Skin:
    """A skin, validated; computes nothing.

    Args:
        skin: a skin file (TOML), or what one would hold.
        name: of a skin that is no file.
        folder: what a mapping's files are relative to; where one is unless given.

    Raises:
        SceneError: something cannot be used as written.
    """
    if isinstance(skin, Mapping):
        return _skin(dict(skin), name, folder or Path.cwd(), f"skin {name}")
    path = Path(skin)
    if not path.is_file():
        raise SceneError(f"Skin {skin} does not exist; give the path of a TOML file.")
    return _skin(read_toml(path, "Skin"), path.stem, path.parent, str(path))


def _skin(data: dict[str, Any], name: str, folder: Path, origin: str) -> Skin:
    def blame(_: tuple[str, ...]) -> str:
        return origin

    table = validated(SkinFile, tuples(data), (), blame, None)
    sensor = validated(Sensor, with_preset(table.sensor, {}), ("sensor",), blame)
    if sensor.start != "equilibrium":
        raise SceneError(f"{origin}: [sensor] start: taxels start at equilibrium.")
    try:
        checked_tolerance(table.tolerance)
    except ParameterError as reason:
        raise SceneError(f"{origin}: {reason}") from reason
    without_end = len(table.array.stuck) * table.array.stuck_rate * table.duration
    if without_end > MOST_STUCK:
        raise SceneError(
            f"{origin}: stuck taxels would fire {without_end:.3g} times; at most "
            f"{MOST_STUCK:.0e} are possible. Make stuck_rate or duration smaller."
        )
    stimuli: list[Stimulus] = []
    frames: list[Frames] = []
    for number, one in enumerate(table.stimulus):
        keys = dict(one)
        at = ("stimulus", f"number {number + 1}")
        kind = keys.pop("kind", None)
        if kind == Frames.kind:
            made = validated(Frames, keys, at, blame)
            made = replace(made, file=str((folder / made.file).resolve()))
            made.checked(table.array)
            frames.append(made)
        elif kind in KINDS:
            stimuli.append(validated(KINDS[kind], keys, at, blame))
        else:
            told = choices(str(kind or ""), [*KINDS, Frames.kind], "Kinds")
            given = "is missing" if kind is None else f'= "{kind}"'
            raise SceneError(f"{origin}: [{'.'.join(at)}] kind {given}: {told}")
    return Skin(
        name=name,
        title=table.title or name,
        circuit=sensor.circuit,
        array=table.array,
        stimuli=tuple(stimuli),
        frames=tuple(frames),
        duration=table.duration,
        tolerance=table.tolerance,
        force_error=table.force_error,
        seed=table.seed,
        source=data,
    )
