"""What is said to tasks in the engine: small classes that carry their own act.

A new command is a new class here, or wherever it belongs: the pipe takes any that can
be pickled.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tactile_lab.engine.engine import Begin, Command, Engine, ServedTask, ToTask

if TYPE_CHECKING:
    from tactile_lab.engine.execution import Execution
    from tactile_lab.engine.manual import ManualControl
    from tactile_lab.engine.task import Task

FOLLOWED = frozenset({"V_C1", "V_C2", "V_K", "spikes"})
"""Signals beside which the model runs."""


class Leave(Command):
    """Whoever looked closes: end all tasks, then the process."""

    def do(self, engine: Engine, number: int) -> None:
        """Serve no more."""
        engine.leaving = True


@dataclass(frozen=True)
class BeginRun(Begin):
    """Run a request.

    Attributes:
        out: folder for run folders.
        notes: kept with the run.
    """

    name = "run"
    out: Path
    notes: Mapping[str, str] = field(default_factory=dict)

    def make(self, served: ServedTask) -> Execution:
        """The run; the model follows it where its signals are recorded."""
        from tactile_lab.acquisition.asked_field import AskedField
        from tactile_lab.engine.execution import Execution

        scene = self.request.load()
        magnet = scene.bench.magnet
        if FOLLOWED & set(scene.record.signals):
            from tactile_lab.engine.model_parts import LiveParts

            served.model = LiveParts(scene)
        return Execution(
            scene,
            self.out,
            realtime=served.realtime,
            emit=served.emit,
            notes=self.notes,
            ask=served.ask,
            asked_field=AskedField(
                served.ask_field, lambda current: float(magnet.field(current))
            ),
        )


@dataclass(frozen=True)
class BeginMonitor(Begin):
    """Monitor a request that asks for no force; nothing is kept but by `Record`."""

    name = "monitor"

    def make(self, served: ServedTask) -> Task[Any]:
        """The monitor."""
        from tactile_lab.engine.monitor import Monitor

        return Monitor(self.request.load(), realtime=True, emit=served.emit)


@dataclass(frozen=True)
class BeginManual(Begin):
    """Open the coil source of a request's bench to drive it by hand; it stays off."""

    name = "manual control"

    def make(self, served: ServedTask) -> Task[Any]:
        """The manual control."""
        from tactile_lab.engine.manual import ManualControl

        return ManualControl(self.request.load(), realtime=True, emit=served.emit)


@dataclass(frozen=True)
class Stop(ToTask["Task[Any]"]):
    """Switch the coil off and end a task; why."""

    reason: str

    def act(self, task: Task[Any]) -> None:
        """Straight to the coil's thread."""
        task.stop(self.reason)


@dataclass(frozen=True)
class Note(ToTask["Execution"]):
    """Put a note of the user into a run's log, stamped with its time, s."""

    text: str
    time: float

    def act(self, task: Execution) -> None:
        """Log it."""
        task.note(self.text, self.time)


@dataclass(frozen=True)
class Hold(ToTask["ManualControl"]):
    """Have the coil go to `current`, A, and stay."""

    current: float

    def act(self, task: ManualControl) -> None:
        """Set it."""
        task.hold(self.current)


@dataclass(frozen=True)
class Renew(ToTask["ManualControl"]):
    """Whoever drives the coil lives: it may stay on for another 2 s."""

    def act(self, task: ManualControl) -> None:
        """Renew the lease."""
        task.renew()


@dataclass(frozen=True)
class Answer(Command):
    """The person has done what a run waits for; `text` is what was typed."""

    text: str = ""

    def do(self, engine: Engine, number: int) -> None:
        """Let the run go on."""
        if number in engine.tasks:
            engine.tasks[number].answers.put(self.text)
