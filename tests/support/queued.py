"""A queue of runs in the window's tests."""

from typing import Any

from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QWidget

from gui.session.queue import Queued
from gui.state import WindowState
from tactile_lab.engine.request import Request


def busy(lab: Any) -> None:
    """As while a run is in progress, without one."""
    lab.session.run.request = lab.window.setup.request()
    lab.session.status.enter(WindowState.RUNNING)


def idle(lab: Any) -> None:
    """As after it, with nothing queued."""
    lab.session.queue.items.clear()
    lab.session.queue.held = False
    lab.session.queue.changed.emit()
    lab.session.status.enter(WindowState.READY)


def idle_after_run(lab: Any) -> None:
    """Stop the run in progress, and queue nothing."""
    lab.session.queue.items.clear()
    lab.session.stop("test is over")
    lab.until(lambda: lab.session.state is WindowState.READY)
    idle(lab)


def waiting(lab: Any) -> list[Queued]:
    """Runs in the queue, the next one first."""
    items: list[Queued] = lab.session.queue.items
    return items


def three_waiting(lab: Any) -> None:
    """One, two and three wait, like the form but for the hold: 1, 2 and 3 s."""
    session, asked = lab.session, lab.window.setup.request()
    busy(lab)
    for number, title in enumerate(("one", "two", "three"), start=1):
        hold = (*asked.overrides, f'protocol.hold="{number} s"')
        session.queue.add(Queued(title, Request(asked.path, hold, asked.bench)))
    lab.until(lambda: all(item.expectation for item in session.queue.items))


def type_into(field: QWidget, text: str) -> None:
    """Type a text in place of what a field has."""
    (edit,) = field.findChildren(QLineEdit)
    edit.selectAll()
    QTest.keyClicks(edit, text)
