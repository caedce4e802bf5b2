"""Which calibrations a run may use, and what is refused before anything is opened."""

import datetime
import json
import re

import pytest

from tactile_lab.analysis.field_calibration import (
    FieldStep,
    calibration_text,
    fit_field,
)
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.planning.plan import plan
from tactile_lab.report.from_run import read
from tactile_lab.report.write import write
from tactile_lab.scene.load import load

KEPCO = "KEPCO,BIT 4886 20-05,E123456,3.05-1.83"


@pytest.fixture
def calibrated(tmp_path):
    """A short scene on the simulated bench with a calibration of its own."""

    def make(*more, most=1.0, coil=KEPCO, age=0, name="pulses"):
        steps = [
            FieldStep(
                branch=branch, current=i * most / 4, field=0.011 * i * most / 4 + s,
                error=1e-6,
            )
            for branch, s in (("rising", -1e-4), ("falling", 1e-4))
            for i in range(-4, 5)
        ]  # fmt: skip
        path = tmp_path / "b2.csv"
        day = datetime.date.today() - datetime.timedelta(days=age)
        if not path.exists():
            path.write_text(calibration_text(fit_field(steps), coil=coil, date=day))
        scene = tmp_path / "scene.toml"
        scene.write_text(
            f'[protocol]\nname = "{name}"\n'
            '[bench.magnet]\nr = "6 mm"\ncalibration = "b2.csv"\n'
        )
        return load(str(scene), more)

    return make


SHORT = (
    'protocol.levels=["120 mN"]', 'protocol.hold="0.6 s"', 'protocol.rest="0 s"',
    'record.signals=["V_C1", "spikes", "coil_current"]',
    'record.sample_rate="0.5 MS/s"',
)  # fmt: skip


def test_an_expired_calibration_is_refused_unless_the_bench_allows_it(calibrated):
    with pytest.raises(SceneError, match=r"expired on .* allow_expired = true"):
        plan(calibrated(age=400), preview=False)
    allowed = calibrated("bench.magnet.allow_expired=true", age=400)
    assert "used nevertheless" in " ".join(plan(allowed, preview=False).warnings)


def test_calibrating_anew_needs_no_valid_calibration(calibrated):
    told = plan(calibrated(age=400, name="calibrate_field"), preview=False).warnings
    assert any("goes beyond the calibration" in text for text in told)


def test_a_changed_calibration_is_refused(calibrated, tmp_path):
    calibrated()
    path = tmp_path / "b2.csv"
    path.chmod(0o644)
    path.write_text(path.read_text().replace("\n0,0\n", "\n0,1e-5\n"))
    with pytest.raises(SceneError, match="changed after it was written"):
        plan(calibrated(), preview=False)


def test_a_force_the_calibration_does_not_cover_is_refused(calibrated):
    scene = calibrated(*SHORT, most=0.5)
    with pytest.raises(LimitError, match=r"reachable is .*calibration"):
        plan(scene, preview=False)


def test_a_calibrated_run_states_what_it_knows(calibrated, tmp_path):
    scene = calibrated(*SHORT, "bench.magnet.geometry_uncertainty=0.05")
    done = Execution(scene, tmp_path / "runs").run()
    assert done.exit_code == 0, done.reason
    report = write(done.folder, read(done.folder))
    found = json.loads(report.results.read_text(encoding="utf-8"))
    (trial,) = found["trials"]
    assert 6e-3 < trial["level_uncertainty_N_95"] < 8e-3
    assert 0 < trial["latency_uncertainty_s"] < 0.02
    assert found["calibration"]["Coil"] == KEPCO
    page = report.html.read_text(encoding="utf-8").replace("\u00a0", " ")
    assert re.search(r"120\.\d+ ± \d\.\d+ mN", page)


def test_another_coil_is_refused_before_it_is_switched_on(calibrated, tmp_path):
    told = []
    done = Execution(
        calibrated(*SHORT, coil="KEPCO of the other lab"),
        tmp_path / "runs",
        emit=told.append,
    ).run()
    assert done.exit_code == 3
    assert done.off.verified
    assert "belongs to the coil KEPCO of the other lab" in done.reason
    assert not any(type(event).__name__ == "CoilCurrent" for event in told)


def test_another_coil_can_be_allowed(calibrated, tmp_path):
    scene = calibrated(
        *SHORT, "bench.magnet.allow_other_coil=true", coil="KEPCO of the other lab"
    )
    told = []
    done = Execution(scene, tmp_path / "runs", emit=told.append).run()
    assert done.exit_code == 0
    messages = [e.text for e in told if type(e).__name__ == "Message"]
    assert any("allow_other_coil" in text for text in messages)
    assert "allow_other_coil" in " ".join(read(done.folder).warnings)
