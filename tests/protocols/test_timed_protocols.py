"""Protocols that only a source with a clock of its own can play."""

from dataclasses import replace

import numpy as np
import pytest

from protocols.texture import Texture
from protocols.touch import Touch
from protocols.vibration import Vibration
from tactile_lab.errors import SceneError
from tactile_lab.lag import Lag
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.planning.way import drive_for
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform


def answered(protocol, *, searched=True, late=0.0) -> Measurement:
    """What the model makes of a protocol; spikes dated `late` s too late."""
    force, placed = Waveform.constant(0.0), []
    for trial in protocol.presentations():
        placed.append((force.end, trial))
        force = force.then(trial.force)
    spikes = simulate(Circuit(), force, keep=("spikes",)).spike_times
    trials = tuple(
        MeasuredTrial(
            label=trial.label,
            level=trial.level,
            start=start,
            duration=trial.length,
            spike_times=spikes[(spikes >= start) & (spikes < start + trial.length)]
            - start
            + late,
            hold=trial.hold,
            clock_uncertainty=1e-3,
        )
        for start, trial in placed
    )
    return Measurement(
        simulated=True,
        bench="model",
        duration=force.end,
        trials=trials,
        force=force,
        searched=searched,
    )


def smooth(wave: Waveform) -> bool:
    """No slope changes by more than a sixth of the steepest from piece to piece."""
    slopes = np.diff(wave.value) / np.diff(wave.time)
    return np.abs(np.diff(slopes)).max() < 0.17 * np.abs(slopes).max()


@pytest.mark.parametrize("kind", [Vibration, Texture, Touch])
def test_each_trial_begins_and_ends_at_no_force_and_has_no_kink(kind):
    for trial in kind().presentations():
        assert trial.force.value[0] == 0.0 and trial.force.value[-1] == 0.0
        start, end = trial.hold
        assert 0 < start < end <= trial.length
        assert smooth(trial.force)


def test_a_vibration_is_the_sine_asked_for_while_it_lasts():
    found = Vibration(base=0.15, amplitude=0.05, lowest=50.0, highest=50.0, count=1)
    trial = next(iter(found.presentations()))
    start, end = trial.hold
    time = np.linspace(start, end, 5000)
    sine = 0.15 + 0.05 * np.sin(2 * np.pi * 50 * (time - found.down))
    assert trial.force.at(time) == pytest.approx(sine, abs=0.05 * 1e-3)


def test_spikes_of_the_model_lock_to_a_strong_vibration():
    protocol = Vibration(count=2, highest=40.0, presentations_each=10)
    run = answered(protocol)
    found = protocol.conclude(run)
    slow, fast = found.plain["phase_locking"]
    assert slow["frequency_Hz"] == pytest.approx(10.0)
    assert slow["vector_strength"]["value"] > 0.5 and slow["chance"] < 0.01
    assert fast["vector_strength"]["low_95"] > 0.2
    assert "locked to the vibration at 10 Hz" in found.text
    note = found.tables[0].note
    assert "clock and coil aligned to 1 ms; not known, and not in it: how well" in note
    # a millisecond is 14 degrees at 40 Hz: phases stood there bare
    lagged = protocol.conclude(replace(run, lag=Lag(eddy=3e-3), lag_uncertainty=3e-3))
    turn = 2 * np.pi * 40
    turned = np.hypot(turn * 1e-3, np.arctan(turn * 6e-3) - np.arctan(turn * 3e-3))
    _, fast = lagged.plain["phase_locking"]
    assert turned < fast["phase_uncertainty_rad_95"] < turned + 0.1
    assert "° ± " in lagged.tables[0].rows[0][3]


@pytest.mark.parametrize("base", [0.14, 0.15, 0.18])
def test_the_sensor_s_own_rhythm_is_not_taken_for_a_vibration_s(base):
    """One of 1 µN moves no spike: the sensor fires as under the constant force."""
    protocol = Vibration(base=base, amplitude=1e-6, count=6, highest=60.0)
    found = protocol.conclude(answered(protocol))
    assert "not locked to the vibration at any frequency" in found.text
    for one in found.plain["phase_locking"]:
        assert one["vector_strength"]["low_95"] == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize("presentations", [3, 5])
def test_an_odd_number_of_presentations_leaves_no_rhythm_of_the_sensor_s_own(
    presentations,
):
    """One of 1 µN was told as locked to at 11 Hz, p = 0.006 and 0.001."""
    odd = Vibration(
        base=0.18,
        amplitude=1e-6,
        lasts=0.8,
        count=24,
        highest=60.0,
        presentations_each=presentations,
    )
    run = answered(odd)
    assert "not locked to the vibration at any frequency" in odd.conclude(run).text
    # a run cut short after the first of each pair has nothing to tell
    alone = replace(run, trials=run.trials[:1])
    assert "both halves of the sine alone" in odd.conclude(alone).missing[0]


def test_a_vibration_that_the_coil_did_not_give_is_told_as_that():
    """All were completed, and it was said that none was."""
    protocol = Vibration(count=1, lowest=20.0, highest=20.0)
    run = answered(protocol)
    still = replace(run, force=Waveform.constant(0.15))
    (missing,) = protocol.conclude(still).missing
    assert "the force has nothing of 20 Hz" in missing


@pytest.mark.parametrize("period", [0.9e-3, 1e-3])
def test_the_sensor_s_own_rhythm_is_not_taken_for_a_texture_s(period):
    protocol = Texture(depth=1e-6, period=period, speeds=(0.01, 0.012))
    assert "tell the profile" not in protocol.conclude(answered(protocol)).text


def test_a_delay_turns_the_phase_and_leaves_the_strength():
    protocol = Vibration(count=1, lowest=20.0, highest=20.0, presentations_each=10)
    (at_once,) = protocol.conclude(answered(protocol)).plain["phase_locking"]
    late = answered(protocol, late=5e-3)
    (later,) = protocol.conclude(late).plain["phase_locking"]
    turned = later["phase_rad"] - at_once["phase_rad"]
    # 5 ms are a tenth of a cycle; a spike or two leave the window
    assert turned == pytest.approx(2 * np.pi / 10, abs=0.15)
    assert later["vector_strength"]["value"] == pytest.approx(
        at_once["vector_strength"]["value"], abs=0.1
    )


def test_a_texture_s_period_is_told_at_every_speed():
    protocol = Texture()
    conclusion = protocol.conclude(answered(protocol))
    found = conclusion.plain["texture"]
    assert len(found) == 3
    assert "period of 2 mm at 10 mm/s, 20 mm/s, 40 mm/s" in conclusion.text
    for one in found:
        near = abs(one["frequency_Hz"] - one["expected_Hz"])
        assert near < 1.5 * one["frequency_half_width_Hz"]


def test_a_profile_of_one_s_own(tmp_path):
    file = tmp_path / "ridges.csv"
    file.write_text("position_m,force_N\n0,0\n0.001,0.05\n0.002,0\n0.004,0\n")
    protocol = Texture(file="ridges.csv", speeds=(0.04,)).located(tmp_path)
    assert protocol.profile(np.array([0.0, 0.001, 0.005, 0.0055])) == pytest.approx(
        [0, 0.05, 0.05, 0.025]
    )
    trial = next(iter(protocol.presentations()))
    start, end = trial.hold
    time = np.linspace(start, end, 400)
    asked = 0.2 + protocol.profile(0.04 * (time - protocol.down))
    assert trial.force.at(time) == pytest.approx(asked, abs=2e-3)
    file.write_text("position_m,force_N\n0,0\n0,0.05\n")
    with pytest.raises(SceneError, match=r"line 3: .* must rise"):
        Texture(file="ridges.csv").located(tmp_path)


def test_faster_touches_are_answered_sooner():
    protocol = Touch(repeats=1)
    run = answered(protocol)
    found = protocol.conclude(run)
    touches = found.plain["touches"]
    took = [one["onset_10_90_s"] for one in touches]
    assert took == pytest.approx([0.59 * onset for onset in protocol.onsets], rel=0.06)
    latencies = [one["latency_s"] for one in touches]
    assert all(late is not None and late > 0 for late in latencies)
    assert "± 1.0 ms after half the force (95 %: clocks, lags of the" in found.text
    lagged = protocol.conclude(replace(run, lag=Lag(eddy=9e-3), lag_uncertainty=3e-3))
    assert "ms after half the force (95 %: clocks, lags)" in lagged.text


def test_a_latency_is_known_as_well_as_its_onset_makes_half_the_force_late():
    """After fast onsets half of it comes late by part of the lag, not by all of it."""
    protocol = Touch(repeats=1)
    run = answered(protocol)
    believed, true = (Lag(1e-3, eddy).follow(run.force)[0] for eddy in (3e-3, 4e-3))
    trials = tuple(replace(one, clock_uncertainty=1e-9) for one in run.trials)
    run = replace(
        run, trials=trials, force=believed, lag=Lag(1e-3, 3e-3), lag_uncertainty=1e-3
    )
    found = protocol.conclude(run).plain["touches"]
    truly = protocol.conclude(replace(run, force=true)).plain["touches"]
    for one, other in zip(found, truly, strict=True):
        late = one["latency_s"] - other["latency_s"]
        assert one["latency_uncertainty_s_95"] == pytest.approx(late, rel=0.02)
    assert found[0]["latency_uncertainty_s_95"] < 0.8e-3


@pytest.mark.parametrize("kind", [Vibration, Texture, Touch])
def test_nothing_is_claimed_without_spikes_or_of_trials_cut_short(kind):
    protocol = kind()
    blind = protocol.conclude(answered(protocol, searched=False))
    assert not blind.sentences and "spikes were not looked for" in blind.missing[0]
    whole = answered(protocol)
    nothing = Measurement(**{**vars(whole), "trials": ()})
    assert protocol.conclude(nothing).missing
    assert not list(protocol.plots(nothing))


@pytest.mark.parametrize("kind", [Vibration, Texture, Touch])
def test_each_is_drawn(kind):
    protocol = kind()
    (plot,) = protocol.plots(answered(protocol))
    assert plot.panels and plot.caption


@pytest.mark.parametrize("name", ["vibration", "texture", "touch"])
def test_the_built_in_bench_follows_the_fastest_within_half_a_percent(name):
    scene = load(name)
    trials = list(scene.protocol.presentations())
    fastest = max(trials, key=lambda trial: trial.force.steepest)
    drive = drive_for(fastest, scene, 0.0)
    assert drive.way == "list" and drive.warning is None
    assert drive.error < 0.005 * fastest.force.peak


def test_a_vibration_with_too_few_cycles_is_refused():
    with pytest.raises(ValueError, match=r"fewer than 2.5 cycles"):
        Vibration(lowest=2.0)
