import tracemalloc

import numpy as np
import pytest

from tactile_lab.report.driven import shunt_over_source
from tactile_lab.scope import Block
from tactile_lab.store.applied import BY_HOST, BY_SAMPLES, applied_current
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.run import Run

STEPS = np.array([0.0, 0.5, 1.0, 0.2])
CAME = np.array([0.0, 1.0, 2.0, 3.0])


def test_points_of_a_list_stand_where_they_are_told():
    """None of them is an edge; where the host dated them, they date nothing."""
    time, sent, read = rows()
    ramp = np.arange(1, 40) * 0.02
    later = time[-1] + 1 + np.arange(39) * 1e-3
    times, levels = np.append(time, later), np.append(sent, ramp)
    listed = np.append(np.zeros(time.size), np.full(39, BY_SAMPLES))
    reads = np.append(read, np.full(39, np.nan))
    found = applied_current(times, levels, reads, shunt(), listed=listed)
    assert found.uncertainty() is not None
    assert np.array_equal(found.steps[-39:, 0], later)
    listed[listed > 0] = BY_HOST
    assert applied_current(times, levels, reads, shunt(), listed=listed).edges == 0


def shunt(scale=1.0, late=0.0, noise=1e-3, blind=(0.0, 0.0)):
    """The coil current as a scope sees it, in 1 ms bins, but not while it is blind."""
    time = np.arange(0, 4, 1e-3) + 5e-4
    time = time[(time < blind[0]) | (time >= blind[1])]
    value = scale * STEPS[np.searchsorted(CAME + late, time, side="right") - 1]
    value = value + np.random.default_rng(0).normal(0, noise, time.size)

    def seen(start, end):
        inside = (time >= start) & (time < end)
        return time[inside], value[inside]

    return seen


def rows():
    """What the host heard: each step 30 ms late, a read-back in between."""
    time = np.concatenate([CAME + 0.03, CAME + 0.5])
    sent = np.concatenate([STEPS, STEPS])
    read = np.concatenate([np.full(4, np.nan), STEPS + 1e-3])
    order = np.argsort(time)
    return time[order], sent[order], read[order]


def test_levels_come_from_the_read_back_and_edges_from_the_shunt():
    found = applied_current(*rows(), shunt())
    assert found.steps[:, 1] == pytest.approx(STEPS + 1e-3)
    assert found.edges == 3
    assert found.steps[1:, 0] == pytest.approx(CAME[1:], abs=1.5e-3)


@pytest.mark.parametrize("hum", [0.012, 0.025, 0.04])
def test_a_crest_of_hum_is_no_edge(hum):
    """Steps of 60 mA, each heard of 7 ms late, under a hum of up to 40 mA."""
    came = 0.2 + 0.1437 * np.arange(30)
    level = 0.06 * (np.arange(31) % 2)
    time = np.arange(0, came[-1] + 0.2, 5e-4)
    value = level[np.searchsorted(came, time, side="right")]
    value = value + hum * np.sin(2 * np.pi * 50 * time + 1.0)

    def seen(start, end):
        inside = (time >= start) & (time < end)
        return time[inside], value[inside]

    found = applied_current(
        np.append(0.0, came + 7e-3), level, np.full(31, np.nan), seen
    )
    early = came + 7e-3 - found.steps[1:, 0]
    assert np.median(np.abs(early - 7e-3)) < 2e-3 if found.edges else not early.any()


@pytest.mark.parametrize("hum", [0.01, 0.02, 0.03])
def test_hum_of_the_shunt_widens_the_band_of_the_edges_it_moves(hum):
    """A current that rises by L/R, in 0.5 ms bins, by steps of 120 and 160 mA."""
    lag, came = 1.1e-3, 0.2 + 0.0453 * np.arange(60)
    sizes = np.where(np.arange(60) % 4 < 2, 0.12, -0.16) * np.where(
        np.arange(60) % 3 == 0, 1.0, 0.8
    )
    time = np.arange(0, came[-1] + 0.2, 5e-4)
    since = np.maximum(time[:, None] - came, 0.0)
    value = (sizes * -np.expm1(-since / lag)).sum(axis=1)
    value = value + hum * np.sin(2 * np.pi * 50 * time + 1.0)

    def seen(start, end):
        inside = (time >= start) & (time < end)
        return time[inside], value[inside]

    found = applied_current(
        np.append(0.0, came + 7e-3),
        np.append(0.0, np.cumsum(sizes)),
        np.full(61, np.nan),
        seen,
        coil_lag=lag,
    )
    missed = np.abs(found.steps[1:, 0] - came)
    assert np.quantile(missed, 0.95) < found.uncertainty()
    assert found.uncertainty() < 2 * lag


def test_an_edge_in_a_gap_of_the_shunt_keeps_the_host_s_time():
    found = applied_current(*rows(), shunt(blind=(1.99, 2.02)))
    assert found.edges == 2
    assert found.steps[1:, 0] == pytest.approx([1.0, 2.03, 3.0], abs=1.5e-3)


def test_without_a_shunt_the_host_s_times_stand():
    found = applied_current(*rows())
    assert found.steps[:, 0] == pytest.approx(CAME + 0.03)
    assert found.edges == 0


def test_a_step_that_was_answered_late_may_have_come_earlier():
    """Half of what its round trip took longer than the quickest, either way."""
    time, sent, read = rows()
    asked = time - 0.02
    asked[:2] = time[:2] - 0.005  # the first is read back, which is no step
    late = np.flatnonzero(sent == 1.0)[0]
    time[late] += 0.01
    found = applied_current(time, sent, read, asked=asked)
    assert found.doubt == pytest.approx([0, 0, 0.005, 0], abs=1e-9)
    assert found.steps[2, 0] == pytest.approx(CAME[2] + 0.03 + 0.005)


def test_an_edge_is_looked_for_from_when_its_set_point_was_sent():
    """Of which the first answer was lost."""
    time, sent, read = rows()
    asked = time - 0.035
    late = np.flatnonzero(sent == 1.0)[0]
    time[late] += 0.2
    found = applied_current(time, sent, read, shunt(), asked=asked)
    assert found.steps[2, 0] == pytest.approx(CAME[2], abs=1.5e-3)
    assert found.edges == 3
    assert not found.doubt.any()


def test_a_wrong_shunt_shows_in_the_averages():
    seen = shunt(scale=0.1, noise=1e-4)
    found = applied_current(*rows(), seen)
    ratio = shunt_over_source(found, seen)
    assert ratio.value == pytest.approx(0.1, rel=0.01)
    assert ratio.high < 0.11
    assert found.edges == 0, "no edge of that size is believed"


def test_steps_below_two_codes_keep_the_host_s_time():
    time, sent, read = rows()
    found = applied_current(time, sent * 0.02, read * np.nan, shunt(scale=0.02))
    assert found.edges == 0
    assert found.steps[:, 1] == pytest.approx(STEPS * 0.02)


def test_nothing_applied_is_nothing():
    found = applied_current([], [], [], shunt())
    assert found.steps.shape == (0, 2)


def test_steps_the_shunt_cannot_show_come_as_early_as_the_others():
    came = np.arange(8.0)
    levels = np.array([0.0, 0.5, 0.51, 1.0, 0.5, 0.0, 0.3, 0.6])
    time = np.arange(0, 9, 1e-3) + 5e-4
    value = levels[np.searchsorted(came, time, side="right") - 1]

    def shunt(start, end):
        inside = (time >= start) & (time < end)
        return time[inside], value[inside]

    found = applied_current(came + 0.03, levels, levels * np.nan, shunt)
    assert found.edges == 6
    assert found.lead == pytest.approx(0.03, abs=1.5e-3)
    assert found.steps[1:, 0] == pytest.approx(came[1:], abs=2e-3)


def test_steps_the_shunt_cannot_show_follow_clocks_that_part():
    """A slow sine before a fast one was dated by the fast: 0.8 ms off in 40 s."""
    drift = 1e-4
    came = np.array([0.0, 0.5, 1.0, 5.0, 38.0, 38.5, 39.0, 39.5, 60.0])
    levels = np.array([0.0, 0.5, 1.0, 1.01, 0.5, 0.0, 0.5, 0.0, 0.01])
    time = np.arange(0, 62, 1e-3) + 5e-4
    value = levels[np.searchsorted(came, time, side="right") - 1]

    def shunt(start, end):
        inside = (time >= start) & (time < end)
        return time[inside], value[inside]

    heard = came * (1 + drift) + 0.03
    heard[6] += 0.02  # an answer that was lost once tells nothing of the clocks
    found = applied_current(heard, levels, levels * np.nan, shunt)
    assert found.steps[3, 0] == pytest.approx(came[3], abs=5e-4)
    # nothing tells of the clocks after the last edge that is seen
    away = found.uncertainty(50.0) - found.uncertainty(0.0, 50.0)
    assert away == pytest.approx(1e-4 * 20.5, rel=0.01)


@pytest.mark.parametrize("unsteady", [0.0, 4e-3])
def test_edges_date_the_current_as_well_as_they_agree(unsteady):
    """They were said to lie within 0.5 ms, where they scatter by a tenth of that."""
    rng, lag = np.random.default_rng(1), 1.1e-3
    came = np.cumsum(rng.uniform(0.9, 1.1, 40))
    levels = np.arange(40) % 2 * 0.5

    def shunt(start, end):
        edges = np.arange(np.ceil(start / 5e-4), end / 5e-4) * 5e-4
        time = (edges[:-1, None] + (np.arange(20) + 0.5) * 2.5e-5).ravel()
        step = np.searchsorted(came, time, side="right") - 1
        old = np.where(step > 0, levels[step - 1], 0.0)
        gone = 1 - np.exp(-(time - came[step]) / lag)
        value = old + (levels[step] - old) * gone
        return edges[:-1] + 2.5e-4, value.reshape(-1, 20).mean(axis=1)

    heard = came + 0.03 + unsteady * rng.uniform(-1, 1, 40)
    found = applied_current(heard, levels, levels * np.nan, shunt, lag)
    off = found.steps[1:, 0] - came[1:]
    assert np.percentile(np.abs(off), 95) < found.uncertainty()
    if unsteady:  # one that it does not show is dated by what the host heard
        assert found.uncertainty() == pytest.approx(5e-4)
    else:
        assert found.uncertainty() < 1e-4
        assert abs(np.mean(off)) < 5e-6  # a bin's line was 28 us late


@pytest.mark.parametrize("unsteady", [0.0, 1e-3])
def test_edges_between_far_samples_are_no_better_known_than_these(unsteady):
    """At 200 S/s they were said to lie within 0.5 ms, where they scatter by 1.4 ms."""
    rng = np.random.default_rng(2)
    came = np.cumsum(rng.uniform(0.9, 1.1, 40))
    levels = np.arange(40) % 2 * 0.5
    time = np.arange(0, 50, 5e-3)
    value = levels[np.searchsorted(came, time, side="right") - 1]

    def shunt(start, end):
        inside = (time >= start) & (time < end)
        return time[inside], value[inside]

    heard = came + 0.03 + unsteady * rng.uniform(-1, 1, 40)
    found = applied_current(heard, levels, levels * np.nan, shunt, 1.1e-3)
    off = found.steps[1:, 0] + 1.1e-3 * np.log(2) - came[1:]
    assert found.edges == 39
    assert np.percentile(np.abs(off), 95) < found.uncertainty()


def test_steps_below_two_codes_of_a_coarse_channel_date_nothing():
    """Edges of a shunt on ±5 V, 0.39 A a code, were said to be 0.5 ms true."""
    found = applied_current(*rows(), shunt(), visible=0.75)
    assert found.edges == 1


def test_a_long_level_is_read_from_the_pyramid(bench, folder):
    """A minute at 1 MS/s once took a GB: every sample, and eight bytes to count it."""
    layout = Layout(signals=("coil_current",), simulated=True)
    recorder = Recorder(folder, layout, reserve=0)
    recorder.segment(bench.stream(interval=1e-6, names=("coil_current",)), 0.0)
    second = np.full((1, 1_000_000), 256, np.int16)
    for first in range(0, 60_000_000, 1_000_000):
        recorder.append(
            Block(first=first, codes=second, overrange=(False,), received=0.0)
        )
    recorder.close("complete", 60_000_000)
    with Run.load(folder.path) as run:
        tracemalloc.start()
        time, value = run.shunt(0.0, 60.0)
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert most < 20e6
        assert value == pytest.approx(run.signal("coil_current")[0])
        assert time[0] < 0.1 and time[-1] > 59.9
