"""The detector finds what is there, once, however the record is sliced."""

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from tactile_lab.acquisition.account import RunningRate
from tactile_lab.errors import ParameterError
from tactile_lab.spikes.detection import Detection
from tactile_lab.spikes.detector import (
    SPIKE,
    Detector,
    ResetDetector,
    detect,
    detector_of,
    estimate,
)


def reference(codes, threshold, hysteresis, refractory, polarity):
    """The definition, one sample at a time, in plain Python."""
    found, mode, last, up, down, peak = [], "unarmed", -np.inf, 0.0, np.nan, 0
    before = 0
    for i, raw in enumerate(codes.tolist()):
        code, level = polarity * raw, polarity * threshold
        if mode == "inside":
            peak = max(peak, code)
            if code < level <= before:
                down = i - 1 + (before - level) / (before - code)
            if code <= level - hysteresis:
                found.append((up, polarity * peak, down - up))
                mode = "armed"
        elif mode == "armed" and code >= level:
            at = i - 1 + (level - before) / (code - before)
            if at - last >= refractory:
                mode, up, last, peak = "inside", at, at, code
            else:
                mode = "ignored"
        elif mode != "armed" and code <= level - hysteresis:
            mode = "armed"
        before = code
    if mode == "inside":
        found.append((up, polarity * peak, np.nan))
    return np.array(found, dtype=SPIKE)


def same(got, want):
    for name in SPIKE.names:
        np.testing.assert_array_equal(got[name], want[name])


def in_blocks(detector, codes, cuts, first=0):
    edges = [0, *sorted(cuts), codes.size]
    parts = [detector.feed(first + a, codes[a:b]) for a, b in pairwise(edges)]
    return np.concatenate([*parts, detector.flush()])


walks = st.one_of(
    arrays(np.int16, st.integers(0, 400), elements=st.integers(-20, 20)),
    st.builds(
        lambda gaps, size: np.concatenate(
            [np.r_[np.zeros(g, np.int16), np.int16(size), np.int16(3)] for g in gaps]
        ),
        st.lists(st.integers(0, 3000), min_size=1, max_size=6),
        st.integers(5, 20),
    ),
)


@settings(max_examples=200)
@given(
    walks,
    st.integers(-8, 8),
    st.integers(1, 10),
    st.integers(0, 30),
    st.sampled_from([1, -1]),
    st.data(),
)
def test_any_slicing_gives_the_definition(
    codes, threshold, hysteresis, refractory, polarity, data
):
    want = reference(codes, threshold, hysteresis, refractory, polarity)
    cuts = data.draw(st.lists(st.integers(0, codes.size), max_size=12))
    detector = Detector(
        threshold=threshold,
        hysteresis=hysteresis,
        refractory=refractory,
        polarity=polarity,
    )
    same(in_blocks(detector, codes, cuts), want)


@settings(max_examples=100)
@given(
    st.lists(st.integers(200, 3000), min_size=1, max_size=8),
    st.integers(1, 4),
    st.data(),
)
def test_resets_survive_any_slicing(gaps, span, data):
    ramps = [np.linspace(-30000, 30000, g).astype(np.int16) for g in gaps]
    codes = np.concatenate([*ramps, np.full(span + 1, -30000, np.int16)])
    wanted = detect(codes, resets := Detection(
        signal="V_C2", threshold=50000, hysteresis=1, kind="reset", span=span
    ))  # fmt: skip
    assert len(wanted) == len(gaps)
    cuts = data.draw(st.lists(st.integers(0, codes.size), max_size=12))
    same(in_blocks(detector_of(resets), codes, cuts), wanted)
    falls = np.cumsum(gaps)
    assert np.all((falls - 1 <= wanted["sample"]) & (wanted["sample"] <= falls))


def test_slow_decay_of_v_c2_is_no_reset():
    codes = np.linspace(30000, -30000, 10_000).astype(np.int16)
    detector = ResetDetector(drop=20000, span=3)
    assert len(in_blocks(detector, codes, [17, 5000])) == 0


def test_crossing_peak_and_width_of_one_spike():
    codes = np.array([0, 0, 100, 300, 200, 0, 0], dtype=np.int16)
    spikes = detect(codes, Detection(signal="V_K", threshold=150, hysteresis=50))
    assert spikes["sample"].tolist() == [2.25]
    assert spikes["amplitude"].tolist() == [300]
    assert spikes["width"][0] == pytest.approx(4.25 - 2.25)


def test_index_stays_exact_late_in_a_long_run():
    late = 10**13
    codes = np.array([0, 0, 512, 0], dtype=np.int16)
    setting = Detection(signal="V_K", threshold=256, hysteresis=128)
    assert detect(codes, setting, first=late)["sample"][0] == late + 1.5


def test_a_gap_closes_the_open_spike_and_arms_anew():
    detector = Detector(threshold=100, hysteresis=50)
    assert len(detector.feed(0, np.array([0, 200, 200], np.int16))) == 0
    after = detector.feed(1000, np.array([200, 200, 0, 200, 0], np.int16))
    assert after["sample"].tolist() == [0.5, 1002.5]
    assert np.isnan(after["width"][0])


def test_noise_across_one_threshold_counts_once_with_hysteresis():
    rng = np.random.default_rng(5)
    slow = 1000 * np.sin(np.arange(20_000) / 500)
    codes = (slow + rng.normal(0, 30, slow.size)).astype(np.int16)
    plain = detect(codes, Detection(signal="V_K", threshold=0, hysteresis=1))
    calm = detect(codes, Detection(signal="V_K", threshold=0, hysteresis=200))
    crossings = int(20_000 / 500 / (2 * np.pi))
    assert len(calm) == crossings
    assert len(plain) > len(calm)


def test_refractory_time_counts_from_the_last_accepted_spike():
    codes = np.zeros(100, dtype=np.int16)
    codes[[10, 15, 21, 40]] = 200
    setting = Detection(signal="V_K", threshold=100, hysteresis=50, refractory=10)
    assert detect(codes, setting)["sample"].tolist() == [9.5, 20.5, 39.5]


def test_threshold_from_noise_ignores_the_spikes_themselves():
    rng = np.random.default_rng(2)
    codes = (256 * rng.integers(-1, 2, 100_000)).astype(np.int16)
    codes[::1000] = 20_000
    threshold, hysteresis = estimate(codes, step=256)
    setting = Detection(signal="V_K", threshold=threshold, hysteresis=hysteresis)
    assert len(detect(codes, setting)) == 99  # the first sample is inside a spike
    still = np.full(1000, 512, dtype=np.int16)
    assert estimate(still, step=256)[0] >= 512 + 2 * 256


@pytest.mark.parametrize("sigma", [0.1, 0.3, 0.5, 0.75, 1.0, 3.0])
def test_noise_around_one_code_is_measured_not_rounded(sigma):
    noise = np.random.default_rng(4).normal(0.2, sigma, 100_000)
    codes = (256 * np.round(noise)).astype(np.int16)
    spread = (estimate(codes, step=256)[0] / 256 - 0.2) / 7
    assert spread == pytest.approx(max(0.5, np.hypot(sigma, 12**-0.5)), rel=0.15)


def test_rate_is_carried_from_block_to_block():
    rate = RunningRate()
    times = np.array([1.0, 1.5, 1.6, 3.6])
    parts = [rate.feed(times[:1]), rate.feed(times[1:1]), rate.feed(times[1:])]
    np.testing.assert_allclose(np.concatenate(parts), [0, 2, 10, 0.5])
    assert rate.value == pytest.approx(0.5)


@pytest.mark.parametrize(
    "wrong",
    [
        {"threshold": 40_000, "hysteresis": 1},
        {"threshold": 0, "hysteresis": 0},
        {"threshold": 0, "hysteresis": 1, "refractory": -1},
        {"threshold": 0, "hysteresis": 1, "polarity": 2},
    ],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(ParameterError):
        Detector(**wrong)


FIRST_BLOCK = """
import numpy as np
from tactile_lab.acquisition.search import SpikeSearch
from tactile_lab.scene.load import load

SpikeSearch.of(load("demo"), "V_K")
from tactile_lab.spikes import crossings, detector

ready = list(crossings.scan.signatures)
block = np.zeros((4, 5000), dtype=np.int16)
detector.Detector(threshold=100, hysteresis=10).feed(0, block[2])
print(len(ready), crossings.scan.signatures == ready)
"""


def test_nothing_is_compiled_when_the_first_block_of_a_run_has_come():
    done = subprocess.run(
        [sys.executable, "-c", FIRST_BLOCK], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["1", "True"]
