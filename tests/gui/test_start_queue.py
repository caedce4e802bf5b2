"""The queue is started where something can begin; nowhere is a start kept for later."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from gui.session.queue import Queued
from gui.state import WindowState


@pytest.fixture
def started(lab, monkeypatch) -> list[str]:
    """Titles of what began, with one run in the queue."""
    began: list[str] = []
    monkeypatch.setattr(
        lab.session, "start", lambda _, title, plan: began.append(title)
    )
    request, plan = lab.window.setup.request(), lab.session.plan.expectation
    lab.session.queue.add(Queued("waits", request, plan))
    return began


def ask(lab) -> None:
    """As the shortcut's list has it."""
    lab.window.page.setFocus()
    both = Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier
    QTest.keyClick(lab.window, Qt.Key.Key_Return, both)


def nothing_begins_later(lab, started: list[str]) -> None:
    lab.until(lambda: lab.session.state is WindowState.READY)
    assert started == [], "the coil would be driven, unasked"
    assert lab.window.centre.notice.isHidden(), "what was in the way is not any more"
    lab.window.render_state()
    assert lab.window.setup.queue.resume.isVisible(), "it can be started now"
    ask(lab)
    assert started == ["waits"]


def test_a_bench_that_is_connected_drives_nothing(lab, started) -> None:
    session = lab.session
    session.disconnect_bench()
    ask(lab)
    assert session.log.lines[-1].text == "Nothing starts. Connect a bench first."
    seen = lab.window.centre.notice
    assert seen.isVisible() and "Connect a bench" in seen.text(), "low windows: no log"
    session.connect_bench("sim")
    nothing_begins_later(lab, started)


def test_a_fault_that_is_acknowledged_drives_nothing(lab, started) -> None:
    session = lab.session
    session.status.set_fault("A fault.", "Of a test.")
    ask(lab)
    assert session.log.lines[-1].text == "Nothing starts. Acknowledge the fault first."
    session.acknowledge()
    nothing_begins_later(lab, started)


def test_a_coil_that_is_let_go_drives_nothing(lab, started) -> None:
    session = lab.session
    session.begin_manual()
    ask(lab)
    assert "by hand first" in session.log.lines[-1].text
    session.manual.stop("let go")
    lab.until(lambda: not session.manual.alive)
    nothing_begins_later(lab, started)
