"""V_GS is found where the sensor begins to fire under the force wanted."""

from dataclasses import replace

import numpy as np
import pytest

from protocols.threshold_trim import ThresholdTrim
from tactile_lab.acquisition.events import RunState
from tactile_lab.analysis.operating_point import V_GS_of_onset
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.quantity import plus_minus, show
from tactile_lab.report.from_run import read
from tactile_lab.scene.load import load
from tactile_lab.trial import Outcome
from tactile_lab.waveform import Waveform

PER_FORCE = 1.53
"""V/N."""


def played(protocol, edge):
    """(V_GS, force, fired) of each press on a sensor that fires above `edge` V."""
    trials, told = protocol.presentations(), []
    trial = next(trials)
    while True:
        fires = False
        if not trial.pause:
            (volts,) = trial.voltages.values()
            more = abs(trial.level) - abs(protocol.wanted)
            fires = volts + PER_FORCE * more > edge
            told.append((volts, trial.level, fires))
        spikes = np.array([0.5]) if fires else np.empty(0)
        outcome = Outcome(
            trial=trial,
            index=0,
            start=0.0,
            spike_times=spikes,
            current=np.empty((0, 2)),
        )
        try:
            trial = trials.send(outcome)
        except StopIteration:
            return told


@pytest.mark.parametrize("wanted", [0.09, -0.09])
@pytest.mark.parametrize("edge", [1.3803, 1.4, 1.41234, 1.4497])
def test_the_bracket_closes_on_the_edge_and_stays_within_its_ends(edge, wanted):
    protocol = ThresholdTrim(wanted=wanted)
    *pressed, less, more = played(protocol, edge)
    volts = [at for at, _, _ in pressed]
    assert min(volts) == protocol.low and max(volts) == protocol.high
    silent = max(at for at, _, fires in pressed if not fires)
    fires = min(at for at, _, fires in pressed if fires)
    assert silent <= edge <= fires
    assert fires - silent <= protocol.resolution * (1 + 1e-9)
    assert less[0] == more[0] == pytest.approx((silent + fires) / 2)
    assert (less[2], more[2]) == (False, True)


@pytest.mark.parametrize(
    ("edge", "said"), [(1.5, "stays silent under 90 mN"), (1.3, "fires under 90 mN")]
)
def test_what_cannot_be_had_is_refused(edge, said):
    with pytest.raises(LimitError, match=said):
        played(ThresholdTrim(), edge)


def test_parameters_that_contradict_each_other_are_refused():
    with pytest.raises(ValueError, match="must be below high"):
        ThresholdTrim(low=1.5, high=1.4)
    with pytest.raises(ValueError, match="margin must be smaller than wanted"):
        ThresholdTrim(wanted=-1e-3)


def measured(presses):
    """A run that pressed so: (V_GS, force, spikes) each."""
    trials = tuple(
        MeasuredTrial(
            label="",
            level=level,
            start=10.0 * i,
            duration=1.5,
            spike_times=np.linspace(0.5, 1.0, spikes),
            hold=(0.25, 1.25),
        )
        for i, (_, level, spikes) in enumerate(presses)
    )
    rows = [(10.0 * i + 0.5, volts) for i, (volts, _, _) in enumerate(presses)]
    return Measurement(
        simulated=True,
        bench="made up",
        duration=10.0 * len(presses),
        trials=trials,
        force=Waveform.constant(0.0),
        circuit=Circuit(),
        voltages={"V_GS": np.array(rows)},
        settings={"source of V_GS": {"error_V": "0.0003", "error_part": "0.00012"}},
    )


PRESSES = [
    (1.45, 0.09, 5), (1.38, 0.09, 0), (1.41, 0.09, 1), (1.40, 0.09, 0),
    (1.405, 0.088, 0), (1.405, 0.092, 2),
]  # fmt: skip


def test_what_the_film_held_of_the_press_before_is_in_how_well_V_GS_is_known():
    """As shipped the true critical force lay within half a bracket in 9 of 12."""
    push = Waveform.pulse(0.09, ramp=0.25, hold=1.0, rest=8.5)
    twice = push.then(push)
    run = replace(measured([(1.41, 0.09, 1), (1.4, 0.09, 0)]), force=twice)
    found = ThresholdTrim(margin=0.0).conclude(run)
    circuit = run.circuit
    (V_P,) = simulate(circuit, twice, keep=("V_P",), until=10.0).sample("V_P", [10.0])
    left = found.values["critical_force_left_in_film_N"]
    assert left == pytest.approx(V_P / circuit.k_F, rel=0.01)
    known = 0.005 / circuit.k_F + abs(left)
    assert f"within ±{show(known, 'N', 2)} of that" in found.text
    assert f"as up to {show(abs(left), 'N', 2)} less" in found.text
    assert f"V_GS = {plus_minus(1.405, circuit.k_F * known, 'V')}, as" in found.text
    error = 0.0003 + 0.00012 * 1.405
    whole = np.hypot(circuit.k_F * known, error)
    assert found.values["V_GS_uncertainty_V"] == pytest.approx(whole)


def test_the_conclusion_tells_V_GS_its_errors_and_the_check():
    found = ThresholdTrim().conclude(measured(PRESSES))
    assert found.values["V_GS_V"] == pytest.approx(1.405)
    assert found.values["V_GS_half_width_V"] == pytest.approx(0.005)
    error = 0.0003 + 0.00012 * 1.405
    assert found.values["V_GS_uncertainty_V"] == pytest.approx(np.hypot(0.005, error))
    assert found.values["critical_force_half_width_N"] == pytest.approx(
        0.005 / Circuit().k_F
    )
    assert found.values["checked"] is True and not found.missing
    whole = found.values["V_GS_uncertainty_V"]
    assert found.budgets["V_GS"].plain == {
        "unit": "V", "whole": whole, "resolution": found.values["V_GS_half_width_V"],
        "source": pytest.approx(error),
    }  # fmt: skip
    assert found.budget_line.endswith("; force not stated.")
    assert 'V_GS = "1.40500 V"' in found.text


def test_a_pull_is_checked_by_a_weaker_and_a_stronger_one():
    pulls = [(volts, -force, spikes) for volts, force, spikes in PRESSES]
    found = ThresholdTrim(wanted=-0.09).conclude(measured(pulls))
    assert found.values["checked"] is True and not found.missing
    assert found.values["critical_force_N"] == -0.09
    assert "−88 mN gives no spikes, −92 mN 2." in found.text


def test_a_check_that_fails_is_no_result():
    presses = [*PRESSES[:4], (1.405, 0.088, 1), (1.405, 0.092, 2)]
    found = ThresholdTrim().conclude(measured(presses))
    assert found.values["checked"] is False
    assert "is not within 2 mN" in found.missing[0]


def test_a_threshold_that_drifted_gives_no_V_GS():
    presses = [*PRESSES[:2], (1.40, 0.09, 1), (1.41, 0.09, 0)]
    found = ThresholdTrim().conclude(measured(presses))
    assert found.values["V_GS_V"] is None
    assert "fired at 1.4 V and was silent at 1.41 V" in found.missing[0]


def test_only_what_fires_or_only_what_is_silent_gives_no_V_GS():
    for presses in (PRESSES[:1], PRESSES[1:2]):
        found = ThresholdTrim().conclude(measured(presses))
        assert found.values["V_GS_V"] is None and found.missing


COARSE = (
    "protocol.resolution=10 mV",
    "protocol.low=1.38 V",
    "protocol.high=1.42 V",
    "protocol.hold=0.7 s",
    'record.signals=["force", "V_K", "spikes"]',
)


def test_a_run_finds_the_V_GS_that_the_simulated_sensor_needs(tmp_path):
    """What the gate has beyond what the source gives is found as well."""
    surprise = 9e-3
    scene = load("threshold_trim", (*COARSE, f"simulated.deviation.V_GS={surprise} V"))
    done = Execution(scene, tmp_path).run()
    assert done.state is RunState.COMPLETE, done.reason
    run = read(done.folder)
    found = scene.protocol.conclude(run)
    assert found.values["checked"] in (True, False)
    bottom, top = (
        found.values["V_GS_V"] + sign * found.values["V_GS_half_width_V"]
        for sign in (-1, 1)
    )
    trial = next(t for t in run.trials if t.level == scene.protocol.wanted)
    inside = (run.force.time > trial.start) & (
        run.force.time < trial.start + trial.duration
    )
    applied = Waveform(
        np.append(0.0, run.force.time[inside] - trial.start),
        np.append(0.0, run.force.value[inside]),
    )
    true, _ = V_GS_of_onset(scene.circuit, applied, applied)
    assert bottom - 2e-4 <= true - surprise <= top + 2e-4
    (plot,) = scene.protocol.plots(run)
    assert plot.panels[0].series


def test_the_plan_refuses_what_the_source_may_not_give():
    scene = load("threshold_trim", ("bench.voltage_source.V_GS.limits.highest=1.4 V",))
    with pytest.raises(LimitError, match=r"V_GS = 1.45 V lies beyond the 0 V to 1.4 V"):
        needs(scene)


def test_the_plan_refuses_a_critical_force_that_no_V_GS_gives():
    with pytest.raises(LimitError, match=r"Raise protocol\.high"):
        plan(load("threshold_trim", ("protocol.wanted=20 mN",)))


def test_the_plan_tells_the_source_and_draws_no_model():
    made = plan(load("threshold_trim"))
    assert "sets it, 1.45 V to begin with" in dict(made.uses)["source of V_GS"]
    assert made.preview is None
    assert not made.scene.compared


def test_the_model_alone_refuses_it(tmp_path):
    from tactile_lab import simulate

    with pytest.raises(SceneError, match="sets V_GS from trial to trial"):
        simulate("threshold_trim")


def test_a_bench_without_a_source_is_told_so(tmp_path):
    scene = load("threshold_trim")
    bare = replace(scene, bench=replace(scene.bench, voltage_source={}))
    with pytest.raises(SceneError, match=r"has no \[voltage_source.V_GS\]"):
        needs(bare)
