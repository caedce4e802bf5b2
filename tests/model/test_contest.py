"""The comparison judges: right, wrong count, time-out, failure."""

import numpy as np
import pytest

from tactile_lab.errors import SolverError
from tactile_lab.model.circuit import Circuit
from tactile_lab.validation import general, spice
from tactile_lab.validation.accuracy import fastest, table, write_csv
from tactile_lab.validation.contest import Method, Truth, judge, ours
from tactile_lab.validation.problem import OutOfTimeError, Problem
from tactile_lab.waveform import Waveform

PROBLEM = Problem(
    "jump", Circuit(), Waveform.through([(0, 0), (0.05, 0), (0.05, 0.3)]), 0.12
)


@pytest.fixture(scope="module")
def exact():
    spikes, V_C1 = ours(PROBLEM, 10.0, 1e-12)
    return Truth(spikes, V_C1)


def test_a_general_solver_agrees(exact):
    spikes, V_C1 = general.scipy_solver(PROBLEM, "LSODA", 1e-10, 30.0)
    assert spikes == pytest.approx(exact.spike_times, abs=1e-7)
    assert V_C1 == pytest.approx(exact.V_C1, abs=1e-7)


def test_fixed_steps_get_better_with_shorter_ones(exact):
    errors = []
    for dt in (1e-5, 1e-6):
        spikes, _ = general.fixed_step(PROBLEM, 1, dt, 30.0)
        errors.append(np.max(np.abs(spikes - exact.spike_times)))
    assert errors[1] < 0.3 * errors[0]


def test_a_charge_that_leaks_away_below_the_threshold_is_no_spike():
    sensor = Circuit()
    fire, tau = sensor.fire_voltage, sensor.tau_L
    rise = np.linspace(0.0, 0.1, 201)
    fall = np.linspace(0.1, 0.4, 61)[1:]
    t = np.concatenate([rise, fall, rise + 0.4, [0.5 + 1e-9, 0.6]])
    leaking = (fire - 2.4e-3) * np.exp(-(fall - 0.1) / tau)
    fired = 10.001 * fire * rise
    V = np.concatenate([(fire - 2.4e-3) * rise / 0.1, leaking, fired, [1e-4, 0.0]])
    found = spice.resets(t, V, fire, sensor.reset_voltage, tau)
    assert found == pytest.approx([0.5 - 0.1 * 1e-4], abs=1e-6)


def test_verdicts(exact, tmp_path):
    def late(problem, cap):
        raise OutOfTimeError("stopped")

    def broken(problem, cap):
        raise SolverError("the solution is NaN")

    def wrong(problem, cap):
        return np.array([0.1]), 1.0

    rows = [
        judge(PROBLEM, Method("m", "s", solve), exact, 5.0)
        for solve in (late, broken, wrong, ours)
    ]
    assert [r.verdict for r in rows] == ["timed out", "NaN", "wrong count", "right"]
    assert rows[3].spike_error < 1e-12
    assert "**wrong: 1 spikes**" in table(rows)
    assert fastest(rows, ours=False) == rows[3]
    assert fastest(rows, ours=True) is None
    write_csv(rows, tmp_path / "rows.csv")
    assert (tmp_path / "rows.csv").read_text().count("\n") == 5
