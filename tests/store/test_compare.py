"""Two runs are compared by what they ran on, with, and what came out."""

import pytest
from click.testing import CliRunner

from tactile_lab.cli import cli
from tactile_lab.store.compare import differences
from tactile_lab.store.folder import RunFolder, write_json
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder


@pytest.fixture
def make(bench, tmp_path):
    def made(*, seed=1, environment=None, gain=0.2, hold="2 s", deviation="0 V"):
        info = {
            "environment": environment or {"numpy": "2.0"},
            "seed": seed,
            "parameters": {"hold": hold},
        }
        folder = RunFolder.create(tmp_path, "pulses", info)
        scene = f"""
            sensor = {{ V_GS = "1.4 V" }}
            simulated = {{ deviation = {{ V_GS = "{deviation}" }} }}
            [protocol]
            hold = "{hold}"
        """
        folder.write_text("scene.toml", scene)
        layout = Layout(
            signals=bench.SIGNALS,
            detection=bench.DETECTION,
            simulated=True,
            attributes={"newtons_per_ampere": gain},
        )
        recorder = Recorder(folder, layout, reserve=0)
        bench.play(recorder, bench.codes(3000, seed), 500)
        recorder.close("complete", 3000)
        return folder.path

    return made


def test_the_same_again_is_the_same(make):
    found = differences(make(), make())
    assert str(found).count("the same") == 3


def test_each_kind_of_difference_is_named(make):
    old = make()
    new = make(seed=2, environment={"numpy": "2.1"}, gain=0.1, hold="3 s")
    found = differences(old, new)
    assert "numpy was 2.0, is 2.1" in found.environment
    assert "seed was 1, is 2" in found.environment
    assert "newtons_per_ampere was 0.2, is 0.1" in found.calibration
    assert "scene protocol.hold was 2 s, is 3 s" in found.calibration
    assert "the samples of V_K are not identical" in found.results
    assert any("spike times differ by up to" in line for line in found.results)


def test_a_key_of_the_scene_is_named_with_its_table(make):
    """Of the V_GS that is believed and the one that the simulated world deviates by."""
    found = differences(make(), make(deviation="3 mV"))
    (line,) = (line for line in found.calibration if line.startswith("scene"))
    assert line == "scene simulated.deviation.V_GS was 0 V, is 3 mV"


def test_what_only_one_of_them_has_was_not_there_or_is_no_more(make):
    old, new = make(seed=None), make(environment={"scipy": "1.17"})
    found = differences(old, new)
    assert "scipy was not there, is 1.17" in found.environment
    assert "numpy was 2.0, is not there any more" in found.environment
    assert "seed was not there, is 1" in found.environment
    assert "None" not in str(found) + str(differences(new, old))


def test_entries_of_a_table_that_only_one_of_them_has_are_named(make):
    old, new = make(), make()
    kept = (old / "scene.toml").read_text()
    (old / "scene.toml").write_text(kept.replace("simulated =", "lab ="))
    found = differences(old, new).calibration
    assert "scene simulated.deviation.V_GS was not there, is 0 V" in found
    assert "scene lab.deviation.V_GS was 0 V, is not there any more" in found


def test_on_the_command_line_values_stand_side_by_side(make, tmp_path):
    old, new = make(), make(hold="3 s")
    write_json(new / "results.json", {"conclusion": {"critical_force_N": 0.0926}})
    done = CliRunner().invoke(cli, ["compare", str(old), str(new)])
    assert done.exit_code == 0, done.output
    lines = [line.split() for line in done.output.splitlines()]
    assert ["protocol.hold", "2", "s", "3", "s"] in lines
    assert ["critical_force", "92.6", "mN"] in lines
    assert "results: the same" in done.output
    none = CliRunner().invoke(cli, ["compare", str(old), str(tmp_path / "none")])
    assert none.exit_code == 2 and "none" in none.output


def test_a_rate_that_one_trial_lacks_moves_no_other_beside_it(make):
    """80 mN gave no rate, and that of 120 mN stood beside the other run's of 80 mN."""
    old, new = make(), make()
    for folder, rates in ((old, (6.5, 10.5)), (new, (None, 5.5))):
        trials = [
            {"label": label, "peak_rate_Hz": rate}
            for label, rate in zip(("80 mN", "120 mN"), rates, strict=True)
        ]
        write_json(folder / "results.json", {"trials": trials})
    done = CliRunner().invoke(cli, ["compare", str(old), str(new)])
    (line,) = (x for x in done.output.splitlines() if x.startswith("peak_rate"))
    told = "80 mN: 6.5 Hz, 120 mN: 10.5 Hz  120 mN: 5.5 Hz"
    assert line.removeprefix("peak_rate").strip() == told
