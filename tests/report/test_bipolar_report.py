"""What a report concludes from a push and a pull."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from modelled_runs import modelled

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.report.findings import find
from tactile_lab.report.results import as_json
from tactile_lab.waveform import Waveform

CODE = 4.0 / 254


def pushed_and_pulled(seed, *, late=0.06, code=CODE, noise=5e-3, levels=(0.08, -0.08)):
    """A `bipolar` run of +-80 mN by a scope of such codes, V; forces come `late` s."""
    steps = []
    for level in levels:
        pulse = Waveform.pulse(level, ramp=0.25, hold=5.0, rest=4.0)
        wave = Waveform(np.append(0.0, pulse.time + late), np.append(0.0, pulse.value))
        steps.append((f"{level * 1e3:g} mN", level, wave, False))
    quiet = ("rest", None, Waveform.through([(0.0, 0.0), (0.5, 0.0)]), False)
    run = modelled("bipolar", [quiet, *steps], searched=False, bins=2000)
    stood = 0.25 + late, 5.25 + late
    held = tuple(replace(t, hold=t.level and stood) for t in run.trials)
    V_C1, rng = run.traces[0], np.random.default_rng(seed)
    noisy = V_C1.mean[:, None] + rng.normal(0, noise, (2000, 100))
    shown = 2.5 + code * np.rint((noisy - 2.5) / code).mean(axis=1)
    seen = replace(V_C1, mean=shown, code=code, samples=100)
    return replace(run, trials=held[1:], traces=(seen,))


def test_bipolar_s_intervals_hold_though_the_converter_has_steps():
    truth = {}
    for seed in range(6):
        run = pushed_and_pulled(seed)
        values = find(run).conclusion.plain
        tau = values["tau_s"]
        assert tau["low_95"] < 8.69 < tau["high_95"]
        assert tau["high_95"] - tau["low_95"] < 0.5
        for change in values["I_DS_changes"]:
            level = change["level_N"]
            if level not in truth:
                truth[level] = _changed_by_eq_8(run, level)
            off = change["change_A"] - truth[level]
            assert abs(off) < change["change_uncertainty_A_95"]
            assert abs(off) < 0.03 * abs(truth[level])
            # R1 is known to 1 %, and it carries most of the current
            least = 0.009 * abs(change["change_A"])
            assert change["change_uncertainty_A_95"] > least


@pytest.mark.parametrize("resistor", ["R1", "R2"])
def test_tau_holds_though_a_resistor_is_other_than_believed_by_its_tolerance(resistor):
    run = pushed_and_pulled(0, code=1e-5)
    told = getattr(run.circuit, resistor)
    for part in (-0.01, 0.01):
        believed = replace(run.circuit, **{resistor: told * (1 + part)})
        tau = find(replace(run, circuit=believed)).conclusion.values["tau_s"]
        assert tau.low < 8.69 < tau.high
        assert tau.half < 0.05


def test_tau_s_interval_reaches_further_where_an_offset_moves_it_further():
    tau = find(pushed_and_pulled(0)).conclusion.values["tau_s"]
    assert np.log(tau.high / tau.value) > 1.05 * np.log(tau.value / tau.low)


def test_a_converter_s_steps_count_once_where_a_hold_passes_over_several():
    run = pushed_and_pulled(0, noise=2e-3)
    steps = run.step_bias("V_C1") * (1 / run.circuit.R1 + 1 / run.circuit.R2)
    for change in find(run).conclusion.values["I_DS_changes"]:
        resistors = 0.01 * change["change_A"]
        told = math.sqrt(change["change_uncertainty_A_95"] ** 2 - resistors**2)
        assert steps < told < 1.4 * steps


def _changed_by_eq_8(run, level):
    """From before the push to when the force is there, node A having followed."""
    trial = next(t for t in run.trials if t.level == level)
    made = simulate(Circuit(), run.force, keep=("V_P",))
    ends = np.array([trial.start, trial.held[0]])
    before, after = np.exp(made.sample("V_P", ends) / (5.646 * 0.025))
    return 24.69e-9 * (after - before)


def test_numbers_from_samples_beyond_the_range_are_refused():
    run = pushed_and_pulled(0)
    push, pull = run.trials
    late = np.array([[pull.start + 0.5, pull.start + 1.0]])
    cut = replace(run.traces[0], overrange=late)
    found = find(replace(run, traces=(cut,)))
    (change,) = found.conclusion.values["I_DS_changes"]
    assert change["level_N"] == 0.08
    assert "-80 mN: V_C1 left its channel's range" in found.conclusion.missing[0]
    assert found.conclusion.values["tau_s"].low < 8.69
    whole = np.array([[push.start, run.duration]])
    lost = find(replace(run, traces=(replace(cut, overrange=whole),)))
    assert not lost.conclusion.values
    assert len(lost.missing) == 2
    told = json.loads(as_json(lost))
    assert told["overrange_s"] == {"V_C1": whole.tolist()}


def test_bipolar_without_a_rest_before_it_says_so():
    run = pushed_and_pulled(0)
    late = tuple(replace(t, start=t.start - 0.5) for t in run.trials)
    kept = run.traces[0].time >= 0.8
    time, mean = (v[kept] for v in (run.traces[0].time - 0.5, run.traces[0].mean))
    cut = replace(run.traces[0], time=time, mean=mean)
    found = find(replace(run, trials=late, traces=(cut,))).conclusion
    assert "current at rest is not known" in found.missing[0]


def test_bipolar_tells_what_it_can_beside_a_pull_that_leaves_no_current():
    """By a coarse converter 5 nA may be none; the push before it was left out too."""
    found = find(pushed_and_pulled(0, code=0.04, levels=(0.08, -0.15))).conclusion
    (change,) = found.plain["I_DS_changes"]
    assert change["level_N"] == 0.08
    assert abs(change["change_A"] - 34.1e-9) < change["change_uncertainty_A_95"]
    (left_out,) = found.missing
    assert "at -150 mN" in left_out and "nA may be none" in left_out
