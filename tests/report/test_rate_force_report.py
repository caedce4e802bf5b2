"""What a report concludes from rates at several forces."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from modelled_runs import modelled, pulse, recovery

from tactile_lab.analysis.rate_force import eq15_rate
from tactile_lab.magnetics import ForceUncertainty
from tactile_lab.model.circuit import Circuit
from tactile_lab.report.canvas import draw
from tactile_lab.report.findings import find
from tactile_lab.report.write import write


def test_rate_force_brackets_the_critical_force_and_compares_with_eq_15(rate_force):
    values = find(rate_force).conclusion.values
    assert values["critical_force_N"] == pytest.approx(0.0975)
    assert values["critical_force_half_width_N"] == pytest.approx(0.0125)
    assert all(0.7 < ratio < 1.02 for ratio in values["peak_rate_over_eq15"])


@pytest.mark.parametrize("saturates", [False, True])
def test_eq_15_beside_a_t1_that_saturates_is_said_not_to_know_it(rate_force, saturates):
    run = replace(rate_force, circuit=Circuit(saturation=saturates), belief=None)
    found = find(run)
    (plot,) = found.answers
    for said in (plot.caption, " ".join(found.conclusion.sentences)):
        assert ("knows neither adaptation nor that T1 saturates" in said) is saturates


def test_rate_force_gets_a_second_figure_and_the_demo_does_not(
    rate_force, demo, tmp_path
):
    assert find(demo).answers == ()
    report = write(tmp_path, rate_force)
    assert (tmp_path / "summary.png").exists()
    assert (tmp_path / "twin.png").exists()
    assert report.html.read_text(encoding="utf-8").count("<figure>") == 3


def test_a_trial_with_one_spike_is_drawn_with_no_rate(rate_force):
    one = replace(rate_force.trials[2], spike_times=np.array([0.9]))
    trials = (*rate_force.trials[:2], one, *rate_force.trials[3:])
    (plot,) = find(replace(rate_force, trials=trials)).answers
    rates, counts = plot.panels
    drawn = next(s for s in rates.series if s.mark == "points")
    assert list(drawn.x) == [0.15, 0.2]
    assert all(value > 0 for value in drawn.y)
    fired = next(s for s in counts.series if s.mark == "points")
    assert (fired.x[0], fired.y[0]) == (0.11, 1)
    silent = next(s for s in counts.series if s.mark == "open")
    none = next(s for s in rates.series if s.mark == "open")
    assert (list(none.x), list(none.y)) == ([0.085, 0.11], [0, 0])
    assert (list(silent.x), list(silent.y)) == ([0.085], [0])


def test_the_force_s_uncertainty_reaches_the_critical_force(rate_force):
    sure = find(rate_force).conclusion
    known = find(
        replace(rate_force, force_uncertainty=ForceUncertainty(5e-3, 0.04))
    ).conclusion
    film = abs(known.values["critical_force_left_in_film_N"])
    assert 0 < film < 1e-4
    expected = np.sqrt((0.0125 + film) ** 2 + 5e-3**2 + (0.04 * 0.0975) ** 2)
    assert known.values["critical_force_uncertainty_N_95"] == pytest.approx(expected)
    assert "states no uncertainty" in " ".join(sure.sentences)
    # with a geometry alone there is no calibration
    assert "bench states of forces, ±5 mN and ±4 %" in " ".join(known.sentences)
    for wide, narrow in zip(known.values["slopes"], sure.values["slopes"], strict=True):
        assert wide["slope_Hz_per_N"].value == narrow["slope_Hz_per_N"].value
        assert wide["slope_Hz_per_N"].half > 1.2 * narrow["slope_Hz_per_N"].half


def test_slopes_are_local_and_hold_eq_15_s(rate_force):
    """A straight line through a curve has an interval of nothing but its bend."""
    circuit = Circuit()
    steep = []
    for one in find(rate_force).conclusion.values["slopes"]:
        force, slope = one["force_N"], one["slope_Hz_per_N"]
        ends = [eq15_rate(circuit, force + step, 0.25) for step in (-1e-4, 1e-4)]
        steep.append((ends[1] - ends[0]) / 2e-4)
        assert slope.value == pytest.approx(steep[-1], rel=0.01)
        assert slope.half < 0.02 * slope.value
    assert abs(steep[1] / steep[0] - 1) > 0.2, "one number could not be both"


def test_a_coil_that_comes_late_makes_no_longer_ramp(rate_force):
    """A slope is of a ramp's end: of its own length, without the delay."""
    late = tuple(
        replace(t, hold=t.hold and (t.hold[0] + 0.05, t.hold[1] + 0.05))
        for t in rate_force.trials
    )
    (found, as_asked) = (
        find(replace(rate_force, trials=trials)).conclusion.values
        for trials in (late, rate_force.trials)
    )
    assert len(found["slopes"]) == 2
    for one, other in zip(found["slopes"], as_asked["slopes"], strict=True):
        value = other["slope_Hz_per_N"].value
        assert one["slope_Hz_per_N"].value == pytest.approx(value, rel=1e-3)


def test_levels_and_latencies_carry_their_uncertainty(rate_force, tmp_path):
    trials = tuple(replace(t, clock_uncertainty=2e-3) for t in rate_force.trials)
    known = ForceUncertainty(3e-3, 0.04)
    report = write(
        tmp_path, replace(rate_force, trials=trials, force_uncertainty=known)
    )
    first, *_, last = json.loads(report.results.read_text())["trials"]
    assert last["level_uncertainty_N_95"] == pytest.approx(np.hypot(3e-3, 8e-3))
    assert last["latency_uncertainty_s"] == 2e-3
    assert first["latency_uncertainty_s"] is None, "it was silent"
    page = report.html.read_text(encoding="utf-8").replace("\u00a0", " ")
    assert "200.0 ± 8.5 mN" in page
    assert "± 2.0 ms" in page
    (answer,) = report.findings.answers
    assert draw(answer, "a run").axes[0].collections, "error bars"


def test_forces_that_all_fire_give_no_critical_force_but_their_rates(rate_force):
    fired = replace(rate_force, trials=rate_force.trials[2:])
    found = find(fired)
    assert "every force made the sensor fire" in found.missing[0]
    assert found.conclusion.values["critical_force_N"] is None
    assert found.conclusion.values["peak_rate_over_eq15"]


def test_equal_forces_have_one_slope():
    """It was told twice, at 150 mN and at 150 mN."""
    run = modelled("rate_force", [pulse(0.15), recovery(), pulse(0.15)])
    found = find(run).conclusion
    assert [one["force_N"] for one in found.values["slopes"]] == [0.15]
    assert found.text.count("at 150 mN") == 1


def test_too_few_intervals_for_a_slope_are_those_that_count():
    """Beside a table's 4 intervals in the hold stood "3 intervals in 1 holds"."""
    (why,) = (
        text
        for text in find(modelled("rate_force", [pulse(0.12)])).missing
        if text.startswith("No slope")
    )
    assert re.search(r"\d+ intervals? in 1 held force once node A had followed", why)
