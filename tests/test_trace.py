"""What holds of every trace: nothing that was measured is lost, nothing is invented."""

import itertools
import tracemalloc

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tactile_lab.pyramid import FINE, Pyramid
from tactile_lab.trace import Trace

WIDTH = 1e-3


@st.composite
def traces(draw, most: int = 400) -> Trace:
    """Bins of 1 ms with some gaps of 1 to 300 of them."""
    size = draw(st.integers(1, most))
    holes = draw(st.dictionaries(st.integers(1, size), st.integers(1, 300), max_size=8))
    number = np.arange(size)
    for after, missing in holes.items():
        number[after:] += missing
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    low, mean, high = np.sort(rng.normal(size=(3, size)), axis=0)
    start = draw(st.integers(0, 5000))
    return Trace.bins((start + number) * WIDTH, low, high, mean, WIDTH)


def same(one: Trace, other: Trace) -> None:
    for name in ("time", "low", "high", "mean", "gap"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def well_formed(trace: Trace) -> None:
    assert np.all(np.diff(trace.time) > 0)
    assert np.all(trace.low <= trace.mean + 1e-12)
    assert np.all(trace.mean <= trace.high + 1e-12)
    assert trace.empty or trace.gap[0]


def bridged(trace: Trace, whole: Trace) -> bool:
    """Whether a line of `trace` passes over a gap of `whole` longer than a cell."""
    for at in np.flatnonzero(whole.gap)[1:]:
        begin, end = whole.time[at - 1] + whole.width, whole.time[at]
        after = np.searchsorted(trace.time, end - WIDTH / 2)
        if end - begin >= trace.width and after < len(trace) and not trace.gap[after]:
            return True
    return False


@given(traces(), st.integers(1, 100))
def test_thinning_keeps_extremes_and_gaps(whole: Trace, count: int) -> None:
    thin = whole.thin(count)
    well_formed(thin)
    assert thin.extent == whole.extent
    assert thin.time[0] == whole.time[0] and thin.time[-1] <= whole.time[-1]
    assert len(thin) <= 2 * count + 10
    assert not bridged(thin, whole)
    assert set(thin.time[thin.gap]) <= set(whole.time[whole.gap])


@given(st.integers(30, 90), st.integers(0, 20))
def test_corners_keep_pauses_and_extremes_of_a_line(count: int, seed: int) -> None:
    """The whole run of a vibration began with a force of which nothing was applied."""
    rng = np.random.default_rng(seed)
    burst = np.sort(rng.uniform(0, 1, 777))
    time = np.concatenate([at + burst for at in (10.0, 20.0, 21.5, 90.0)])
    value = np.sin(777 * time)
    value[776::777] = 0.0
    value[::777] = 0.0
    whole = Trace.line(np.append(0.0, time), np.append(0.0, value))
    few = whole.corners(count)
    assert few.extent == whole.extent and len(few) <= 4 * count + 8
    for at in (5.0, 15.0, 22.6, 50.0, 80.0):
        told = few.at(at)
        assert told is not None and abs(told) < 1e-12, f"nothing was applied at {at}"
    assert few.time[0] == whole.time[0] and few.time[-1] == whole.time[-1]


@given(st.integers(1, 20), st.integers(2, 9))
def test_more_gaps_than_cells_do_not_make_more_cells(per: int, count: int) -> None:
    """As of a scope that polls: short records, far apart."""
    number = (10 * np.arange(1000)[:, None] + np.arange(per % 4 + 1)).ravel()
    value = np.sin(number)
    whole = Trace.bins(number * WIDTH, value, value, value, WIDTH)
    thin = whole.thin(count)
    assert thin.extent == whole.extent
    assert len(thin) <= 3 * count + 3


@given(traces(), st.lists(st.floats(0.0, 9.0), max_size=6))
def test_cuts_joined_are_the_whole(whole: Trace, places: list[float]) -> None:
    edges = [-1.0, *sorted(places), 1e9]
    joined = Trace.nothing()
    for start, end in itertools.pairwise(edges):
        part = whole.cut(start, end)
        well_formed(part)
        joined = joined.join(part)
    same(joined, whole)


@given(traces(), st.floats(0.0, 6.0), st.floats(0.0, 1.0))
def test_around_has_one_more_on_either_side(
    whole: Trace, start: float, width: float
) -> None:
    inside, more = whole.cut(start, start + width), whole.around(start, start + width)
    assert set(inside.time) <= set(more.time)
    assert len(inside) <= len(more) <= len(inside) + 2


@given(traces(), st.floats(-1.0, 8.0))
def test_a_value_is_read_where_there_is_one(whole: Trace, time: float) -> None:
    value, near = whole.at(time), whole.time[whole.time <= time]
    if near.size == 0 or time - near[-1] > 0.0101:
        assert value is None
    if near.size and time - near[-1] < WIDTH:
        assert value is not None
        assert whole.mean.min() <= value <= whole.mean.max()


@given(traces())
def test_nothing_is_left_of_a_trace_less_itself(whole: Trace) -> None:
    rest = whole.residual(whole)
    well_formed(rest)
    assert np.abs(rest.mean).max(initial=0.0) < 1e-6
    if len(whole) > 2:
        ends = np.append(np.flatnonzero(whole.gap)[1:] - 1, len(whole) - 1)
        assert not set(rest.time) & set(whole.time[ends])
    grid = np.linspace(0.0, 8.0, 77)
    assert np.all(whole.minus(whole, grid).mean == 0.0)


@given(traces(), st.floats(0.1, 1e3), st.floats(-5.0, 5.0))
def test_scaled_and_shifted_keep_their_shape(
    whole: Trace, by: float, later: float
) -> None:
    moved = whole.scaled(by, "mV").shifted(later)
    assert np.allclose(moved.mean, whole.mean * by)
    assert np.allclose(moved.time, whole.time + later)
    assert np.array_equal(moved.gap, whole.gap) and moved.width == whole.width


def test_lines_are_not_joined_across_what_nobody_said() -> None:
    line = Trace.line(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    both = line.join(line.shifted(2.0))
    assert both.gap.tolist() == [True, False, True, False]
    steps = Trace.steps(np.array([0.0, 1.0]), np.array([5.0, 6.0]), until=4.0)
    assert steps.time.tolist() == [0.0, 1.0, 1.0, 4.0]
    assert steps.mean.tolist() == [5.0, 5.0, 6.0, 6.0]


@settings(max_examples=30)
@given(traces(3000), st.lists(st.integers(1, 700), max_size=8), st.integers(1, 300))
def test_a_pyramid_is_what_it_was_fed_at_any_zoom(
    whole: Trace, sizes: list[int], count: int
) -> None:
    fed, at = Pyramid(), 0
    for size in [*sizes, len(whole)]:
        fed.add(whole[at : at + size])
        at += size
    all_at_once = Pyramid.of(whole)
    for start, end in ((-1.0, 1e3), (0.5, 2.0), (1.0, 1.01)):
        found = fed.between(start, end, count)
        same(found, all_at_once.between(start, end, count))
        well_formed(found)
        assert not bridged(found, whole)
    assert fed.between(-1.0, 1e3, count).extent == whole.extent
    assert fed.end == whole.end


@settings(max_examples=15)
@example([1, 1, 3072, 1023])
@given(st.lists(st.integers(1, 9000), min_size=3, max_size=12))
def test_coarser_levels_do_not_depend_on_the_blocks(sizes: list[int]) -> None:
    size = sum(sizes)
    number = np.arange(size) + 40 * (np.arange(size) // 7777)
    value = np.sin(number * 0.7)
    whole = Trace.bins(number * WIDTH, value, value, value, WIDTH)
    fed, at = Pyramid(), 0
    for part in sizes:
        fed.add(whole[at : at + part])
        at += part
        seen = fed.between(0.0, 1e6, 50)
        assert seen.extent == whole[:at].extent, "the newest cell is in the picture"
    same(fed.between(0.0, 1e6, 50), Pyramid.of(whole).between(0.0, 1e6, 50))


def test_a_signal_that_is_known_takes_the_memory_of_its_cells() -> None:
    time = np.arange(50_000) * WIDTH
    whole = Trace.bins(time, time, time, time, WIDTH)
    cells = 4 * time.nbytes + time.size
    tracemalloc.start()
    try:
        kept = Pyramid.of(whole)
        taken = tracemalloc.get_traced_memory()[0]
    finally:
        tracemalloc.stop()
    assert kept.end == whole.end and taken < 1.2 * cells


def test_a_pyramid_forgets_details_but_no_spike() -> None:
    fed, step = Pyramid(), 50_000
    for first in range(0, 20 * step, step):
        value = np.zeros(step)
        value[7] = first == 3 * step
        time = np.arange(first, first + step) * WIDTH
        fed.add(Trace.bins(time, value, value, value, WIDTH))
    assert fed.between(0.0, 1e6, 100).extent == (0.0, 1.0)
    old, new = fed.between(149.0, 151.0, 5000), fed.between(998.0, 1000.0, 5000)
    assert old.extent == (0.0, 1.0) and old.width == 16 * WIDTH
    assert len(new) >= 2000 and len(fed.newest(10 * FINE)) <= FINE


def test_a_closer_look_is_used_where_it_reaches() -> None:
    time = np.arange(1000) * 1.0
    fed = Pyramid.of(Trace.bins(time, 0 * time, time, 0 * time, 1.0))
    assert not fed.wants(0.0, 1000.0, 100) and fed.wants(10.0, 12.0, 100)
    assert not fed.wants(1000.0, 1002.0, 100), "there is nothing beyond the end"
    near = np.arange(9.0, 13.0, 0.01)
    fed.refine(9.0, 13.0, Trace.bins(near, near, near + 1, near, 0.01))
    assert not fed.wants(10.0, 12.0, 100) and fed.wants(10.0, 14.0, 100)
    assert fed.wants(10.0, 10.1, 100), "closer still"
    assert fed.between(10.0, 12.0, 100).low[1] >= 9.0
    assert fed.between(0.0, 100.0, 50).low[1] == 0.0
    fed.refine(9.0, 13.0, Trace.bins(near, near, near, near, 0.01))
    assert not fed.wants(10.0, 10.1, 100), "each cell shows one value: nothing is finer"
