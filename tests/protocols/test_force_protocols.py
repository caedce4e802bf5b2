import math
import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from modelled_runs import modelled, pulse, recovery
from pydantic import ValidationError

from protocols.bipolar import Bipolar
from protocols.calibrate_field import CalibrateField, _steps
from protocols.force_check import ForceCheck
from protocols.hold import Hold
from protocols.monitor import NoForce
from protocols.rate_force import RateForce
from protocols.repeat import Repeat
from protocols.sine_sweep import SineSweep
from protocols.staircase import Staircase
from protocols.threshold_search import ThresholdSearch
from protocols.wiring_check import WiringCheck
from tactile_lab.analysis.rate_force import onset
from tactile_lab.errors import LimitError, NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.quantity import show
from tactile_lab.stimulus.demagnetise import demagnetising_current
from tactile_lab.stimulus.recovery import MOST_EXTENSIONS
from tactile_lab.trial import Outcome
from tactile_lab.waveform import Waveform


def outcome_of(trial, index=0, *, spikes=(), rest=None):
    return Outcome(
        trial=trial,
        index=index,
        start=0.0,
        spike_times=np.array(spikes, dtype=float),
        current=np.empty((0, 2)),
        rest={} if rest is None else {"V_C1": rest},
    )


def drive(protocol, answer):
    """All trials, each answered by `answer(trial)`."""
    trials, generator = [], protocol.trials()
    trial = next(generator)
    while True:
        trials.append(trial)
        try:
            trial = generator.send(answer(trial))
        except StopIteration:
            return trials


def quiet(trial):
    return outcome_of(trial)


def test_hold_is_one_trial_whose_force_is_constant_during_the_hold():
    (trial,) = drive(Hold(level=0.1, ramp=0.5, hold=3.0, before=1.0, rest=2.0), quiet)
    assert trial.hold == (1.5, 4.5)
    assert trial.force.at(np.linspace(*trial.hold, 50)) == pytest.approx(0.1)
    assert trial.length == pytest.approx(7.0)
    assert trial.force.at(0.99) == 0


def test_rate_force_separates_its_steps_by_recovery_down_to_1_mv():
    levels = (0.1, 0.2, 0.15)
    trials = drive(RateForce(levels=levels), quiet)
    steps = [t for t in trials if not t.pause]
    pauses = [t for t in trials if t.pause]
    assert [t.level for t in steps] == list(levels)
    assert len(pauses) == 2
    assert pauses[1].length == pytest.approx(49.7, abs=0.1)
    k_F, tau = Circuit().k_F, Circuit().tau
    for level, pause in zip(levels, pauses, strict=False):
        assert k_F * level * np.exp(-pause.length / tau) <= 1e-3 * (1 + 1e-6)


@pytest.mark.parametrize(
    ("order", "expected"),
    [("given", [0.2, 0.1, 0.15]), ("rising", [0.1, 0.15, 0.2]),
     ("falling", [0.2, 0.15, 0.1])],
)  # fmt: skip
def test_levels_come_in_the_order_asked_for(order, expected):
    trials = drive(RateForce(levels=(0.2, 0.1, 0.15), order=order), quiet)
    assert [t.level for t in trials if t.level is not None] == expected


def test_a_random_order_repeats_from_its_seed():
    levels = tuple(np.linspace(0.1, 0.2, 12).tolist())

    def order(seed):
        protocol = RateForce(levels=levels, order="random", seed=seed)
        return [t.level for t in drive(protocol, quiet) if t.level is not None]

    assert order(3) == order(3)
    assert order(3) != order(4)
    assert sorted(order(3)) == list(levels)


def test_recovery_is_extended_until_v_c1_is_back():
    looks = iter([4.30, 4.34])

    def answer(trial):
        if trial.label == "look at rest":
            return outcome_of(trial, rest=next(looks))
        return outcome_of(trial, rest=4.347)

    trials = drive(RateForce(levels=(0.1, 0.2)), answer)
    assert [t.label for t in trials] == [
        "100 mN", "recovery", "look at rest", "recovery", "look at rest", "200 mN",
    ]  # fmt: skip


def test_back_at_rest_means_within_one_code_of_the_channel():
    looks = iter([4.30, 4.34])

    def answer(trial):
        if trial.label == "look at rest":
            seen = outcome_of(trial, rest=next(looks))
            return replace(seen, codes={"V_C1": 50e-3})
        return outcome_of(trial, rest=4.347)

    trials = drive(RateForce(levels=(0.1, 0.2)), answer)
    assert [t.label for t in trials] == ["100 mN", "recovery", "look at rest", "200 mN"]


def test_a_rest_that_never_comes_back_is_waited_for_only_so_long():
    def answer(trial):
        return outcome_of(trial, rest=4.0 if trial.label == "look at rest" else 4.347)

    trials = drive(RateForce(levels=(0.1, 0.2)), answer)
    assert sum(t.label == "look at rest" for t in trials) == MOST_EXTENSIONS
    assert trials[-1].level == 0.2


def test_demagnetising_comes_first_and_dies_away():
    trials = drive(RateForce(levels=(0.1,), demagnetise=True), quiet)
    assert [t.label for t in trials] == ["demagnetise", "recovery", "100 mN"]
    assert trials[0].pause
    current = demagnetising_current()
    turns = np.abs(current.value[1:-1])
    assert np.all(np.diff(turns) < 0)
    assert turns[0] == pytest.approx(1.0)
    assert turns[-1] < 6e-3
    assert np.all(np.sign(current.value[1:-1:2]) == -np.sign(current.value[2:-1:2]))
    assert current.steepest < 5.0


def test_a_staircase_steps_without_a_jump_and_says_what_it_is():
    trials = drive(Staircase(levels=(0.1, 0.2, 0.0)), quiet)
    for before, after in pairwise(trials):
        assert before.force.value[-1] == after.force.value[0]
    assert "no rate-force curve" in Staircase.title


def test_a_staircase_step_acts_as_less_than_a_step_from_rest():
    """The reason why `rate_force` exists."""
    step = simulate(Circuit(), drive(RateForce(levels=(0.15,)), quiet)[0].force)
    force, stairs = None, drive(Staircase(levels=(0.075, 0.15), hold=3.0), quiet)
    for trial in stairs:
        force = trial.force if force is None else force.then(trial.force)
    climbed = simulate(Circuit(), force)
    fastest_step = 1 / np.diff(step.spike_times).min()
    fastest_stair = 1 / np.diff(climbed.spike_times).min()
    assert fastest_stair < 0.95 * fastest_step


def test_repeat_gives_equal_presentations():
    trials = drive(Repeat(level=0.16, count=5), quiet)
    assert len(trials) == 5
    assert len({t.force for t in trials}) == 1


def test_bipolar_pushes_and_pulls():
    trials = drive(Bipolar(levels=(0.1, -0.1)), quiet)
    assert [t.force.value.max() for t in trials] == [0.1, 0.0]
    assert [t.force.value.min() for t in trials] == [0.0, -0.1]
    assert "I_DS" in Bipolar.signals


def test_sine_sweep_is_a_sine_at_each_frequency():
    sweep = SineSweep(amplitude=0.04, bias=0.05, lowest=0.2, highest=0.8, count=3)
    *trials, last = drive(sweep, quiet)
    assert last.force.value[-1] == 0
    for trial, frequency in zip(trials, (0.2, 0.4, 0.8), strict=True):
        start, end = trial.hold
        assert end - start == pytest.approx(sweep.cycles / frequency)
        time = np.linspace(start, end, 997)
        swing = (trial.force.at(time) - 0.05) / 0.04
        first = np.arctan2(
            trial.force.at(start) - 0.05, 0.04 * np.sqrt(1 - swing[0] ** 2)
        )
        phases = 2 * np.pi * frequency * (time - start)
        either = [np.sin(phases + first), np.sin(phases + np.pi - first)]
        assert min(np.max(np.abs(swing - sine)) for sine in either) < 0.01


@pytest.mark.parametrize("tau", [8.69, 3.0])
def test_each_sine_begins_with_the_film_settled(tau):
    force = None
    sweep = SineSweep(lowest=0.012, highest=0.3, count=3, cycles=3, tau=tau)
    circuit, spans = Circuit(tau=tau), []
    for trial in drive(sweep, quiet):
        start = 0.0 if force is None else force.end
        spans.append([start + edge for edge in trial.hold or ()])
        force = trial.force if force is None else force.then(trial.force)
    made = simulate(circuit, force, keep=("V_P",))
    for (start, end), frequency in zip(spans, sweep.frequencies(), strict=False):
        cycle = np.linspace(start, start + 1 / frequency, 200)
        first, last = (
            made.sample("V_P", at) for at in (cycle, cycle + end - cycle[-1])
        )
        assert first == pytest.approx(last, abs=0.004 * np.ptp(last))


@pytest.mark.parametrize("critical", [0.071, 0.0926, 0.1333])
def test_threshold_search_closes_in_on_the_critical_force(critical):
    def answer(trial):
        fires = trial.level is not None and trial.level >= critical
        return outcome_of(trial, spikes=[0.3] if fires else [])

    search = ThresholdSearch(resolution=1e-3)
    tried = {
        t.level: t.level >= critical
        for t in drive(search, answer)
        if t.level is not None
    }
    low = max(level for level, fires in tried.items() if not fires)
    high = min(level for level, fires in tried.items() if fires)
    assert low < critical <= high
    assert high - low <= 1e-3 * (1 + 1e-6)
    assert len(tried) <= 10


def test_threshold_search_finds_the_models_critical_force():
    def answer(trial):
        if trial.pause:
            return outcome_of(trial)
        found = simulate(Circuit(), trial.force)
        return outcome_of(trial, spikes=found.spike_times)

    trials = drive(ThresholdSearch(ramp=0.01, hold=1.0, resolution=2e-4), answer)
    levels = [t.level for t in trials if t.level is not None]
    assert levels[-1] == pytest.approx(96.1e-3, abs=3e-4)


def searched(search, true, believed):
    """The run that a search makes of a sensor, and what is believed of it."""
    trials, force = [], None

    def answer(trial):
        nonlocal force
        if trial.pause:
            return outcome_of(trial)
        found = simulate(true, trial.force).spike_times
        start = 0.0 if force is None else force.end
        force = trial.force if force is None else force.then(trial.force)
        trials.append(
            MeasuredTrial(
                label=trial.label,
                level=trial.level,
                start=start,
                duration=trial.length,
                spike_times=found,
            )
        )
        return outcome_of(trial, spikes=found)

    drive(search, answer)
    return Measurement(
        simulated=True,
        bench="made up",
        duration=force.end,
        trials=tuple(trials),
        force=force,
        circuit=believed,
    )


def test_a_sensor_that_fires_when_pulled_has_its_critical_force_below_zero():
    """All but the sign is as of the sensor that fires when pushed."""
    pushed = Circuit()
    pulled = replace(pushed, g31=-pushed.g31)
    push, pull = ThresholdSearch(), ThresholdSearch(low=-0.06, high=-0.14)
    above, below = (
        search.conclude(searched(search, circuit, circuit))
        for search, circuit in ((push, pushed), (pull, pulled))
    )
    for name, sign in (("critical_force_N", -1), ("critical_force_half_width_N", 1)):
        assert below.values[name] == pytest.approx(sign * above.values[name])
        assert above.values[name] > 0
    for name in ("V_GS_low_V", "V_GS_high_V"):
        assert below.values[name] == pytest.approx(above.values[name], abs=5e-5)
    assert below.values["V_GS_low_V"] < pulled.V_GS < below.values["V_GS_high_V"]
    assert re.search(r"between −9\d(\.\d+)? mN \(silent\) and −9\d", below.text)
    (plot,) = pull.plots(searched(pull, pulled, pulled))
    (band,) = plot.panels[0].guides
    assert band.at < below.values["critical_force_N"] < band.to < 0


@pytest.mark.parametrize(
    ("low", "high"), [(-0.06, 0.14), (0.06, -0.14), (-0.14, -0.06), (0.14, 0.06)]
)
def test_a_search_goes_one_way_from_zero(low, high):
    with pytest.raises(ValueError, match="nearer to 0 N than high"):
        ThresholdSearch(low=low, high=high)


def test_rates_of_pulls_have_a_critical_force_and_an_expectation():
    levels = (-0.08, -0.12, -0.16)
    trials = tuple(
        MeasuredTrial(
            label=show(level, "N"), level=level, start=2.0 * i, duration=2.0,
            hold=(0.25, 1.25), spike_times=0.3 + np.arange(3 * i) / 10,
        )
        for i, level in enumerate(levels)
    )  # fmt: skip
    force = Waveform.constant(0.0)
    pulled = replace(Circuit(), g31=-Circuit().g31)
    run = Measurement(
        simulated=True, bench="made up", duration=6.0, trials=trials, force=force,
        circuit=pulled,
    )  # fmt: skip
    (plot,) = RateForce(levels=levels).plots(run)
    assert plot.panels[0].guides[0].to == pytest.approx(-0.08)
    (line,) = (one for one in plot.panels[0].series if one.mark == "dashed")
    assert min(line.x) < min(levels) and max(levels) < max(line.x) < 0


@pytest.mark.parametrize("sign", [1, -1])
def test_a_larger_force_that_was_silent_is_refused_either_way(sign):
    forces = [sign * mN / 1e3 for mN in (80, 100, 120)]
    found = onset(forces, [0, 1, 4])
    assert (found.silent, found.fires) == (forces[0], forces[1])
    assert found.half_width == pytest.approx(0.01)
    with pytest.raises(NotIdentifiableError, match=r"120 mN silent though −?100 mN"):
        onset(forces, [0, 1, 0])


def test_threshold_search_carries_the_follower_s_bias_into_V_GS():
    """The true follower draws 10 pA less than believed, half of its band."""
    believed, search = Circuit(I_bias=65e-12), ThresholdSearch()
    run = searched(search, replace(believed, I_bias=55e-12), believed)
    biased = replace(believed, I_bias=believed.I_bias + 20e-12)
    found = search.conclude(replace(run, displaced={"follower": biased}))
    low, high = found.values["V_GS_low_V"], found.values["V_GS_high_V"]
    assert low < believed.V_GS < high
    assert "95 %, the circuit's other parameters as believed) explains" in found.text
    bare = search.conclude(run).values
    bracket = bare["V_GS_high_V"] - bare["V_GS_low_V"]
    assert high - low == pytest.approx(math.hypot(bracket, 1e-3), rel=0.05)


def test_threshold_search_carries_the_scatter_of_V_fire_into_V_GS():
    """A single press fires or not by the V_fire that it happens to meet."""
    steps = [pulse(0.14), recovery(), pulse(0.0965), recovery(), pulse(0.0975)]
    run, search = modelled("threshold_search", steps), ThresholdSearch()
    steady = search.conclude(run)
    assert "scatters" not in steady.text
    most = run.trials[0]
    # half a millisecond of an interval is some 15 mV of V_fire
    later = np.cumsum(np.random.default_rng(1).normal(0, 5e-4, most.spike_times.size))
    scattered = replace(most, spike_times=most.spike_times + later)
    found = search.conclude(replace(run, trials=(scattered, *run.trials[1:])))
    assert "V_fire scatters by ±" in found.text
    assert steady.values["critical_force_scatter_N_95"] < 1e-4
    scatter = found.values["critical_force_scatter_N_95"]
    bracket = found.values["critical_force_half_width_N"]
    film = abs(found.values["critical_force_left_in_film_N"])
    half = math.hypot(bracket + film, scatter)
    assert f"and V_fire's scatter: ±{show(half, 'N', 2)} (95 %)" in found.text
    (plot,) = search.plots(replace(run, trials=(scattered, *run.trials[1:])))
    (band,) = plot.panels[0].guides
    assert (band.to - band.at) / 2 == pytest.approx(half)
    wider = (
        (found.values["V_GS_high_V"] - found.values["V_GS_low_V"]) / 2 / Circuit().k_F
    )
    assert half == pytest.approx(wider, rel=0.1)
    before, after = (
        told.values["V_GS_high_V"] - told.values["V_GS_low_V"]
        for told in (steady, found)
    )
    assert after > 1.2 * before


def test_what_the_film_held_is_told_of_a_bracket_that_is_no_wider():
    """Of 12 true critical forces 9 lay within half a bracket of 0.16 mN."""
    steps = [pulse(0.14), recovery(), pulse(0.0967), recovery(), pulse(0.0969)]
    run = modelled("threshold_search", steps)
    began = [t.start for t in run.results if t.level][1:]
    film = simulate(run.circuit, run.force, keep=("V_P",), until=began[-1])
    found = ThresholdSearch().conclude(run)
    left = found.values["critical_force_left_in_film_N"]
    most = max(film.sample("V_P", began), key=abs)
    assert left == pytest.approx(most / run.circuit.k_F, rel=0.01)
    assert left < -0.2 * found.values["critical_force_half_width_N"]
    assert f"from rest these presses are as up to {show(-left, 'N', 2)} less" in (
        found.text
    )
    wide = modelled("threshold_search", [pulse(0.14), recovery(), pulse(0.09)])
    assert "film still held" not in ThresholdSearch().conclude(wide).text


def test_a_scatter_that_is_not_known_is_told_as_such():
    steps = [pulse(0.14), recovery(), pulse(0.0965), recovery(), pulse(0.0975)]
    run, search = modelled("threshold_search", steps), ThresholdSearch()
    assert "do not tell how far V_fire" not in search.conclude(run).text
    saturating = replace(run, circuit=replace(run.circuit, saturation=True))
    assert "do not tell how far V_fire" in search.conclude(saturating).text
    alone = replace(run.trials[0], spike_times=run.trials[0].spike_times[:1])
    few = replace(run, trials=(alone, *run.trials[1:]))
    assert "do not tell how far V_fire" in search.conclude(few).text


@pytest.mark.parametrize(
    ("spikes", "message"), [([], "does not make the sensor fire"), ([0.2], "already")]
)
def test_threshold_search_says_when_the_range_does_not_hold_it(spikes, message):
    with pytest.raises(LimitError, match=message):
        drive(ThresholdSearch(), lambda trial: outcome_of(trial, spikes=spikes))


def test_calibrate_field_never_overshoots_a_step():
    trials = drive(CalibrateField(most=0.8, points=11), quiet)
    prepared = [t.label for t in trials if t.pause]
    assert prepared == [
        "demagnetise", "conditioning 1", "conditioning 2", "turn", "turn", "turn",
        "back to 0 A",
    ]  # fmt: skip
    steps = [t for t in trials if not t.pause]
    levels = [t.current.value[-1] for t in steps]
    assert levels[:11] == pytest.approx(np.linspace(0.8, -0.8, 11))
    assert levels[11:22] == pytest.approx(np.linspace(-0.8, 0.8, 11))
    assert levels[22:] == levels[:3]
    assert [t.label.split()[0] for t in steps[22:]] == ["again"] * 3
    for before, after in pairwise(trials):
        if after.label != "demagnetise":
            assert before.current.value[-1] == pytest.approx(after.current.value[0])
    assert all(t.label.startswith("falling") for t in steps[:11])


def test_a_field_read_before_a_late_set_point_is_not_that_of_the_hold():
    time = np.arange(0.0, 3.0, 0.1)
    step = Waveform(time=[0.0, 3.0], value=[0.5, 0.5])
    held = MeasuredTrial(
        label="rising 500 mA", level=None, start=0.0, duration=3.0,
        spike_times=np.empty(0), hold=(0.5, 3.0),
    )  # fmt: skip

    def measured(came):
        return Measurement(
            simulated=False, bench="made up", duration=3.0, trials=(held,), force=step,
            current=np.array([[0.0, 0.4], [came, 0.5]]),
            field=np.column_stack([time, np.where(time < came, 4.4e-3, 5.5e-3)]),
        )  # fmt: skip

    assert measured(0.3).field_held(held).size == 25
    late = measured(1.25)
    assert np.all(late.field_held(held) == 5.5e-3)
    assert late.field_held(held).size == 14
    (told,) = _steps(late)
    assert (told.current, told.field) == (0.5, 5.5e-3)


def test_wiring_check_pushes_little():
    ground, supply, rest, push, again = drive(WiringCheck(), quiet)
    touched = [t.probes for t in (ground, supply, rest, push, again)]
    assert touched == ["ground", "supply", "circuit", "circuit", "circuit"]
    assert rest.force.peak == again.force.peak == 0
    assert push.force.peak <= 0.1


def test_monitor_asks_for_no_force():
    trials = drive(NoForce(duration=25.0, part=10.0), quiet)
    assert [t.length for t in trials] == pytest.approx([10, 10, 5])
    assert all(t.force.peak == 0 for t in trials)


@pytest.mark.parametrize(
    ("protocol", "values"),
    [(ThresholdSearch, {"low": 0.2, "high": 0.1}), (RateForce, {"levels": ()}),
     (SineSweep, {"lowest": 2.0, "highest": 1.0}), (Repeat, {"count": 1}),
     (ForceCheck, {"levels": (0.1, 0.2), "readings": (0.1,)}),
     (WiringCheck, {"push": 0.5}), (Hold, {"hold": 0.0}), (Hold, {"levle": 0.1})],
)  # fmt: skip
def test_impossible_parameters_are_refused(protocol, values):
    with pytest.raises(ValidationError):
        protocol(**values)


def test_parameters_are_frozen_values():
    protocol = Hold()
    with pytest.raises(ValidationError):
        protocol.level = 0.2
