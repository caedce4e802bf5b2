import numpy as np
import pytest

from tactile_lab.analysis.rate_force import eq15_rate, fit_rate_law, onset
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform


def test_eq_15_is_the_models_rate_where_nothing_adapts():
    slow = Circuit(tau=1e6)
    for force in (0.1, 0.15, 0.2):
        run = simulate(slow, Waveform.pulse(force, ramp=0.01, hold=3.0))
        held = run.spike_times[run.spike_times > 1.0]
        measured = 1 / np.diff(held).mean()
        assert eq15_rate(slow, force) == pytest.approx(measured, rel=1e-3)


def test_eq_15_is_zero_below_the_quasi_static_critical_force():
    assert eq15_rate(Circuit(), 92.55e-3) == 0
    assert eq15_rate(Circuit(), 92.65e-3) > 0


def test_a_slow_ramp_leaves_less():
    assert eq15_rate(Circuit(), 0.15, ramp=2.0) < eq15_rate(Circuit(), 0.15)


@pytest.mark.parametrize("tau", [1.5, 8.69])
def test_the_scale_of_the_force_is_that_of_the_model(tau):
    """Node A late by 6 ms was 0.4 % of force where the film forgets in 1.5 s."""
    circuit, trains = Circuit(tau=tau, V_GS=1.47), []
    steps = [Waveform.pulse(force, ramp=0.25, hold=1.0) for force in (0.1, 0.15, 0.2)]
    for start, force in zip((0, 100, 200), steps, strict=True):
        spikes = simulate(circuit, force, keep=("spikes",)).spike_times
        trains.append(start + spikes[(spikes > 0.28) & (spikes < 1.25)])
    force = {
        100 * i: simulate(circuit, one, keep=("V_P",), until=2)
        for i, one in enumerate(steps)
    }

    def V_P(time):
        which = 100 * np.floor((time + 50) / 100)
        return sum(
            np.where(which == start, run.sample("V_P", np.clip(time - start, 0, 2)), 0)
            for start, run in force.items()
        )

    law = fit_rate_law(circuit, V_P, trains)
    assert law.scale.value == pytest.approx(1, abs=2e-4)
    assert law.V_GS.value == pytest.approx(1.47, abs=1e-4)


def test_the_reset_time_adds_to_each_interval():
    with_reset = Circuit(t_eps=0.01)
    plain = 1 / eq15_rate(Circuit(), 0.15)
    assert 1 / eq15_rate(with_reset, 0.15) == pytest.approx(plain + 0.01)


def test_onset_lies_between_the_last_silent_and_the_first_firing():
    found = onset([0.2, 0.08, 0.1, 0.09], [30, 0, 4, 0])
    assert (found.silent, found.fires) == (0.09, 0.1)
    assert found.middle == pytest.approx(0.095)
    assert found.half_width == pytest.approx(0.005)


@pytest.mark.parametrize(
    ("spikes", "message"),
    [
        ([0, 0], "no spike was detected"),
        ([1, 2], "every force"),
        ([2, 0], "silent though"),
    ],
)
def test_an_onset_that_is_not_there(spikes, message):
    with pytest.raises(NotIdentifiableError, match=message):
        onset([0.1, 0.2], spikes)
