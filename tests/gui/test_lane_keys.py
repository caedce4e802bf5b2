"""The lanes by keys alone."""

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QMenu

from gui.look.tokens import LIGHT


def test_a_lane_is_driven_by_keys_alone(stack):
    force, v_c1 = stack.row("force"), stack.row("V_C1")
    force.card.setFocus()
    QTest.keyClick(force.card, Qt.Key.Key_Down)
    assert v_c1.card.hasFocus()
    low, high = v_c1.box.shown
    QTest.keyClick(v_c1.card, Qt.Key.Key_Up, Qt.KeyboardModifier.ControlModifier)
    nearer = v_c1.box.shown
    assert v_c1.box.locked
    assert nearer[1] - nearer[0] == pytest.approx((high - low) / 1.25)
    QTest.keyClick(v_c1.card, Qt.Key.Key_PageUp)
    assert v_c1.box.shown[0] == pytest.approx(nearer[0] + (high - low) / 12.5)
    QTest.keyClick(v_c1.card, Qt.Key.Key_Up, Qt.KeyboardModifier.ShiftModifier)
    assert [row.lane.key for row in stack.rows][:2] == ["V_C1", "force"]
    assert v_c1.card.hasFocus(), "the keyboard goes with its lane"
    QTest.keyClick(v_c1.card, Qt.Key.Key_Return)
    menu = stack.findChild(QMenu)
    assert menu.accessibleName() == "V_C1"
    chosen = {one.text(): one for one in menu.actions()}
    chosen["Cursor A here"].trigger()
    menu.close()
    assert stack.view.cursors[0] == pytest.approx(10.0), "the middle of 5 to 15 s"


def test_a_lane_shows_that_it_has_the_keyboard(stack):
    card = stack.row("V_C1").card
    before = card.grab().toImage()
    card.setFocus()
    after = card.grab().toImage()
    at = QPoint(1, card.height() // 2)
    assert after.pixelColor(at) != before.pixelColor(at)
    assert after.pixelColor(at).name().upper() == LIGHT.accent
