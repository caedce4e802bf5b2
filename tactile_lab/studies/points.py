"""Points of a study: one after another, or many circuits at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.errors import ParameterError, TactileLabError, UnsafeError
from tactile_lab.model.equations import critical_force
from tactile_lab.planning.preview import DEFAULT_TOLERANCE, model
from tactile_lab.planning.timeline import Timeline, timeline
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.spikes.trains import Trains
from tactile_lab.studies.addresses import Axes, Columns, Group, seeds_of
from tactile_lab.studies.axes import changed
from tactile_lab.studies.column import Column, Rows, Value, packed, placed
from tactile_lab.studies.design import by_point
from tactile_lab.studies.kept import CRITICAL_FORCE, OF_TRAINS, Kept
from tactile_lab.studies.shelf import Batch
from tactile_lab.studies.study import Study
from tactile_lab.trial import Protocol
from tactile_lab.whole_file import write_text

if TYPE_CHECKING:
    from tactile_lab.acquisition.ending import Executed
    from tactile_lab.engine.execution import Execution
    from tactile_lab.store.run import Run

RUNS, BY_POINT = "runs", "by-point"
"""Folders of a study: of the runs that are kept, and in it files by the addresses of
points, each with the name of its run."""
SCENES = 64
"""Scenes that differ in more than numbers of the sensor, kept with their force."""


@dataclass(frozen=True, eq=False)
class PointTask:
    """Some points to compute.

    Attributes:
        addresses: of each, of dtype `NAME`.
        columns: of each axis the values, see `Design.columns`.
        repeats: which repeat each is, from 0.
    """

    addresses: NDArray[np.void]
    columns: Columns
    repeats: NDArray[np.intp]


def _played(execution: Execution) -> Executed:
    return execution.run()


class Points:
    """Computes points of a study; made once in each process.

    Args:
        study: which.
        runs: where run folders are kept; None to keep none of a simulated bench.
        play: carries out a run; whoever minds signals meanwhile gives another.

    Attributes:
        runs: the same.
    """

    def __init__(
        self,
        study: Study,
        runs: Path | None = None,
        play: Callable[[Execution], Executed] = _played,
    ) -> None:
        self._study = study
        self.runs, self._play = runs, play
        self._axes = Axes(study.design.axes, study.scene)
        self._with = lru_cache(SCENES)(self._scene_and_force)

    def batch(self, task: PointTask) -> Batch:
        """What is kept of the points of a task; one that fails keeps its reason.

        Raises:
            UnsafeError: a coil's state is not known: nothing goes on.
            KeyboardInterrupt: a run was stopped: nothing goes on.
        """
        size = task.addresses.size
        parts: dict[str, list[tuple[NDArray[np.intp], Column]]]
        parts = {one.name: [] for one in self._study.kept}
        reasons: dict[int, str] = {}
        alone = np.ones(size, dtype=bool)
        for group in self._axes.groups(task.columns, size) if self._together else ():
            rows, columns = self._solved(group)
            alone[rows] = False
            for name, column in columns.items():
                parts[name].append((rows, column))
        left = np.flatnonzero(alone)
        found: list[Mapping[str, Value]] = []
        for row in left.tolist():
            values = by_point([column[row : row + 1] for column in task.columns])
            try:
                address = bytes(task.addresses[row]).hex()
                repeat = int(task.repeats[row])
                one, why = self.compute(values[0] if values else (), repeat, address)
            except UnsafeError:
                raise
            except Exception as error:  # whatever a user's protocol raises
                one, why = {}, _why(error)
            found.append(one)
            if why:
                reasons[row] = why
        for name, some in parts.items() if left.size else ():
            some.append((left, packed([one.get(name) for one in found])))
        columns = {name: placed(some, size) for name, some in parts.items()}
        return Batch(task.addresses, columns, reasons)

    def compute(
        self, values: Sequence[Any], repeat: int, address: str
    ) -> tuple[dict[str, Value], str]:
        """What is kept of one point, by name, and why the rest is not; "" if all is.

        Raises:
            TactileLabError: the point is refused or fails.
        """
        if self._study.on == "model":
            return self._modelled(values)
        return self._run(self._scene(values), repeat, address)

    # --- the model alone

    @cached_property
    def _together(self) -> bool:
        """Whether many circuits can be solved at once: what is kept needs no more."""
        needed = (one for one in self._study.kept if one.expression != CRITICAL_FORCE)
        return (
            self._study.on == "model"
            and all(one.of_spikes for one in needed)
            and self._alike
        )

    def _solved(self, group: Group) -> tuple[NDArray[np.intp], dict[str, Column]]:
        """Those of a group's points that a batch solves, and what is kept of them.

        The others are for `compute`, which says why they are refused.
        """
        from tactile_lab.model.batch import certain, critical_forces, records

        none: tuple[NDArray[np.intp], dict[str, Column]] = (np.empty(0, np.intp), {})
        try:
            scene, drive = self._with(group.others)
        except TactileLabError:
            return none
        circuit = scene.circuit
        if circuit.saturation or scene.sensor.temperature is not None:
            return none  # both voltages together; numbers that follow from others
        many = records(circuit, group.numbers)
        good = np.flatnonzero(certain(circuit, many, scene.start))
        if not good.size:
            return none
        columns, kept = {}, self._study.kept
        trains, solved = self._trains(scene, drive, many[good])
        for one in kept:
            if one.expression in OF_TRAINS:
                columns[one.name] = OF_TRAINS[one.expression](trains)
            elif one.expression == CRITICAL_FORCE:
                columns[one.name] = critical_forces(circuit, many[good])
            else:
                columns[one.name], right = _each(one, trains, drive)
                solved &= right
        rows = np.flatnonzero(solved)
        return group.rows[good[rows]], {
            name: column.take(rows) if isinstance(column, Rows) else column[rows]
            for name, column in columns.items()
        }

    def _trains(
        self, scene: Scene, drive: Timeline, many: NDArray[np.void]
    ) -> tuple[Trains, NDArray[np.bool_]]:
        """The spikes of many circuits in a scene, and which were solved."""
        from tactile_lab.model.batch import spike_trains

        return spike_trains(
            scene.circuit,
            many,
            drive.force,
            until=drive.duration,
            start=scene.start,
            tolerance=DEFAULT_TOLERANCE,
            keep_times=any(one.needs_times for one in self._study.kept),
        )

    def _kept(
        self, names: Mapping[str, Any], uncounted: str = ""
    ) -> tuple[dict[str, Value], str]:
        """Of one point, by the names it gives; what fails takes nothing with it.

        Args:
            names: what expressions may use.
            uncounted: why its spikes are no count; "" where they are one.
        """
        found, why = {}, []
        for one in self._study.kept:
            if uncounted and one.uses_spikes:
                why.append(f"{one.name}: {uncounted}")
                continue
            try:
                found[one.name] = one.of(names)
            except ParameterError as error:
                why.append(str(error))
        return found, "; ".join(why)

    def _modelled(self, values: Sequence[Any]) -> tuple[dict[str, Value], str]:
        if self._alike:
            (group,) = self._axes.groups([[value] for value in values], 1)
            scene, drive = self._with(group.others)
            sensor: dict[str, Any] = {n: float(v[0]) for n, v in group.numbers.items()}
            scene = replace(scene, sensor=replace(scene.sensor, **sensor))
        else:
            scene = self._scene(values)
            drive = timeline(scene, through_coil=False)
        result = model(
            scene, drive.force, drive.duration, self._signals, DEFAULT_TOLERANCE
        )
        names = {
            "result": result,
            "spikes": result.spike_times,
            "circuit": scene.circuit,
            "scene": scene,
            **_always(drive),
        }
        return self._kept(names)

    @cached_property
    def _signals(self) -> tuple[str, ...]:
        """What the model must keep for the expressions to be evaluated."""
        told = " ".join(one.expression + one.source for one in self._study.kept)
        voltages = (n for n in ("V_P", "V_C1", "V_C2", "I_DS", "I_C") if n in told)
        return ("spikes", *voltages)

    @cached_property
    def _alike(self) -> bool:
        """Whether every sensor gets the same force: then it is made once."""
        protocol = type(self._study.scene.protocol)
        if protocol.on_sensor is not Protocol.on_sensor:
            return False
        return not timeline(self._study.scene, through_coil=False).adaptive

    def _scene_and_force(self, others: tuple[Any, ...]) -> tuple[Scene, Timeline]:
        """The scene with the values of all but the sensor's numbers, and its force."""
        scene = load(self._study.scene, changed(self._axes.others, others))
        return scene, timeline(scene, through_coil=False)

    # --- the whole bench

    def _run(
        self, scene: Scene, repeat: int, address: str
    ) -> tuple[dict[str, Value], str]:
        from tactile_lab.acquisition.events import RunState
        from tactile_lab.engine.execution import Execution
        from tactile_lab.report.findings import find
        from tactile_lab.report.from_run import read
        from tactile_lab.store.run import Run

        seed = int(seeds_of(self._study, np.array([repeat]))[0])
        scene = replace(scene, simulated=replace(scene.simulated, seed=seed))
        with ExitStack() as stack:
            folder = self.runs or Path(
                stack.enter_context(TemporaryDirectory(prefix="tactile-lab-"))
            )
            real = self._study.on == "bench"
            done = self._play(Execution(scene, folder, realtime=real))
            if self.runs is not None:
                named = self.runs / BY_POINT / address
                write_text(named, done.folder.name)
            if not done.off.verified:
                raise UnsafeError(
                    f"{done.told} The study stops; what was finished is kept. Make the "
                    "coil safe and start it again."
                ) from done.failure
            if done.state is RunState.ABORTED:
                raise KeyboardInterrupt  # a run that was stopped is no point
            if done.failure is not None:
                raise done.failure
            run = stack.enter_context(Run.load(done.folder))
            names = {
                "run": run,
                "spikes": np.asarray(run.spikes["time"]),
                "circuit": scene.circuit,
                "scene": scene,
                **_always(),
            }
            if any("answer" in one.expression for one in self._study.kept):
                names["answer"] = find(read(done.folder)).conclusion.plain
            return self._kept(names, self._uncounted(run))

    def _uncounted(self, run: Run) -> str:
        """Why the spikes of a run are no count; "" where they are, or are not kept."""
        from tactile_lab.store.uncounted import uncounted

        if not any(one.uses_spikes for one in self._study.kept):
            return ""
        if run.detection is None:
            return "spikes were not looked for; put spikes into record.signals"
        return "; ".join(dict.fromkeys(filter(None, uncounted(run))))

    def _scene(self, values: Sequence[Any]) -> Scene:
        return load(self._study.scene, changed(self._study.design.axes, values))


def _each(
    kept: Kept, trains: Trains, drive: Timeline
) -> tuple[Column, NDArray[np.bool_]]:
    """An expression of the spikes for each point, and where it does not fail."""
    found: list[Value | None] = []
    names = _always(drive)
    for spikes in trains.rows():
        try:
            found.append(kept.of({**names, "spikes": spikes}))
        except TactileLabError:
            found.append(None)
    return packed(found), np.array([value is not None for value in found])


def _always(drive: Timeline | None = None) -> dict[str, Any]:
    """Names that every expression may use; the force where one is modelled."""
    force = {} if drive is None else {"force": drive.force}
    return {"critical_force": critical_force, "np": np, "nan": np.nan, **force}


def _why(error: BaseException) -> str:
    """The reason that a point which failed is kept with."""
    if isinstance(error, TactileLabError):
        return str(error)
    return f"{type(error).__name__}: {error}"
