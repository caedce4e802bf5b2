"""A field calibration from the current source to a file that a bench then uses."""

import json
from dataclasses import replace

import pytest
from short_runs import run_scene

from sim_backend.bench import open_bench, options
from tactile_lab.acquisition.events import Message, RunState
from tactile_lab.bench import Reading
from tactile_lab.calibration import read_calibration
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError
from tactile_lab.planning.needs import needs
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load

__all__ = ["run_scene"]

SHORT = (
    "protocol.points=5",
    "protocol.most=0.5 A",
    "protocol.loops=0",
    "protocol.dwell=0.5 s",
    "record.sample_rate=2 kS/s",
    "conditions.temperature=22.5 °C",
)


@pytest.fixture(scope="module")
def calibrated(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")
    done = Execution(load("calibrate_field", SHORT), folder).run()
    assert done.state is RunState.COMPLETE, done.reason
    write(done.folder, read(done.folder))
    return done.folder


def test_drift_and_temperature_are_checked_and_told(calibrated):
    told = json.loads((calibrated / "results.json").read_text())
    found, budget = told["conclusion"], told["error_budget_95"]["one field"]
    assert found["slope_T_per_A"] == pytest.approx(0.011, rel=1e-3)
    assert abs(found["drift_T"]) < 1e-6
    assert 0 <= found["warming_K"] < 10
    # the loop of mild steel, 50 mA to either side
    assert found["uncertainty_T"] == pytest.approx(0.05 * 0.011, rel=0.02)
    assert budget["whole"] == found["uncertainty_T"] >= budget["loop"]
    head = (calibrated / "report.html").read_text().partition("<h2>")[0]
    assert "Error budget (95 % or bound): one field ±550 µT = loop 550 µT" in head
    assert "; meter not stated." in head


def test_the_file_tells_its_origin_and_covers_what_was_measured(calibrated):
    path = calibrated / "calibration.csv"
    assert path.stat().st_mode & 0o222 == 0
    used = read_calibration(path)
    assert used.whole
    assert {"coil", "date", "valid until", "drift T", "winding warmed by K"} <= set(
        used.head
    )
    assert used.head["temperature"] == "22.5 °C (entered)"
    assert used.at(0.3) == pytest.approx(0.3 * 0.011, abs=1e-5)
    with pytest.raises(LimitError, match="outside the calibration"):
        used.at(0.6)


def test_a_field_and_a_shunt_that_lie_are_told(run_scene):
    """They gave a calibration without a word."""

    def lying(scene):
        world = replace(options(scene), attenuation={"D": 2.0})
        made = open_bench(scene, needs(scene), world=world)
        read_field = made.field_meter.read

        def other():
            reading = read_field()
            return Reading(reading.time, -0.5 * reading.value)

        made.field_meter.read = other
        return made

    ran = run_scene(*SHORT, scene="calibrate_field", bench=lying)
    sentences = find(read(ran.folder)).conclusion.sentences
    assert any("−0.5 times" in s and "the other way round" in s for s in sentences)
    told = [one.text for one in ran.told if isinstance(one, Message)]
    assert any("the shunt shows" in text for text in told)


def test_neither_a_value_nor_the_date_can_be_changed_unnoticed(calibrated, tmp_path):
    text = (calibrated / "calibration.csv").read_text()
    for old, new in (("valid until: 20", "valid until: 21"), ("\n0.5,0", "\n0.5,1")):
        assert old in text
        changed = tmp_path / "changed.csv"
        changed.write_text(text.replace(old, new))
        assert not read_calibration(changed).whole
