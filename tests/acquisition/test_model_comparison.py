import re
from dataclasses import replace

import numpy as np
import pytest

from tactile_lab.acquisition.events import CoilCurrent
from tactile_lab.acquisition.live_model import LiveModel
from tactile_lab.acquisition.model_comparison import ModelComparison
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.quantity import parse
from tactile_lab.scene.load import load
from tactile_lab.trial import Outcome, Trial
from tactile_lab.waveform import Waveform

SCENE = load(
    "demo",
    {
        "bench.followers.input_bias": 0.0,
        "bench.magnet.coil_lag": 0.0,
        "bench.magnet.eddy_lag": 0.0,
    },
)
LAGGED = load("demo")
MAGNET = SCENE.bench.magnet
PUSH = Trial(
    force=Waveform.through([(0, 0), (0, 0.15), (2, 0.15), (2, 0), (3, 0)]),
    label="150 mN",
    level=0.15,
)


def outcome(circuit, start=1.0):
    found = simulate(circuit, PUSH.force, keep=("V_C1", "spikes"), until=3.0)
    time = np.arange(0.0005, 3, 1e-3)
    return Outcome(
        trial=PUSH,
        index=0,
        start=start,
        spike_times=found.spike_times,
        current=np.empty((0, 2)),
        traces={"V_C1": np.column_stack([time, found.sample("V_C1", time)])},
    )


def follow(beside, start=1.0):
    amperes = 0.15 / MAGNET.newtons_per_ampere
    for at, value in ((0.0, 0.0), (start, amperes), (start + 2, 0.0)):
        beside.add(CoilCurrent(at, value, value, at))


def test_a_trial_like_the_model_s_has_nothing_to_tell_but_that():
    beside = ModelComparison(SCENE, searched=True)
    follow(beside)
    told = beside.ended(outcome(Circuit()))
    assert re.match(r"150 mN: measured less model: (\d+) spikes \(model \1\)", told)
    assert parse(re.search(r"\(([^()]+ [fpnµm]V) rms\)", told)[1], "V") < 1e-5
    assert "e−" not in told, "V_C1 −9.3e−05 mV is nothing to read"


def test_a_sensor_that_differs_shows_at_once():
    beside = ModelComparison(SCENE, searched=True)
    follow(beside)
    told = beside.ended(outcome(Circuit(V_GS=1.42)))
    spikes, model = map(int, re.search(r"(\d+) spikes \(model (\d+)\)", told).groups())
    assert spikes > model
    assert "V_C1 −" in told


def test_a_voltage_that_was_cut_off_is_compared_with_nothing():
    """V_C1 −850 mV was told of a channel at the end of its range."""
    beside = ModelComparison(SCENE, searched=True)
    follow(beside)
    told = beside.ended(replace(outcome(Circuit()), cut_off=frozenset({"V_C1"})))
    assert "spikes (model" in told and told.endswith(", V_C1 left its range")


def test_pauses_are_followed_in_silence():
    beside = ModelComparison(SCENE, searched=True)
    follow(beside)
    pause = Trial(force=PUSH.force, label="recovery", pause=True)
    quiet = Outcome(
        trial=pause, index=0, start=1.0, spike_times=np.empty(0),
        current=np.empty((0, 2)),
    )  # fmt: skip
    assert beside.ended(quiet) == ""
    assert beside.ended(outcome(Circuit(), start=4.0)).startswith("150 mN")


@pytest.mark.parametrize("ahead", [0.0, 0.5, 9.0])
def test_slices_of_any_size_give_the_same_model(ahead):
    points = [(0.0, 0.0), (0.3, 0.6), (0.9, 0.9), (2.0, 0.0)]
    whole, parts = LiveModel.of(LAGGED), LiveModel.of(LAGGED)
    for point in points:
        whole.add(*point)
    expected = whole.until(3.0).spike_times
    seen, rest = [], list(points)
    for end in (0.3, 0.31, 1.7, 3.0):
        while rest and rest[0][0] <= end + ahead:  # told before its turn, or not
            parts.add(*rest.pop(0))
        seen.append(parts.until(end).spike_times)
    assert np.concatenate(seen) == pytest.approx(expected, abs=3e-5)
    assert parts.reached == 3.0


def test_spikes_that_fall_between_two_samples_are_no_count():
    """At 1 kS/s "0 spikes (model 15)" read as a sensor that does not fire."""
    beside = ModelComparison(SCENE, searched=True, counted=False)
    follow(beside)
    told = beside.ended(outcome(Circuit()))
    assert re.search(r"\d+ spikes seen, not all \(model \d+\)", told)
