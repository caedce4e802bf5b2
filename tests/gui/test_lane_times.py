"""Which times the lanes show: the way back, and the whole run below them."""

import numpy as np
import pytest

from gui.lanes import navigator
from gui.lanes.expected import Preview, Stretch
from gui.lanes.floor import AXIS, LaneContext, round_times
from gui.lanes.live import LiveSource
from gui.lanes.navigator import Navigator
from gui.lanes.source import PlanSource
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from tactile_lab.trace import Trace
from tactile_lab.waveform import Waveform


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


@pytest.mark.parametrize("room", [250, 372, 1000])
def test_the_time_axis_has_two_numbers_at_least(room: int) -> None:
    """From 0.35 to 8.9 s it had 5 alone, which says nothing of the scale."""
    view = TimeView()
    stage = LaneContext(view, width=AXIS + room + 56, lanes=[(0.0, 300.0)])
    view.set_now(100.0, 100.0)
    for width in np.geomspace(1e-4, 120.0, 97):
        for start in (-0.1 * width, 0.0, 0.35, 9.99):
            view.show_span(start, width)
            told = [
                words for _, words, seen in round_times(view, stage.whole()) if seen
            ]
            assert len(told) > 1, (start, width, told)


def test_one_drag_is_one_step_back():
    view = TimeView()
    view.clock = lambda: 1.0
    view.set_now(100.0, 100.0)
    view.show_span(10.0, 5.0)
    for start in range(11, 30):
        view.show_span(float(start), 5.0)
    view.back()
    assert view.start == 95.5, "where it was before: following the newest data"


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
