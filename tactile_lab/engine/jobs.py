"""Questions to the engine: who is on a bench, the field, a record, a report, a model.

`Link.ask` takes these functions, and any other whose first argument is the engine.
"""

from __future__ import annotations

import math
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_lab.engine.engine import Engine
from tactile_lab.engine.events import ModelPart
from tactile_lab.engine.request import Request
from tactile_lab.errors import RecordingError, RefusedError, TactileLabError
from tactile_lab.lab import lab, stand_back
from tactile_lab.quantity import count

if TYPE_CHECKING:
    from tactile_lab.analysis.noise import Noise
    from tactile_lab.arrays import FloatArray
    from tactile_lab.bench import Bench, Coil, Meter, OffReport, SeenOutput
    from tactile_lab.engine.manual import FieldReading
    from tactile_lab.engine.model_parts import StoredParts
    from tactile_lab.engine.monitor import Monitor
    from tactile_lab.scene.scene import Scene
    from tactile_lab.scope import Scope
    from tactile_lab.store.spike_shapes import SpikeShapes
    from tactile_lab.store.statistics import SignalStatistics
    from tactile_lab.voltage_source import VoltageSource

    Instrument = Coil | Scope | Meter | VoltageSource

LONGEST = 300.0
"""Seconds a report may take."""


BUSY = 10.0
"""Seconds that somebody who asks who is there waits for a task to end."""


@dataclass(frozen=True)
class InstrumentAnswer:
    """One instrument answered, or did not.

    Attributes:
        role: coil, scope, meter, thermometer, or the voltage that it holds.
        identity: as it answered.
        problem: why it did not, "" if it did.
    """

    role: str
    identity: str
    problem: str


@dataclass(frozen=True)
class Checked:
    """The bench was asked who is there.

    Attributes:
        found: one entry per instrument of the bench.
        off: how the coil was left, or found; None without a coil, or where its driver
            cannot look.
        on: whether the coil's output was found on and left so.
    """

    found: tuple[InstrumentAnswer, ...]
    off: OffReport | None
    on: bool = False

    @property
    def sound(self) -> bool:
        """Whether everybody answered and no coil is in doubt."""
        silent = any(one.problem for one in self.found)
        return not silent and (self.off is None or self.off.verified)


def check_bench(engine: Engine, request: Request) -> Checked:
    """Ask every instrument of a request's bench who it is; make the coil safe.

    Raises:
        RefusedError: something uses them, and goes on doing so.
    """
    return _alone(engine, request, check)


def look_at_bench(engine: Engine, request: Request) -> Checked:
    """Ask every instrument of a request's bench who it is; nothing is set or switched.

    Raises:
        RefusedError: something uses them, and goes on doing so.
    """
    return _alone(engine, request, look)


def _alone(
    engine: Engine, request: Request, ask: Callable[[Bench], Checked]
) -> Checked:
    bench = bench_of(request.load(), realtime=engine.realtime)
    if not engine.instruments.acquire(timeout=BUSY):
        raise RefusedError(
            "The instruments are still in use by what was begun last; wait until it "
            "has ended, or switch the source off at its front panel."
        )
    try:
        return ask(bench)
    finally:
        engine.instruments.release()


def check(bench: Bench) -> Checked:
    """Open, identify and close each instrument; the coil is verified off on the way."""
    off: list[OffReport] = []

    def opened(instrument: Instrument) -> str:
        instrument.open()
        if instrument is bench.coil:
            off.append(bench.coil.safe_off())
        identity = instrument.identity
        instrument.close()
        return identity

    found = _answers(bench, opened)
    return Checked(found, off[0] if off else None)


def look(bench: Bench) -> Checked:
    """Ask each instrument who it is, and the coil's source whether its output is on.

    Nothing is set: a person may be using it. An oscilloscope is opened and closed; a
    driver that cannot look is left alone.
    """
    seen: list[SeenOutput] = []

    def looked(instrument: Instrument) -> str:
        if instrument is bench.scope:
            instrument.open()
            identity = instrument.identity
            instrument.close()
            return identity
        ask = getattr(instrument, "look", None)
        if ask is None:
            return "not asked: its driver cannot look without setting anything"
        answer: SeenOutput | str = ask()
        if isinstance(answer, str):
            return answer
        seen.append(answer)
        return answer.identity

    found = _answers(bench, looked)
    on = bool(seen) and seen[0].on
    return Checked(found, seen[0].report if seen else None, on)


def _answers(
    bench: Bench, ask: Callable[[Instrument], str]
) -> tuple[InstrumentAnswer, ...]:
    """What each instrument of the bench answers when it is asked.

    All are asked at once where time is lived through: most of it is waiting.
    """
    every = (
        ("coil", bench.coil),
        ("scope", bench.scope),
        ("meter", bench.field_meter),
        ("thermometer", bench.thermometer),
        *bench.voltage_sources.items(),
    )
    there = [(role, one) for role, one in every if one is not None]

    def answer(role: str, instrument: Instrument) -> InstrumentAnswer:
        try:
            return InstrumentAnswer(role, ask(instrument), "")
        except (TactileLabError, OSError) as error:
            return InstrumentAnswer(role, "", str(error))

    if bench.clock.simulated:
        with bench.clock.taking_part("check"):
            return tuple(answer(*one) for one in there)
    with ThreadPoolExecutor(max(1, len(there))) as asking:
        return tuple(asking.map(answer, *zip(*there, strict=True)))


def read_field(engine: Engine, request: Request, task: int) -> FieldReading:
    """Read the field of a request's bench; `task`: manual control that has it, or 0."""
    from tactile_lab.engine import manual

    held = engine.tasks.get(task)
    if held is not None and held.task is not None:
        return manual.read_field(held.task.bench)
    return manual.read_field(bench_of(request.load(), realtime=True))


def record(engine: Engine, task: int, out: Path, notes: Mapping[str, str]) -> Path:
    """Keep what the monitor `task` holds, the last minute, as a run in `out`."""
    return _monitor(engine, task).record(out, notes)


def noise_of_monitor(engine: Engine, task: int, signal: str) -> Noise:
    """The noise of a signal in the last seconds that the monitor `task` holds."""
    return _monitor(engine, task).noise(signal)


def recover_run(engine: Engine, folder: Path) -> str:
    """Make a run whole that was cut short; what could be saved, in words."""
    from tactile_lab.store.recover import recover

    done = recover(folder)
    return (
        f"{done.samples} samples per channel and {count(done.spikes, 'spike')} "
        f"recovered, {done.dropped} samples dropped"
    )


def write_report(engine: Engine, folder: Path) -> None:
    """Write figures, results and report into a finished run's folder.

    In a process of its own, behind the window and a next run.

    Raises:
        RecordingError: it could not be written.
    """
    asked = [sys.executable, "-m", "tactile_lab", "report", str(folder)]
    try:
        writing = subprocess.Popen(
            asked, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        stand_back(writing)
        _, said = writing.communicate(timeout=LONGEST)
    except subprocess.TimeoutExpired as error:
        raise RecordingError(
            f"The report is not there after {LONGEST:g} s, and is written on; open the "
            "run again once it is."
        ) from error
    except OSError as error:
        raise RecordingError(f"The report was not written: {error}") from error
    if writing.returncode:
        last = (said.strip().splitlines() or ["no message"])[-1]
        raise RecordingError(f"The report was not written: {last}")


def follow_run(engine: Engine, folder: Path) -> str:
    """Call what the lab has follow each run; what went wrong, "" if nothing did.

    Raises:
        SceneError: the lab's file cannot be read.
    """
    return lab().follow(folder)


def model_of_run(
    engine: Engine,
    folder: Path,
    start: float = 0.0,
    end: float = math.inf,
    count: int | None = None,
) -> ModelPart:
    """Solve the model beside a finished run, unless it was the last, and sample it.

    Args:
        engine: where.
        folder: of the run.
        start: on the run's time axis, s.
        end: likewise.
        count: of bins; None: of a millisecond, if that is not too many.
    """
    with _SOLVING:
        stored = _stored(folder)
    return stored.part(start, end, count)


def shapes_of_run(engine: Engine, folder: Path, times: FloatArray) -> SpikeShapes:
    """The stored samples around the spikes of a run that are nearest to `times`, s."""
    from tactile_lab.store.run import Run
    from tactile_lab.store.spike_shapes import spike_shapes

    with Run.load(folder) as run:
        return spike_shapes(run, times)


def statistics_of_run(
    engine: Engine, folder: Path, start: float, end: float
) -> dict[str, SignalStatistics]:
    """Statistics of each stored signal from `start` to `end` s of a run, by name.

    Raises:
        RunFolderError: the stretch has no sample, or too many.
    """
    from tactile_lab.store.run import Run
    from tactile_lab.store.statistics import statistics

    with Run.load(folder) as run:
        names = run.signals
        return {name: statistics(run.signal(name), start, end) for name in names}


_SOLVING = threading.Lock()


@lru_cache(maxsize=1)
def _stored(folder: Path) -> StoredParts:
    from tactile_lab.engine.model_parts import StoredParts

    return StoredParts(folder)


def _monitor(engine: Engine, task: int) -> Monitor:
    from tactile_lab.engine.monitor import Monitor

    held = engine.tasks.get(task)
    monitor = None if held is None else held.task
    if not isinstance(monitor, Monitor):
        raise RecordingError("Nothing has been seen yet.")
    return monitor


def bench_of(scene: Scene, *, realtime: bool) -> Bench:
    """The bench of a scene; nothing of it is open."""
    from tactile_lab.engine.bench import open_bench
    from tactile_lab.planning.needs import needs

    return open_bench(scene, needs(scene), realtime=realtime)
