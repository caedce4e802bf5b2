"""The model beside a run of plain values, and what is identified with it."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from modelled_runs import MAGNET, modelled, pulse

from tactile_lab.model.circuit import Circuit
from tactile_lab.report.findings import find
from tactile_lab.report.identified import identify_run, identify_runs, settled
from tactile_lab.report.twin import sentences
from tactile_lab.report.write import write
from tactile_lab.waveform import Waveform


def test_a_model_that_stays_cool_beside_a_sensor_that_warms_says_so(rate_force):
    time = np.linspace(0, rate_force.duration, 20)
    warming = np.column_stack([time, 291.65 + 15 * time / time[-1]])
    beside = find(rate_force).beside
    said = sentences(beside, replace(rate_force, temperature=warming))
    assert any(
        "read from 291.65 K to 306.65 K; the model stays at 290.11 K" in t for t in said
    )
    assert not any("read from" in text for text in sentences(beside, rate_force))


def test_the_twin_is_reported(rate_force, tmp_path):
    report = write(tmp_path, rate_force)
    values = json.loads(report.results.read_text())["twin"]
    assert values["voltages"]["V_C1"]["rms_V"] < 2e-3
    assert values["spikes"]["missed"] == values["spikes"]["extra"] == 0
    page = report.html.read_text(encoding="utf-8")
    assert re.search(r"V_C1: measured less model is .{1,8} mV on average", page)


def test_runs_that_do_not_share_a_value_are_named():
    runs = [
        replace(modelled("pulses", [pulse(0.15)], circuit=Circuit(V_GS=V_GS)), run=name)
        for name, V_GS in (("S1", 1.40), ("S2", 1.38))
    ]
    found = identify_runs(runs, ("V_GS",))
    assert any("S2 alone gives V_GS" in text for text in found.warnings)


def test_tau_is_known_no_better_than_the_clock_it_is_measured_by(rate_force):
    for part in (-8e-5, 8e-5):
        slow = {n: getattr(Circuit(), n) * (1 + part) for n in ("tau", "C1", "C2")}
        run = modelled("pulses", [pulse(0.15), pulse(0.18)], circuit=Circuit(**slow))
        tau = identify_run(run, ("tau",)).estimates["tau"]
        assert tau.low < 8.69 < tau.high
        assert tau.half < 1.1e-4 * 8.69


def test_steps_that_came_by_themselves_earlier_or_later_are_in_the_interval():
    """Ramps in steps of 45 ms, each answered up to 8 ms later than it might be."""
    rng, scale = np.random.default_rng(0), MAGNET.newtons_per_ampere
    up = np.linspace(0.0, 0.15, 7)[1:]
    level = np.tile(np.concatenate([up, up[-2::-1], [0.0]]), 3) / scale
    told = np.concatenate([0.2 + 0.045 * np.arange(6) + k for k in range(6)])
    doubt = rng.uniform(0, 4e-3, told.size)
    came, heard = (np.column_stack([at, level]) for at in (told - doubt, told))
    force = Waveform.stairs(came, 6.5).scaled(scale)
    run = modelled("pulses", [("", 0.15, force, False)], bins=600)
    V_C1, (trial,) = run.traces[0], run.trials
    mean = V_C1.mean + rng.normal(0, 5e-4, 600)
    spikes = trial.spike_times + rng.normal(0, 1e-6, trial.spike_times.size)
    believed = replace(
        run.belief, setpoint=Waveform.stairs(heard, 6.5), clock=0.02, dated=False,
        steps=heard, doubt=doubt,
    )  # fmt: skip
    seen = replace(trial, spike_times=spikes)
    trace = replace(V_C1, mean=mean)
    run = replace(run, traces=(trace,), trials=(seen,), belief=believed)
    found = identify_run(run, ("V_GS", "tau")).estimates
    for name, truth in (("V_GS", 1.4), ("tau", 8.69)):
        assert found[name].low < truth < found[name].high
    assert found["V_GS"].half < 5e-5
    assert found["tau"].half < 5e-3


def test_a_factor_of_the_force_is_not_held_by_what_was_believed_of_it():
    def known(run):
        magnet = replace(run.belief.magnet, geometry_uncertainty=0.04)
        return replace(run, belief=replace(run.belief, magnet=magnet))

    runs = [
        known(replace(modelled("pulses", [pulse(0.15), pulse(level)]), run=name))
        for name, level in (("S1", 0.18), ("S2", 0.13))
    ]
    found = identify_runs(runs, ("V_GS",), force_scales=True).together
    assert found.estimates["force_1"].value == pytest.approx(1.0, abs=1e-4)
    assert found.estimates["force_1"].half < 1e-3


def test_runs_whose_forces_err_differently_share_a_value_with_factors():
    """Alone too the factor is fitted, by the name that it has among all."""

    def pressed(name, factor):
        sensor = Circuit(g31=factor * Circuit().g31, V_GS=1.402)
        run = modelled("pulses", [pulse(0.15), pulse(0.18)], circuit=sensor)
        return replace(run, run=name, belief=replace(run.belief, circuit=Circuit()))

    found = identify_runs(
        [pressed("S1", 1.02), pressed("S2", 0.97)], ("V_GS",), force_scales=True
    )
    assert found.warnings == ()
    for run, name, factor in (("S1", "force_1", 1.02), ("S2", "force_2", 0.97)):
        alone = found.alone[run].estimates
        assert list(alone) == ["V_GS", name]
        assert alone["V_GS"].value == pytest.approx(1.402, abs=2e-4)
        assert alone[name].value == pytest.approx(factor, abs=2e-3)


def test_identification_leaves_out_the_field_s_lag(rate_force):
    steps = np.array([1.0, 1.0, 2.0, 2.0])
    force = Waveform(np.r_[0.0, steps, 3.0], np.array([0, 0, 0.1, 0.1, 0, 0]))
    time = np.arange(0.005, 3, 0.01)
    late = ~settled(force, time, 0.0, 0.03)
    assert late.sum() == 8
    assert np.all((time[late] - np.floor(time[late])) < 0.04)
    # clocks that err make it early as well
    blurred = ~settled(force, time, 0.02, 0.03)
    assert np.all(time[blurred] > np.floor(time[blurred] + 0.03) - 0.03)
    assert blurred.sum() > late.sum() + 2
    # V_C1 that comes some milliseconds late, as behind a real core
    trace = rate_force.trace("V_C1")
    lagging = replace(trace, mean=np.interp(trace.time - 4e-3, trace.time, trace.mean))
    run = replace(rate_force, traces=(lagging,), searched=False)
    found = identify_run(run, ("V_GS", "tau")).estimates
    assert found["tau"].value == pytest.approx(8.69, rel=0.05)
    assert found["V_GS"].value == pytest.approx(1.4, abs=2e-3)
