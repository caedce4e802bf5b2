"""The live picture: nothing between two polls is invisible, whatever the slicing."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.acquisition.live import CAPACITY, LiveBins
from tactile_lab.scope import Block, Channel, Stream

CHANNELS = (
    Channel(signal="V_C1", input="A", range=5.0, offset=-4.0),
    Channel(signal="V_K", input="C", range=5.0, scale=10.0),
)


def stream(interval=1e-4):
    return Stream(
        channels=CHANNELS,
        interval=interval,
        full_scale=32512,
        shift=8,
        started=7.0,
        uncertainty=0.0,
    )


def fill(live, codes, cuts=()):
    edges = [0, *sorted(cuts), codes.shape[1]]
    for first, last in itertools.pairwise(edges):
        part = np.ascontiguousarray(codes[:, first:last])
        live.add(Block(first, part, (False, False), 0.0))


def noise(samples, seed=1):
    rng = np.random.default_rng(seed)
    return (rng.integers(-127, 128, (2, samples)) * 256).astype(np.int16)


@given(st.lists(st.integers(0, 3000), max_size=12))
def test_bins_do_not_depend_on_block_edges(cuts):
    codes = noise(3000)
    whole, sliced = LiveBins(), LiveBins()
    for live, edges in ((whole, ()), (sliced, cuts)):
        live.begin(stream(), 0.5)
        fill(live, codes, edges)
    a, b = whole.since(0, "V_K"), sliced.since(0, "V_K")
    np.testing.assert_allclose(a.time, b.time, rtol=0, atol=1e-9)
    for kind in ("low", "high", "mean"):
        np.testing.assert_array_equal(getattr(a, kind), getattr(b, kind))


def test_one_sample_shows_in_its_bin_in_the_signals_unit():
    live = LiveBins()
    live.begin(stream(), 2.0)
    codes = np.zeros((2, 100), np.int16)
    codes[1, 57] = 32512
    fill(live, codes)
    bins = live.since(0, "V_K")
    assert bins.width == pytest.approx(1e-3)
    assert bins.time[0] == 2.0
    assert bins.high[5] == pytest.approx(50.0)
    assert bins.high[[4, 6]].max() == 0.0
    assert live.since(0, "V_C1").mean[0] == pytest.approx(4.0)


def test_a_slow_reader_gets_the_newest_bins():
    live = LiveBins()
    live.begin(stream(interval=1e-3), 0.0)
    for first in range(0, CAPACITY + 500, 1000):
        live.add(Block(first, np.zeros((2, 1000), np.int16), (False, False), 0.0))
    bins = live.since(0, "V_C1")
    assert bins.time.size == CAPACITY
    assert bins.time[-1] == pytest.approx(live.reach - 1e-3)


def test_part_of_the_record_is_found_by_time():
    live = LiveBins()
    live.begin(stream(), 0.0)
    fill(live, noise(5000))
    part = live.between(0.1, 0.2, "V_C1")
    assert part.time[0] == pytest.approx(0.1)
    assert part.time.size == 100


def test_an_unmeasured_signal_is_no_silent_zero():
    live = LiveBins()
    live.begin(stream(), 0.0)
    with pytest.raises(KeyError):
        live.since(0, "V_C2")
