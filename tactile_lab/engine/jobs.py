"""Questions to the engine that need a bench or a run: who is there, field, record."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_lab.engine.engine import Engine, Job
from tactile_lab.engine.events import ModelPart
from tactile_lab.engine.request import Request
from tactile_lab.errors import RecordingError, TactileLabError

if TYPE_CHECKING:
    from tactile_lab.bench import Bench, OffReport
    from tactile_lab.engine.manual import FieldReading
    from tactile_lab.engine.model_parts import StoredParts
    from tactile_lab.scene.scene import Scene

LONGEST = 300.0
"""Seconds a report may take."""


@dataclass(frozen=True)
class Identified:
    """One instrument answered, or did not.

    Attributes:
        role: coil, scope or meter.
        identity: as it answered.
        problem: why it did not, "" if it did.
    """

    role: str
    identity: str
    problem: str


@dataclass(frozen=True)
class Checked:
    """The bench was asked who is there, and the coil was made safe.

    Attributes:
        found: one entry per instrument of the bench.
        off: how the coil was left; None without a coil.
    """

    found: tuple[Identified, ...]
    off: OffReport | None


@dataclass(frozen=True)
class CheckBench(Job[Checked]):
    """Ask every instrument of a request's bench who it is; make the coil safe."""

    name = "check of the bench"
    request: Request

    def work(self, engine: Engine) -> Checked:
        """Who answers.

        Raises:
            SceneError: the bench cannot be used.
        """
        return check(_open(self.request.load(), realtime=engine.realtime))


def check(bench: Bench) -> Checked:
    """Open, identify and close each instrument; the coil is verified off on the way."""
    found: list[Identified] = []
    off: OffReport | None = None
    every = (("coil", bench.coil), ("scope", bench.scope), ("meter", bench.field_meter))
    with bench.clock.taking_part("check"):
        for role, instrument in every:
            if instrument is None:
                continue
            try:
                instrument.open()
                if instrument is bench.coil:
                    off = bench.coil.safe_off()
                identity = instrument.identity
                instrument.close()
                found.append(Identified(role, identity, ""))
            except (TactileLabError, OSError) as error:
                found.append(Identified(role, "", str(error)))
    return Checked(tuple(found), off)


@dataclass(frozen=True)
class ReadField(Job["FieldReading"]):
    """Read the field a few times.

    Attributes:
        request: names the bench.
        task: manual control whose bench it is; 0 if there is none.
    """

    name = "reading of the field"
    request: Request
    task: int = 0

    def work(self, engine: Engine) -> FieldReading:
        """What the teslameter showed."""
        from tactile_lab.engine.manual import read_field

        held = engine.tasks.get(self.task)
        if held is not None and held.task is not None:
            return read_field(held.task.bench)
        return read_field(_open(self.request.load(), realtime=True))


@dataclass(frozen=True)
class Record(Job[Path]):
    """Keep what the monitor `task` holds, the last minute, as a run in `out`."""

    name = "record of the monitor"
    task: int
    out: Path
    notes: Mapping[str, str] = field(default_factory=dict)

    def work(self, engine: Engine) -> Path:
        """The run's folder."""
        from tactile_lab.engine.monitor import Monitor

        held = engine.tasks.get(self.task)
        monitor = None if held is None else held.task
        if not isinstance(monitor, Monitor):
            raise RecordingError("Nothing has been seen yet.")
        return monitor.record(self.out, self.notes)


@dataclass(frozen=True)
class WriteReport(Job[None]):
    """Write figures, results and report into a finished run's folder.

    In a process of its own, behind the window and a next run.
    """

    name = "report"
    folder: Path

    def work(self, engine: Engine) -> None:
        """Write it.

        Raises:
            RecordingError: it could not be written.
        """
        asked = [sys.executable, "-m", "tactile_lab", "report", str(self.folder)]
        try:
            writing = subprocess.Popen(
                asked, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
            )
            if hasattr(os, "setpriority"):
                os.setpriority(os.PRIO_PROCESS, writing.pid, 10)
            _, said = writing.communicate(timeout=LONGEST)
        except (OSError, subprocess.TimeoutExpired) as error:
            raise RecordingError(f"The report was not written: {error}") from error
        if writing.returncode:
            last = (said.strip().splitlines() or ["no message"])[-1]
            raise RecordingError(f"The report was not written: {last}")


_SOLVING = threading.Lock()


@lru_cache(maxsize=1)
def _stored(folder: Path) -> StoredParts:
    from tactile_lab.engine.model_parts import StoredParts

    return StoredParts(folder)


@dataclass(frozen=True)
class ModelOfRun(Job[ModelPart]):
    """Solve the model beside a finished run, unless it was the last, and sample it.

    Attributes:
        folder: of the run.
        start, end: on the run's time axis, s.
        count: of bins; None: of a millisecond, if that is not too many.
    """

    name = "model"
    folder: Path
    start: float = 0.0
    end: float = math.inf
    count: int | None = None

    def work(self, engine: Engine) -> ModelPart:
        """The part asked for."""
        with _SOLVING:
            stored = _stored(self.folder)
        return stored.part(self.start, self.end, self.count)


def _open(scene: Scene, *, realtime: bool) -> Bench:
    from tactile_lab.engine.bench import open_bench
    from tactile_lab.planning.needs import needs

    return open_bench(scene, needs(scene), realtime=realtime)
