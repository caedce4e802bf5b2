"""Plans: what is needed, left out, estimated and warned of."""

import json
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from peak_memory import peak, tells_peak

from tactile_lab.errors import LimitError, SceneError
from tactile_lab.planning.computing import slowness
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan, text
from tactile_lab.planning.ranges import expected
from tactile_lab.scene.load import load


def left_out(planned):
    return {what for what, _ in planned.leaves_out}


def test_the_demo_needs_four_channels_and_no_teslameter():
    planned = plan(load())
    assert [c.signal for c in planned.needs.channels] == [
        "V_C1",
        "V_C2",
        "V_K",
        "coil_current",
    ]
    assert planned.needs.stored == ("V_C1", "V_C2", "V_K", "coil_current")
    assert not planned.needs.field_meter
    assert "teslameter" in left_out(planned)
    cost = planned.estimate
    # 0.1 s of rest, and the time to switch the coil on, come before the trials' 18 s
    assert (cost.duration, cost.trials) == (pytest.approx(18.304609, abs=1e-6), 4)
    assert cost.samples_per_channel == 18_304_609
    assert cost.disk_raw == 18_304_609 * 4
    assert cost.peak_current == pytest.approx(0.997, abs=1e-3)
    assert 0 < cost.heat < cost.heat_budget == 30.0
    assert 15 < 1 / cost.update_interval < 40
    assert cost.step_current == pytest.approx(
        cost.peak_current / 0.25 * cost.update_interval
    )
    assert cost.resolution["V_K"] == pytest.approx(39e-3, abs=0.5e-3)
    assert cost.resolution["V_C1"] == pytest.approx(15.7e-3, abs=0.1e-3)


def test_what_a_run_takes_beside_its_samples_grows_with_them():
    """It was told as 1 to 3 MB of any run; a few vibrations took 6.4 MB."""
    least, most = plan(load(), preview=False).estimate.disk_beside
    assert least < 3.2e6 < most < 5e6  # measured
    keys = ["protocol.presentations_each=3", "protocol.count=2"]
    least, most = plan(load("vibration", keys), preview=False).estimate.disk_beside
    assert least < 6.35e6 < most < 10e6  # measured
    keys = ["protocol.duration=3600 s", 'record.signals=["V_C1"]']
    least, most = plan(load("monitor", keys), preview=False).estimate.disk_beside
    assert least > 1.8e9 * 6 / 512  # at 500 kS/s


def test_spikes_only_streams_v_k_and_stores_no_samples():
    planned = plan(load("spikes_only"))
    assert [c.signal for c in planned.needs.channels] == ["V_K"]
    assert planned.needs.stored == ()
    assert planned.needs.detect_on == "V_K"
    assert planned.estimate.samples_stored == planned.estimate.disk_raw == 0
    assert planned.preview.stages["V_K"] == 0
    assert planned.preview.stages["spikes"] > 0
    assert {"channel A: V_C1", "samples of V_K"} <= left_out(planned)


def test_v_c1_only_leaves_the_integrator_and_the_spikes_out():
    planned = plan(load("v_c1_only"))
    assert [c.signal for c in planned.needs.channels] == ["V_C1"]
    assert planned.needs.detect_on is None
    assert planned.preview.stages["V_C1"] > 0
    assert planned.preview.stages["V_C2"] == planned.preview.stages["spikes"] == 0
    assert planned.preview.stages["I_C"] == 0
    assert "spike detection" in left_out(planned)


def test_field_only_computes_nothing_of_the_model():
    planned = plan(load(None, ['record.signals=["field"]']))
    assert planned.preview is None
    assert planned.needs.field_meter
    assert planned.needs.channels == ()
    assert "scope" in left_out(planned)


def test_drain_current_is_derived_from_v_c1():
    needed = needs(load(None, ['record.signals=["I_DS"]']))
    assert needed.stored == ("V_C1",)


def test_what_no_instrument_has_is_left_out_and_that_is_said():
    """V_P was told as needed, and no run ever held it."""
    planned = plan(load(None, ['record.signals=["V_P", "V_C1"]']), preview=False)
    assert "V_P" in left_out(planned)
    assert "V_P" not in {what for what, _ in planned.uses}
    (said,) = [text for text in planned.warnings if "V_P" in text]
    assert said.startswith("V_P exists only in the model; a run leaves it out")


def warned(*overrides):
    return " ".join(plan(load(None, overrides), preview=False).warnings)


def assumed(*overrides):
    return " ".join(plan(load(None, overrides), preview=False).assumptions)


def test_amplitudes_need_a_faster_rate():
    told = assumed("record.sample_rate=1 MS/s")
    assert "counts and times to ±1 µs, not amplitudes" in told
    assert "not amplitudes" not in assumed("record.sample_rate=5 MS/s")
    assert "not amplitudes" not in assumed("record.sample_rate=0.2 MS/s"), "none seen"


def test_nothing_warns_for_good():
    """The demo had two warnings whatever was done: who always sees them reads none."""
    assert warned() == ""


def test_a_rate_that_misses_spikes_is_warned_of():
    assert "misses about 44 % of the spikes" in warned("record.sample_rate=0.2 MS/s")
    assert "misses" not in warned("record.sample_rate=0.5 MS/s")
    quiet = warned("record.sample_rate=0.2 MS/s", 'record.signals=["V_C1"]')
    assert "misses" not in quiet, "nobody looks for spikes there"


def test_noise_above_the_threshold_is_warned_of():
    assert "adds spikes" in warned("simulated.noise.V_K=200 mV")
    assert "about 7,700 times" in warned("simulated.noise.V_K=150 mV")
    assert "adds spikes" not in warned("simulated.noise.V_K=20 mV")


def test_hum_above_the_threshold_is_warned_of():
    """It crosses once a cycle where its peaks and the noise on them get there."""
    assert "mains hum of 480 mV" in warned("simulated.hum=480 mV")
    assert "hum" not in warned("simulated.hum=300 mV")
    assert "hum of" not in warned("simulated.hum=480 mV", "detect.threshold=auto")


def test_spikes_that_never_reach_the_threshold_are_warned_of():
    told = warned("detect.threshold=4 V")
    assert "no spike is high enough" in told and told.endswith("is 4 V. Lower it.")


def test_spikes_within_one_code_are_not_found_by_a_lower_threshold():
    """Behind its follower a spike had 16 mV, a code 39 mV: "Lower it" was told."""
    told = warned("sensor.C2=0.05 pF")
    assert "rises to 15.9 mV" in told and "One code of scope input C is 39.4" in told
    assert "Lower" not in told
    told = warned("sensor.C2=0.15 pF")
    assert "rises to 45 mV" in told and told.endswith("Lower it.")


def test_the_printed_a2_is_told_and_a_real_core_is_not():
    assert "Table 1's value as printed" in assumed()
    real = assumed("bench.magnet.A2=2.25e-4 m^2", 'protocol.levels=["10 mN"]')
    assert "printed" not in real


def test_a_calibration_of_the_field_still_rests_on_the_printed_a2(tmp_path):
    for unit, rows in (
        ("field_T", "-1,-0.011\n1,0.011"),
        ("force_N", "-1,-0.2\n1,0.2"),
    ):
        file = tmp_path / f"{unit}.csv"
        file.write_text(f"current_A,{unit}\n{rows}\n")
        told = assumed(f'bench.magnet.calibration="{file}"')
        assert ("Table 1's value as printed" in told) is (unit == "field_T")
        assert ("r = 6 mm, A1" in told) is (unit == "field_T")
        assert f"from the calibration {file.name}" in told


def test_a_real_bench_is_warned_of_the_printed_a2(tmp_path):
    """There the force may be a tenth; the simulated core is the printed one."""
    bench = tmp_path / "bench.toml"
    bench.write_text('[coil]\nport = "/dev/null"\nbaud = 19200\n[magnet]\nr = "6 mm"\n')
    made = plan(load(None, ['record.signals=["force"]'], bench=bench), preview=False)
    assert any("Table 1's value as printed" in text for text in made.warnings)


def test_a_real_core_refuses_the_demo_and_names_what_it_reaches():
    with pytest.raises(LimitError, match=r"reachable is −40\.12 mN to 40.12 mN"):
        plan(load(None, ["bench.magnet.A2=2.25e-4 m^2"]))


@pytest.fixture
def fixed_ranges(tmp_path):
    """The built-in bench with the ranges it has."""
    own = resources.files("tactile_lab.scene") / "simulated_bench.toml"
    file = tmp_path / "fixed.toml"
    file.write_text(own.read_text().replace("auto_range = true", ""))
    return str(file)


@pytest.mark.parametrize("preview", [True, False], ids=["plan", "run"])
def test_a_signal_that_will_leave_its_range_is_warned_of(fixed_ranges, preview):
    pull = ['protocol.levels=["100 mN","-100 mN"]']
    scene = load("bipolar", pull, bench=fixed_ranges)
    told = " ".join(plan(scene, preview=preview).warnings)
    assert "V_C1 will leave its channel's range, 500 mV to 4.5 V" in told


def test_a_range_is_widened_where_the_model_expects_more(fixed_ranges):
    """Such as after a long push; demo and `bipolar` keep the finer one."""

    def ranges(name):
        made = plan(load(name), preview=False)
        assert "leave" not in " ".join(made.warnings)
        return {c.signal: c.range for c in made.needs.channels}

    assert ranges("demo")["V_C1"] == ranges("bipolar")["V_C1"] == 2.0
    assert ranges("hold_10s")["V_C1"] == 5.0
    assert ranges("hold_10s")["V_C2"] == 2.0
    # without a force nothing is expected beyond
    assert ranges("monitor")["V_C1"] == 2.0


def test_spikes_that_leave_the_range_of_v_k_are_foreseen(fixed_ranges):
    bench = Path(fixed_ranges)
    text = bench.read_text()
    assert "V_K" not in " ".join(plan(load(bench=fixed_ranges)).warnings)
    bench.write_text(
        text.replace('input = "C"\nrange = "5 V"', 'input = "C"\nrange = "2 V"')
    )
    told = " ".join(plan(load(bench=fixed_ranges), preview=False).warnings)
    assert "V_K rises to 2.67 V at a spike, scope input C sees −2 V to 2 V" in told


def test_a_coil_current_beyond_its_channel_is_foreseen():
    """It was cut off, dated no steps, and seemed another than the source's."""
    shunt = {"signal": "coil_current", "input": "D", "range": 0.05, "shunt": 0.1}
    scene = {
        "bench.scope.channels": [shunt],
        "record.signals": ["coil_current"],
        "protocol.levels": ["-120 mN", "60 mN"],
    }
    told = " ".join(plan(load("demo", scene), preview=False).warnings)
    assert "current will be −598.2 mA to 299.1 mA, scope input D sees −500 mA" in told
    scene["protocol.levels"] = ["-90 mN", "60 mN"]
    assert "sees" not in " ".join(plan(load("demo", scene), preview=False).warnings)


def test_a_short_push_in_a_long_run_is_expected_as_deep_as_it_goes():
    """Of 20 s of scans V_C1 lies below 0.5 V for 5 ms, once."""
    scan = [
        "protocol.period=3 mm",
        'protocol.speeds=["30 mm/s"]',
        "protocol.lasts=1.2 s",
    ]
    made = plan(load("texture", scan), preview=False)
    (channel,) = [c for c in made.needs.channels if c.signal == "V_C1"]
    assert channel.span[0] < 0.468


def test_a_force_beyond_all_ranges_is_warned_of():
    far = ['protocol.levels=["350 mN"]', "protocol.ramp=0.4 s"]
    (channel,) = [
        c
        for c in plan(load(None, far), preview=False).needs.channels
        if c.signal == "V_C1"
    ]
    assert channel.span[0] < 0.3 and channel.span[1] > 4.5


def test_a_rate_no_scope_has_is_refused():
    with pytest.raises(LimitError, match=r"sample interval.*record\.sample_rate"):
        plan(load(None, ["record.sample_rate=1 TS/s"]))
    assert "guaranteed" in warned("record.sample_rate=10 MS/s")


def test_an_unwired_signal_and_a_missing_meter_are_refused(tmp_path):
    bench = tmp_path / "b.toml"
    bench.write_text(
        'simulated = true\n[coil]\n[magnet]\nr = "6 mm"\n'
        '[[scope.channels]]\nsignal = "V_C1"\ninput = "A"\n'
    )
    with pytest.raises(SceneError, match="wires it to no"):
        plan(load(None, bench=str(bench)))
    with pytest.raises(SceneError, match="field_meter"):
        plan(load(None, ['record.signals=["field"]'], bench=str(bench)))


def test_without_v_k_spikes_are_found_as_resets(tmp_path):
    bench = tmp_path / "b.toml"
    bench.write_text(
        'simulated = true\n[coil]\n[magnet]\nr = "6 mm"\n'
        '[[scope.channels]]\nsignal = "V_C2"\ninput = "A"\n'
    )
    planned = plan(load("spikes_only", bench=str(bench)), preview=False)
    assert planned.needs.detect_on == "V_C2"
    assert any("resets of V_C2, within one" in line for line in planned.warnings)


def test_a_threshold_outside_the_channel_is_refused():
    with pytest.raises(
        SceneError, match=r"threshold 6 V .* Lower it, or take a larger"
    ):
        plan(load(None, ["detect.threshold=6 V"]))


def test_it_says_how_well_samples_are_dated_where_no_shunt_shows_the_current():
    """Nothing was said of it: they were dated to 46 ms, not to 0.5."""
    seen = assumed('record.signals=["V_C1", "V_K", "spikes"]')
    assert "dated against the force within 45" in seen
    assert "clocks:" not in assumed()
    assert "clocks:" not in assumed('record.signals=["force"]')


def test_it_says_where_hum_or_coarse_codes_hide_the_steps_from_the_shunt(tmp_path):
    """Nothing was said of it: the run then dated its spikes to 45 ms, not to 0.5."""
    hum = assumed("simulated.hum=20 mV")
    assert "it shows those above 620 mA, by its noise and hum" in hum
    assert "dated against the force within 45" in hum
    assert "within 1.3 ms, not 500 µs" in assumed("simulated.hum=4 mV")
    bench = tmp_path / "b.toml"
    bench.write_text(
        'simulated = true\n[coil]\n[magnet]\nr = "6 mm"\n'
        + "".join(
            f'[[scope.channels]]\nsignal = "{signal}"\ninput = "{input_}"\n'
            f'range = "{range_}"\n'
            for signal, input_, range_ in (("V_C1", "A", "5 V"), ("V_K", "B", "5 V"))
        )
        + '[[scope.channels]]\nsignal = "coil_current"\ninput = "D"\n'
        'range = "5 V"\nshunt = "0.1 Ohm"\n'
    )
    keys = ['record.signals=["V_C1", "V_K", "coil_current", "spikes"]']
    told = plan(load(None, keys, bench=str(bench)), preview=False).assumptions
    assert any("those above 750 mA, two of its codes, and 5" in line for line in told)


def test_assumptions_are_stated():
    told = " ".join(plan(load(), preview=False).assumptions)
    for fact in (
        "r = 6 mm",
        "A2 = 2250 mm²",
        "11 mT per ampere",
        "19200 baud",
        "200.6 mN",
    ):
        assert fact in told


def test_json_is_plain_and_complete():
    data = plan(load("spikes_only")).to_dict()
    assert json.loads(json.dumps(data, allow_nan=False)) == data
    assert data["coil_update"]["rate_Hz"] == 1 / data["coil_update"]["interval_s"]


def test_text_names_both_lists():
    shown = text(plan(load("v_c1_only"), preview=False))
    assert "needs\n" in shown
    assert "leaves out\n" in shown
    assert "REAL" not in shown


def test_no_force_means_no_coil():
    planned = plan(load("monitor"))
    assert not planned.needs.coil
    assert "coil source" in left_out(planned)
    assert planned.to_dict()["coil_update"] is None
    assert "set-points" not in text(planned)


def test_a_bench_without_a_coil_can_watch_but_not_push(tmp_path):
    bench = tmp_path / "b.toml"
    bench.write_text(
        'simulated = true\n[magnet]\nr = "6 mm"\n'
        '[[scope.channels]]\nsignal = "V_K"\ninput = "A"\n'
    )
    watch = ['record.signals=["spikes"]']
    assert not plan(load("monitor", watch, bench=str(bench)), preview=False).needs.coil
    with pytest.raises(SceneError, match=r"has no \[coil\]"):
        plan(load("demo", watch, bench=str(bench)))


ONE_SIGN = """
name = "one sign"
simulated = true
[coil]
dialect = "aim-tti-pl"
[coil.limits]
current = "1.5 A"
[magnet]
r = "6 mm"
B2_per_ampere = "{slope} mT/A"
"""


@pytest.mark.parametrize(
    ("slope", "given", "refused", "reach"),
    [(11, 100, -100, "0 N to 300.9 mN"), (-11, -100, 100, "−300.9 mN to 0 N")],
)
def test_a_source_that_cannot_reverse_is_asked_for_one_sign_only(
    tmp_path, slope, given, refused, reach
):
    bench = tmp_path / "bench.toml"
    bench.write_text(ONE_SIGN.format(slope=slope))

    def scene(level):
        levels = f'protocol.levels=["{level} mN"]'
        return load("demo", [levels, 'record.signals=["force"]'], str(bench))

    assert plan(scene(given), preview=False).estimate.peak_current > 0.4
    with pytest.raises(LimitError) as why:
        plan(scene(refused), preview=False)
    assert reach in str(why.value) and "one sign only" in str(why.value)
    assert "−498" in str(why.value)  # mA


def test_what_a_run_computes_is_the_sum_of_its_parts_and_each_can_be_left_out():
    whole = plan(load(None))
    cost, saved = whole.computing, {s.what: s for s in whole.savings}
    assert cost.seconds == pytest.approx(sum(cost.time.values()))
    less = plan(load(None, ["record.compare=false"]))
    assert "model beside the run" not in less.computing.time
    left = cost.seconds - less.computing.seconds
    assert saved["model beside the run"].seconds == pytest.approx(left)
    signals = [s for s in whole.scene.record.signals if s != "V_C2"]
    without = plan(load(None, [f"record.signals={json.dumps(signals)}"]))
    left = whole.estimate.disk - without.estimate.disk
    assert saved["V_C2"].disk == pytest.approx(left, abs=1)
    left = cost.seconds - without.computing.seconds
    assert saved["V_C2"].seconds == pytest.approx(left)
    assert without.computing.memory < cost.memory


SHORT_SPIKES = ["sensor.C2=10 pF", "sensor.V_GS=1.45 V", "protocol.level=300 mN"]
"""Six thousand, of which most fall between two samples."""
LONG = "protocol.hold=1200 s"


@pytest.mark.parametrize(
    ("keys", "seconds", "memory"),
    [
        (["protocol.level=5 mN", LONG, "record.sample_rate=100 kS/s"], 43.1, 399e6),
        (["protocol.level=118 mN", LONG, 'record.signals=["spikes"]'], 27.6, 354e6),
        (SHORT_SPIKES, 6.1, 383e6),
    ],
    ids=["twenty minutes", "one channel", "uncounted spikes"],
)
def test_what_long_holds_and_many_spikes_cost_is_foreseen(keys, seconds, memory):
    """As measured, on a computer of 1: what rests or is not counted costs less."""
    cost = plan(load("hold_10s", keys)).computing
    assert 1 / 1.5 < cost.seconds / slowness() / seconds < 1.5
    assert 1 / 1.5 < cost.memory / memory < 1.5


def test_what_a_force_that_never_rests_costs_is_foreseen(tmp_path):
    """Its model is solved whole, with all its set-points; measured as those above."""
    time = np.arange(0, 300, 0.05)
    force = 0.09 + 0.08 * np.sin(1.3 * time) * np.sin(0.11 * time)
    rows = [f"{t:.3f},{f:.6f}" for t, f in zip(time, force, strict=True)]
    file = tmp_path / "force.csv"
    file.write_text("\n".join(["time_s,force_N", *rows]), encoding="utf-8")
    keys = [f"protocol.file={file}", "record.sample_rate=50 kS/s"]
    cost = plan(load("waveform", keys)).computing
    assert 1 / 1.5 < cost.seconds / slowness() / 39.1 < 1.5
    assert 1 / 1.5 < cost.memory / 582e6 < 1.5


def test_what_a_source_meter_and_the_fits_of_a_trim_cost_is_foreseen():
    """Without a preview too; it took 5.7 s on a computer of 0.62 (plan-figures.md)."""
    planned = plan(load("threshold_trim"))
    cost = planned.computing
    assert 9.2 / 1.5 < cost.seconds / slowness() < 9.2 * 1.5
    assert planned.preview is None and planned.timeline.spikes > 0
    assert "source meters" in cost.time


def test_a_search_is_foreseen_where_the_scene_has_its_bench_deviate():
    planned = plan(load("surprise"))
    cost, saved = planned.computing, {s.what: s for s in planned.savings}
    assert cost.time["search for a cause"] > 1.4 * slowness()
    less = plan(load("surprise", ["record.compare=false"])).computing
    left = cost.seconds - less.seconds
    assert saved["model beside the run"].seconds == pytest.approx(left)
    assert "search for a cause" not in less.time
    assert "search for a cause" not in plan(load()).computing.time
    for other in ("specimen=9", "hysteresis=50 mA", "warming=5 K"):
        found = plan(load(None, [f"simulated.{other}"])).computing
        assert "search for a cause" in found.time
    saturated = plan(load("surprise", ["sensor.saturation=true"])).computing
    assert "search for a cause" not in saturated.time  # none is sought there


def test_a_drain_current_keeps_the_v_c1_that_it_is_derived_from():
    """To leave V_C1 out of the scene alone saves nothing: its samples stay stored."""
    for signals in (["V_C1", "I_DS", "V_C2"], ["I_DS", "V_C2"]):
        planned = plan(load(None, [f"record.signals={json.dumps(signals)}"]))
        assert dict(planned.uses)["I_DS"] == "derived from V_C1 by Eq. (16)"
        assert not {"I_DS", "channel I_DS"} & left_out(planned)
        told = {saving.how for saving in planned.savings}
        names = [name for name in ("V_C1", "I_DS") if name in signals]
        kept = " and ".join(f'"{name}"' for name in names)
        assert f"without {kept} in record.signals" in told
        without = sorted(set(signals) - set(names))
        less = plan(load(None, [f"record.signals={json.dumps(without)}"]))
        assert less.needs.stored == ("V_C2",)


def test_a_link_too_slow_for_an_instrument_s_name_is_warned_of():
    """A plan at 1200 baud had no doubt, and the run ended as it opened the source."""
    slow = "bench.coil.baud=1200"
    told = " ".join(plan(load("demo", [slow])).warnings)
    assert "[coil] 1200 baud: 40 characters" in told and "330 ms" in told
    patient = " ".join(plan(load("demo", [slow, "bench.coil.timeout=0.7 s"])).warnings)
    quicker = " ".join(plan(load("demo", ["bench.coil.baud=2400"])).warnings)
    assert "characters" not in patient + quicker


def test_hum_that_cuts_a_signal_off_is_planned_for(fixed_ranges):
    """The plan knew of 60 mV; the run had V_C1 cut off, and refused its gains."""
    loud = ["simulated.hum=60 mV", "protocol.count=2", "protocol.lowest=0.3 Hz"]
    told = " ".join(plan(load("sine_sweep", loud, bench=fixed_ranges)).warnings)
    assert "V_C1 will leave its channel's range, 500 mV to 4.5 V" in told
    assert "noise and hum 75 mV more" in told
    wider = next(c for c in needs(load("sine_sweep", loud)).channels if c.input == "A")
    assert wider.range > 2.0
    quiet = next(c for c in needs(load("sine_sweep")).channels if c.input == "A")
    assert quiet.range == 2.0


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        ("threshold_trim", "V_GS is another from trial to trial"),
        ("wiring_check", "the probes are moved"),
        ("monitor", "no current is applied"),
        ("calibrate_field", "nothing recorded is predicted by it"),
    ],
)
def test_why_no_model_is_compared_is_told(scene, why):
    planned = plan(load(scene))
    assert dict(planned.leaves_out)["model beside the run"].startswith(why)
    assert "model beside the run" not in planned.computing.time


def test_no_error_of_spike_times_is_told_where_no_spike_is_expected():
    told = text(plan(load("monitor")))
    assert "spikes     0 by the model from the first trial on" in told
    assert "spike times within" not in told and "V_C1 within" in told


def test_spikes_while_nothing_is_streamed_are_told_apart():
    """Demagnetising pushes the sensor too; a run finds no spike of that."""
    planned = plan(load("hold_10s", ["protocol.demagnetise=true"]))
    assert planned.spikes == plan(load("hold_10s")).spikes == 37
    assert planned.to_dict()["preview"]["spikes"] == 37
    others = planned.preview.spike_times.size - 37
    assert others > 0
    told = f"37 by the model from the first trial on, {others} more while nothing is"
    assert told in text(planned)


def test_a_rate_that_node_a_does_not_need_is_told():
    """The same V_C1 at a hundredth of the disk; nothing is said where that is so."""
    (told,) = plan(load("v_c1_only", ["record.sample_rate=1 MS/s"])).suggestions
    assert "V_C1 at 10 kS/s, not 1 MS/s" in told
    assert 'record.sample_rate = "10 kS/s"' in told
    assert plan(load("v_c1_only")).suggestions == ()
    assert not any("kS/s" in line for line in plan(load(None)).suggestions)


@tells_peak
def test_ranges_are_chosen_in_the_memory_of_a_slice(monkeypatch):
    """The run of an hour of `repeat` began with 230 MB for that alone."""
    scene = load("repeat", {"protocol.count": 150})
    planned = plan(scene, preview=False)
    channels = planned.needs.channels
    taken, found = [], []
    for points in (500, 500, 10**6):  # what is taken for the first time stays
        monkeypatch.setattr("tactile_lab.model.slices.POINTS", points)
        most, told = peak(lambda: expected(scene, channels, planned.timeline))
        taken.append(most)
        found.append({name: (one.low, one.high) for name, one in told.items()})
    assert found[0] == found[1] == found[2]
    assert taken[1] < 0.3 * taken[2]
