"""What is told at the terminal of a task that does not end."""

import threading

from tactile_lab.acquisition.ending import CoilState, Ending
from tactile_lab.acquisition.events import RunState
from tactile_lab.bench import Bench, OffReport
from tactile_lab.clock import RealClock
from tactile_lab.commands import attended
from tactile_lab.commands.attended import Signals, run_attended
from tactile_lab.engine.task import Task
from tactile_lab.scene.load import load

OFF = OffReport(True, 0.0, "Output off, 0 A read back.")


class Blocked(Task[Ending]):
    """Its coil is off, and it waits."""

    off: OffReport | None = None

    def __init__(self) -> None:
        bench = Bench(name="blocked", simulated=True, clock=RealClock())
        super().__init__(load("demo"), bench, lambda event: None)
        self.let_go = threading.Event()

    def run(self) -> Ending:
        assert self.let_go.wait(60.0)
        return Ending(RunState.COMPLETE, OFF)

    @property
    def coil_state(self) -> CoilState:
        return CoilState(off=self.off)


def test_a_task_that_does_not_end_after_its_coil_says_how_to_end_it(
    monkeypatch, capsys
):
    """A protocol that blocked left the terminal silent, and Ctrl-C did nothing."""
    monkeypatch.setattr(attended, "OVERDUE", 0.0)
    blocked, told = Blocked(), []

    def look() -> None:
        told.append(capsys.readouterr().err)
        if len(told) == 2:
            blocked.off = OFF
        if len(told) == 6:
            blocked.let_go.set()

    with Signals() as signals:
        assert run_attended(blocked, signals, look).off is OFF
    assert not any(told[:2])
    (text,) = filter(None, told)
    assert "The coil is left: Output off, 0 A read back." in text
    assert "kill -9" in text
