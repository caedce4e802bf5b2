"""Numbers beside the lanes."""

import numpy as np
import pytest
from PySide6.QtWidgets import QApplication

from gui.lanes.card import LINE, TITLE, LaneCard
from gui.lanes.expected import Stretch
from gui.lanes.lane import Lane, lanes_for
from gui.lanes.live import LiveSource
from gui.lanes.readings import (
    Painted,
    count_between,
    interval_text,
    newest,
    values_at,
    view_text,
)
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from tactile_lab.engine.events import ModelPart
from tactile_lab.trace import HOLDS, Trace

READ = {"force", "V_C1", "spikes", "field", "temperature"}
LANES = {lane.key: lane for lane in lanes_for(READ)}


def test_value_of_a_trace_is_between_its_points_and_nothing_in_a_gap() -> None:
    value = np.array([0.0, 1.0, 2.0, 9.0, 9.0])
    gap = np.array([True, False, False, True, False])
    drawn = Trace(np.array([0.0, 0.1, 0.2, 5.0, 5.1]), value, value, value, gap)
    assert [drawn.at(t) for t in (-0.01, 0.05, 0.2, 0.21)] == [None, 0.5, 2.0, 2.0]
    assert drawn.at(2.0) is None and drawn.at(5.05) == 9.0
    assert drawn.at(5.25) == 9.0 and drawn.at(5.4) is None
    alone = Trace.line(np.array([1.0]), np.array([7.0]))
    assert alone.at(1.0) == 7.0 and alone.at(1.1) is None
    assert alone.at(1.0 + HOLDS / 2) == 7.0
    assert Trace.nothing().at(0.0) is None


def test_spikes_of_a_stored_run_are_those_in_view() -> None:
    spikes = np.array([1.0, 1.1, 5.0, 5.2, 5.3])
    assert count_between(spikes, 1.05, 5.2) == 3
    assert view_text(spikes, 4.9, 5.25) == "of 5 · last ISI 200.0 ms"
    assert view_text(spikes, 4.9, 5.1) == "of 5", "one spike has no interval"
    assert view_text(spikes, 0.0, 5.1) == "of 5", "nor has one after a silence"
    lone = np.array([1.0, 46.0, 91.0])
    assert view_text(lone, 0.0, 99.0) == "of 3 · last ISI 45000.0 ms"
    steps = np.array([0.5, 45.5, 90.5])
    assert view_text(lone, 0.0, 99.0, steps) == "of 3", "each in a step of its own"
    assert view_text(spikes, 5.1, 5.25) == "of 5", "the interval began out of view"


def test_first_spike_after_a_silence_tells_the_silence() -> None:
    spikes = np.array([1.0, 1.1, 5.6])
    assert interval_text(spikes, 5.7) == "after 4.5 s of silence"
    assert interval_text(spikes, 8.0) == "silent 2.4 s"


@pytest.fixture
def theme(app: QApplication) -> Theme:
    made = Theme("light")
    made.apply()
    return made


def card(lane: Lane, theme: Theme, height: int) -> LaneCard:
    made = LaneCard(lane, theme)
    theme.dress(made)
    made.resize(made.width(), height)
    return made


@pytest.mark.parametrize("height", [34, 48, TITLE + 3 * LINE, 120])
@pytest.mark.parametrize("cursors", [False, True])
def test_card_tells_each_run_at_any_height(theme, height: int, cursors: bool) -> None:
    one = card(LANES["V_C1"], theme, height)
    changes = [0.25, -0.5, None] if cursors else None
    one.show_runs([3.721, -12.345, None], changes, "at A" if cursors else "")
    assert "3.721" in one.text and "−12.345" in one.text and "▲ —" in one.text
    if height >= TITLE + LINE:
        assert "●" in one.more and "■" in one.more and "▲" in one.more
    if cursors:
        assert "Δ +0.250" in one.text and "Δ −0.500" in one.text
    assert one.sizeHint().width() <= one.width()
    one.show_value(1.5)
    assert one.text == "1.500" and not one.more, "back to one run"


def test_low_card_gives_up_decimals_not_runs(theme) -> None:
    high, low = (card(LANES["V_C1"], theme, height) for height in (120, 48))
    for one in (high, low):
        one.show_runs([-123.456, -23.456, -33.456], None, "")
    assert "−123.456" in high.more
    assert "−123.456" not in low.more and "−123" in low.more
    assert low.text == high.text, "the tool tip has them all"


def test_a_wide_column_is_not_read_as_a_value() -> None:
    time = np.linspace(0.0, 100.0, 201)
    wide = Painted(0.0, 100.0, (Trace.line(time, time),))
    assert not wide.close(LANES["V_C1"], 50.0)
    near = Painted(0.0, 1.0, (Trace.line(time / 100 / 8, time),))
    assert near.close(LANES["V_C1"], 0.5) and not near.close(LANES["V_C1"], 1.5)
    moving = Painted(0.0, 5.0, (Trace.line(time / 20, time),))
    assert moving.close(LANES["V_C1"], 2.5, 0.03), "a tag is where the trace ends"
    assert not moving.close(LANES["V_C1"], 2.5), "a number tells what is there"
    assert not Painted().close(LANES["V_C1"], 0.0), "nothing was painted"


def test_what_is_at_the_cursors_takes_the_place_of_the_value_where_it_is_low(theme):
    low, high = (card(LANES["V_C1"], theme, height) for height in (48, 90))
    for one in (low, high):
        one.show_value(3.721)
        one.show_more("A 1.00 B 2.00")
        assert one.more == "A 1.00 B 2.00"
    assert low.sizeHint().height() <= 48 < high.sizeHint().height()
    low.show_more("")
    assert not low.more and low.text == "3.721"


def test_newest_rate_counts_a_spike_told_before_its_samples() -> None:
    source = LiveSource(None, 1.0)
    rate = next(lane for lane in LANES.values() if lane.key == "rate")
    assert newest(rate, source) is None, "nothing was measured"
    assert values_at(rate, source, 0.0, Painted()) == (None,)
    source.add_bins({"V_C1": Trace.bins(np.array([0.0, 1.0]), *[np.zeros(2)] * 3, 1.0)})
    source.add_spikes((1.8, 1.9, 2.01))
    assert abs(newest(rate, source) - 1 / 0.11) < 1e-9


@pytest.mark.parametrize(
    ("ends", "told"), [(59.94, True), (59.97, True), (50.0, False)]
)
def test_a_run_seen_whole_has_values_though_its_record_ends_before_it(ends, told):
    source, lane = LiveSource(None, 1.0), LANES["V_C1"]
    for signal, end in (("V_C1", ends), ("V_C2", 60.0)):
        time = np.arange(0.0, end, 1e-3)
        flat = np.full(time.size, 1.25, np.float32)
        source.add_bins({signal: Trace.bins(time, flat, flat, flat, 1e-3)})
    whole = source.shown(lane, 0.0, 60.0, 800)
    edge = source.right_edge(_seen(60.0), lane)
    found = values_at(lane, source, edge, Painted(0.0, 60.0, tuple(whole)))
    assert found == ((1.25,) if told else (None,))


def _sampled() -> tuple[LiveSource, Trace]:
    """A source with 3 s of V_C1, and these."""
    source, flat = LiveSource(None, 0.12), np.full(3000, 1.25)
    bins = Trace.bins(np.arange(3000) * 1e-3, flat, flat, flat, 1e-3)
    source.add_bins({"V_C1": bins})
    return source, bins


def test_force_is_read_where_its_lane_ends_though_the_scope_was_unplugged() -> None:
    """It said 120.0 mN beside a line that had fallen to 0."""
    source, _ = _sampled()
    for time, current in ((0.0, 1.0), (3.4, 0.0)):
        source.add_current(time, current)
    assert _right(source, "force") == 0.12e3, "the run goes on: it is behind the coil"
    source.running = False
    assert (_right(source, "force"), _right(source, "V_C1")) == (0.0, 1.25)


def test_what_a_meter_reads_is_read_where_its_own_lane_ends() -> None:
    """Not where samples end: a teslameter goes on as the scope is unplugged."""
    source, _ = _sampled()
    source.add_current(6.0, 0.0)
    for time, tesla, kelvin in ((2.0, 0.2, 295.0), (5.0, 0.1, 296.0)):
        source.add_field(time, tesla)
        source.add_reading("temperature", time, kelvin)
    source.running = False
    assert (_right(source, "field"), _right(source, "temperature")) == (100.0, 296.0)


def test_the_loop_pairs_a_field_with_the_current_it_was_read_under() -> None:
    """A meter answers late: by then the current of the next step had been told."""
    source = LiveSource(None, 0.2)
    source.begin_trial(0, Stretch(0.0, 1.0, "0.4 A", held=(0.1, 0.95)))
    source.add_field(0.15, 0.0001)  # nobody knows under which current
    source.add_current(0.2, 0.4)
    source.add_field(0.5, 0.0044)
    source.begin_trial(1, Stretch(1.0, 2.0, "0.8 A", held=(1.1, 1.95)))
    source.add_current(1.01, 0.8)
    source.add_field(0.94, 0.0044)  # read before, answered after
    source.add_field(1.5, 0.0088)
    assert source.loop == pytest.approx(
        np.array([[0.4, 0.0044], [0.4, 0.0044], [0.8, 0.0088]])
    )


def test_a_residual_is_read_where_the_model_has_come_to() -> None:
    source, bins = _sampled()
    model = bins[:2800]
    source.model.add(ModelPart({"V_C1": model}, np.empty(0), model.end))
    source.running = False
    assert _right(source, "residual") == 0.0, "it said —"


def _right(source: LiveSource, key: str) -> float | None:
    lane = LANES[key]
    edge = source.right_edge(_seen(10.0), lane)
    return values_at(lane, source, edge, Painted())[0]


def _seen(width: float) -> TimeView:
    view = TimeView()
    view.width = width
    return view
