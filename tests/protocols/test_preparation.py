"""What all force protocols share: a clean magnet, F(0), the order, a steady rest."""

import json

import numpy as np
import pytest

from protocols.bipolar import Bipolar
from protocols.hold import Hold
from protocols.pulses import Pulses
from protocols.rate_force import RateForce
from protocols.repeat import Repeat
from protocols.sine_sweep import SineSweep
from protocols.staircase import Staircase
from protocols.threshold_search import ThresholdSearch
from protocols.waveform import ForceTable
from tactile_lab.acquisition.drift import Drift
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest_V_C1
from tactile_lab.model.simulate import simulate
from tactile_lab.planning.needs import needs
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load
from tactile_lab.stimulus.demagnetise import demagnetising_current
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import Outcome
from tactile_lab.waveform import Waveform

FORCE = (
    Pulses, Hold, RateForce, Staircase, Repeat, Bipolar, SineSweep, ThresholdSearch,
    ForceTable,
)  # fmt: skip


def drive(protocol):
    trials, generator = [], protocol.trials()
    trial = next(generator)
    while True:
        trials.append(trial)
        fires = trial.level is not None and trial.level > 0.1
        outcome = Outcome(
            trial=trial,
            index=0,
            start=0.0,
            spike_times=np.array([0.3] if fires else []),
            current=np.empty((0, 2)),
        )
        try:
            trial = generator.send(outcome)
        except StopIteration:
            return trials


@pytest.mark.parametrize("kind", FORCE)
def test_every_force_protocol_offers_the_same_preparation(kind, tmp_path):
    given = {}
    if kind is ForceTable:
        (tmp_path / "f.csv").write_text("time_s,force_N\n0,0\n1,0.1\n2,0\n")
        given["file"] = str(tmp_path / "f.csv")
    plain = [t.label for t in drive(kind(**given))]
    prepared = drive(
        kind(demagnetise=True, demagnetise_from=0.5, force_at_zero=True, **given)
    )
    labels = [t.label for t in prepared]
    assert labels == ["demagnetise", "recovery", "F(0) before", *plain, "F(0) after"]
    assert prepared[0].current.peak == pytest.approx(0.5)
    assert prepared[2].force.peak == prepared[-1].force.peak == 0
    assert not prepared[2].pause


@pytest.mark.parametrize("kind", [Pulses, Bipolar, Staircase, RateForce])
@pytest.mark.parametrize(
    ("order", "expected"),
    [
        ("given", [0.2, 0.05, 0.1]),
        ("rising", [0.05, 0.1, 0.2]),
        ("falling", [0.2, 0.1, 0.05]),
    ],
)
def test_levels_come_in_the_order_asked_for(kind, order, expected):
    trials = drive(kind(levels=(0.2, 0.05, 0.1), order=order))
    assert [t.level for t in trials if t.level is not None] == expected
    assert trials[-1].force.value[-1] == 0


def test_the_field_is_read_where_the_bench_can_and_only_if_asked(tmp_path):
    assert not needs(load("demo")).field_meter
    assert needs(load("demo", ["protocol.force_at_zero=true"])).field_meter
    bench = tmp_path / "bare.toml"
    bench.write_text(
        'name = "no meter"\nsimulated = true\n[coil]\n[magnet]\nr = "6 mm"\n'
        '[scope]\n[[scope.channels]]\nsignal = "V_C1"\ninput = "A"\n'
    )
    bare = load(
        "v_c1_only", ["protocol.force_at_zero=true"], bench=str(bench)
    )  # a wish is no demand
    assert not needs(bare).field_meter


def test_the_film_s_own_memory_is_no_drift():
    """V_C1 before a trial soon after a push, as the model has it: no drift at all."""
    circuit = Circuit()
    push = Waveform.pulse(0.2, ramp=0.25, hold=2.0, rest=1.0)
    after = simulate(circuit, push, keep=("V_C1",)).sample("V_C1", [push.end])[0]
    watch = Drift(circuit, lambda current: current.scaled(0.2), limit=0.1)
    rest = rest_V_C1(circuit)
    assert watch.before(rest, 0.0) == 0
    watch.plays(push.scaled(5.0), 0.0)
    assert after - rest > 0.03  # what a plain comparison would call drift
    assert watch.before(after, push.end) == pytest.approx(0, abs=1e-4)


def test_a_force_that_is_there_from_its_first_moment_is_remembered_too():
    """A wave may begin at its force, where the one before ended at none."""
    rest, found = rest_V_C1(Circuit()), []
    for time, force in (
        ([0.0, 0.0, 1.0, 1.0, 2.0], [0.0, 0.2, 0.2, 0.0, 0.0]),
        ([0.0, 1.0, 1.0, 2.0], [0.2, 0.2, 0.0, 0.0]),
    ):
        watch = Drift(Circuit(), lambda current: current.scaled(0.2), limit=0.1)
        watch.before(rest, 0.0)
        watch.plays(Waveform(np.array(time), np.array(force)).scaled(5.0), 0.0)
        found.append(watch.before(rest, 2.0))
    assert found[1] == pytest.approx(found[0]) and abs(found[0]) > 0.01


def test_only_a_sensor_at_rest_is_judged():
    watch = Drift(Circuit(), lambda current: current, limit=0.1)
    watch.before(4.35, 0.0)
    watch.plays(Waveform.through([(0.0, 0.0), (0.2, 0.1)]), 0.0)
    assert watch.before(3.0, 5.0) is None  # the coil holds
    watch.plays(Waveform.through([(0.0, 0.1), (0.2, 0.0)]), 5.0)
    assert watch.before(3.0, 5.3) is None  # it may be late
    assert watch.before(4.4, 6.0) is not None


def test_what_a_list_leaves_far_behind_its_push_is_no_force():
    """Its points round: no touch, texture or vibration was ever judged for drift."""
    rest = rest_V_C1(Circuit())
    watch = Drift(Circuit(), lambda current: current, limit=0.1)
    watch.before(rest, 0.0)
    left = [(0.0, 0.0), (0.1, 1e-3), (0.2, 1e-12), (4.9, 2e-12), (5.0, 0.0)]
    watch.plays(Waveform.through(left), 0.0)
    assert watch.before(rest, 0.3) is None
    assert watch.before(rest, 5.0) == pytest.approx(0, abs=1e-3)


def test_a_rest_that_was_cut_off_gives_no_drift_but_may_end_the_run():
    watch = Drift(Circuit(), lambda current: current, limit=0.1)
    assert watch.before(4.5, 0.0, cut_off=True) is None
    assert watch.before(4.35, 1.0) == 0  # nothing was compared with the former
    assert watch.before(4.4, 2.0, cut_off=True) is None
    with pytest.raises(LimitError):
        watch.before(4.5, 3.0, cut_off=True)


def test_a_film_that_remembers_less_than_believed_is_no_drift():
    """A core with a tenth of Table 1's A2 moves the sensor by a tenth."""
    watch = Drift(Circuit(), lambda current: current, limit=0.1)
    rest = rest_V_C1(Circuit())
    watch.before(rest, 0.0)
    watch.plays(Waveform.pulse(0.3, ramp=0.25, hold=10.0, rest=1.0), 0.0)
    believed = watch.before(rest + 0.02, 12.0)
    assert believed < -0.1


@pytest.mark.parametrize("change", [0.11, -0.11])
def test_a_drift_beyond_the_limit_is_refused_with_what_to_do(change):
    watch = Drift(Circuit(), lambda current: current, limit=0.1)
    watch.before(4.3, 0.0)
    assert watch.before(4.3 + change / 2, 10.0) == pytest.approx(change / 2)
    with pytest.raises(LimitError, match=r"drifted by .*110 mV.*drift_limit"):
        watch.before(4.3 + change, 20.0)


def test_demagnetising_from_a_small_current_still_alternates():
    assert demagnetising_current(1e-3).peak == pytest.approx(1e-3)


SHORT = (
    'protocol.levels=["200 mN", "80 mN"]',
    "protocol.order=rising",
    "protocol.hold=0.3 s",
    "protocol.rest=0.4 s",
    "protocol.force_at_zero=true",
    'record.signals=["V_C1", "V_K", "spikes"]',
    "record.sample_rate=200 kS/s",
    "simulated.hysteresis=50 mA",
)


def test_a_run_tells_f_at_zero_and_the_rest_before_every_trial(tmp_path):
    done = Execution(load("demo", SHORT), tmp_path).run()
    assert done.state is RunState.COMPLETE, done.reason
    write(done.folder, read(done.folder))
    found = json.loads((done.folder / "results.json").read_text())
    zero = found["conclusion"]["force_at_zero"]
    # a virgin core; afterwards the loop's half-width, 50 mA, remains
    assert zero["before_N"] == pytest.approx(0, abs=1e-4)
    assert zero["after_T"] == pytest.approx(0.05 * 0.011, rel=0.05)
    assert zero["after_N"] == pytest.approx(0.01, rel=0.05)
    assert [t["label"] for t in found["trials"]] == ["80 mN", "200 mN"]
    for trial in found["trials"]:
        assert trial["rest_V_C1_V"] == pytest.approx(4.35, abs=0.1)
        assert abs(trial["drift_V"]) < 0.03
    assert "F(0)" in (done.folder / "report.html").read_text()


def test_a_run_whose_rest_drifts_ends_safely_with_its_data(tmp_path):
    """The remanent force of an undemagnetised core moves the rest by 15 mV."""
    scene = load("demo", (*SHORT, "protocol.drift_limit=5 mV"))
    done = Execution(scene, tmp_path).run()
    assert done.state is RunState.FAULTED
    assert "V_C1 at rest has drifted" in (done.reason or "")
    assert done.off.verified
    assert done.spikes == 0  # the 200 mN trial was never played
    assert len(read(done.folder).trials) == 2


def test_a_user_s_force_protocol_needs_only_its_presentations():
    class Own(ForceProtocol):
        name = "own"
        title = "Own"

        def presentations(self):
            yield from ()

    assert [t.label for t in drive(Own(demagnetise=True))] == [
        "demagnetise", "recovery",
    ]  # fmt: skip
