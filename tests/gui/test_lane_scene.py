"""The lanes under the hand: values, time, cursors, zoom, menu, export."""

from collections.abc import Iterator

import numpy as np
import pytest
from PySide6.QtCore import (
    QEvent,
    QPoint,
    QPointF,
    QRect,
    QRectF,
    Qt,
    qInstallMessageHandler,
)
from PySide6.QtGui import QImage, QMouseEvent, QPainter, QWheelEvent
from PySide6.QtSvg import QSvgGenerator, QSvgRenderer
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QMenu

from gui.lanes import navigator
from gui.lanes.arrangement import Arrangement
from gui.lanes.box import LaneBox, heights_of
from gui.lanes.card import LaneCard
from gui.lanes.expected import Preview, Stretch
from gui.lanes.floor import AXIS
from gui.lanes.lane import lanes_for
from gui.lanes.navigator import Navigator
from gui.lanes.source import LiveSource, PlanSource
from gui.lanes.stack import LaneStack
from gui.lanes.tools import Tools
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.look.tokens import DARK, LIGHT
from gui.parts import IconButton
from tactile_lab.trace import Trace
from tactile_lab.waveform import Waveform

LEFT = Qt.MouseButton.LeftButton


@pytest.fixture
def stack(app) -> Iterator[LaneStack]:
    """Four lanes with 20 s of a slow sine, two steps and a spike each second."""
    made = LaneStack(TimeView(), Theme("light"))
    made.show_lanes(lanes_for(("force", "V_C1", "V_K", "spikes"), twin=False))
    made.resize(900, 600)
    made.show()
    source = LiveSource(None, 0.2)
    time = 1e-3 * np.arange(20_000)
    for signal in ("V_C1", "V_K"):
        mean = np.sin(time).astype(np.float32)
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
        move(stack, QPointF(a) + share * QPointF(b - a), LEFT)
    QTest.mouseRelease(stack.scene.viewport(), LEFT, pos=b)


def test_the_threshold_is_dragged_to_where_the_next_run_counts(
    app: QApplication, stack: LaneStack, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LiveSource, "threshold", 0.5)
    lane, asked = box(stack, "V_K"), []
    stack.threshold_asked.connect(asked.append)
    bare = stack.scene.grab().toImage()
    low, high = lane.shown
    line = lane.geometry().bottom() - lane.height() * (0.5 - low) / (high - low)
    start, view = QPoint(AXIS + 200, round(line)), stack.view.start
    drag(stack, start, start - QPoint(0, 20))
    assert asked == [pytest.approx(lane.value_at(line - 20), abs=0.03)]
    assert stack.view.start == view and lane.wanted is None
    settle(app)
    assert stack.scene.grab().toImage() == bare, "the run's own stays where it was"
    drag(stack, start, QPoint(start.x(), round(lane.geometry().bottom()) - 1))
    assert len(asked) == 1, "below 0 nothing can be counted"


@pytest.mark.parametrize(
    ("low", "high", "height"), [(-25, 200, 39), (3.8, 4.45, 55), (-5, 55, 500)]
)
def test_a_low_axis_tells_two_heights_and_a_high_one_not_too_many(low, high, height):
    found = heights_of(low, high, height)
    assert 2 <= len(found) <= 13
    assert all(4 <= told <= height - 4 for _, _, told in found), "none is cut off"
    assert all(abs(line - told) <= 4.5 for _, line, told in found)


def span(lane: LaneBox) -> float:
    low, high = lane.shown
    return high - low


def test_plots_lie_beside_their_cards(app, stack):
    stack.hide_lane("V_K", True)
    settle(app)
    for row in stack.visible_rows():
        place, card = row.box.geometry(), row.card.geometry()
        assert card.top() <= place.top() < place.bottom() <= card.top() + card.height()
    assert not box(stack, "V_K").isVisible()


@pytest.mark.parametrize("how", ["axis", "Ctrl"])
def test_the_wheel_zooms_values_of_one_lane_and_its_range_stays(app, stack, how):
    lane, other = box(stack, "V_C1"), box(stack, "V_K")
    before, beside, time = span(lane), other.shown, stack.view.width
    if how == "axis":
        wheel(stack, middle(stack, "V_C1", AXIS / 2))
    else:
        wheel(stack, middle(stack, "V_C1"), "ControlModifier")
    settle(app)
    assert np.isclose(span(lane), before / 1.25)
    assert other.shown == beside and stack.view.width == time
    kept = lane.shown
    stack.view.show_span(0.0, 20.0)
    settle(app)
    assert lane.shown == kept


def test_a_drag_on_the_axis_moves_the_values_and_a_double_click_ends_it(app, stack):
    lane = box(stack, "V_C1")
    before = lane.shown
    at = middle(stack, "V_C1", AXIS / 2)
    drag(stack, at, at + QPoint(0, 20))
    settle(app)
    assert np.isclose(span(lane), before[1] - before[0]) and lane.shown[0] > before[0]
    assert lane.locked
    QTest.mouseDClick(stack.scene.viewport(), LEFT, pos=at)
    settle(app)
    assert lane.shown == before and not lane.locked


def test_a_drag_pans_and_the_wheel_zooms_time(app, stack):
    at = middle(stack, "V_K")
    under = stack.scene.time_at(at.x())
    wheel(stack, at)
    assert np.isclose(stack.view.width, 8.0)
    assert np.isclose(stack.scene.time_at(at.x()), under)
    drag(stack, at, at + QPoint(100, 0))
    assert np.isclose(stack.scene.time_at(at.x() + 100), under)
    assert np.isclose(stack.view.width, 8.0)


def test_a_zoom_box_zooms_time_and_values_and_shows_the_data_in_it(app, stack):
    lane = box(stack, "V_C1")
    stack.stage.zoom_box = True
    stack.scene.box_zoomed.connect(lambda a, b: stack.view.show_span(a, b - a))
    place = lane.geometry()
    a = place.topLeft().toPoint() + QPoint(100, 10)
    b = a + QPoint(200, 30)
    before, times = span(lane), (stack.scene.time_at(a.x()), stack.scene.time_at(b.x()))
    QTest.mousePress(stack.scene.viewport(), LEFT, pos=a)
    move(stack, QPointF(b), LEFT)
    image = stack.scene.grab().toImage()
    inside = {image.pixelColor(x, a.y() + 15).name() for x in range(a.x(), b.x())}
    QTest.mouseRelease(stack.scene.viewport(), LEFT, pos=b)
    settle(app)
    assert np.isclose(stack.view.start, times[0]) and np.isclose(
        stack.view.end, times[1]
    )
    assert np.isclose(span(lane), before * 30 / place.height())
    assert len(inside) > 1, "the box covers what is in it"


def test_a_cursor_is_dragged_through_all_lanes(app, stack):
    stack.view.place_cursors(8.0, 12.0)
    settle(app)
    x = round(stack.stage.whole().x1(8.0))
    drag(stack, middle(stack, "V_K", x), middle(stack, "V_C1", x + 60))
    a, b = stack.view.cursors
    assert np.isclose(a, stack.scene.time_at(x + 60)) and b == 12.0
    assert stack.view.start == 5.0, "the view stays"


def menu_of(app, stack: LaneStack, at: QPoint) -> QMenu:
    QTest.mousePress(stack.scene.viewport(), Qt.MouseButton.RightButton, pos=at)
    QTest.mouseRelease(stack.scene.viewport(), Qt.MouseButton.RightButton, pos=at)
    (menu,) = (m for m in stack.findChildren(QMenu) if m.isVisible())
    return menu


def choose(app, stack: LaneStack, key: str, words: str) -> None:
    menu = menu_of(app, stack, middle(stack, key))
    found = [a for a in menu.actions() if a.text() == words]
    for one in (a.menu() for a in menu.actions() if a.menu()):
        found += [a for a in one.actions() if a.text() == words]
    (action,) = found
    action.trigger()
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


def test_back_and_forward_through_what_was_seen():
    view = TimeView()
    clock = iter(np.arange(0.0, 100.0, 10.0).tolist())
    view.clock = lambda: next(clock)
    view.set_now(100.0, 100.0)
    for start in (0.0, 20.0, 40.0):
        view.show_span(start, 5.0)
    view.back()
    assert view.start == 20.0
    view.back()
    assert view.start == 0.0
    view.forward()
    assert view.start == 20.0
    view.show_span(60.0, 5.0)
    view.forward()
    assert view.start == 60.0, "a new way has no forward"
    view.back()
    assert view.start == 20.0


def test_one_drag_is_one_step_back():
    view = TimeView()
    view.clock = lambda: 1.0
    view.set_now(100.0, 100.0)
    view.show_span(10.0, 5.0)
    for start in range(11, 30):
        view.show_span(float(start), 5.0)
    view.back()
    assert view.start == 95.5, "where it was before: following the newest data"


@pytest.mark.parametrize("tokens", [LIGHT, DARK], ids=["light", "dark"])
def test_the_same_picture_on_screen_in_png_and_in_svg(app, stack, tokens, tmp_path):
    stack.stage.tokens = tokens
    target = QRectF(stack.scene.rect())
    size = stack.scene.size()
    pictures = {"screen": stack.scene.grab().toImage()}
    pictures["png"] = QImage(size, QImage.Format.Format_RGB32)
    painter = QPainter(pictures["png"])
    stack.scene.draw_onto(painter, target, tokens)
    painter.end()
    generator = QSvgGenerator()
    generator.setFileName(str(tmp_path / "lanes.svg"))
    generator.setSize(size)
    generator.setViewBox(target)
    painter = QPainter(generator)
    stack.scene.draw_onto(painter, target, tokens)
    painter.end()
    pictures["svg"] = QImage(size, QImage.Format.Format_RGB32)
    painter = QPainter(pictures["svg"])
    QSvgRenderer(str(tmp_path / "lanes.svg")).render(painter, target)
    painter.end()
    grey = {name: pixels(image) for name, image in pictures.items()}
    assert np.array_equal(grey["screen"], grey["png"])
    assert np.mean(np.abs(grey["svg"] - grey["screen"]) > 40) < 0.02
    assert grey["screen"].std() > 3


def pixels(image: QImage) -> np.ndarray:
    grey = image.convertToFormat(QImage.Format.Format_Grayscale8)
    rows = np.frombuffer(grey.constBits(), np.uint8).reshape(grey.height(), -1)
    return rows[:, : grey.width()].astype(int)


def test_lanes_that_cannot_be_painted_leave_the_window_alive(app, stack, qtbot):
    lane, complaints = box(stack, "V_C1"), []
    before = qInstallMessageHandler(lambda *words: complaints.append(words[-1]))
    with qtbot.captureExceptions() as told:
        for one in (lane, box(stack, "V_K")):
            one._traces = lambda *_: 1 / 0
        stack.scene.grab()
        stack.scene.grab()
        for one in (lane, box(stack, "V_K")):
            del one._traces
        settle(app)
    qInstallMessageHandler(before)
    assert complaints == [], "Painter ended with 2 saved states"
    assert len(told) >= 4 and {one[0] for one in told} == {ZeroDivisionError}
    assert not stack.scene.grab().isNull()


@pytest.mark.parametrize("width", [700, 900, 1100, 1250, 1400])
def test_cursors_move_no_button_and_tell_their_times(app, stack, width):
    tools = Tools(stack, stack.view, Theme("light"))
    tools.resize(width, 46)
    tools.show()
    settle(app)

    def places() -> list[QRect]:
        return [button.geometry() for button in tools.findChildren(IconButton)]

    before, bare = places(), stack.scene.grab().toImage()
    tools.cursors.click()
    settle(app)
    assert places() == before
    shown, frame = stack.scene.grab().toImage(), stack.stage.whole()
    for time in stack.view.cursors:
        part = QRect(round(frame.x1(time)) - 20, round(frame.bottom) + 5, 40, 12)
        assert shown.copy(part) != bare.copy(part)
    if width >= 1250:
        assert "Δt" in tools.readout.text() and "Hz" in tools.readout.text()
    tools.close()
    tools.deleteLater()
    settle(app)


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


def shown(stack: LaneStack) -> list[str]:
    return [one.lane.key for one in stack.visible_rows()]


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


def test_a_stretch_beyond_the_range_is_shaded(app, stack, monkeypatch):
    bare = stack.scene.grab().toImage()
    beyond = {"V_C1": np.array([[7.0, 9.0]])}
    nothing = np.empty((0, 2))
    monkeypatch.setattr(
        LiveSource, "beyond", lambda self, signal: beyond.get(signal, nothing)
    )
    seen = stack.scene.grab().toImage()
    for key, marked in (("V_C1", True), ("V_K", False)):
        lane = box(stack, key)
        at = QPoint(round(stack.stage.whole().x1(8.0)), round(lane.y() + 4))
        assert (seen.pixelColor(at) != bare.pixelColor(at)) is marked, key


def test_lanes_that_stay_keep_their_range_when_another_comes(app, stack):
    lane = box(stack, "V_C1")
    lane.zoom(2.0, lane.y() + 10)
    lane.levels = [0.5]
    shown_before = lane.shown
    stack.show_lanes(lanes_for(("force", "V_C1", "V_K", "spikes"), twin=True))
    settle(app)
    assert box(stack, "V_C1") is lane
    assert lane.shown == shown_before and lane.levels == [0.5]
    assert box(stack, "residual").isVisible()
    stack.show_lanes(lanes_for(("force", "V_C1", "V_K", "spikes"), twin=False))
    settle(app)
    assert stack.row("residual") is None
    assert shown(stack) == ["force", "V_C1", "V_K", "spikes", "rate"]


@pytest.mark.parametrize("pull", [-0.05, 0.0])
def test_the_whole_run_shows_a_pull_below_the_push(app, pull):
    force = Waveform.through([(0.0, 0.0), (1.0, 0.05), (3.0, pull), (4.0, 0.0)])
    whole = Navigator(TimeView(), Theme("light"))
    whole.source = PlanSource(Preview(force, length=4.0))
    whole.resize(600, 62)
    whole.show()
    app.processEvents()
    low, high = whole._box.viewRange()[1]
    assert high == pytest.approx(1.05)
    assert low == pytest.approx(1.05 * pull / 0.05, abs=1e-6)
    assert min(whole._plan.getData()[1]) == pytest.approx(pull / 0.05, abs=1e-6)


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


def test_the_window_in_the_whole_run_follows_as_its_picture_grows(app, monkeypatch):
    """It was moved by a pixel in every frame: a tenth of what a frame cost."""
    clock = [100.0]
    monkeypatch.setattr(navigator, "monotonic", lambda: clock[0])
    source, view = LiveSource(None, 0.2), TimeView()
    source.holds.append(Stretch(0.0, 20.0, "hold"))
    whole = Navigator(view, Theme("light"))
    whole.source = source

    def shown_at(now: float) -> tuple[float, float]:
        cells = np.arange(source.reach, now, 1e-3)
        source.add_bins({"V_C1": Trace.bins(cells, cells, cells, cells, 1e-3)})
        view.set_now(now, 20.0)
        whole.refresh()
        return whole.window_.getRegion()

    first = shown_at(6.0)
    assert first == (view.start, view.end)
    clock[0] += 0.033
    assert shown_at(6.033) == first and view.end > first[1]
    view.set_width(3.0)
    assert shown_at(6.04) == (view.start, view.end)  # what a hand does is seen at once
    clock[0] += navigator.GROWS
    assert shown_at(6.3) == (view.start, view.end)
    view.show_span(1.0, 2.0)
    assert shown_at(6.4) == (1.0, 3.0)
