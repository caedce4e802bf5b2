"""The critical force is followed, and its slope against temperature told."""

import math
from dataclasses import replace

import numpy as np
import pytest

from protocols.threshold_drift import ThresholdDrift, brackets
from tactile_lab.magnetics import ForceUncertainty
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.trial import Outcome
from tactile_lab.waveform import Waveform


def followed(protocol, critical, kelvin=None):
    """A run on a sensor whose critical force is `critical(i)` N at press i."""
    trials, done, pressed = protocol.presentations(), [], 0
    trial, time = next(trials), 0.0
    while True:
        spikes = np.empty(0)
        if not trial.pause:
            fires_at = critical(pressed)
            if trial.level / fires_at > 1:
                spikes = np.array([0.5])
            done.append(
                MeasuredTrial(
                    label=trial.label,
                    level=trial.level,
                    start=time,
                    duration=trial.length,
                    spike_times=spikes,
                    hold=trial.hold,
                )
            )
            pressed += 1
        time += trial.length
        outcome = Outcome(
            trial=trial, index=0, start=0, spike_times=spikes, current=np.empty((0, 2))
        )
        try:
            trial = trials.send(outcome)
        except StopIteration:
            break
    warm = None
    if kelvin is not None:
        warm = np.array([(t.start + 0.1, kelvin(i)) for i, t in enumerate(done)])
    return Measurement(
        simulated=True,
        bench="made up",
        duration=time,
        trials=tuple(done),
        force=Waveform.constant(0.0),
        temperature=warm,
    )


def test_it_holds_a_steady_critical_force_between_two_presses():
    protocol = ThresholdDrift(begin=0.11, presses=30)
    run = followed(protocol, lambda i: 0.1004)
    for one in brackets(run):
        assert abs(one.middle - 0.1004) <= one.half
    found = protocol.conclude(run)
    slope = found.values["drift_N_per_h"]
    assert slope.low < 0 < slope.high
    assert found.values["drift_N_per_K"] is None
    assert "No temperature was read" in found.text


@pytest.mark.parametrize("slope", [-4e-4, 3e-4, 8e-4])
@pytest.mark.parametrize("begin", [0.1, 0.105])
def test_a_slope_against_temperature_lies_in_its_interval(slope, begin):
    protocol = ThresholdDrift(begin=begin, presses=80)
    run = followed(
        protocol, lambda i: 0.1 + slope * i / 4, kelvin=lambda i: 290 + i / 4
    )
    found = protocol.conclude(run).values["drift_N_per_K"]
    assert found.low <= slope <= found.high
    assert found.half < 3e-4
    (plot,) = protocol.plots(run)
    assert plot.x_label == "Temperature" and len(plot.panels[0].series) == 2


def test_a_sensor_that_fires_when_pulled_is_followed_below_zero():
    """All but the sign is as of one that fires when pushed."""
    push, pull = (ThresholdDrift(begin=way * 0.105, presses=30) for way in (1, -1))
    pushed, pulled = followed(push, lambda i: 0.1004), followed(pull, lambda i: -0.1004)
    assert [-t.level for t in pulled.trials] == [t.level for t in pushed.trials]
    assert len(brackets(pulled)) == len(brackets(pushed)) > 4
    for one in brackets(pulled):
        assert abs(one.middle + 0.1004) <= one.half
    with pytest.raises(ValueError, match="step must be smaller than begin, −1 mN"):
        ThresholdDrift(begin=-1e-3, step=1e-3)


def test_too_few_values_give_no_slope():
    protocol = ThresholdDrift(presses=8)
    found = protocol.conclude(followed(protocol, lambda i: 0.2))
    assert "are needed" in found.missing[0]
    assert "drift_N_per_K" not in found.values


def test_pairs_are_told_as_they_are_counted():
    """Of presses that fired and did not by turns, 5 times, "3 times" was told."""
    protocol = ThresholdDrift(begin=0.098, presses=6)
    run = followed(protocol, lambda i: 0.0975)
    fired = [bool(t.spike_times.size) for t in run.results]
    assert fired == [True, False] * 3
    (why,) = protocol.conclude(run).missing
    assert why.startswith("3 pairs of presses") and "no press counted twice" in why


def test_a_temperature_that_stands_still_is_said():
    protocol = ThresholdDrift(presses=20)
    run = followed(protocol, lambda i: 0.1004, kelvin=lambda i: 290.0)
    found = protocol.conclude(run)
    assert "The temperature did not change." in found.text
    assert not protocol.conclude(replace(run, searched=False)).sentences
    assert "states no uncertainty of force" in found.text
    known = replace(run, force_uncertainty=ForceUncertainty(0.0, 0.03))
    told = protocol.conclude(known).text
    assert "All of them together may be off by 3 mN (95 %)" in told
    assert "A1" not in told
    assert "each by itself, with half its bracket, by 3.1 mN" in told
    for one in protocol.conclude(known).values["critical_forces"]:
        stated = 0.03 * one["force_N"]
        assert one["uncertainty_N_95"] == pytest.approx(math.hypot(5e-4, stated))
    bare = replace(run, force_uncertainty=ForceUncertainty(1e-3, 0.0, unstated=True))
    assert (
        "no uncertainty of Eq. (2)'s r, A1, A2 and B1" in protocol.conclude(bare).text
    )


def test_it_asks_for_the_temperature_and_never_for_no_force():
    assert "temperature" in ThresholdDrift().wishes()
    run = followed(ThresholdDrift(begin=3e-3, presses=12), lambda i: 1e-6)
    assert min(t.level for t in run.trials) == 1e-3
    with pytest.raises(ValueError, match="step must be smaller than begin"):
        ThresholdDrift(begin=1e-3, step=1e-3)
