"""The lanes under the pointer: values, time, cursors, zoom."""

from itertools import pairwise, product

import numpy as np
import pytest
from lane_stack import LEFT, box, drag, middle, move, settle, shown, span, wheel
from PySide6.QtCore import QPoint, QPointF, QRect, Qt
from PySide6.QtGui import QImage, QPainter
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from gui.lanes.across import Across, draw_across, places
from gui.lanes.box import heights_of
from gui.lanes.expected import Stretch
from gui.lanes.floor import AXIS, cursor_times, grounds, round_times
from gui.lanes.lane import lanes_for
from gui.lanes.live import LiveSource
from gui.lanes.paint import Frame, shortened, width_of
from gui.lanes.stack import LaneStack
from gui.lanes.tools import Tools
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.look.tokens import LIGHT
from gui.parts import IconButton


def test_plots_stay_beside_their_cards_where_these_are_laid_out_later(
    app: QApplication, stack: LaneStack
) -> None:
    """After a plan that had failed each lane stood 3 to 14 px below its card."""
    first = stack.visible_rows()[0].card
    first.setMinimumHeight(first.height() + 40)
    settle(app)
    settle(app)
    for one in stack.visible_rows():
        assert one.box.y() == one.card.y() + 5


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
    ("low", "high", "height"),
    [
        *((-25, 200, 39), (3.8, 4.45, 55), (-5, 55, 500), (-1, 15, 20)),
        (0.47, 2.7, 60),  # the lowest, moved inwards, lay over the next
        *((0.01 * low, 2.7, height) for low in range(0, 60, 7) for height in (28, 66)),
    ],
)
def test_a_low_axis_tells_two_heights_and_a_high_one_not_too_many(low, high, height):
    found = heights_of(low, high, height)
    assert 2 <= len(found) <= 13
    assert all(4 <= told <= height - 4 for _, _, told in found), "none is cut off"
    assert all(abs(line - told) <= 7 for _, line, told in found)
    heights = [told for _, _, told in found]
    assert min(b - a for b, a in pairwise(heights)) >= 11, "none lies over another"


@pytest.mark.parametrize("height", [15, 18])
@pytest.mark.parametrize(("low", "high"), [(-60, 60), (-0.5, 7)])
def test_an_axis_lower_than_two_numbers_has_one(low, high, height):
    """Below a banner on a small screen, 50 stood on -50."""
    ((words, _, told),) = heights_of(low, high, height)
    assert words in ("50", "5") and 4 <= told <= height - 4


@pytest.mark.parametrize(("a", "b"), [(6.4, 12.0), (5.2, 5.9), (6.0, 6.1), (0.1, 30.0)])
def test_no_round_time_stands_half_below_that_of_a_cursor(app, a, b):
    view = TimeView()
    view.set_now(20.0, 20.0)
    view.show_span(0.0, 20.0)
    view.place_cursors(a, b)
    frame = Frame(0.0, 1200.0, 0.0, 100.0, view.start, view.end, 0.0, 1.0)
    times = round_times(view, frame)
    whole = [x for x, _, told in times if told]
    seen = [
        (x - side * width_of(words), x + (1 - side) * width_of(words))
        for x, words, side in cursor_times(view, frame)
        if x <= frame.right
    ]
    assert len(times) > 5 and 3 <= len(whole) < len(times)
    assert all(not left <= x <= right for x in whole for left, right in seen)


def test_a_line_across_beyond_the_lane_leaves_no_half_of_its_words(app) -> None:
    image = QImage(200, 40, QImage.Format.Format_RGB32)
    image.fill(Qt.GlobalColor.white)
    bare = image.copy()
    painter, dots = QPainter(image), Qt.PenStyle.DotLine
    frame = Frame(0, 200, 0, 40, 0, 1, -0.25, 0.25)
    for value in (0.35, -0.35):
        line = Across(value, "threshold", LIGHT.muted, dots, right=False)
        draw_across(painter, frame, [line], LIGHT.plot)
    painter.end()
    assert image == bare


@pytest.mark.parametrize("tall", [20.0, 34.0, 90.0])
def test_words_of_lines_across_lie_in_the_lane_and_over_no_others(tall):
    high, widths = 16, (40.0, 110.0)
    for a, b in product(np.linspace(0.5, tall - 0.5, 9), repeat=2):
        one, other = places([a, b], widths, tall)
        assert abs(one[1] - other[1]) >= high or other[0] > one[0] + widths[0]
        for _, at in (one, other):
            assert -4 <= at - high / 2 and at + high / 2 <= tall + 5


def test_a_name_that_is_cut_off_shows_that_it_is(app) -> None:
    assert shortened("160 mN", 60) == "160 mN"
    assert shortened("160 mN", 36).endswith("…"), "not 160 m"
    assert shortened("160 mN", 8) == ""


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
    stack.view.clock = lambda: 1e9  # long after the view was chosen
    if how == "axis":
        wheel(stack, middle(stack, "V_C1", AXIS / 2))
    else:
        wheel(stack, middle(stack, "V_C1"), "ControlModifier")
    settle(app)
    assert np.isclose(span(lane), before / 1.25)
    assert other.shown == beside and stack.view.width == time
    kept, seen = lane.shown, (stack.view.start, stack.view.width)
    stack.view.back()
    settle(app)
    assert np.isclose(span(lane), before), "values alone are a step back"
    assert (stack.view.start, stack.view.width) == seen and not lane.locked
    stack.view.forward()
    stack.view.show_span(0.0, 20.0)
    settle(app)
    assert lane.shown == kept


def test_a_drag_on_the_axis_moves_the_values_and_a_double_click_ends_it(app, stack):
    lane = box(stack, "V_C1")
    before, seen = lane.shown, stack.view.start
    stack.view.clock = lambda: 1e9  # long after the view was chosen
    at = middle(stack, "V_C1", AXIS / 2)
    drag(stack, at, at + QPoint(0, 20))
    settle(app)
    assert np.isclose(span(lane), before[1] - before[0]) and lane.shown[0] > before[0]
    assert lane.locked
    stack.view.back()
    settle(app)
    assert lane.shown == before and not lane.locked, "the drag is taken back"
    assert stack.view.start == seen
    stack.view.forward()
    settle(app)
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
    stack.view.back()
    settle(app)
    assert np.isclose(span(lane), before) and not lane.locked, "values go back, too"
    stack.view.forward()
    settle(app)
    assert np.isclose(span(lane), before * 30 / place.height()) and lane.locked
    assert len(inside) > 1, "the box covers what is in it"


def test_a_cursor_is_dragged_through_all_lanes(app, stack):
    stack.view.place_cursors(8.0, 12.0)
    settle(app)
    x = round(stack.stage.whole().x1(8.0))
    drag(stack, middle(stack, "V_K", x), middle(stack, "V_C1", x + 60))
    a, b = stack.view.cursors
    assert np.isclose(a, stack.scene.time_at(x + 60)) and b == 12.0
    assert stack.view.start == 5.0, "the view stays"


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


def test_a_hidden_lane_that_comes_is_not_seen(app, stack):
    """It stood in the corner of the lane of the force, over its axis."""
    keys = [row.lane.key for row in stack.rows]
    stack.show_lanes(lanes_for([*keys, "coil_current"], twin=False))
    settle(app)
    assert not box(stack, "coil_current").isVisible()
    assert box(stack, "force").isVisible()


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


def test_no_pixel_below_the_lanes_is_filled_twice() -> None:
    """Of two steps that overlap the later is seen, and the future before any."""
    source = LiveSource(None, 0.2)
    steps = (-5, -2, ""), (0, 4, ""), (3, 5, "recovery"), (6, 99, "")
    source.holds = [Stretch(a, b, t, pause=bool(t)) for a, b, t in steps]
    source.add_reading("force", 8.0, 0.0)
    across = grounds(source, Frame(50, 150, 0, 10, 0, 10, 0, 1), LIGHT)
    plain, band, pause = LIGHT.plot, LIGHT.band, LIGHT.sunken
    ahead = (130, LIGHT.ahead), (150, plain)
    assert across == [
        (0, plain), (50, band), (80, pause), (100, plain), (110, band), *ahead
    ]  # fmt: skip
    source.running = False
    across = grounds(source, Frame(50, 150, 0, 10, 0, 10, 0, 1), LIGHT)
    assert across[-2:] == [(110, band), (150, plain)]
