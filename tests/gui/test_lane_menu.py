"""What the menu of a lane does, and how lanes are arranged."""

import pytest
from lane_stack import box, choose, drag, menu_of, middle, move, settle, shown
from PySide6.QtCore import QEvent, QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QMouseEvent
from PySide6.QtWidgets import QApplication

from gui.lanes.arrangement import Arrangement
from gui.lanes.card import LaneCard
from gui.lanes.lane import lanes_for
from gui.lanes.stack import LaneStack
from gui.lanes.view import TimeView
from gui.look.theme import Theme


def test_the_menu_names_a_lane_as_its_card_does(app, stack) -> None:
    """It offered "Hide Measured V_C1 less the model's"."""
    stack.show_lanes(lanes_for(("V_C1",)))
    settle(app)
    for key, name in (("residual", "Residual"), ("V_C1", "V_C1")):
        menu = menu_of(app, stack, middle(stack, key))
        assert f"Hide {name}" in [one.text() for one in menu.actions()]
        menu.close()
        menu.deleteLater()
        settle(app)


def test_the_menu_of_a_lane(app, stack):
    lane = box(stack, "V_C1")
    under = stack.scene.time_at(middle(stack, "V_C1").x())
    choose(app, stack, "V_C1", "Keep this range")
    assert lane.locked
    choose(app, stack, "V_C1", "Automatic range")
    assert not lane.locked
    choose(app, stack, "V_C1", "Cursor B here")
    assert stack.view.cursors[1] == pytest.approx(under)
    assert stack.view.start < stack.view.cursors[0] < stack.view.end
    choose(app, stack, "V_C1", "80 mN")
    assert (stack.view.start, stack.view.width) == pytest.approx((9.5, 11.0))
    asked = []
    stack.export_asked.connect(lambda: asked.append(True))
    choose(app, stack, "V_C1", "Export this view …")
    assert asked == [True]
    choose(app, stack, "V_C1", "Hide V_C1")
    assert stack.is_hidden("V_C1")


def test_the_crosshair_tells_time_and_values_and_goes_with_the_pointer(app, stack):
    bare = stack.scene.grab().toImage()
    choose(app, stack, "V_C1", "Crosshair")
    at = middle(stack, "V_C1")
    move(stack, QPointF(at), Qt.MouseButton.NoButton)
    settle(app)
    crossed = stack.scene.grab().toImage()
    for key in ("V_C1", "V_K"):
        place = box(stack, key).geometry()
        part = QRect(at.x() + 4, round(place.top()) + 2, 60, 14)
        assert crossed.copy(part) != bare.copy(part), key
    QApplication.sendEvent(stack.scene, QEvent(QEvent.Type.Leave))
    settle(app)
    assert stack.scene.grab().toImage() == bare


def drag_card(card: LaneCard, y: float, by: float) -> None:
    """Drag a lane's card by so many px, in steps as a hand does."""
    at, button = QPointF(40, y), Qt.MouseButton.LeftButton
    for kind, moved in (
        (QEvent.Type.MouseButtonPress, 0.0),
        *((QEvent.Type.MouseMove, by * part / 8) for part in range(1, 9)),
        (QEvent.Type.MouseButtonRelease, by),
    ):
        there = QPointF(card.mapToGlobal(at.toPoint())) + QPointF(0, moved)
        QApplication.sendEvent(
            card,
            QMouseEvent(
                kind, at, there, button, button, Qt.KeyboardModifier.NoModifier
            ),
        )


def test_lanes_are_moved_and_resized_by_drag_and_stay_so(app, stack):
    settle(app)
    before = box(stack, "V_C1").height()
    card = stack.row("V_C1").card
    drag_card(card, card.height() - 2, 30)
    settle(app)
    assert box(stack, "V_C1").height() == pytest.approx(before + 30, abs=3)
    card = stack.row("spikes").card
    drag_card(card, 10, -1.1 * card.height())
    settle(app)
    assert shown(stack) == ["force", "V_C1", "spikes", "V_K", "rate"]
    tops = [box(stack, key).geometry().top() for key in shown(stack)]
    assert tops == sorted(tops), "plots are beside their cards"
    other = LaneStack(TimeView(), Theme("light"))
    other.arrangement.restore(stack.arrangement.text)
    other.show_lanes(lanes_for(("force", "V_C1", "V_K", "spikes"), twin=False))
    kept = [one.lane.key for one in other.rows if not other.is_hidden(one.lane.key)]
    assert [key for key in kept if key in shown(stack)] == shown(stack)
    choose(app, stack, "V_C1", "All as at first")
    assert shown(stack)[:3] == ["force", "V_C1", "V_K"]
    other.close()


def test_a_lane_grows_where_the_next_below_is_at_its_least(app, stack):
    """On a small screen the edge above a low lane could be dragged and did nothing."""
    settle(app)
    before, by = box(stack, "V_C1").height(), box(stack, "V_K").height()
    card = stack.row("V_C1").card
    drag_card(card, card.height() - 2, by)
    settle(app)
    assert box(stack, "V_C1").height() == pytest.approx(before + by, abs=4)
    drag_card(card, card.height() - 2, -by)
    settle(app)
    assert box(stack, "V_C1").height() == pytest.approx(before, abs=4)


@pytest.mark.parametrize("text", ["", "no JSON", "{}", '[[], {"V_K": -1}, []]'])
def test_an_arrangement_that_cannot_be_read_changes_nothing(text):
    lanes = lanes_for(("force", "V_C1", "V_K"), twin=False)
    arrangement = Arrangement()
    arrangement.put(["V_K"])
    arrangement.restore(text)
    assert arrangement.ordered(lanes)[0].key == "V_K"
    assert arrangement.weight(lanes[0]) == lanes[0].weight


def test_level_lines_are_put_dragged_and_told(app, stack):
    lane, bare = box(stack, "V_C1"), stack.scene.grab().toImage()
    at = middle(stack, "V_C1")
    under = lane.value_at(at.y())
    choose(app, stack, "V_C1", "Level line here")
    assert lane.levels == [pytest.approx(under, abs=0.05)]
    settle(app)
    assert stack.scene.grab().toImage() != bare
    start = QPoint(at.x(), round(lane.y() + lane.height() / 2))
    lane.levels = [lane.value_at(start.y())]
    drag(stack, start, start - QPoint(0, 20))
    assert lane.levels[0] == pytest.approx(lane.value_at(start.y() - 20), abs=0.02)
    choose(app, stack, "V_C1", "Remove level lines")
    assert lane.levels == []
