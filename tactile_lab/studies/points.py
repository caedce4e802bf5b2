"""One point of a study: its address, and what is kept of it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import fields, replace
from functools import cache, cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from tactile_lab.errors import TactileLabError, UnsafeError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import critical_force
from tactile_lab.planning.preview import DEFAULT_TOLERANCE, model
from tactile_lab.planning.timeline import Timeline, timeline
from tactile_lab.plugins import registered
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.studies.axes import Axis, changed
from tactile_lab.studies.kept import Value
from tactile_lab.studies.study import Study
from tactile_lab.trial import Protocol

ADDRESS = 16
"""Bytes of an address."""
REGISTERED = (
    "tactile_lab.drivers",
    "tactile_lab.far_ends",
    "tactile_lab.benches",
    "tactile_lab.protocols",
)
"""Groups of entry points whose packages a point may depend on."""


class Points:
    """Computes points of a study; made once in each process.

    Args:
        study: which.
        runs: where run folders are kept; None to keep none of a simulated bench.
    """

    def __init__(self, study: Study, runs: Path | None = None) -> None:
        self._study = study
        self._runs = runs
        self._axes = study.design.axes
        sensor = study.scene.sensor
        self._sensor = {
            f.name: value
            for f in fields(Circuit)
            if isinstance(value := getattr(sensor, f.name), float)
        }
        self._numbers = np.array(list(self._sensor.values()))
        self._columns = {name: i for i, name in enumerate(self._sensor)}
        self._others = tuple(one for one in self._axes if not self._of_sensor(one))
        self._last: tuple[tuple[Any, ...], Scene, Timeline] | None = None
        self._digests: dict[tuple[Any, ...], bytes] = {}

    def address(self, values: Sequence[Any], repeat: int) -> bytes:
        """What tells this point from every other: scene, code, seed, what is kept.

        Hexadecimal digits. A point that the scene refuses has one, too.
        """
        sensor, others = self._split(values)
        digest = self._digests.get(others)
        if digest is None:
            digest = self._digests[others] = self._digest(others)
        numbers = self._numbers.copy()
        for name, value in sensor.items():
            numbers[self._columns[name]] = value
        found = hashlib.blake2b(digest, digest_size=ADDRESS)
        found.update(numbers.tobytes())
        found.update(self._seed(repeat).to_bytes(8, "little"))
        return found.hexdigest().encode()

    def compute(self, values: Sequence[Any], repeat: int) -> dict[str, Value]:
        """What is kept of the point, by name.

        Raises:
            TactileLabError: the point is refused or fails.
        """
        if self._study.on == "model":
            return self._modelled(values)
        return self._run(self._scene(values), repeat)

    # --- the model alone

    def _modelled(self, values: Sequence[Any]) -> dict[str, Value]:
        if self._alike:
            sensor, others = self._split(values)
            scene, drive = self._with(others)
            changes: dict[str, Any] = dict(sensor)  # all of them numbers
            scene = replace(scene, sensor=replace(scene.sensor, **changes))
        else:
            scene = self._scene(values)
            drive = timeline(scene, through_coil=False)
        result = model(
            scene, drive.force, drive.duration, self._signals, DEFAULT_TOLERANCE
        )
        names = {
            "result": result,
            "spikes": result.spike_times,
            "force": drive.force,
            **_always(scene),
        }
        return {one.name: one.of(names) for one in self._study.kept}

    @cached_property
    def _signals(self) -> tuple[str, ...]:
        """What the model must keep for the expressions to be evaluated."""
        told = " ".join(one.expression + one.source for one in self._study.kept)
        voltages = (n for n in ("V_P", "V_C1", "V_C2", "I_DS", "I_C") if n in told)
        looked = (
            "spikes" in told
            or "result" in told
            or any(one.source for one in self._study.kept)
        )
        return (*(("spikes",) if looked else ()), *voltages) or ("spikes",)

    @cached_property
    def _alike(self) -> bool:
        """Whether every sensor gets the same force: then it is made once."""
        protocol = type(self._study.scene.protocol)
        if protocol.on_sensor is not Protocol.on_sensor:
            return False
        return not timeline(self._study.scene, through_coil=False).adaptive

    def _with(self, others: tuple[Any, ...]) -> tuple[Scene, Timeline]:
        """The scene with the values that are no numbers of the sensor, and its force.

        Points come in order: the last one is mostly the one that is wanted again.
        """
        if self._last is None or self._last[0] != others:
            scene = load(self._study.scene, changed(self._others, others))
            self._last = (others, scene, timeline(scene, through_coil=False))
        return self._last[1:]

    # --- the whole bench

    def _run(self, scene: Scene, repeat: int) -> dict[str, Value]:
        from tactile_lab.engine.execution import Execution
        from tactile_lab.report.findings import find
        from tactile_lab.report.from_run import read
        from tactile_lab.store.run import Run

        simulated = replace(scene.simulated, seed=self._seed(repeat))
        scene = replace(scene, simulated=simulated)
        with ExitStack() as stack:
            folder = self._runs or Path(
                stack.enter_context(TemporaryDirectory(prefix="tactile-lab-"))
            )
            done = Execution(scene, folder, realtime=self._study.on == "bench").run()
            if not done.off.verified:
                raise UnsafeError(done.off.text) from done.failure
            if done.failure is not None:
                raise done.failure
            run = stack.enter_context(Run.load(done.folder))
            names = {
                "run": run,
                "spikes": np.asarray(run.spikes["time"]),
                **_always(scene),
            }
            if any("answer" in one.expression for one in self._study.kept):
                names["answer"] = find(read(done.folder)).conclusion.plain
            return {one.name: one.of(names) for one in self._study.kept}

    def _scene(self, values: Sequence[Any]) -> Scene:
        return load(self._study.scene, changed(self._axes, values))

    # --- addresses

    def _of_sensor(self, axis: Axis) -> bool:
        """Whether it varies a number of the sensor, so that a point needs no file."""
        table, _, name = axis.key.partition(".")
        return axis.numeric and table == "sensor" and name in self._sensor

    def _split(self, values: Sequence[Any]) -> tuple[dict[str, float], tuple[Any, ...]]:
        """The sensor's numbers by name, and the other values."""
        sensor, others = {}, []
        for axis, value in zip(self._axes, values, strict=True):
            if self._of_sensor(axis):
                sensor[axis.key.removeprefix("sensor.")] = float(value)
            else:
                others.append(value)
        return sensor, tuple(others)

    def _digest(self, others: tuple[Any, ...]) -> bytes:
        """Of everything but the sensor's numbers and the seed."""
        changes = changed(self._others, others)
        try:
            scene = load(self._study.scene, changes)
        except TactileLabError as reason:
            return hashlib.blake2b(f"{changes} {reason}".encode()).digest()
        data = scene.to_dict()
        del data["conditions"]  # a label: nothing is computed from it
        data["simulated"].pop("seed", None)
        for name in self._sensor:
            data["sensor"].pop(name, None)
        files = {str(path): path.read_text(encoding="utf-8") for path in scene.files}
        kept = [(one.name, one.expression, one.source) for one in self._study.kept]
        whole = json.dumps(
            [self._study.on, data, files, kept, DEFAULT_TOLERANCE, code_digest()],
            sort_keys=True,
        )
        return hashlib.blake2b(whole.encode(), digest_size=ADDRESS).digest()

    def _seed(self, repeat: int) -> int:
        """Of the simulated bench's noise; 0 where nothing is random."""
        if self._study.on == "model":
            return 0
        return self._study.design.seed * 1_000_003 + repeat


def _always(scene: Scene) -> Mapping[str, Any]:
    """Names that every expression may use."""
    return {
        "circuit": scene.circuit,
        "scene": scene,
        "critical_force": critical_force,
        "np": np,
        "nan": np.nan,
    }


@cache
def code_digest() -> str:
    """Of the program's own source: another program computes every point anew."""
    from importlib.util import find_spec

    modules = {
        entry.module for group in REGISTERED for entry in registered(group).values()
    }
    found = hashlib.blake2b(digest_size=ADDRESS)
    for package in sorted({_top(name) for name in (__name__, *modules)}):
        spec = find_spec(package)
        for place in (spec.submodule_search_locations or ()) if spec else ():
            for path in sorted(Path(place).rglob("*.py")):
                found.update(str(path.relative_to(place)).encode())
                found.update(path.read_bytes())
    return found.hexdigest()


def _top(module: str) -> str:
    return module.partition(".")[0]


def why(error: BaseException) -> str:
    """The reason that a point which failed is kept with."""
    if isinstance(error, TactileLabError):
        return str(error)
    return f"{type(error).__name__}: {error}"
