"""Four lanes, and what a hand does to them."""

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, Qt
from PySide6.QtGui import QMouseEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from gui import bindings as _first  # noqa: F401  the first of all, as in gui.app
from gui.lanes.box import LaneBox
from gui.lanes.expected import Stretch
from gui.lanes.lane import lanes_for
from gui.lanes.live import LiveSource
from gui.lanes.stack import LaneStack
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from tactile_lab.trace import Trace

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def stack(app: QApplication) -> Iterator[LaneStack]:
    """Four lanes with 20 s of a slow sine, two steps and a spike each second."""
    made = LaneStack(TimeView(), Theme("light"))
    made.show_lanes(lanes_for(("force", "V_C1", "V_K", "spikes"), twin=False))
    made.resize(900, 600)
    made.show()
    source = LiveSource(None, 0.2)
    time = np.arange(20_000) / 1e3
    for signal in ("V_C1", "V_K"):
        mean = np.sin(time)
        bins = Trace.bins(time, mean - 0.01, mean + 0.01, mean, 1e-3)
        source.add_bins({signal: bins})
    source.add_spikes(tuple(np.arange(1.0, 20.0).tolist()))
    source.begin_trial(0, Stretch(0.0, 10.0, "50 mN"))
    source.begin_trial(1, Stretch(10.0, 20.0, "80 mN"))
    made.show_source(source)
    made.view.set_now(source.reach, source.length)
    made.view.show_span(5.0, 10.0)
    settle(app)
    yield made
    made.close()
    made.deleteLater()
    settle(app)


def settle(app: QApplication) -> None:
    for _ in range(3):
        app.processEvents()


def box(stack: LaneStack, key: str) -> LaneBox:
    row = stack.row(key)
    assert row is not None
    return row.box


def middle(stack: LaneStack, key: str, x: float | None = None) -> QPoint:
    place = box(stack, key).geometry()
    return QPoint(
        round(place.center().x() if x is None else x), round(place.center().y())
    )


def wheel(stack: LaneStack, at: QPoint, held: str = "NoModifier") -> None:
    where, view = QPointF(at), stack.scene.viewport()
    event = QWheelEvent(
        where, view.mapToGlobal(where), QPoint(), QPoint(0, 120),
        Qt.MouseButton.NoButton, Qt.KeyboardModifier[held],
        Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(view, event)


def move(stack: LaneStack, at: QPointF, held: Qt.MouseButton) -> None:
    view, none = stack.scene.viewport(), Qt.MouseButton.NoButton
    QApplication.sendEvent(view, QMouseEvent(
        QEvent.Type.MouseMove, at, view.mapToGlobal(at), none, held,
        Qt.KeyboardModifier.NoModifier,
    ))  # fmt: skip


def drag(stack: LaneStack, a: QPoint, b: QPoint) -> None:
    """With the button held in between, as a hand does it."""
    QTest.mousePress(stack.scene.viewport(), LEFT, pos=a)
    for share in (0.3, 0.6, 1.0):
        move(stack, QPointF(a) + QPointF(b - a) * share, LEFT)
    QTest.mouseRelease(stack.scene.viewport(), LEFT, pos=b)


def span(lane: LaneBox) -> float:
    low, high = lane.shown
    return high - low


def menu_of(app: QApplication, stack: LaneStack, at: QPoint) -> QMenu:
    QTest.mousePress(stack.scene.viewport(), Qt.MouseButton.RightButton, pos=at)
    QTest.mouseRelease(stack.scene.viewport(), Qt.MouseButton.RightButton, pos=at)
    (menu,) = (m for m in stack.findChildren(QMenu) if m.isVisible())
    return menu


def choose(app: QApplication, stack: LaneStack, key: str, words: str) -> None:
    menu = menu_of(app, stack, middle(stack, key))
    found = [a for a in menu.actions() if a.text() == words]
    for one in menu.findChildren(QMenu):
        found += [a for a in one.actions() if a.text() == words]
    (action,) = found
    action.trigger()
    menu.close()
    menu.deleteLater()
    settle(app)


def shown(stack: LaneStack) -> list[str]:
    return [one.lane.key for one in stack.visible_rows()]
