"""The planned heat is what the driver's interlock will count."""

import numpy as np
import pytest

from drivers.coil.interlock import HeatBudget
from tactile_lab.bench import CoilLimits
from tactile_lab.planning.heat import cool_down, heat_along, heat_left
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


@pytest.mark.parametrize("part", [0.02, 0.5, 1.0, 1.3])
def test_a_coil_below_its_budget_is_warm_until_it_has_cooled(part):
    used = part * LIMITS.heat
    rest = cool_down(used, LIMITS)
    assert rest > 0
    assert heat_left(rest, LIMITS) == pytest.approx(used)
    left, *_ = heat_along(Waveform.through([(0, 0), (rest, 0)]), LIMITS, used)
    assert cool_down(left * (1 - 1e-9), LIMITS) == 0
    assert heat_left(cool_down(0.0, LIMITS), LIMITS) == 0


@pytest.mark.parametrize("rest", [20, 80], ids=["hottest last", "hottest first"])
def test_same_as_the_interlock_on_a_staircase_of_set_points(rest):
    wave = Waveform.pulse(-1.8, ramp=0.5, hold=3, rest=rest).then(
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
