"""A study: a base scene, what varies in it, what is kept of each point."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from tactile_lab.arrays import FloatArray
from tactile_lab.complaint import validated
from tactile_lab.errors import QuantityError, SceneError, choices, nearest
from tactile_lab.plugins import study_names, study_path
from tactile_lab.quantity import parse, show
from tactile_lab.scene.load import load, read_toml, tuples
from tactile_lab.scene.scene import Scene
from tactile_lab.studies.axes import axis, changed
from tactile_lab.studies.design import Design, Method, checked
from tactile_lab.studies.kept import Kept, kept
from tactile_lab.table import SceneTable

On = Literal["model", "simulated", "bench"]
Order = Literal["random", "blocked", "as written"]
ALWAYS = ("spike_count", "first_spike", "mean_rate")
"""Kept unless the study says what."""
SEED = "simulated.seed"
"""Each repeat has its own, at every point the same ones."""
MODELLED = ("sensor.", "protocol.", "bench.followers.")
"""What says all there is of a circuit, its followers with it, and of the force."""


@dataclass(frozen=True, kw_only=True)
class AxisTable(SceneTable):
    """``[[axis]]``: one of `values`, `normal` and `uniform` says what the key takes.

    Attributes:
        key: ``table.key`` of the scene.
        values: a list, or a text ``from : to : step``.
        normal: standard deviation about the scene's value ("1 %", "2 mV"), or
            [centre, deviation].
        uniform: half-width about the scene's value, or [least, most].
        zip: axes with the same text go through their values together.
    """

    key: str
    values: Any = None
    normal: Any = None
    uniform: Any = None
    zip: str | None = None


@dataclass(frozen=True, kw_only=True)
class Draw(SceneTable):
    """``[draw]``: how the axes with `normal` or `uniform` are drawn.

    Attributes:
        points: how often; of "indices" the number of pairs.
        method: see `Design`.
    """

    points: Annotated[int, Field(ge=1)] = 256
    method: Method = "latin hypercube"


@dataclass(frozen=True, kw_only=True)
class Requirement(SceneTable):
    """``[require.NAME]``: what a kept number must be for a point to be good.

    Attributes:
        least, most: inclusive, SI or a quantity ("20 mN"); None for no limit.
    """

    least: float | str | None = None
    most: float | str | None = None


@dataclass(frozen=True)
class Limits:
    """Between which a kept number of a good point lies.

    Attributes:
        least, most: inclusive, SI; None for no limit.
        unit: SI; "" without one.
    """

    least: float | None
    most: float | None
    unit: str

    def __str__(self) -> str:
        parts = [
            f"{word} {show(limit, self.unit)}"
            for word, limit in (("at least", self.least), ("at most", self.most))
            if limit is not None
        ]
        return " and ".join(parts)

    def hold(self, column: FloatArray) -> NDArray[np.bool_]:
        """Which numbers lie between, of the same shape; NaN never does."""
        low = -np.inf if self.least is None else self.least
        high = np.inf if self.most is None else self.most
        return np.isfinite(column) & (column >= low) & (column <= high)


@dataclass(frozen=True, kw_only=True)
class StudyFile(SceneTable):
    """What a study's TOML file holds; see docs/studies.md."""

    scene: str
    title: str = ""
    on: On = "model"
    bench: str | None = None
    repeat: Annotated[int, Field(ge=1)] = 1
    seed: Annotated[int, Field(ge=0)] = 1
    order: Order = "random"
    runs: bool = False
    keep: tuple[str, ...] | dict[str, str] = ALWAYS
    set: dict[str, Any] = field(default_factory=dict)
    axis: tuple[AxisTable, ...] = ()
    draw: Draw = field(default_factory=Draw)
    require: dict[str, Requirement] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True, eq=False)
class Study:
    """What one study computes.

    Attributes:
        name: of its folder.
        title: for people.
        scene: what varies.
        on: the circuit alone ("model"), the whole simulated bench ("simulated"), or
            real instruments ("bench").
        design: its points.
        kept: what is kept of each.
        require: what makes a point good, by the name of what is kept.
        order: in which a bench plays the points.
        keeps_runs: whether the run of each point is kept whole.
        source: the file's contents, kept with the results.
    """

    name: str
    title: str
    scene: Scene
    on: On
    design: Design
    kept: tuple[Kept, ...]
    require: Mapping[str, Limits]
    order: Order
    keeps_runs: bool
    source: Mapping[str, Any]

    def __repr__(self) -> str:
        shape = " × ".join(map(str, self.design.shape)) or "1"
        return f"<Study {self.name}: {shape} points of {self.scene.name} on {self.on}>"


def load_study(study: str | Path | Mapping[str, Any], name: str = "study") -> Study:
    """A study, validated; computes nothing.

    Args:
        study: a study file (TOML), the name of a study that ships, or what one would
            hold.
        name: of a study that is no file.

    Raises:
        SceneError: something cannot be used as written.
    """
    if isinstance(study, Mapping):
        return _study(dict(study), name, Path.cwd(), f"study {name}")
    path = Path(study)
    if str(study) in study_names() and not path.is_file():
        path = study_path(str(study))
    elif not path.is_file():
        told = choices(str(study), study_names(), "Studies that ship")
        raise SceneError(f"Study {study} does not exist; {told}")
    return _study(read_toml(path, "Study"), path.stem, path.parent, str(path))


def _study(data: dict[str, Any], name: str, folder: Path, origin: str) -> Study:
    table = validated(StudyFile, tuples(data), (), lambda at: origin, None)
    if SEED in table.set or any(one.key == SEED for one in table.axis):
        raise SceneError(
            f"{origin}: {SEED} is set by the study, for each repeat another; say "
            "repeat = 12 for twelve of them, or seed = 2 for others."
        )
    scene = _scene(table, folder)
    axes = []
    for one in table.axis:
        given = {
            word: value
            for word in ("values", "normal", "uniform")
            if (value := getattr(one, word)) is not None
        }
        if len(given) != 1:
            raise SceneError(
                f"{origin}: axis {one.key} has {' and '.join(given) or 'no values'}; "
                "write one of values, normal, uniform."
            )
        if one.zip is not None and one.values is None:
            raise SceneError(
                f"{origin}: axis {one.key} is drawn and cannot go through values with "
                f'others; leave zip = "{one.zip}" out, or give values.'
            )
        axes.append(axis(one.key, {**given, "zip": one.zip}, scene))
    axes.sort(key=lambda one: one.spread is not None)
    if table.on == "model" and table.repeat > 1:
        raise SceneError(
            f"{origin}: repeat = {table.repeat}, but the model gives the same each "
            'time; leave repeat out, or say on = "simulated".'
        )
    if table.on == "model" and table.runs:
        raise SceneError(
            f"{origin}: runs = true, but the model makes no runs; leave it out, or say "
            'on = "simulated".'
        )
    drawn = any(one.spread is not None for one in axes)
    if not drawn and "draw" in data:
        raise SceneError(f"{origin}: [draw] draws no axis; give one normal or uniform.")
    design = Design(
        axes=tuple(axes),
        draws=table.draw.points if drawn else 1,
        method=table.draw.method,
        repeat=table.repeat,
        seed=table.seed,
    )
    keeping = kept(table.keep, folder, table.on)
    if table.on == "model" and not any(one.uses_scene for one in keeping):
        for asked in table.axis:
            if asked.key != "bench" and not asked.key.startswith(MODELLED):
                raise SceneError(
                    f"{origin}: axis {asked.key} moves nothing of a circuit alone; "
                    'leave it out, or say on = "simulated".'
                )
    study = Study(
        name=name,
        title=table.title or name,
        scene=scene,
        on=table.on,
        design=checked(design),
        kept=keeping,
        require=_limits(table.require, keeping, origin),
        order=table.order,
        keeps_runs=table.runs or table.on == "bench",
        source=data,
    )
    _check(study)
    return study


def _scene(table: StudyFile, folder: Path) -> Scene:
    beside = folder / table.scene
    base = load(beside if beside.is_file() else table.scene, table.set, table.bench)
    if table.on == "bench" and base.bench.simulated:
        raise SceneError(
            'on = "bench" needs real instruments: name the bench file, bench = "...", '
            'or say on = "simulated".'
        )
    if table.on != "bench" and not base.bench.simulated:
        base = load(base, (), "sim")  # nothing may reach an instrument
    return base.sensor_alone if table.on == "model" else base


def _limits(
    asked: Mapping[str, Requirement], keeping: tuple[Kept, ...], origin: str
) -> dict[str, Limits]:
    """What is required, in SI."""
    by_name = {one.name: one for one in keeping}
    found = {}
    for name, table in asked.items():
        where = f"{origin}: [require.{name}]"
        if name not in by_name:
            hint = nearest(name, by_name)
            raise SceneError(
                f"{where}: nothing of that name is kept"
                f"{'; ' + hint if hint else '.'} Kept: {', '.join(by_name)}."
            )
        if by_name[name].expression == "spike_times":
            raise SceneError(
                f"{where}: spike_times is a row of numbers; require a number, such "
                "as spike_count."
            )
        unit = by_name[name].unit
        try:
            least, most = (
                parse(limit, unit) if isinstance(limit, str) else limit
                for limit in (table.least, table.most)
            )
        except QuantityError as reason:
            raise SceneError(f"{where}: {reason}") from reason
        if least is None and most is None:
            raise SceneError(f"{where} asks for nothing; give least or most.")
        if least is not None and most is not None and least > most:
            raise SceneError(
                f"{where}: least = {show(least, unit)} lies above most = "
                f"{show(most, unit)}; no number can be both."
            )
        found[name] = Limits(least, most, unit)
    return found


def _check(study: Study) -> None:
    """Refuse keys that no point could use."""
    for one in study.design.axes:  # each key alone, so that the message names it
        first = one.values[0] if one.values else one.spread and one.spread.centre
        load(study.scene, changed([one], [first]))
