"""The twin of the window against the model in one piece."""

from collections.abc import Callable
from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gui.lanes.twin import CLOSE, TwinTraces
from tactile_lab.acquisition.live_model import LiveModel
from tactile_lab.engine.events import ModelPart
from tactile_lab.engine.model_parts import binned, live_part
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.scene.load import load
from tactile_lab.trace import Trace
from tactile_lab.waveform import Waveform

SCENE = load("demo")
POINTS = [(0.1, 0.0), (0.2, 0.3), (0.3, 0.6), (0.9, 0.2), (1.2, 0.0)]


def in_one_piece() -> ModelPart:
    twin = LiveModel.of(SCENE)
    for point in POINTS:
        twin.add(*point)
    part = live_part(twin, 1.5)
    assert part is not None
    return part


@settings(max_examples=15)
@given(st.lists(st.floats(0.01, 1.45), max_size=6))
def test_any_slicing_gives_the_spikes_of_one_piece(cuts: list[float]) -> None:
    whole = in_one_piece()
    twin, tracks = LiveModel.of(SCENE), TwinTraces()
    fed = 0
    for end in [*sorted(cuts), 1.5]:
        while fed < len(POINTS) and POINTS[fed][0] <= end:
            twin.add(*POINTS[fed])
            fed += 1
        part = live_part(twin, end)
        if part is not None:
            tracks.add(part)
    assert whole.spikes.size > 2
    assert np.allclose(tracks.spikes, whole.spikes, atol=1e-5)


def test_set_points_hold_until_the_next() -> None:
    part = in_one_piece()
    time, value = np.array(POINTS).T
    steps, held = np.repeat(time, 2)[1:], np.repeat(value, 2)[:-1]
    current = Waveform(
        np.concatenate([[0.0], steps, [1.5]]), np.concatenate([[0.0], held, [0.0]])
    )
    force, _ = SCENE.bench.magnet.lagged_force(current)
    result = simulate(SCENE.circuit, force, keep=("spikes", "V_C1"), until=1.5)
    assert result.spike_times is not None
    assert np.allclose(part.spikes, result.spike_times, atol=1e-5)
    bins = part.bins["V_C1"]
    expected = result.sample("V_C1", bins.time)
    assert np.abs(bins.mean - expected).max() < 1e-4


def test_late_set_point_moves_to_where_the_twin_is() -> None:
    twin = LiveModel.of(SCENE)
    assert live_part(twin, 0.5) is not None
    twin.add(0.4, 0.8)
    part = live_part(twin, 1.0)
    assert part is not None and part.end == 1.0
    assert part.bins["V_C1"].mean[-1] < part.bins["V_C1"].mean[0] - 0.1


def test_nothing_joined_to_something_is_that() -> None:
    line = Trace.line(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    assert Trace.nothing().join(line) is line
    assert line.join(Trace.nothing()) is line
    assert line.join(line).time.size == 4


@cache
def simulated() -> Result:
    """Not at import, where every worker that collects would solve, or compile, it."""
    return simulate(
        SCENE.circuit,
        Waveform(np.array([0.0, 0.2, 1.5]), np.array([0.0, 0.16, 0.16])),
        keep=("V_C1", "V_C2", "V_K", "spikes"),
        until=1.5,
    )


@given(
    start=st.floats(0.0, 1.4), width=st.floats(1e-6, 0.1), count=st.integers(2, 300),
    signal=st.sampled_from(["V_C1", "V_C2", "V_K"]),
)  # fmt: skip
def test_bins_hold_all_the_model_does(start, width, count, signal) -> None:
    end = start + width
    spikes = simulated().spike_times
    assert spikes is not None and spikes.size > 5
    inside = spikes[(spikes >= start) & (spikes < end)]
    bins = binned([simulated().solution], [signal], start, end, count)[signal]
    assert np.all(bins.low <= bins.mean) and np.all(bins.mean <= bins.high)
    peak = {"V_C1": 0.0, "V_C2": 3.0, "V_K": 3.0}[signal]
    for spike in inside:
        at = min(int((spike - start) / bins.width), count - 1)
        assert bins.high[at] >= peak, "a spike falls between the bins"


def parts(
    asked: list[tuple[float, float, int]],
) -> tuple[TwinTraces, Callable[[], None]]:
    """A twin, and what answers its newest look."""

    def slice_(start: float, end: float, count: int) -> ModelPart:
        spikes = np.empty(0)
        bins = binned([simulated().solution], ["V_C1"], start, end, count)
        return ModelPart(bins, spikes, end)

    twin = TwinTraces(lambda *part: asked.append(part))
    twin.add(slice_(0.0, 1.5, 1500))
    return twin, lambda: twin.refine(slice_(*asked[-1]))


def test_wide_views_ask_for_nothing() -> None:
    asked: list[tuple[float, float, int]] = []
    drawn = parts(asked)[0].trace("V_C1", 0.0, 1.5, 1000)
    assert not drawn.empty and not asked
    assert parts(asked)[0].trace("V_K", 0.0, 1e-3, 1000).empty and not asked


@given(
    start=st.floats(0.0, 1.45), width=st.floats(1e-5, 0.04),
    count=st.integers(200, 6000),
)  # fmt: skip
def test_a_close_look_is_asked_for_once_and_then_exact(start, width, count) -> None:
    asked: list[tuple[float, float, int]] = []
    twin, answer = parts(asked)
    end = start + width
    twin.trace("V_C1", start, end, count)
    twin.trace("V_C1", start, end, count)
    assert len(asked) == 1, "one look at a time"
    assert asked[0][0] <= start and asked[0][1] >= end and asked[0][2] == CLOSE
    answer()
    for _ in range(3):
        drawn = twin.trace("V_C1", start, end, count)
    assert len(asked) == 1, "the answer is as fine as another one would be"
    middle = (drawn.time >= start) & (drawn.time <= end)
    exact = simulated().sample("V_C1", drawn.time[middle])
    assert np.allclose(drawn.mean[middle], exact, atol=1e-3)


@given(start=st.floats(-1.0, 3.0), width=st.floats(1e-5, 0.04))
def test_nothing_is_asked_for_beyond_the_run(start, width) -> None:
    asked: list[tuple[float, float, int]] = []
    twin, _ = parts(asked)
    twin.trace("V_C1", start, start + width, 1000)
    beyond = start >= 1.5 or start + width <= 0
    assert len(asked) == (0 if beyond else 1)
    for first, last, _ in asked:
        assert 0.0 <= first < last <= 1.5


def test_looks_at_a_few_places_do_not_drive_each_other_out() -> None:
    asked: list[tuple[float, float, int]] = []
    twin, answer = parts(asked)
    places = [(0.3, 0.31), (0.6, 0.64), (0.9, 0.94)]
    for _ in range(4):
        for start, end in places:
            before = len(asked)
            twin.trace("V_C1", start, end, 1000)
            if len(asked) > before:
                answer()
    assert len(asked) == len(places)
