"""Where the twin of a run in progress meets the plan ahead of now."""

import numpy as np
from hypothesis import assume, given
from hypothesis import strategies as st

from gui.lanes.expected import Preview, Stretch
from gui.lanes.live import LiveSource
from gui.lanes.phase import phase
from gui.lanes.rate import rate_of
from tactile_lab.engine.events import ModelPart
from tactile_lab.spikes.rate import begins
from tactile_lab.trace import Trace
from tactile_lab.waveform import Waveform

PERIOD = 4.5


def stretch(first: float, interval: float, growth: float, end: float) -> np.ndarray:
    """A train that slows down, from `first` to `end` s."""
    times = [first]
    while times[-1] + interval < end:
        times.append(times[-1] + interval)
        interval *= growth
    return np.array(times)


def trains(draw: st.DrawFn, count: int) -> np.ndarray:
    """`count` holds of 2 s with rests of 2.5 s between, each with its own rate."""
    parts = [
        PERIOD * k
        + stretch(
            draw(st.floats(0.05, 0.6)),
            draw(st.floats(0.05, 0.4)),
            draw(st.floats(1.0, 1.1)),
            2.0,
        )
        for k in range(count)
    ]
    return np.concatenate(parts)


@st.composite
def meetings(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray, float]:
    """The plan's spikes, those of the twin so far, and how far it has come."""
    planned = trains(draw, 3)
    twin, end = trains(draw, 3), draw(st.floats(0.1, 2.5 * PERIOD))
    return planned, twin[twin < end], end


def live(planned: np.ndarray, twin: np.ndarray, end: float) -> LiveSource:
    """A run in progress: `V_C2` rises after each spike and falls at the next."""
    time = np.sort(np.concatenate([np.linspace(0, 14, 2000), planned, planned - 1e-9]))
    since = np.searchsorted(planned, time, side="right")
    value = time - np.append(0.0, planned)[since]
    force = Waveform.through([(0.0, 0.0), (14.0, 0.0)])
    holds = [Stretch(PERIOD * k, PERIOD * (k + 1), str(k)) for k in range(3)]
    preview = Preview(force, {"V_C2": (time, value)}, planned, holds, 14.0)
    source = LiveSource(preview, 1.0)
    value = np.zeros(2, np.float32)
    bins = Trace.bins(np.array([end - 2e-3, end - 1e-3]), value, value, value, 1e-3)
    source.model.add(ModelPart({"V_C2": bins}, twin, end))
    return source


@given(meetings())
def test_no_interval_at_the_seam_is_shorter_than_those_beside_it(meeting) -> None:
    planned, twin, end = meeting
    assume(twin.size > 1 and planned.size > 1)
    spikes = live(planned, twin, end).twin_spikes
    assert np.array_equal(spikes[: twin.size], twin), "what the twin did stays"
    assert np.all(spikes[twin.size :] > end), "and what comes is ahead"
    shortest = min(np.diff(twin).min(), np.diff(planned).min())
    assert np.diff(spikes).min() > shortest * (1 - 1e-9)


@given(meetings())
def test_plan_is_carried_on_in_its_own_intervals(meeting) -> None:
    planned, twin, end = meeting
    assume(twin.size)
    moved = phase(planned, float(twin[-1])).moved(planned)
    assert np.all(np.diff(moved) > 0), "no spike overtakes another"
    inside = ~begins(planned)[1:]
    later = moved[1:] > end
    before, after = np.diff(planned)[inside & later], np.diff(moved)[inside & later]
    assert np.allclose(before, after, rtol=0, atol=1e-9)
    assert np.abs(moved - planned).max() <= 0.5 * np.diff(planned)[inside].max(
        initial=0.5
    )


@given(meetings())
def test_rate_does_not_jump_at_the_seam(meeting) -> None:
    planned, twin, end = meeting
    spikes = live(planned, twin, end).twin_spikes
    drawn = rate_of(spikes, 0.0, 20.0, 1000)
    if not drawn.empty:
        known = [rate_of(train, 0, 20, 1000).high for train in (twin, planned)]
        assert drawn.high.max() <= np.concatenate(known).max() * (1 + 1e-9)


@given(meetings())
def test_trace_ahead_of_now_falls_where_its_spikes_are(meeting) -> None:
    planned, twin, end = meeting
    source = live(planned, twin, end)
    drawn = source.twin("V_C2", end, 13.9, 5000)
    ahead = source.twin_spikes[twin.size :]
    falls = drawn.time[1:][np.diff(drawn.mean) < -0.02]
    assert drawn.time[0] >= end and np.all(np.diff(drawn.time) >= 0)
    assert drawn.gap[0], "nothing bridges the seam"
    assert np.allclose(falls, ahead[ahead < 13.9][-falls.size :], atol=1e-6)
    assert falls.size >= ahead[ahead < 13.9].size - 1


def test_plan_lies_over_no_data_of_a_signal_without_a_twin() -> None:
    planned = stretch(0.2, 0.1, 1.0, 2.0)
    source = live(planned, planned[:5], 0.65)
    source.preview.traces["V_K"] = source.preview.traces["V_C2"]
    source.add_bins({"V_K": Trace.bins(np.array([0.8]), *[np.zeros(1)] * 3, 1e-3)})
    assert source.twin("V_K", 0.0, 2.0, 5000).time[0] >= source.reach == 0.801
    assert source.twin("V_C2", 0.66, 2.0, 5000).time[0] < 0.67


def test_twin_in_step_with_the_plan_moves_nothing() -> None:
    planned = stretch(0.2, 0.1, 1.05, 2.0)
    assert np.allclose(phase(planned, planned[4]).moved(planned), planned)


def test_plan_is_carried_on_at_every_phase() -> None:
    planned = stretch(0.2, 0.1, 1.1, 2.0)
    for last in np.linspace(planned[0], planned[-2], 500):
        moved = phase(planned, last).moved(planned)
        ahead = moved[moved > last + 1e-9]
        expected = np.interp(last, planned[:-1], np.diff(planned))
        assert 0.9 * expected < ahead[0] - last < 1.1 * expected


def test_twin_that_lags_takes_the_train_along_and_no_later_one() -> None:
    one = stretch(0.2, 0.1, 1.05, 2.0)
    planned = np.concatenate([one, one + PERIOD])
    moved = phase(planned, one[6] + 0.03).moved(planned)
    assert np.allclose(moved[7 : one.size], one[7:] + 0.03)
    assert np.allclose(moved[one.size :], one + PERIOD)


def test_twin_that_fires_where_the_plan_is_silent_moves_nothing() -> None:
    planned = PERIOD + stretch(0.2, 0.1, 1.05, 2.0)
    assert np.array_equal(phase(planned, 1.0).moved(planned), planned)
