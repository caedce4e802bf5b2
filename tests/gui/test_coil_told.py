"""What the window claims of the coil, from what the engine told of it, and when."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from PySide6.QtWidgets import QApplication

from gui.session import coil, heard
from gui.session.live_task import LiveTask
from gui.session.session import Session
from gui.state import HOLDS, STALE, CoilKnowledge, Lamp, WindowState, stop_text, truth
from tactile_lab.acquisition.ending import CoilState, Ending
from tactile_lab.acquisition.events import RunState
from tactile_lab.bench import CoilLimits, OffReport
from tactile_lab.engine.events import Begun, Ended, Samples
from tactile_lab.engine.link import RemoteTask

LIMITS = CoilLimits()
VERIFIED = OffReport(True, 0.0, "Off, 0 mA read back.")
OFF, LIVE, UNKNOWN = CoilKnowledge.OFF, CoilKnowledge.LIVE, CoilKnowledge.UNKNOWN


class Told:
    """A window's session that hears what a test tells it, at the test's own times."""

    def __init__(self, folder: Path, patch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        patch.setattr(coil, "time", SimpleNamespace(monotonic=lambda: self.now))
        patch.setattr(heard, "monotonic", lambda: self.now)
        self.session = Session(folder, separate=False)
        self.session.status.state = WindowState.READY
        self.session.status.coil.use(LIMITS, "COM3")
        self.session.status.coil.left(VERIFIED)
        self.task: LiveTask = self.session.run

    def begin(self, task: LiveTask, *, told: bool = True) -> None:
        self.task, task.task = task, RemoteTask(0, lambda *_: None)
        if told:
            task.take(Begun(None, LIMITS, 0.2, 1.0, True))

    def tell(self, **known: object) -> None:
        self.task.take(Samples({}, CoilState(**known)))

    def end(self, off: OffReport = VERIFIED) -> None:
        self.task.take(Ended(Ending(RunState.FAULTED, off, "over")))

    @property
    def known(self) -> CoilKnowledge:
        return truth(self.session.state, self.session.coil_view())


@pytest.fixture
def told(
    app: QApplication, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Told]:
    made = Told(tmp_path, monkeypatch)
    yield made
    made.session.close()


@pytest.mark.parametrize("by", ["run", "manual"])
def test_a_coil_told_to_go_on_is_not_off_until_it_is_read_back(
    told: Told, by: str
) -> None:
    for reading in (7.0, 3.0):  # a second time, after a clock of its own
        told.begin(getattr(told.session, by))
        told.tell()
        assert told.known is OFF, "as it was left before: nothing was switched on"
        told.now += 60.0  # connecting may take its time
        told.tell(live=True)
        assert told.known is LIVE
        view = told.session.coil_view()
        words = stop_text(told.session.state, view).detail
        assert words == "switched on, not read back"
        told.now += STALE + 0.1
        told.tell(live=True)
        assert told.known is UNKNOWN, "its answers do not come"
        told.tell(live=True, setpoint=0.0, measured=0.0, read=reading)
        assert told.known is LIVE
        told.tell(live=False, off=VERIFIED, setpoint=0.0, measured=0.0, read=reading)
        assert told.known is OFF
        told.end()
        assert told.known is OFF
        told.now += 10.0


def test_off_is_claimed_in_a_run_only_while_the_engine_tells_so(told: Told) -> None:
    told.begin(told.session.run, told=False)
    told.now += 60.0
    assert told.known is OFF, "it plans: nothing is held before it has begun"
    told.session.run.take(Begun(None, LIMITS, 0.2, 1.0, True))
    told.tell()
    assert told.known is OFF
    told.now += STALE + 0.1
    assert told.known is UNKNOWN, "it may have been switched on since"
    told.tell()
    assert told.known is OFF
    told.now += 60.0
    told.tell(off=replace(VERIFIED))  # a report of its own, as old as it is told
    told.now += 60.0
    assert told.known is OFF, "it was left off and closed; nothing more comes"
    told.end()
    told.now += 60.0
    assert told.known is OFF


def test_off_is_as_old_as_its_read_back(told: Told) -> None:
    told.begin(told.session.run)
    told.now += 600.0
    told.tell(off=VERIFIED)
    told.end()
    assert told.known is OFF, "read back at the end of the run"
    told.now += HOLDS + 1
    assert told.known is CoilKnowledge.WAS_OFF
    chip = told.session.snapshot().instruments[0]
    assert chip.lamp is not Lamp.GOOD and chip.value == "—"
    told.session.status.coil.left(VERIFIED)
    assert told.known is OFF, "asked again"


def test_what_an_ended_run_could_not_verify_stays_unknown_in_the_next(
    told: Told,
) -> None:
    told.begin(told.session.run)
    told.tell(live=True)
    told.end(OffReport(False, None, "No answer."))
    assert told.known is UNKNOWN
    told.begin(told.session.run)
    told.tell()
    assert told.known is UNKNOWN, "nobody has looked since"
