"""The circuit's own adaptation law, fitted to spikes and to the silence after them."""

import numpy as np
import pytest

from tactile_lab.analysis.adaptation import fit_adaptation
from tactile_lab.analysis.circuit_adaptation import (
    FOLLOWED,
    fit_circuit_adaptation,
    followed,
)
from tactile_lab.deviation import Deviation
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import I_C, rest_V_C1
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

HOLD = (0.3, 10.25)


def held(circuit, level=0.15, hold=10.0):
    force = Waveform.pulse(level, ramp=0.25, hold=hold)
    return simulate(circuit, force, keep=("spikes",)).spike_times


def scattered(circuit, V_P, wobble, seed, *, hold=10.0, step=5e-4):
    """Spikes of a hold whose V_fire is another each time, by `wobble` V."""
    rng = np.random.default_rng(seed)
    time = np.arange(0, hold, step)
    grid = np.linspace(0, V_P, 200)
    known = [float(I_C(circuit, rest_V_C1(circuit, v))) for v in grid]
    current = np.interp(V_P * np.exp(-time / circuit.tau), grid, known)
    left, V, spikes = np.exp(-step / circuit.tau_L), 0.0, []
    charge = circuit.R_L * current * (1 - left)
    level = circuit.fire_voltage + wobble * rng.normal()
    for i in range(time.size):
        before, V = V, V * left + charge[i]
        if V >= level:
            part = (level - before) / (V - before)
            spikes.append(time[i] + part * step)
            # the charge that came after the spike within this step
            V, level = (
                (1 - part) * charge[i],
                circuit.fire_voltage + wobble * rng.normal(),
            )
    return np.array(spikes)


def test_a_scatter_that_is_small_by_luck_tells_no_tau():
    """A touch of half a second: 1.1 s (0.58 to 2.09 s) for 8.69 s, one of 120 alike."""
    force = Waveform.through([(0, 0), (0.05, 0.2), (0.65, 0.2)])
    spikes = simulate(Circuit(), force, keep=("spikes",)).spike_times
    wobble = np.random.default_rng(74).normal(0, 1.5e-4, spikes.size)
    with pytest.raises(NotIdentifiableError, match="factor 2"):
        fit_circuit_adaptation(Circuit(), spikes + np.cumsum(wobble), (0.1, 0.6))


@pytest.mark.parametrize("ramp", [0.0, 0.008, 0.02, 0.25])
def test_it_waits_longer_for_node_A_after_a_force_that_came_faster(ramp):
    """30 ms were waited after any: a touch of 8 ms told a tau of 9.1 s, with a
    converter's and the coil's errors 9.7 s, always at the same end of its interval."""
    circuit, force = Circuit(), Waveform.pulse(0.16, ramp=ramp, hold=0.7)
    spikes = simulate(circuit, force, keep=("spikes",)).spike_times
    waited = followed(circuit, ramp)
    found = fit_circuit_adaptation(circuit, spikes, (ramp + waited, ramp + 0.7))
    assert found.tau.value == pytest.approx(circuit.tau, rel=1e-3)
    assert found.V_GS.value == pytest.approx(circuit.V_GS, abs=5e-5)
    assert (waited == FOLLOWED) is (ramp == 0.25)


@pytest.mark.parametrize("level", [0.02, 0.03, 0.04])
def test_a_circuit_without_R3_obeys_its_own_law(level):
    """Its current was straight between points an eighth apart: tau was 8.51 s."""
    direct = Circuit(t1="direct", I_T1s=1.3e-20)
    law = fit_circuit_adaptation(direct, held(direct, level, 2.0), (0.3, 2.25))
    assert law.tau.value == pytest.approx(direct.tau, abs=0.02)
    assert law.V_GS.value == pytest.approx(direct.V_GS, abs=1e-4)
    assert law.scatter < 2e-4


@pytest.mark.parametrize("begin", [0.264, 0.2983, 0.3284])
def test_a_law_without_another_spike_is_silent_from_the_measured_last_one(begin):
    """Not from a rounding later, which was told as a law that would fire on."""
    spikes = held(Circuit(), 0.14)
    law = fit_circuit_adaptation(Circuit(), spikes, (begin, 10.25))
    assert law.silent_from == spikes[-1]


@pytest.mark.parametrize("tau", [8.69, 6.0])
def test_it_gives_the_circuit_back_from_the_believed_one(tau):
    circuit = Circuit(tau=tau, V_GS=1.41)
    found = fit_circuit_adaptation(Circuit(), held(circuit) + 4.0, (4.3, 14.25))
    assert found.tau.value == pytest.approx(tau, rel=1e-3)
    assert found.V_GS.value == pytest.approx(1.41, abs=1e-4)
    assert found.rms < 1e-3


def test_it_knows_the_silence_where_the_exponential_expects_more_spikes():
    times = held(Circuit())
    law, described = (fit_circuit_adaptation(Circuit(), times, HOLD),
                      fit_adaptation(times, HOLD))  # fmt: skip
    assert law.silent_from == pytest.approx(times[-1], abs=0.05)
    assert described.unseen > 5
    assert described.systematic
    left = np.diff(times) ** -1 - described.rate((times[1:] + times[:-1]) / 2)
    assert law.rms < np.sqrt(np.mean(left[3:] ** 2)) / 50
    late = law.rate([times[-1] - 0.1, times[-1] + 1.0])
    assert late[0] > 3.0 and late[1] == 0.0


def test_the_silence_is_evidence_too():
    """Cut the hold right after a spike, or let it be silent for seconds more."""
    train = scattered(Circuit(), 0.225, 0.02, 3)[:-1]
    going_on, stopped = (
        fit_circuit_adaptation(Circuit(), train, (0.0, end))
        for end in (train[-1] + 1e-2, 10.0)
    )
    assert going_on.silent_from is None
    assert stopped.silent_from is not None
    assert stopped.tau.value > 1.1 * going_on.tau.value
    with pytest.raises(NotIdentifiableError, match="explains both"):
        fit_circuit_adaptation(Circuit(), train[:24], (0.0, 10.0))


def test_its_intervals_cover_the_truth():
    hits, repeats = np.zeros(2), 40
    for seed in range(repeats):
        train = scattered(Circuit(), 0.25, 0.01, seed, hold=8.0)
        found = fit_circuit_adaptation(Circuit(), train, (0.0, 8.0))
        for i, (estimate, truth) in enumerate(((found.tau, 8.69), (found.V_GS, 1.4))):
            hits[i] += estimate.low < truth < estimate.high
    assert np.all(hits / repeats >= 0.86)
    assert np.all(hits / repeats <= 1.0)
    assert found.tau.half < 1.5


@pytest.mark.parametrize(
    "off", [Deviation(input_bias=20e-12), Deviation(temperature=1.0)]
)
def test_what_is_not_known_of_the_circuit_is_in_the_intervals(off):
    other = off.circuit(Circuit())
    times = held(other)
    sure = fit_circuit_adaptation(Circuit(), times, HOLD)
    open_ = fit_circuit_adaptation(Circuit(), times, HOLD, displaced=[other])
    for name, truth in (("tau", 8.69), ("V_GS", 1.4)):
        missed, found = getattr(sure, name), getattr(open_, name)
        assert not missed.low < truth < missed.high
        assert found.low < truth < found.high


@pytest.mark.parametrize(
    ("times", "message"),
    [(np.arange(5) * 0.2, "4 intervals"), (np.arange(40) * 0.1, "V_P"),
     (np.log1p(0.05 * np.arange(40)), "V_P")],
)  # fmt: skip
def test_trains_that_tell_nothing_are_refused(times, message):
    with pytest.raises(NotIdentifiableError, match=message):
        fit_circuit_adaptation(Circuit(), times, (0.0, 5.0))
