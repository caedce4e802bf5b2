"""What a report concludes from runs of each protocol, on plain values."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from protocols.calibrate_field import CalibrateField
from protocols.force_check import ForceCheck
from protocols.hold import Hold
from tactile_lab.analysis.belief import Belief
from tactile_lab.analysis.rate_force import eq15_rate
from tactile_lab.calibration import read_calibration
from tactile_lab.magnetics import ForceUncertainty, Magnet
from tactile_lab.measurement import MeasuredTrial, RecordedSignal
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.plugins import protocol_class
from tactile_lab.report.canvas import draw
from tactile_lab.report.findings import find
from tactile_lab.report.identified import identify_run, identify_runs, settled
from tactile_lab.report.overview import overview
from tactile_lab.report.results import as_json, results
from tactile_lab.report.run_data import RunData
from tactile_lab.report.splice import ClosedTime
from tactile_lab.report.table import trials_table
from tactile_lab.report.twin import sentences
from tactile_lab.report.write import write
from tactile_lab.store.facts import facts, grouped
from tactile_lab.store.folder import write_json
from tactile_lab.store.summary import RunSummary
from tactile_lab.waveform import Waveform

NEWTONS_PER_AMPERE = 0.2
LEVELS = (0.05, 0.1)

MAGNET = Magnet(r=6e-3)


def means(found, signal, time):
    """Of bins about these times, as a scope's samples give them."""
    step = time[1] - time[0]
    inside = time[:, None] + step * (np.arange(8) - 3.5) / 8
    return found.sample(signal, inside).mean(axis=1)


def modelled(protocol, steps, *, circuit=None, bins=2000, parameters=None, **entries):
    """A run of (label, level, force, pause) steps as the model answers them."""
    circuit = circuit or Circuit()
    force, starts = None, []
    for _, _, wave, _ in steps:
        starts.append(0.0 if force is None else force.end)
        force = wave if force is None else force.then(wave)
    found = simulate(circuit, force, keep=("V_C1", "V_C2", "spikes"))
    time = (np.arange(bins) + 0.5) * force.end / bins
    trials = []
    for start, (label, level, wave, pause) in zip(starts, steps, strict=True):
        inside = (found.spike_times >= start) & (found.spike_times < start + wave.end)
        trials.append(
            MeasuredTrial(
                label=label,
                level=level,
                start=start,
                duration=wave.end,
                spike_times=found.spike_times[inside] - start,
                hold=None if level is None else (0.25, 0.25 + 1.0),
                pause=pause,
            )
        )
    traces = tuple(
        RecordedSignal(signal=s, time=time, mean=means(found, s, time))
        for s in ("V_C1", "V_C2")
    )
    plain = {
        "title": protocol,
        "protocol": protocol_class(protocol)(**(parameters or {})),
        "run": "a run",
        "status": "complete",
        "simulated": True,
        "bench": "test",
        "duration": force.end,
        "trials": tuple(trials),
        "force": force,
        "current": np.column_stack([force.time, force.value / NEWTONS_PER_AMPERE]),
        "traces": traces,
        "circuit": Circuit(),
        "belief": Belief(
            Circuit(), MAGNET, force.scaled(1 / MAGNET.newtons_per_ampere)
        ),
    }
    return RunData(**{**plain, **entries})


def pulse(level, rest=0.5):
    label = f"{level * 1e3:g} mN"
    return (label, level, Waveform.pulse(level, ramp=0.25, hold=1.0, rest=rest), False)


def recovery(seconds=50.0):
    quiet = Waveform.through([(0.0, 0.0), (seconds, 0.0)])
    return ("recovery", None, quiet, True)


@pytest.fixture(scope="module")
def rate_force():
    steps = []
    for level in (0.085, 0.11, 0.15, 0.2):
        steps += [pulse(level), recovery()]
    return modelled("rate_force", steps[:-1])


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


def test_a_figure_closes_up_over_recoveries(rate_force):
    shown = overview(find(rate_force).run)
    force, voltage, *_ = shown.panels
    cuts = [g for g in force.guides if g.to is None]
    assert len(cuts) == 3
    duration = shown.x_limits[1]
    assert duration == pytest.approx(rate_force.duration - 150.0)
    holds = [g.at - 0.25 for g in force.guides if g.to is not None]
    assert holds == pytest.approx([0.0, 2.0, 4.0, 6.0])
    pushed = force.series[0]
    assert pushed.x[-1] == pytest.approx(duration)
    assert np.interp(4.5, pushed.x, pushed.y) == pytest.approx(0.15)
    V_C1 = next(s for s in voltage.series if s.name == "V_C1")
    known = V_C1.x[np.isfinite(V_C1.x)]
    assert np.all(np.diff(known) > -1e-9)
    assert known[-1] <= duration
    *_, last = draw(shown, "a run").axes
    assert "recoveries left out" in last.get_xlabel()


def test_a_run_without_recoveries_is_left_as_it_is(demo):
    axis, time = ClosedTime(demo), np.linspace(0, demo.duration, 7)
    assert axis.cuts == ()
    assert axis.closed(time).tolist() == time.tolist()
    assert axis.shown(time).all()


def test_rate_force_gets_a_second_figure_and_the_demo_does_not(
    rate_force, demo, tmp_path
):
    assert find(demo).answers == ()
    report = write(tmp_path, rate_force)
    assert (tmp_path / "summary.png").exists()
    assert (tmp_path / "twin.png").exists()
    assert report.html.read_text(encoding="utf-8").count("<figure>") == 3


def test_repeat_tells_the_decrement():
    run = modelled("repeat", [pulse(0.16) for _ in range(4)])
    found = find(run)
    rates = found.conclusion.values["peak_rates_Hz"]
    assert rates == sorted(rates, reverse=True)
    assert "Highest rate in the hold, from one" in found.conclusion.sentences[0]
    assert [plot.name for plot in found.answers] == ["summary"]


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


CODE = 4.0 / 254


def pushed_and_pulled(seed, *, late=0.06):
    """A `bipolar` run of +-80 mN as an 8 bit scope shows it; forces come `late` s."""
    steps = []
    for level in (0.08, -0.08):
        pulse = Waveform.pulse(level, ramp=0.25, hold=5.0, rest=4.0)
        wave = Waveform(np.append(0.0, pulse.time + late), np.append(0.0, pulse.value))
        steps.append((f"{level * 1e3:g} mN", level, wave, False))
    quiet = ("rest", None, Waveform.through([(0.0, 0.0), (0.5, 0.0)]), False)
    run = modelled("bipolar", [quiet, *steps], searched=False, bins=2000)
    held = tuple(replace(t, hold=t.level and (0.25, 5.25)) for t in run.trials)
    V_C1, rng = run.traces[0], np.random.default_rng(seed)
    noisy = V_C1.mean[:, None] + rng.normal(0, 5e-3, (2000, 100))
    shown = 2.5 + CODE * np.rint((noisy - 2.5) / CODE).mean(axis=1)
    seen = replace(V_C1, mean=shown, code=CODE, samples=100)
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


def _changed_by_eq_8(run, level):
    """From before the push to when the force is there, node A having followed."""
    trial = next(t for t in run.trials if t.level == level)
    made = simulate(Circuit(), run.force, keep=("V_P",))
    ends = np.array([trial.start, run.applied_edge(trial)])
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


def test_a_trial_whose_spikes_could_not_be_told_has_a_count_and_no_rate():
    train = MeasuredTrial(
        label="120 mN", level=0.12, start=0.0, duration=2.0, hold=(0.25, 1.5),
        spike_times=np.array([0.3, 0.4, 0.5]),
    )  # fmt: skip
    assert train.response.latency == 0.3
    blind = replace(train, unsearched=True)
    assert blind.response.spikes == 3
    assert (blind.response.latency, blind.response.peak_rate) == (None, None)
    assert "left its range" in blind.why_not


def test_bipolar_without_a_rest_before_it_says_so():
    run = pushed_and_pulled(0)
    late = tuple(replace(t, start=t.start - 0.5) for t in run.trials)
    kept = run.traces[0].time >= 0.8
    time, mean = (v[kept] for v in (run.traces[0].time - 0.5, run.traces[0].mean))
    cut = replace(run.traces[0], time=time, mean=mean)
    found = find(replace(run, trials=late, traces=(cut,))).conclusion
    assert "current at rest is not known" in found.missing[0]


def test_wiring_check_passes_a_right_bench_and_names_a_wrong_one():
    quiet = Waveform.through([(0.0, 0.0), (1.25, 0.0)])
    steps = [("rest", 0.0, quiet, False), ("push", *pulse(0.05)[1:])]
    run = modelled("wiring_check", steps)
    channels = find(run).conclusion.values["channels"]
    assert {name for name, given in channels.items() if given["ok"]} == {"V_C1", "V_C2"}
    first, second = run.traces
    swapped = (
        replace(first, mean=second.mean),
        replace(second, mean=first.mean),
    )
    wrong = find(replace(run, traces=swapped)).conclusion
    assert "swapped with V_C2" in wrong.values["channels"]["V_C1"]["text"]
    assert "V_C1: WRONG" in " ".join(wrong.sentences)


def test_calibrate_field_reads_both_branches(tmp_path):
    trials, time, rows = [], 0.0, []
    readings, levels = [], np.linspace(-1, 1, 11)
    for branch, sign, order in (
        ("falling", 1, levels[::-1]),
        ("rising", -1, levels),
    ):
        for level in order:
            trials.append(
                MeasuredTrial(
                    label=f"{branch} {level * 1e3:.0f} mA", level=None, start=time,
                    duration=1.8, spike_times=np.empty(0), hold=(0.8, 1.8),
                )
            )  # fmt: skip
            rows.append((time + 0.5, level))
            for at in np.arange(time + 0.85, time + 1.8, 0.2):
                readings.append((at, 0.011 * level + sign * 3e-4))
            time += 1.8
    run = RunData(
        title="", protocol=CalibrateField(), run="", status="complete", bench="",
        simulated=True, duration=time, trials=tuple(trials),
        force=Waveform.constant(0.0), current=np.array(rows),
        field=np.array(readings), searched=False,
    )  # fmt: skip
    few = (0.9, 1.0, 1.1, 1.2, 1.3)
    scattered = np.array([(at, 1e-3 + 1e-6 * n) for n, at in enumerate(few)])
    shown = trials_table(replace(run, field=scattered)).rows[0][3]
    # Student's t of five readings: 2.776 times 1.58 uT over the root of 5
    assert shown == "1.0020 ± 0.0020 mT"
    values = find(run).conclusion.values
    assert values["slope_T_per_A"] == pytest.approx(0.011, rel=1e-6)
    assert values["half_width_T"] == pytest.approx(3e-4, rel=1e-6)
    dated = replace(run, started="2026-11-21 03:00:00", settings={})
    write(tmp_path, dated)
    written = read_calibration(tmp_path / "calibration.csv")
    assert written.whole
    assert written.head["date"] == "2026-11-21"
    kept = (tmp_path / "calibration.csv").read_text()
    write(tmp_path, replace(dated, field=dated.field * 1.5))
    assert (tmp_path / "calibration.csv").read_text() == kept, "never overwritten"
    assert not (tmp_path / "calibration.csv").stat().st_mode & 0o222
    without = find(replace(run, field=None)).conclusion
    assert "no teslameter readings" in without.sentences[0]
    for believed, unlike in ((0.011, False), (0.013, False), (0.022, True)):
        told = find(replace(run, field_per_ampere=believed)).conclusion.sentences
        assert any("check the probe's place" in one for one in told) == unlike


def test_force_check_finds_the_slip_in_table_1():
    run = modelled("force_check", [pulse(0.05), pulse(0.1)])
    read = replace(run, protocol=ForceCheck(levels=LEVELS, readings=(0.0051, 0.0099)))
    found = find(read).conclusion
    assert found.values["read_over_eq2"] == pytest.approx(0.0996, rel=1e-3)
    assert "2.25e-4" in found.sentences[0]
    assert "No independent readings" in find(run).conclusion.sentences[0]
    assert "eq2_uncertainty_95" not in found.values
    known = replace(read, force_uncertainty=ForceUncertainty(0.0, 0.1))
    values = find(known).conclusion.values
    assert values["eq2_uncertainty_95"] == pytest.approx(0.1 * values["read_over_eq2"])


def test_a_teslameter_that_hangs_is_no_exact_one():
    """Its force stood as "0 N" without an uncertainty."""
    run = modelled("force_check", [pulse(0.05)])
    at = np.arange(-1.0, run.duration, 0.2)
    hangs = np.column_stack([at, np.full(at.size, 3e-3)])
    found = find(replace(run, field=hangs, newtons_per_tesla=18.0)).conclusion
    (band,) = found.values["F_minus_F0_uncertainty_N_95"]
    assert found.values["F_minus_F0_by_field_N"] == [pytest.approx(0, abs=1e-9)]
    assert band is not None and 20e-6 < band < 1e-3


def test_a_model_that_stays_cool_beside_a_sensor_that_warms_says_so(rate_force):
    time = np.linspace(0, rate_force.duration, 20)
    warming = np.column_stack([time, 291.65 + 15 * time / time[-1]])
    beside = find(rate_force).beside
    said = sentences(beside, replace(rate_force, temperature=warming))
    assert any(
        "read from 291.65 K to 306.65 K; the model stays at 290.11 K" in t for t in said
    )
    assert not any("read from" in text for text in sentences(beside, rate_force))


def test_monitor_tells_the_distance_to_threshold():
    quiet = Waveform.through([(0.0, 0.0), (3.0, 0.0)])
    run = modelled("monitor", [("part 1", 0.0, quiet, False)])
    distance = find(run).conclusion.values["distance_to_threshold_V"]
    assert distance == pytest.approx(4.347 - 3.974, abs=2e-3)
    drawn = overview(replace(run, searched=True))
    assert "Rate" not in [panel.label for panel in drawn.panels], "there is none"


def test_the_twin_is_reported(rate_force, tmp_path):
    report = write(tmp_path, rate_force)
    values = json.loads(report.results.read_text())["twin"]
    assert values["voltages"]["V_C1"]["rms_V"] < 2e-3
    assert values["spikes"]["missed"] == values["spikes"]["extra"] == 0
    page = report.html.read_text(encoding="utf-8")
    assert re.search(r"V_C1: measured less model is .{1,8} mV on average", page)


def test_a_run_without_current_has_no_twin(rate_force):
    assert find(replace(rate_force, belief=None)).beside is None


def test_sine_sweep_gives_the_gain_of_small_forces():
    frequency, cycles = 0.5, 4
    phase = np.arange(0, 24 * cycles + 1) / 24
    wave = Waveform(phase / frequency, 0.005 * np.sin(2 * np.pi * phase))
    run = modelled("sine_sweep", [("0.5 Hz", None, wave, False)], searched=False)
    held = (replace(run.trials[0], hold=(0.0, cycles / frequency)),)
    told = find(replace(run, trials=held)).conclusion
    (found,) = told.plain["V_C1_over_force"]
    ((frequency_, gain, phase_, *model),) = told.tables[0].rows
    assert frequency_ == "0.5 Hz"
    shown, half = (part.partition(".")[2] for part in gain.split(" ± "))
    assert len(shown) == len(half) > 1, "the gain is told as far as it is known"
    assert float(gain.split(" ± ")[0]) == pytest.approx(
        found["gain_V_per_N"]["value"], abs=found["gain_V_per_N"]["error"]
    )
    assert float(model[0]) == pytest.approx(found["gain_V_per_N"]["value"], rel=0.02)
    assert phase_.startswith("−1") and model[1].startswith("−1")
    # small signal: dV_C1/dF = -k_F g_m R, low-passed by node A at 27 Hz
    circuit = Circuit()
    steep = 24.69e-9 / (circuit.m * circuit.V_T)
    resistance = 1 / (1 / circuit.R1 + 1 / circuit.R2)
    assert found["gain_V_per_N"]["value"] == pytest.approx(
        circuit.k_F * steep * resistance, rel=0.02
    )
    assert abs(found["phase_rad"]["value"]) == pytest.approx(np.pi, abs=0.2)


def test_the_force_s_uncertainty_reaches_the_critical_force(rate_force):
    sure = find(rate_force).conclusion
    known = find(
        replace(rate_force, force_uncertainty=ForceUncertainty(5e-3, 0.04))
    ).conclusion
    expected = np.sqrt(0.0125**2 + 5e-3**2 + (0.04 * 0.0975) ** 2)
    assert known.values["critical_force_uncertainty_N_95"] == pytest.approx(expected)
    assert "states no uncertainty" in " ".join(sure.sentences)
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


def test_too_few_spikes_to_fit_are_said(rate_force, tmp_path):
    held = replace(rate_force, protocol=Hold(), trials=rate_force.trials[2:3])
    report = write(tmp_path, held)
    film, said = report.findings.missing
    assert said.startswith("No time constant of an exponential: not identifiable: ")
    found = json.loads(report.results.read_text(encoding="utf-8"))
    assert found["missing"] == [film, said]
    assert found["conclusion"]["time_constant_s"] is None
    assert found["trials"][0]["spikes"] > 3, "what there is, is kept"
    assert "Not determined" in report.html.read_text(encoding="utf-8")


def test_what_a_report_says_of_adaptation_finds_its_run(tmp_path):
    held = Waveform.pulse(0.16, ramp=0.01, hold=10.0)
    run = modelled("pulses", [("160 mN", 0.16, held, False)])
    trials = results(find(run))["trials"]
    write_json(tmp_path / "results.json", {"trials": trials})
    found = grouped(facts(RunSummary(folder=tmp_path, name="pushed")))
    tau = trials[0]["circuit_adaptation"]["tau_s"]["value"]
    assert found["tau"] == [("tau", tau, "", "s")]


@pytest.mark.parametrize(
    ("protocol", "says"),
    [
        ("hold", "spikes were not looked for"),
        ("rate_force", "spikes were not looked for"),
        ("repeat", "spikes were not looked for"),
        ("threshold_search", "spikes were not looked for"),
        ("bipolar", "No drain current"),
        ("sine_sweep", "No gain"),
    ],
)
def test_a_run_without_its_signal_says_so_and_claims_nothing(
    rate_force, protocol, says
):
    blind = replace(
        rate_force, protocol=protocol_class(protocol)(), searched=False, traces=()
    )
    found = find(blind)
    assert says in found.missing[0]
    assert not found.conclusion.sentences


def test_forces_that_all_fire_give_no_critical_force_but_their_rates(rate_force):
    fired = replace(rate_force, trials=rate_force.trials[2:])
    found = find(fired)
    assert "every force made the sensor fire" in found.missing[0]
    assert found.conclusion.values["critical_force_N"] is None
    assert found.conclusion.values["peak_rate_over_eq15"]


def test_what_cannot_be_computed_is_said_and_the_rest_is_kept(rate_force, tmp_path):
    first, second = rate_force.traces
    ragged = replace(
        first,
        time=np.sort(np.random.default_rng(0).uniform(0, 8, first.time.size)),
    )
    broken = replace(
        rate_force, traces=(ragged, second), circuit=replace(Circuit(), V_S=1e-3)
    )
    report = write(tmp_path, broken)
    assert any("No I_DS" in text for text in report.findings.missing)
    assert "Not determined" in report.html.read_text(encoding="utf-8")
    assert sum(t.response.spikes for t in report.findings.run.results) > 30
    assert report.html.exists()


def test_runs_that_do_not_share_a_value_are_named():
    runs = [
        replace(modelled("pulses", [pulse(0.15)], circuit=Circuit(V_GS=V_GS)), run=name)
        for name, V_GS in (("S1", 1.40), ("S2", 1.38))
    ]
    found = identify_runs(runs, ("V_GS",))
    assert any("S2 alone gives V_GS" in text for text in found.warnings)


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
