"""What a report concludes from runs of the other protocols, on plain values."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from modelled_runs import modelled, pulse

from protocols.calibrate_field import CalibrateField
from protocols.force_check import ForceCheck
from protocols.sine_sweep import SineSweep
from tactile_lab.calibration import read_calibration
from tactile_lab.lag import Lag
from tactile_lab.magnetics import ForceUncertainty
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.model.circuit import Circuit
from tactile_lab.report.findings import find
from tactile_lab.report.overview import overview
from tactile_lab.report.results import results
from tactile_lab.report.run_data import RunData
from tactile_lab.report.table import trials_table
from tactile_lab.report.write import write
from tactile_lab.store.facts import facts, grouped
from tactile_lab.store.folder import write_json
from tactile_lab.store.summary import RunSummary
from tactile_lab.waveform import Waveform

LEVELS = (0.05, 0.1)
CAME = np.array([[0.0, 0.0], [0.95, 0.25]])
"""A current that stood from 0.95 s on, s and A."""


def test_repeat_tells_the_decrement():
    run = modelled("repeat", [pulse(0.16) for _ in range(4)])
    found = find(run)
    rates = found.conclusion.values["peak_rates_Hz"]
    assert rates == sorted(rates, reverse=True)
    assert "Highest rate in the hold, from one" in found.conclusion.sentences[0]
    assert [plot.name for plot in found.answers] == ["summary"]


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
    factor = "force read over Eq. (2) ±0.015 = readings 0.015"
    assert f"{factor}; force not stated" in "".join(find(read).budget_lines)
    assert "not stated" not in find(known).conclusion.budget_line
    assert values["eq2_uncertainty_95"] == pytest.approx(0.1 * values["read_over_eq2"])


@pytest.mark.parametrize(
    ("levels", "readings"), [((0.05,), (0.0051,)), ((0.05, 0.1), (0.05, 0.1))]
)
def test_readings_without_scatter_are_no_exact_factor(levels, readings):
    """One was told as "102 m (95 %) times", known to ±0."""
    run = modelled("force_check", [pulse(level) for level in levels])
    read = replace(run, protocol=ForceCheck(levels=levels, readings=readings))
    found = find(read).conclusion
    assert "95 %" not in found.sentences[0] and "±" not in found.sentences[0]
    assert "nothing of how far they are off" in found.sentences[0]
    assert found.values["read_over_eq2_uncertainty_95"] is None
    assert not found.budget_line


def test_a_field_that_has_not_settled_tells_no_force():
    """A hold of 0.3 s told forces to ±1.2 mN of what its table called 0 readings."""
    run = modelled("force_check", [pulse(0.05)])
    at = np.arange(-1.0, run.duration, 0.1)
    read = replace(run, field=np.column_stack([at, at]), newtons_per_tesla=18.0)
    (trial,) = run.trials
    short = replace(read, trials=(replace(trial, hold=(1.0, 1.25)),), current=CAME)
    found = find(short)
    assert found.conclusion.values["F_minus_F0_by_field_N"] == [None]
    assert found.missing[0].startswith("No F(I) of 50 mN: the field was not read once")
    assert find(replace(short, trials=run.trials)).conclusion.values[
        "F_minus_F0_by_field_N"
    ] != [None], "in a hold of 1 s it was"


def test_a_teslameter_that_hangs_is_no_exact_one():
    """Its force stood as "0 N" without an uncertainty."""
    run = modelled("force_check", [pulse(0.05)])
    at = np.arange(-1.0, run.duration, 0.2)
    hangs = np.column_stack([at, np.full(at.size, 3e-3)])
    found = find(replace(run, field=hangs, newtons_per_tesla=18.0)).conclusion
    (band,) = found.values["F_minus_F0_uncertainty_N_95"]
    assert found.values["F_minus_F0_by_field_N"] == [pytest.approx(0, abs=1e-9)]
    assert band is not None and 20e-6 < band < 1e-3
    assert "F(0) in the second before each trial" in found.sentences[0]
    (budget,) = found.budgets.values()
    assert budget.whole == band == budget.parts["readings"]
    assert budget.text.endswith("; force, meter not stated")


def test_monitor_tells_the_distance_to_threshold():
    quiet = Waveform.through([(0.0, 0.0), (3.0, 0.0)])
    run = modelled("monitor", [("part 1", 0.0, quiet, False)])
    distance = find(run).conclusion.values["distance_to_threshold_V"]
    assert distance == pytest.approx(4.347 - 3.974, abs=2e-3)
    drawn = overview(replace(run, searched=True))
    assert "Rate" not in [panel.label for panel in drawn.panels], "there is none"
    texts = [(g.text, g.above) for panel in drawn.panels for g in panel.guides]
    assert ("fires below 3.974 V", False) in texts
    coded = tuple(replace(trace, code=16e-3) for trace in run.traces)
    biased = {"follower": replace(Circuit(), I_bias=20e-12)}
    told = find(replace(run, traces=coded, displaced=biased)).conclusion
    half = told.values["distance_to_threshold_uncertainty_V_95"]
    assert 16e-3 < half < 24e-3
    line, *_ = find(replace(run, traces=coded, displaced=biased)).budget_lines
    assert line.startswith("Error budget (95 % or bound): V_C1 to its critical ±")
    assert re.search(r"= converter 1\d mV, follower 2.1 mV; temperature not", line)
    assert told.budgets["V_C1 to its critical"].whole == half
    assert "mV above the critical" in told.sentences[0]
    assert told.sentences[0].endswith("the sensor is silent at rest.")
    # the very V_GS at which it fires, but for 10 mV of V_C1
    near = replace(Circuit(), V_GS=1.5378)
    close = modelled("monitor", [("part 1", 0.0, quiet, False)], circuit=near)
    told = find(replace(close, traces=tuple(
        replace(trace, code=16e-3) for trace in close.traces
    ))).conclusion  # fmt: skip
    fires = overview(modelled(
        "monitor", [("part 1", 0.0, quiet, False)], circuit=Circuit(V_GS=1.57)
    ))  # fmt: skip
    # of a sensor that fires V_C1 lies below, where it crossed the words
    assert [g.above for p in fires.panels for g in p.guides if g.text] == [True]
    assert 0 < told.values["distance_to_threshold_V"] < 16e-3
    assert told.sentences[0].endswith("fires at rest cannot be told.")


def swung(frequency, amplitude, *, cycles, label, **parameters):
    """A modelled run of one sine, held all of the time."""
    phase = np.arange(0, 24 * cycles + 1) / 24
    wave = Waveform(phase / frequency, amplitude * np.sin(2 * np.pi * phase))
    run = modelled(
        "sine_sweep", [(label, None, wave, False)], searched=False,
        parameters=parameters,
    )  # fmt: skip
    trial = replace(run.trials[0], hold=(0.0, cycles / frequency))
    return replace(run, trials=(trial,))


def test_sine_sweep_gives_the_gain_of_small_forces():
    run = swung(0.5, 0.005, cycles=4, label="0.5 Hz", lowest=0.5, highest=0.5, count=1)
    told = find(run).conclusion
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


def test_a_lag_that_is_not_quite_known_is_in_gain_and_phase():
    """At 20 Hz a millisecond of it is 4 % of the gain, of which nothing was told."""
    run = swung(
        20.0, 0.005, cycles=9, label="20 Hz", lowest=20.0, highest=20.0, count=1
    )
    believed, true = (
        replace(run, force=Lag(eddy=eddy).follow(run.force)[0], lag=Lag(eddy=eddy))
        for eddy in (3e-3, 4e-3)
    )
    stated = find(replace(believed, lag_uncertainty=1e-3)).conclusion
    alone, truth = find(believed).conclusion, find(true).conclusion
    ((told,), (bare,), (truly,)) = (
        one.plain["V_C1_over_force"] for one in (stated, alone, truth)
    )
    for what in ("gain_V_per_N", "phase_rad"):
        off = abs(truly[what]["value"] - told[what]["value"])
        half = told[what]["high_95"] - told[what]["value"]
        scatter = bare[what]["high_95"] - bare[what]["value"]
        assert half == pytest.approx(math.hypot(off, scatter), rel=0.03)
        assert off > 2 * scatter, "nothing but the lag explains it"


def test_a_sine_that_cannot_be_told_from_drift_is_told_as_unknown():
    """Of one cycle the model's own gain was told 0.7 V/N where it is 2.4."""
    one = {"lowest": 0.5, "highest": 0.5, "count": 1}
    told = find(swung(0.5, 0.005, cycles=1, label="0.5 Hz", **one))
    assert not told.conclusion.values.get("V_C1_over_force")
    assert told.missing[0].startswith("No gain at 0.5 Hz: fewer than 1.4 cycles")
    with pytest.raises(ValueError, match="greater than or equal to 2"):
        SineSweep(cycles=1)


def test_a_sine_is_looked_at_with_its_frequency_and_not_with_its_label():
    frequency = math.sqrt(0.03 * 0.5)
    run = swung(
        frequency, 0.01, cycles=2, label="0.122 Hz", lowest=0.03, highest=0.5, count=3
    )
    (found,) = find(run).conclusion.plain["V_C1_over_force"]
    # Eqs. (7), (8) and (16), small signal; by 0.122 Hz it was 0.07 rad off
    circuit, turn = Circuit(), 2 * np.pi * frequency
    resistance = 1 / (1 / circuit.R1 + 1 / circuit.R2)
    leak = math.atan(1 / (turn * circuit.tau))
    late = math.atan(turn * resistance * circuit.C1)
    assert found["frequency_Hz"] == pytest.approx(frequency)
    assert found["phase_rad"]["value"] == pytest.approx(leak - late - np.pi, abs=5e-3)
    assert run.trials[0].hold[0] == 0.0, "a sine is at no level that it comes to"


def test_what_a_report_says_of_adaptation_finds_its_run(tmp_path):
    held = Waveform.pulse(0.16, ramp=0.01, hold=10.0)
    run = modelled("pulses", [("160 mN", 0.16, held, False)])
    trials = results(find(run))["trials"]
    write_json(tmp_path / "results.json", {"trials": trials})
    found = grouped(facts(RunSummary(folder=tmp_path, name="pushed")))
    tau = trials[0]["circuit_adaptation"]["tau_s"]["value"]
    assert found["tau"] == [("tau", tau, "", "s", "160 mN")]
