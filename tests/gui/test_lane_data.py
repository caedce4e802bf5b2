import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gui.lanes.expected import Aligned, Preview, Stretch
from gui.lanes.live import LiveSource, Readings
from gui.lanes.paint import zigzag
from gui.lanes.rate import rate_of
from gui.plots.numbers import decimals, nice_range, number, signed, ticks
from tactile_lab.pyramid import COARSE, FINE, Pyramid
from tactile_lab.spikes.rate import rate_at
from tactile_lab.trace import Trace
from tactile_lab.waveform import Waveform


def bins(first: int, values: np.ndarray, width: float = 1e-3) -> Trace:
    low = values.astype(np.float32)
    time = width * np.arange(first, first + values.size)
    return Trace.bins(time, low, low + 1, low, width)


@given(st.integers(1, 5000), st.integers(1, 300), st.integers(0, 1000))
def test_columns_keep_every_extreme(n: int, count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    value = rng.normal(size=n)
    time = np.arange(n) * 1e-3
    drawn = Trace.bins(time, value, value, value, 1e-3).thin(count)
    assert drawn.low.min() == value.min()
    assert drawn.high.max() == value.max()
    assert drawn.time.size <= max(count, n if n <= count else 0) + 2


def test_columns_do_not_wander_when_the_view_scrolls() -> None:
    time = np.arange(10_000) * 1e-3
    value = np.sin(time * 40)
    whole = Trace.bins(time, value, value, value, 1e-3)
    one, two = whole[100:5100].thin(500), whole[103:5103].thin(500)
    both = np.intersect1d(one.time[1:-1], two.time[1:-1])
    assert both.size > 0.95 * one.time.size


def test_dense_line_keeps_extremes_and_means() -> None:
    time = np.arange(0.0, 100.0, 0.01)
    saw = (time % 0.5) * 2  # from 0 to 1, 0.49 in the mean
    drawn = Trace.line(time, saw).around(0.0, 100.0).thin(25)
    assert drawn.time.size <= 100
    assert drawn.low.min() == 0.0 and drawn.high.max() == saw.max()
    assert np.allclose(drawn.mean, 0.49, atol=1e-9), "columns of whole periods"


def test_gap_breaks_the_line() -> None:
    time = np.concatenate([np.arange(100), np.arange(150, 250)]) * 1e-3
    value = np.ones(200)
    drawn = Trace.bins(time, value, value, value, 1e-3).thin(1000)
    assert np.flatnonzero(drawn.gap).tolist() == [0, 100]


def test_zigzag_passes_through_both_extremes() -> None:
    rows = np.array([np.arange(4.0), [0, 1, 0, 1], [2, 3, 2, 3], [1, 2, 1, 2]])
    x, y = zigzag(Trace.bins(*rows, 1.0).thin(10))
    assert x.tolist() == [0, 0, 1, 1, 2, 2, 3, 3]
    for k in range(4):
        assert sorted(y[2 * k : 2 * k + 2]) == [rows[1, k], rows[2, k]]


@settings(max_examples=30)
@given(st.lists(st.integers(1, 4000), min_size=1, max_size=40))
def test_track_shows_what_was_added(pieces: list[int]) -> None:
    track, first = Pyramid(), 0
    for size in pieces:
        track.add(bins(first, np.arange(first, first + size, dtype=float)))
        first += size
    drawn = track.between(0.0, 1e9, 100)
    assert drawn.low[0] == 0
    assert drawn.high[-1] >= first - 4096  # the coarse picture may lag by open bins
    assert track.end == np.float64((first - 1) * 1e-3) + 1e-3


def test_history_is_bounded_and_keeps_a_single_spike() -> None:
    track = Pyramid()
    total = 3_600_000
    step = 20_000
    for first in range(0, total, step):
        values = np.zeros(step)
        if first == 100 * step:
            values[7] = 500.0
        track.add(bins(first, values))
    drawn = track.between(0.0, 3600.0, 1000)
    assert drawn.high.max() >= 500.0
    parts = [part for level in track._levels for part in vars(level).values()]
    held = sum(part.nbytes for part in parts if isinstance(part, np.ndarray))
    assert held > 8 * 4 * FINE, "this is where it is"
    assert held <= 8 * 4 * (2 * FINE + COARSE)
    newest = track.between(3595.0, 3600.0, 10_000)
    assert newest.time.size == 5000 or newest.time.size == 5001


def test_rate_is_one_over_the_last_interval_from_the_second_spike_on() -> None:
    drawn = rate_of(np.array([1.0, 1.5, 1.75]), 0.0, 3.0, 100)
    assert drawn.time.tolist() == [1.5, 1.75]
    assert drawn.mean.tolist() == [2.0, 4.0]


def test_rate_has_no_point_for_the_spike_after_a_silence() -> None:
    spikes = np.array([1.0, 1.5, 2.0, 6.0, 9.0, 9.5, 9.8])
    drawn = rate_of(spikes, 0.0, 10.0, 100)
    assert drawn.time.tolist() == [1.5, 2.0, 9.5, 9.8], "a spike alone has none either"
    assert np.flatnonzero(drawn.gap).tolist() == [0, 2]


def test_slow_but_regular_firing_has_a_rate() -> None:
    assert np.allclose(rate_of(np.arange(0.0, 60, 5), 0, 60, 100).mean, 0.2)


def test_interval_from_one_step_to_the_next_is_none_where_it_is_long() -> None:
    steps = np.arange(0.0, 60, 5)
    lone = steps + 1.0
    assert rate_of(lone, 0, 60, 100, steps).empty, "one spike for each presentation"
    assert rate_at(lone, 31.2, steps) is None and rate_at(lone, 34.0, steps) == 0.0
    going_on = np.arange(0.0, 60, 0.3)
    assert rate_of(going_on, 0, 60, 1000, steps).time.size == going_on.size - 1


trains = st.lists(
    st.tuples(st.integers(1, 9), st.floats(0.05, 0.3), st.floats(1.5, 6.0)),
    min_size=1,
    max_size=5,
).map(
    lambda parts: np.cumsum(
        np.concatenate([[rest, *[gap] * more] for more, gap, rest in parts])
    )
)
"""Stretches of at least two spikes, parted by silences."""


@given(trains, st.floats(0, 30), st.floats(0.01, 30))
def test_rate_in_view_does_not_depend_on_the_view(
    spikes: np.ndarray, start: float, width: float
) -> None:
    whole = rate_of(spikes, -1.0, 1e3, 1000)
    part = rate_of(spikes, start, start + width, 1000)
    inside = (whole.time >= start) & (whole.time <= start + width)
    assert set(whole.time[inside]) <= set(part.time) <= set(whole.time)
    assert set(part.mean) <= set(whole.mean)
    assert part.time[1:][part.gap[1:]].size == 0 or set(part.time[part.gap][1:]) <= set(
        whole.time[whole.gap]
    )


@given(trains, st.integers(20, 200))
def test_many_rates_in_few_columns_stay_broken_at_silences(
    spikes: np.ndarray, times: int
) -> None:
    span = spikes[-1] + 5.0
    many = np.concatenate([spikes + k * span for k in range(times)])
    fine, coarse = rate_of(many, 0, 1e9, many.size), rate_of(many, 0, 1e9, 5)
    assert set(fine.time[fine.gap]) == set(coarse.time[coarse.gap])
    assert coarse.extent == fine.extent


def test_rate_at_a_time_is_that_of_the_last_interval_and_0_in_silence() -> None:
    spikes = np.array([1.0, 1.5, 1.75, 9.0, 9.1])
    rates = [rate_at(spikes, t) for t in (0.5, 1.2, 1.5, 1.7, 1.75, 2.4, 2.6, 8.9)]
    assert rates == [0.0, None, 2.0, 2.0, 4.0, 4.0, 0.0, 0.0]
    assert rate_at(spikes, 9.05) is None, "4.5 s of silence are no interval"
    assert rate_at(spikes[:4], 9.05) is None, "nor while nobody knows what follows"
    assert rate_at(spikes[:4], 9.6) == 0.0, "a spike alone"
    assert rate_at(np.empty(0), 3.0) == 0.0


@given(trains)
def test_rate_on_the_card_is_that_of_the_line(spikes: np.ndarray) -> None:
    drawn = rate_of(spikes, 0.0, 1e3, 1000)
    assert [rate_at(spikes, t) for t in drawn.time] == drawn.mean.tolist()


def test_model_moves_to_where_each_trial_really_started() -> None:
    holds = [Stretch(0.1, 1.0, "a"), Stretch(1.0, 2.0, "b")]
    force = Waveform.through([(0.1, 0.0), (0.5, 1.0), (1.5, 1.0)])
    preview = Preview(force, {}, np.array([0.5, 1.5]), holds, 2.0)
    aligned = Aligned(preview)
    aligned.begin(0, 0.2)
    assert np.allclose(aligned.spikes, [0.6, 1.6])
    aligned.begin(1, 1.5)
    assert np.allclose(aligned.spikes, [0.6, 2.0])
    assert aligned.length == 2.5


def test_slow_track_is_bounded() -> None:
    track = Readings()
    for k in range(450_000):
        track.add(k * 0.01, float(k))
    assert track.between(0.0, 1e9, 1000).time.size <= 4000
    assert track.last == 449_999.0


def test_set_points_hold_until_the_next_and_to_now() -> None:
    track = Readings()
    for time, value in ((1.0, 0.0), (1.1, 0.3), (1.2, 0.6)):
        track.add(time, value)
    held = track.between(0.0, 9.0, 100, hold=2.0)
    assert [held.at(t) for t in (1.05, 1.15, 1.25, 2.0)] == [0.0, 0.3, 0.6, 0.6]
    through = track.between(0.0, 9.0, 100)
    assert abs(through.at(1.05) - 0.15) < 1e-9, "other readings are joined"


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3))
def test_nice_range_contains_the_data(low: float, span: float) -> None:
    a, b = nice_range(low, low + span, 1e-3)
    assert a <= low and b >= low + span
    assert b - a <= 3 * span + 1e-3


def test_ticks_are_round() -> None:
    assert ticks(0.0, 1.0, 5) == [0.0, 0.2, 0.4, 0.6000000000000001, 0.8, 1.0]
    assert decimals(0.2) == 1
    assert decimals(50) == 0
    assert number(-0.04, 1) == "0.0"
    assert number(-1.5, 1) == "−1.5"
    assert [signed(v, 1) for v in (1.5, -1.5, 0.04, -0.04)] == [
        "+1.5",
        "−1.5",
        "0.0",
        "0.0",
    ]


@pytest.mark.parametrize("later", [1, 200])  # s; of 131 the finest are kept
def test_what_is_frozen_has_nothing_that_came_later(later: int) -> None:
    source = LiveSource(None, 1.0)

    def go_on(start: float, end: float) -> None:
        time = np.arange(start, end - 5e-4, 1e-3)
        flat = np.full(time.size, end)
        source.add_bins({"V_C1": Trace.bins(time, flat, flat, flat, 1e-3)})
        source.add_current(end - 0.1, end)
        source.add_spikes((end - 0.2,))

    go_on(0.0, 1.0)
    frozen = source.frozen()
    for start in range(1, 1 + later):
        go_on(start, start + 1.0)
    assert source.reach == pytest.approx(1.0 + later)
    assert frozen.reach == pytest.approx(1.0) and frozen.of is source
    assert frozen.spikes.tolist() == [0.8]
    for start, end in ((0.0, 1e4), (0.0, 1.2), (0.9, 1.1)):
        force = frozen.measured("force", start, end, 500)
        voltage = frozen.measured("V_C1", start, end, 500)
        for found in (force, voltage):
            assert 0.95 < found.end <= frozen.reach + 1e-9, (start, end)
            assert found.extent == (1.0, 1.0)
    assert frozen.measured("V_C1", 2.0, 3.0, 500).empty


def test_spikes_that_no_circuit_gives_have_no_rate_as_they_come() -> None:
    """Of one step alone, and only where they are more than one now and then."""
    source = LiveSource(None, 1.0)
    source.shortest_interval = 0.01
    for at in range(2):
        source.begin_trial(at, Stretch(2.0 * at, 2.0 * at + 2, str(at)))
    right = (0.5, 0.505, 0.6, 0.7, 0.8, 0.9, 1.0)
    source.add_spikes(right)
    source.add_spikes(())
    assert not source.unrated and source.rate(1.0) == pytest.approx(10)
    for first in (2.1, 2.15):  # also those of two messages beside each other
        source.add_spikes((first, first + 0.001))
    assert not source.unrated
    frozen = source.frozen()
    source.add_spikes((2.152,))
    assert [one.label for one, _ in source.unrated] == ["1"] and not frozen.unrated
    assert source.rate(2.153) is None and source.rate(1.0) == pytest.approx(10)
    assert source.rated.tolist() == list(right)
    drawn = source.trace("rate", 0.0, 4.0, 100)
    assert not drawn.empty and drawn.time.max() < 2.0
