"""The planned heat is what the driver's interlock will count."""

import numpy as np
import pytest

from drivers.coil.interlock import HeatBudget
from tactile_lab.bench import CoilLimits
from tactile_lab.planning.heat import heat_along
from tactile_lab.waveform import Waveform

LIMITS = CoilLimits()


def test_holding_one_ampere_spends_the_budget_in_47_s():
    used, most, spent = heat_along(Waveform.through([(0, 1), (60, 1)]), LIMITS)
    assert spent == pytest.approx(30 / 0.64)
    assert used == most == pytest.approx(0.64 * 60)


def test_below_the_continuous_current_it_cools():
    used, most, spent = heat_along(Waveform.through([(0, 0.5), (60, 0.5)]), LIMITS, 20)
    assert (most, spent) == (20, None)
    assert used == pytest.approx(20 * np.exp(-1))


def test_same_as_the_interlock_on_a_staircase_of_set_points():
    wave = Waveform.pulse(-1.8, ramp=0.5, hold=3, rest=20).then(
        Waveform.pulse(1.2, ramp=1.0, hold=5, rest=5)
    )
    budget = HeatBudget(LIMITS, 0.0)
    most = 0.0
    for time in np.arange(0, wave.end, 4e-3):
        budget.flow(float(time), float(wave.at(time + 2e-3)))
        most = max(most, budget.used(float(time)))
    used, planned, spent = heat_along(wave, LIMITS)
    assert used == pytest.approx(budget.used(wave.end), rel=1e-3)
    assert planned == pytest.approx(most, rel=1e-3)
    assert spent is None
