from dataclasses import replace

import numpy as np
import pytest

from tactile_lab.analysis.operating_point import V_GS_of_onset
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform


def push(level):
    return Waveform.pulse(level, ramp=0.25, hold=1.0)


def bracket(circuit, low=0.05, high=0.15, width=5e-4):
    """Strongest silent and weakest firing force of a circuit, as a search finds."""
    while high - low > width:
        tried = (low + high) / 2
        fires = simulate(circuit, push(tried)).spike_times.size > 0
        low, high = (low, tried) if fires else (tried, high)
    return low, high


@pytest.mark.parametrize("V_GS", [1.37, 1.4, 1.44])
def test_the_critical_force_gives_v_gs_back_to_a_millivolt(V_GS):
    silent, fires = bracket(Circuit(V_GS=V_GS))
    low, high = V_GS_of_onset(Circuit(), push(silent), push(fires))
    assert low < V_GS < high
    assert high - low < 1e-3


def test_a_circuit_without_R3_gives_v_gs_back():
    """0.15 V above its V_GS it would fire 1e7 times, which was refused."""
    direct = Circuit(t1="direct", I_T1s=1.3e-20)
    silent, fires = bracket(direct, low=0.002, high=0.02)
    low, high = V_GS_of_onset(direct, push(silent), push(fires))
    assert low < direct.V_GS < high
    assert high - low < 1e-3


def test_the_force_s_error_widens_it_by_0_65_mn_a_millivolt():
    silent, fires = bracket(Circuit())
    low, high = V_GS_of_onset(Circuit(), push(silent), push(fires))
    wide = V_GS_of_onset(Circuit(), push(silent), push(fires), force_error=0.65e-3)
    # bracket and force are independent
    assert wide[1] - wide[0] == pytest.approx(np.hypot(high - low, 2e-3), rel=0.01)
    assert wide[0] + wide[1] == pytest.approx(low + high)


def test_what_the_bias_leaves_open_is_in_it():
    """As often as it says: biases and critical forces drawn, V_GS as believed."""
    rng, inside, believed = np.random.default_rng(2), 0, Circuit(I_bias=65e-12)
    for _ in range(40):
        bias = rng.normal(0, 20e-12 / 1.96)
        true = replace(believed, I_bias=believed.I_bias + bias)
        silent, fires = bracket(true, low=rng.uniform(0.05, 0.06), width=7e-4)
        low, high = V_GS_of_onset(
            believed,
            push(silent),
            push(fires),
            displaced=[replace(believed, I_bias=believed.I_bias + 20e-12)],
        )
        inside += low < believed.V_GS < high
    assert 35 <= inside


def test_trials_that_contradict_each_other_are_refused():
    with pytest.raises(NotIdentifiableError, match="strongest silent one"):
        V_GS_of_onset(Circuit(), push(0.12), push(0.08))


def test_a_threshold_far_away_is_refused():
    far = replace(Circuit(), V_th=3.9)
    said = "weakest force that fired it is silent by the model with each V_GS from"
    with pytest.raises(NotIdentifiableError, match=said):
        V_GS_of_onset(far, push(0.001), push(0.002))


def test_a_silent_pull_tells_no_v_gs_and_contradicts_none():
    """It was said that no V_GS explains it: with the believed one the model agrees."""
    said = "strongest silent one it is silent by the model with each V_GS from"
    with pytest.raises(NotIdentifiableError, match=said):
        V_GS_of_onset(Circuit(), push(-0.08), push(0.1))
