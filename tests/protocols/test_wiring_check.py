"""Each mistake in the wiring, made on the simulated bench, is named by its verdict."""

import json
import re
from dataclasses import replace

import pytest

from sim_backend.bench import open_bench, options
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import SceneError
from tactile_lab.planning.needs import needs
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.results import results
from tactile_lab.scene.load import load

SHORT = ("protocol.hold=0.4 s", "record.sample_rate=20 kS/s")


def checked(folder, *overrides, **faults):
    """The conclusion of a wiring check of a bench with those faults."""
    scene = load("wiring_check", (*SHORT, *overrides))
    world = replace(options(scene), **faults)
    done = Execution(
        scene, folder, bench=open_bench(scene, needs(scene), world=world)
    ).run()
    assert done.state is RunState.COMPLETE, done.reason
    findings = find(read(done.folder))
    values = json.loads(json.dumps(results(findings)))["conclusion"]
    return values, (*findings.conclusion.sentences, *findings.budget_lines)


def test_a_right_bench_passes_and_tells_its_v_gs(tmp_path):
    values, sentences = checked(tmp_path)
    channels = values["channels"]
    assert set(channels) == {"V_C1", "V_C2", "V_K", "coil_current", "field"}
    assert all(c["ok"] for c in channels.values()), channels
    for signal in ("V_C1", "V_C2", "V_K"):
        assert channels[signal]["gain"] == pytest.approx(1, abs=0.02)
        assert abs(channels[signal]["offset_V"]) < 0.025
        assert channels[signal]["hum_V"] < 0.01
    # a probe on 0 V has none of the noise that smooths V_K's steps at rest
    assert channels["V_K"]["offset_uncertainty_V_95"] > 0.019
    # the whole window shows 0 V, nothing of V_S that comes after it: half a code
    assert channels["V_K"]["offset_V"] == pytest.approx(-10 / 508, rel=1e-6)
    gate = values["V_GS"]
    *_, budget = sentences
    assert re.search(r"V_GS ±\S+ mV = converter \S+ mV; temperature not", budget)
    assert gate["low_95"] < 1.4 < gate["high_95"]
    assert gate["high_95"] - gate["low_95"] < 0.1  # tens of mV: 8 bits over 10 V
    assert any("threshold_search" in s for s in sentences)
    # it held the truth in 1000 of 1000 runs as a "95 %" interval
    assert gate["is_bound"] and any("a bound rather than" in s for s in sentences)
    assert not any("95 %)" in s for s in sentences if "V_GS of" in s)


@pytest.mark.parametrize(
    ("faults", "named"),
    [
        ({"wired": {"A": "V_C2", "B": "V_C1"}},
         {"V_C1": "swapped with V_C2", "V_C2": "swapped with V_C1"}),
        ({"wired": {"B": "V_K", "C": "V_C2"}},
         {"V_C2": "swapped with V_K", "V_K": "swapped with V_C2"}),
        ({"wired": {"A": "coil_current", "D": "V_C1"}},
         {"V_C1": "swapped with coil_current",
          "coil_current": "another signal's probe"}),
        ({"inverted_coil": True},
         {"V_C1": "coil is inverted", "V_C2": "coil is inverted", "field": "reversed"}),
        ({"open_inputs": ("A",)}, {"V_C1": "open probe"}),
        ({"open_inputs": ("C",)}, {"V_K": "open probe"}),
        ({"open_inputs": ("D",)}, {"coil_current": "not connected"}),
        ({"attenuation": {"A": 10.0}}, {"V_C1": "10 times too little"}),
        ({"attenuation": {"B": 0.1}}, {"V_C2": "times too much"}),
        ({"attenuation": {"D": 10.0}}, {"coil_current": "10 times too little"}),
        ({"attenuation": {"D": 1.9}}, {"coil_current": "52 % of it: check the shunt"}),
    ],
    ids=lambda value: next(iter(value)) if isinstance(value, dict) else "",
)  # fmt: skip
def test_each_fault_is_named_and_nothing_else(tmp_path, faults, named):
    values, sentences = checked(tmp_path, **faults)
    wrong = {s: c["text"] for s, c in values["channels"].items() if not c["ok"]}
    assert set(wrong) == set(named), wrong
    for signal, text in named.items():
        assert text in wrong[signal]
    assert ("V_GS" in values) == ("V_C1" not in named)
    assert sum("WRONG" in s for s in sentences) == len(named)


def test_the_mains_hum_of_each_channel_is_told_in_millivolt(tmp_path):
    values, sentences = checked(tmp_path, hum=60e-3)
    for signal in ("V_C1", "V_C2", "V_K", "coil_current"):
        hum = values["channels"][signal]["hum_V"]
        assert hum == pytest.approx(60e-3, abs=20e-3)  # half a code is 20 mV
    assert any("V_C1" in s and "50 Hz hum" in s and "mV" in s for s in sentences)


def test_a_follower_s_offset_shows_in_v_gs_not_in_a_verdict(tmp_path):
    values, _ = checked(tmp_path, offset=30e-3)
    assert all(c["ok"] for c in values["channels"].values())


def test_a_scene_can_make_the_mistakes_itself(tmp_path):
    scene = load("wiring_check", (
        *SHORT, 'simulated.swapped=["V_C1", "V_C2"]', 'simulated.open_probes=["V_K"]',
        "simulated.attenuation.coil_current=10.0", "simulated.inverted_coil=true",
    ))  # fmt: skip
    assert load_again(scene, tmp_path).simulated == scene.simulated
    done = Execution(scene, tmp_path).run()
    channels = find(read(done.folder)).conclusion.values["channels"]
    assert "swapped with V_C2" in channels["V_C1"]["text"]
    assert "open probe" in channels["V_K"]["text"]
    assert "10 times too little" in channels["coil_current"]["text"]
    assert "reversed" in channels["field"]["text"]


def load_again(scene, folder):
    path = folder / "again.toml"
    path.write_text(scene.to_toml())
    return load(path)


@pytest.mark.parametrize("mistake", ['swapped=["V_C1"]', 'open_probes=["V_C11"]'])
def test_a_mistake_that_cannot_be_made_is_refused(mistake):
    with pytest.raises(SceneError, match=mistake.partition("=")[0]):
        load("wiring_check", [f"simulated.{mistake}"])


BARE = """
name = "no meter, no shunt"
simulated = true
[coil]
[magnet]
r = "6 mm"
[scope]
[[scope.channels]]
signal = "V_C1"
input = "A"
[[scope.channels]]
signal = "V_K"
input = "B"
"""


def test_what_the_bench_does_not_measure_is_not_checked(tmp_path):
    (tmp_path / "bare.toml").write_text(BARE)
    scene = load("wiring_check", SHORT, bench=str(tmp_path / "bare.toml"))
    done = Execution(scene, tmp_path / "runs").run()
    assert done.state is RunState.COMPLETE, done.reason
    channels = find(read(done.folder)).conclusion.values["channels"]
    assert {name: c["ok"] for name, c in channels.items()} == {
        "V_C1": True,
        "V_K": True,
    }


def test_a_force_check_needs_neither_teslameter_nor_shunt(tmp_path):
    (tmp_path / "bare.toml").write_text(BARE)
    scene = load("force_check", bench=str(tmp_path / "bare.toml"))
    assert scene.record.signals == ("force",)


def test_without_calibration_swapped_channels_are_still_named(tmp_path):
    values, _ = checked(
        tmp_path, "protocol.calibrate=false", wired={"A": "V_C2", "B": "V_C1"}
    )
    assert "swapped with V_C2" in values["channels"]["V_C1"]["text"]
    assert values["channels"]["V_K"]["gain"] is None


def without_hands(scene):
    return replace(open_bench(scene, needs(scene)), place_probes=None)


def test_where_nobody_can_move_the_probes_it_is_refused_at_once(tmp_path):
    scene = load("wiring_check", SHORT)
    with pytest.raises(SceneError, match=r"needs a person.*calibrate = false"):
        Execution(scene, tmp_path / "runs", bench=without_hands(scene))
    assert not (tmp_path / "runs").exists()


def test_a_person_is_asked_for_each_place_in_turn(tmp_path):
    scene = load("wiring_check", ("protocol.hold=0.2 s", "record.sample_rate=10 kS/s"))
    bench = open_bench(scene, needs(scene))
    move, asked = bench.place_probes, []

    def ask(text):
        asked.append(text)
        move({1: "ground", 2: "supply", 3: "circuit"}[len(asked)])

    bench = replace(bench, place_probes=None)
    done = Execution(scene, tmp_path, bench=bench, ask=ask).run()
    assert done.state is RunState.COMPLETE, done.reason
    assert ["0 V" in a or "V_S" in a for a in asked] == [True, True, False]
    channels = find(read(done.folder)).conclusion.values["channels"]
    assert channels["V_C1"]["ok"], channels


def test_a_person_who_goes_away_ends_the_run_safely(tmp_path):
    scene = load("wiring_check", ("protocol.hold=0.2 s", "record.sample_rate=10 kS/s"))
    bench = replace(open_bench(scene, needs(scene)), place_probes=None)

    def gone(text):
        raise EOFError("the terminal was closed")

    done = Execution(scene, tmp_path, bench=bench, ask=gone).run()
    assert done.state is RunState.FAULTED
    assert "the terminal was closed" in done.reason
    assert done.off.verified
