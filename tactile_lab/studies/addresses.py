"""The address of a point: what tells it from every other, of whatever study."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.engine.cluster import code_digests
from tactile_lab.errors import TactileLabError
from tactile_lab.model.circuit import Circuit
from tactile_lab.planning.preview import DEFAULT_TOLERANCE
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.studies.axes import Axis, changed
from tactile_lab.studies.design import by_point
from tactile_lab.studies.study import Study

ADDRESS = 16
"""Bytes of an address."""
NAME = np.dtype(f"V{ADDRESS}")
"""Addresses as numpy holds them."""
AT_ONCE = 50_000
"""Points whose addresses are made at a time."""
Columns = Sequence[Sequence[Any] | FloatArray]
"""Of each axis the values at some points, see `Design.columns`."""


class Group(NamedTuple):
    """Points that differ in numbers of the sensor alone.

    Attributes:
        rows: which of the points, in order.
        others: their value of every other axis.
        numbers: of the sensor, by name, shape (rows,), SI.
    """

    rows: NDArray[np.intp]
    others: tuple[Any, ...]
    numbers: dict[str, FloatArray]


class Axes:
    """The axes of a study: those of its sensor's numbers, and the others."""

    def __init__(self, axes: Sequence[Axis], scene: Scene) -> None:
        self.sensor = {
            f.name: value
            for f in fields(Circuit)
            if isinstance(value := getattr(scene.sensor, f.name), float)
        }
        self._of_sensor = [self._is_number(axis) for axis in axes]
        self._names = [axis.key.partition(".")[2] for axis in axes]
        self.others = tuple(
            axis for axis, one in zip(axes, self._of_sensor, strict=True) if not one
        )

    def groups(self, columns: Columns, size: int) -> Iterator[Group]:
        """The points of some columns; the order of groups is that of their first."""
        numbers = {
            name: np.asarray(column, dtype=np.float64)
            for name, one, column in self._each(columns)
            if one
        }
        others = [column for _, one, column in self._each(columns) if not one]
        if not others:
            yield Group(np.arange(size), (), numbers)
            return
        found: dict[tuple[Any, ...], list[int]] = {}
        for row, values in enumerate(by_point(others)):
            found.setdefault(values, []).append(row)
        for values, some in found.items():
            rows = np.array(some)
            yield Group(
                rows, values, {n: column[rows] for n, column in numbers.items()}
            )

    def _each(self, columns: Columns) -> Iterator[tuple[str, bool, Any]]:
        return zip(self._names, self._of_sensor, columns, strict=True)

    def _is_number(self, axis: Axis) -> bool:
        """Whether it varies a number of the sensor, so that a point needs no scene."""
        table, _, name = axis.key.partition(".")
        return axis.numeric and table == "sensor" and name in self.sensor


def addresses(study: Study) -> NDArray[np.void]:
    """The address of each point, in the order of their numbers, of dtype `NAME`.

    Scene, code, seed and what is kept make it. A point that the scene refuses has one.
    """
    design = study.design
    axes = Axes(design.axes, study.scene)
    place = {name: i for i, name in enumerate(axes.sensor)}
    found = np.empty(design.size, dtype=NAME)
    digests: dict[tuple[Any, ...], bytes] = {}
    for first in range(0, design.size, AT_ONCE):
        points = np.arange(first, min(first + AT_ONCE, design.size))
        seeds = seeds_of(study, design.repeats(points))
        for group in axes.groups(design.columns(points), points.size):
            if group.others not in digests:
                digests[group.others] = _digest(study, axes, group.others)
            whole = np.empty((group.rows.size, len(place) + 1))
            whole[:, :-1] = list(axes.sensor.values())
            for name, numbers in group.numbers.items():
                whole[:, place[name]] = numbers
            whole[:, -1] = seeds[group.rows].view(np.float64)
            found[points[group.rows]] = _named(digests[group.others], whole)
    return found


def study_digest(study: Study) -> str:
    """What tells a study's results from any other's; made without its addresses."""
    design = study.design
    axes = Axes(design.axes, study.scene)
    others: set[tuple[Any, ...]] = {()}
    if axes.others:
        columns = design.columns(np.arange(design.size))
        others = {group.others for group in axes.groups(columns, design.size)}
    told = [design, study.title, study.require, study.kept, sorted(axes.sensor.items())]
    found = hashlib.blake2b(repr(told).encode(), digest_size=ADDRESS)
    for digest in sorted(_digest(study, axes, values) for values in others):
        found.update(digest)
    return found.hexdigest()


def seeds_of(study: Study, repeats: NDArray[np.intp]) -> NDArray[np.int64]:
    """Seeds of the simulated bench's noise; 0 where nothing is random."""
    if study.on == "model":
        return np.zeros(repeats.size, np.int64)
    return study.design.seed * 1_000_003 + repeats.astype(np.int64)


def _named(digest: bytes, rows: FloatArray) -> NDArray[np.void]:
    """A hash of each row, of dtype `NAME`."""
    begun = hashlib.blake2b(digest, digest_size=ADDRESS)
    raw, width = rows.data.cast("B"), rows.shape[1] * rows.itemsize
    found = []
    for at in range(0, rows.nbytes, width):
        one = begun.copy()
        one.update(raw[at : at + width])
        found.append(one.digest())
    return np.frombuffer(b"".join(found), NAME)


def _digest(study: Study, axes: Axes, others: tuple[Any, ...]) -> bytes:
    """Of everything but the sensor's numbers and the seed."""
    changes = changed(axes.others, others)
    try:
        scene = load(study.scene, changes)
    except TactileLabError as reason:
        return hashlib.blake2b(f"{changes} {reason}".encode()).digest()
    data = scene.to_dict()
    del data["conditions"]  # a label: nothing is computed from it
    data["simulated"].pop("seed", None)
    for name in axes.sensor:
        data["sensor"].pop(name, None)
    files = {str(path): path.read_text(encoding="utf-8") for path in scene.files}
    kept = [(one.name, one.expression, one.source) for one in study.kept]
    whole = json.dumps(
        [study.on, data, files, kept, DEFAULT_TOLERANCE, code_digests()], sort_keys=True
    )
    return hashlib.blake2b(whole.encode(), digest_size=ADDRESS).digest()
