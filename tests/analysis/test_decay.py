import numpy as np
import pytest

from tactile_lab.analysis.decay import fit_decay
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

TIME = np.arange(0, 30, 0.02)


def decaying(tau=8.69, noise=0.0, seed=0, amplitude=1.0):
    rng = np.random.default_rng(seed)
    ideal = 25e-9 * np.exp(amplitude * np.exp(-TIME / tau))
    return ideal * np.exp(rng.normal(0, noise, TIME.size))


def test_it_gives_tau_back():
    found = fit_decay(TIME, decaying(), [(0.0, 30.0)])
    assert found.tau.value == pytest.approx(8.69, rel=1e-6)
    assert found.amplitudes[0].value == pytest.approx(1.0, rel=1e-6)


def test_a_known_rest_current_makes_a_short_hold_enough():
    current = decaying(noise=0.01)
    found = fit_decay(TIME, current, [(0.0, 4.0)], rest=25e-9)
    assert found.tau.low < 8.69 < found.tau.high
    with pytest.raises(NotIdentifiableError, match="does not determine tau"):
        fit_decay(TIME[:50], current[:50], [(0.0, 1.0)])


def test_its_intervals_cover_the_truth():
    repeats = 80
    hits = 0
    for seed in range(repeats):
        found = fit_decay(TIME, decaying(noise=0.02, seed=seed), [(0.0, 30.0)])
        hits += found.tau.low <= 8.69 <= found.tau.high
    assert 0.88 < hits / repeats < 1.0


def test_the_models_i_ds_decays_with_the_models_tau():
    circuit = Circuit(tau=6.0)
    force = Waveform.pulse(0.1, ramp=0.25, hold=20.0)
    result = simulate(circuit, force, keep=("I_DS",))
    time = np.linspace(0, force.end, 2000)
    found = fit_decay(time, result.sample("I_DS", time), [(0.3, 20.2)])
    assert found.tau.value == pytest.approx(6.0, rel=0.01)


def test_a_pull_decays_upwards():
    found = fit_decay(TIME, decaying(amplitude=-0.8), [(0.0, 30.0)])
    assert found.tau.value == pytest.approx(8.69, rel=1e-6)
    assert found.amplitudes[0].value < 0


def test_currents_that_tell_nothing_are_refused():
    rng = np.random.default_rng(0)
    flat = 25e-9 * np.exp(rng.normal(0, 0.01, TIME.size))
    with pytest.raises(NotIdentifiableError):
        fit_decay(TIME, flat, [(0.0, 30.0)])
    with pytest.raises(NotIdentifiableError, match="not above 0 A"):
        fit_decay(TIME, -flat, [(0.0, 30.0)])
    with pytest.raises(NotIdentifiableError, match="points lie in the hold"):
        fit_decay(TIME, flat, [(40.0, 50.0)])
