"""The one thing that is other than believed is named, with its size; or none is."""

from dataclasses import replace
from weakref import ref

import numpy as np
import pytest

from tactile_lab.analysis.belief import Belief
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.suspects import SUSPECTS, Explanation, Suspect, explain
from tactile_lab.analysis.twin import Measured
from tactile_lab.bench import Followers
from tactile_lab.deviation import Deviation
from tactile_lab.magnetics import ForceUncertainty, Magnet
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

MAGNET = Magnet(r=6e-3, coil_lag=1.1e-3, eddy_lag=3e-3, lag_uncertainty=1e-3)
FOLLOWERS = Followers(input_bias_uncertainty=20e-12, offset_uncertainty=3e-3)
FORCE = Waveform.pulse(0.13, ramp=0.1, hold=1.5, rest=1.0).then(
    Waveform.pulse(0.18, ramp=0.1, hold=1.5, rest=1.0)
)
BELIEF = Belief(
    circuit=Circuit(I_bias=65e-12),
    magnet=MAGNET,
    setpoint=MAGNET.current_for(FORCE),
    followers=FOLLOWERS,
    clock=5e-4,
)


def explained(deviation, seed=1, **other):
    """What is made of a run whose truth is off by `deviation`."""
    circuit, force = BELIEF.deviating(deviation)
    true = simulate(replace(circuit, **other), force, keep=("V_C1", "spikes"))
    rng = np.random.default_rng(seed)
    time = (np.arange(1000) + 0.5) * true.duration / 1000
    volts = true.sample("V_C1", time) + rng.normal(0, 4e-4, time.size) + 1e-3
    seen = Measured("V_C1", time, volts, resolution=16e-3, offset=3e-3)
    return explain(BELIEF, true.duration, V_C1=seen, spike_times=true.spike_times)


def test_clocks_far_apart_within_their_band_are_no_misfit():
    """Without a shunt they are known to 47 ms; a lag that was none was named."""
    time, level, begin = [], [], 0.2
    up = np.linspace(0, 0.16, 7)[1:]
    for _ in range(8):
        for way in (up, [*up[::-1][1:], 0.0]):
            time += list(begin + 0.0455 * np.arange(6))
            level += list(way)
            begin += 1.25
    force = Waveform.stairs(np.column_stack([time, level]), begin)
    believed = replace(BELIEF, setpoint=MAGNET.current_for(force), clock=0.047)
    true = believed.force.shifted(0.02)
    found = simulate(BELIEF.circuit, true.since(0.0), keep=("spikes",), until=begin)
    assert explain(believed, begin, spike_times=found.spike_times) is None


def test_lists_that_each_began_a_little_off_are_no_misfit():
    """Of each the shunt shows when it began, to half a millisecond, by itself."""
    at = np.linspace(0.0, 1.0, 201)
    grating = np.column_stack([0.1 + at, 0.16 - 0.1 * np.cos(2 * np.pi * 10 * at)])
    scan = Waveform.through([(0, 0), *grating, (1.2, 0), (2.39, 0)])
    begins = 0.5 + 2.4 * np.arange(4)
    late = np.array([4e-4, -3e-4, 2e-4, 4e-4])
    believed, true = (
        Waveform(
            np.concatenate([[0.0], *(scan.time + t for t in begins + off)]),
            np.concatenate([[0.0], *(scan.value for _ in begins)]),
        )
        for off in (0.0, late)
    )
    belief = replace(BELIEF, setpoint=MAGNET.current_for(believed))
    there = replace(BELIEF, setpoint=MAGNET.current_for(true))
    found = simulate(there.circuit, there.force, keep=("V_C1", "spikes"))
    time = (np.arange(2000) + 0.5) * found.duration / 2000
    rng = np.random.default_rng(5)
    volts = found.sample("V_C1", time) + rng.normal(0, 4e-4, time.size)
    seen = Measured("V_C1", time, volts, resolution=16e-3, offset=3e-3)
    data = {"V_C1": seen, "spike_times": found.spike_times}
    assert explain(belief, found.duration, **data) is not None  # all off alike: no
    assert explain(replace(belief, begins=begins), found.duration, **data) is None


@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("input_bias", 45e-12), ("V_GS", -3e-3), ("force", 0.03), ("lag", 3e-3),
        ("temperature", -2.0), ("R1", 0.02),
    ],
)  # fmt: skip
def test_the_single_cause_is_named_with_its_size(name, size):
    found = explained(Deviation(**{name: size}))
    assert found.cause is not None
    assert found.cause.name == name
    assert found.cause.size.low <= size <= found.cause.size.high
    assert found.cause.size.value == pytest.approx(size, rel=0.1)
    assert set(SUSPECTS) == {suspect.name for suspect in found.suspects}
    assert "One cause explains it" in found.text


@pytest.mark.parametrize(
    ("deviation", "other"),
    [
        (Deviation(V_GS=3e-3, R1=0.03), {}),
        (Deviation(force=0.03, input_bias=-50e-12), {}),
        (Deviation(), {"tau": 6.0}),
        (Deviation(), {"C2": 165e-12}),
    ],
)
def test_what_no_single_suspect_explains_is_pinned_on_none(deviation, other):
    found = explained(deviation, **other)
    assert found.cause is None
    assert not found.candidates
    assert "cannot be told" in found.text
    assert "95 %" not in found.text


@pytest.mark.parametrize(
    ("deviation", "told"),
    [
        (Deviation(temperature=0.5), {"temperature", "force"}),
        (Deviation(V_GS=0.7e-3), {"V_GS", "R1", "temperature"}),
    ],
)
def test_causes_that_explain_it_equally_well_are_all_named(deviation, told):
    found = explained(deviation)
    assert found.cause is None
    assert {suspect.name for suspect in found.candidates} == told
    assert f"Each of {len(told)} causes would explain it alone" in found.text
    assert "cannot tell them apart" in found.text
    assert all(suspect.text in found.text for suspect in found.candidates)
    assert "Something else" not in found.text


@pytest.mark.parametrize(
    "within", [{}, {"input_bias": 18e-12}, {"lag": -8e-4}, {"offset": 0.0}]
)
def test_what_the_bench_s_bands_allow_needs_no_explanation(within):
    assert explained(Deviation(**within)) is None


def fired(deviation, late, clock=46e-3):
    """What is made of spikes alone, by clocks that are off by `late` s."""
    belief = replace(BELIEF, clock=clock)
    circuit, force = belief.deviating(deviation)
    true = simulate(circuit, force.shifted(late).since(0.0), keep=("spikes",))
    return explain(belief, true.duration, spike_times=true.spike_times)


@pytest.mark.parametrize("late", [-40e-3, -7.3e-3, 7.3e-3, 40e-3])
def test_clocks_within_a_wide_band_need_no_explanation(late):
    assert fired(Deviation(), late) is None


@pytest.mark.parametrize(
    ("name", "size", "late"), [("V_GS", -4e-3, -20e-3), ("R1", 0.03, -10e-3)]
)
def test_a_cause_is_named_though_clocks_are_off_within_a_wide_band(name, size, late):
    cause = fired(Deviation(**{name: size}), late).cause
    assert cause.name == name
    assert cause.size.value == pytest.approx(size, rel=0.02)


def test_steps_of_a_converter_that_no_noise_smooths_are_no_misfit():
    code, true = 10 / 254, simulate(*BELIEF.driven, keep=("V_C1", "spikes"))
    time = (np.arange(1000) + 0.5) * true.duration / 1000
    volts = code * np.rint(true.sample("V_C1", time) / code)
    seen = Measured("V_C1", time, volts, resolution=code, offset=3e-3, steps=code / 2)
    assert explain(BELIEF, true.duration, V_C1=seen) is None


def test_steps_of_a_converter_that_noise_smooths_half_are_no_misfit():
    """A long hold in codes of 39 mV under 5 mV of noise was told as one of 4.5."""
    code, true = 10 / 254, simulate(*BELIEF.driven, keep=("V_C1", "spikes"))
    time = (np.arange(1000) + 0.5) * true.duration / 1000
    volts, left = true.sample("V_C1", time), 0.22 * code
    volts += left * np.sin(2 * np.pi * volts / code)
    seen = Measured("V_C1", time, volts, resolution=code, offset=3e-3, steps=left)
    assert explain(BELIEF, true.duration, V_C1=seen) is None


def test_a_cause_is_named_though_the_follower_is_not_quite_as_stated():
    found = explained(Deviation(V_GS=4e-3, input_bias=15e-12))
    assert found.cause.name == "V_GS"
    assert found.cause.size.low <= 4e-3 <= found.cause.size.high


def test_what_a_cause_leaves_is_said_beside_what_the_belief_leaves():
    size = Estimate(4e-3, 1e-4, 3.8e-3, 4.2e-3)
    found = Explanation(176.4, (Suspect("V_GS", size, 1.02), Suspect("R1", size, 9.0)))
    assert (
        "With it the misfit falls from 180 to 1 times the noise; the next best, R1, "
        "leaves 9 times."
    ) in found.text


@pytest.mark.parametrize(("seconds", "kept"), [(1, True), (401, False)])
def test_the_force_of_a_long_run_is_not_kept_when_none_needs_it(seconds, kept):
    time = np.arange(0, seconds, 0.02)
    stairs = Waveform.stairs(np.column_stack([time, time % 0.3]), seconds)
    force = ref(Deviation().driven(Circuit(), MAGNET, stairs).force)
    assert (force() is not None) is kept


@pytest.mark.parametrize("clock", [-0.3, 0.0, 0.3])
def test_the_force_of_a_long_run_is_in_pieces_what_it_is_at_once(clock, monkeypatch):
    known = ForceUncertainty(2e-3, 0.04)
    monkeypatch.setattr(Magnet, "force_uncertainty", known)
    parts = np.array([clock / BELIEF.clock, 0.4, 0.3, -0.2, 0.1])
    moved = replace(BELIEF).moved(parts)
    monkeypatch.setattr("tactile_lab.deviation.KEPT", 0)
    monkeypatch.setattr("tactile_lab.lag.AT_ONCE", 3)
    circuit, force = replace(BELIEF).moved(parts)
    assert circuit == moved.circuit
    pieces = list(force.pieces(50))
    assert len(pieces) > 5
    time = [pieces[0].time[:1], *(piece.time[1:] for piece in pieces)]
    value = [pieces[0].value[:1], *(piece.value[1:] for piece in pieces)]
    assert Waveform.tidied(np.concatenate(time), np.concatenate(value)) == moved.force


@pytest.mark.parametrize(
    ("name", "size", "told"),
    [
        ("force", Estimate(3e-2, 2.3e-5, 2.9955e-2, 3.0046e-2), "(2.995 to 3.005 %"),
        ("lag", Estimate(8e-3, 3e-7, 7.9994e-3, 8.0006e-3), "(7.9994 to 8.0006 ms"),
    ],
)
def test_the_ends_of_an_interval_are_told_apart(name, size, told):
    """The force +3 % (3 % to 3 %, 95 %) was no interval."""
    assert told in Suspect(name, size, 1.0).text


@pytest.mark.parametrize("off", [{"V_GS": -4e-3}, {"lag": -4e-3}])
def test_no_lag_is_less_than_none(off):
    """Less made no difference to anything, and had an interval of 1e149 s."""
    found = explained(Deviation(**off))
    assert found is not None
    (lag,) = (s for s in found.suspects if s.name == "lag")
    assert lag.size.value >= -MAGNET.eddy_lag
    assert lag.size.half < 1.0
