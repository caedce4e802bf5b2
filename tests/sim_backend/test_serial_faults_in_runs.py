"""Each serial fault in a whole run: verified off or told so, data kept, reason told."""

from __future__ import annotations

from pathlib import Path

import pytest

from sim_backend.bench import open_bench
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.acquisition.ending import Executed
from tactile_lab.acquisition.events import RunState
from tactile_lab.commands.show import describe, rows
from tactile_lab.engine.execution import Execution
from tactile_lab.planning.needs import needs
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.report.results import results
from tactile_lab.report.table import trials_table
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run

OVERRIDES = (
    'protocol.levels=["120 mN"]',
    "protocol.ramp=0.2 s",
    "protocol.hold=0.3 s",
    "protocol.rest=0.1 s",
    "record.sample_rate=0.2 MS/s",
)
PULSE = r"^CURR 0\.[1-9]"
"""Set-points of the pulse."""


def run(folder: Path, fault: SerialFault) -> tuple[Executed, int]:
    """The finished run, and samples of V_K in its folder."""
    scene = load("demo", OVERRIDES)
    bench = open_bench(scene, needs(scene), coil_faults=[fault])
    done = Execution(scene, folder, bench=bench).run()
    if not (done.folder / "data.h5").exists():
        return done, 0  # it ended before the first sample
    with Run.load(done.folder) as stored:
        return done, len(stored.signal("V_K"))


@pytest.mark.parametrize(
    "fault",
    [
        SerialFault(kind="late", amount=0.25, line=PULSE),
        SerialFault(kind="late", amount=1.0, line=PULSE),
        SerialFault(kind="late", amount=1.0, line="^SYST:ERR"),
        SerialFault(kind="missing", line=PULSE),
        SerialFault(kind="partial", amount=5, line=PULSE),
        SerialFault(kind="garbled", line=PULSE),
        SerialFault(kind="echo", line=PULSE),
        SerialFault(kind="no_terminator", line=PULSE),
        SerialFault(kind="carriage_return", line=PULSE),
        SerialFault(kind="flow_control", times=None),
        SerialFault(kind="noise", line=PULSE),
        SerialFault(kind="deaf", line=PULSE),
        SerialFault(kind="stuck", line=PULSE),
    ],
    ids=lambda fault: fault.kind,
)
def test_what_a_run_survives(tmp_path: Path, fault: SerialFault) -> None:
    done, samples = run(tmp_path, fault)
    assert done.state is RunState.COMPLETE, done.reason
    assert done.off is not None and done.off.verified
    assert samples > 150_000


def test_set_points_that_came_too_late_are_told_and_stored(tmp_path: Path) -> None:
    done, _ = run(tmp_path, SerialFault(kind="late", amount=0.25, line=PULSE))
    with Run.load(done.folder) as stored:
        assert stored.trials["skipped"].sum() > 0
        skipped = int(stored.trials["skipped"][0])
    found = find(read(done.folder))
    assert f"120 mN, {skipped} set-point" in trials_table(found.run).rows[0][0]
    assert results(found)["trials"][0]["skipped"] == skipped
    shown = describe(done.folder)
    assert shown["trials"][0]["skipped"] == skipped
    told = next(line for name, line in rows(shown) if name == "trial")
    assert told.endswith(f", {skipped} set-points skipped")
    log = (done.folder / "log.jsonl").read_text(encoding="utf-8")
    assert "coil set-points came too late and were skipped" in log
    assert "the source answered late" in log and "computer" not in log
    reported = " ".join(read(done.folder).warnings)
    assert "coil set-points came too late and were skipped" in reported
    assert reported.count("Check the link to it.") == log.count("Check the link to it.")


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (SerialFault(kind="refused", line=PULSE), "-222"),
        (SerialFault(kind="late", amount=3.0, line=PULSE), "answered nothing"),
        (SerialFault(kind="unplug", amount=0.6, line=PULSE), "was lost"),
        (SerialFault(kind="unplug", amount=0.6, line=PULSE, form="closed"), "was lost"),
        (SerialFault(kind="unplug", amount=0.6, line=PULSE, form="reset"), "was lost"),
    ],
    ids=["refused", "late", "usb", "closed", "reset"],
)
def test_faults_that_end_a_run_safely(
    tmp_path: Path, fault: SerialFault, reason: str
) -> None:
    done, samples = run(tmp_path, fault)
    assert done.state is RunState.FAULTED
    assert done.exit_code == 3
    assert done.off is not None and done.off.verified, done.off
    assert reason in (done.reason or ""), done.reason
    assert samples > 0
    assert done.loss["samples"] == 0


@pytest.mark.parametrize(
    "fault",
    [
        SerialFault(kind="unplug", line=PULSE),
        SerialFault(kind="unplug", line="OUTP 0", skip=1),
        SerialFault(kind="deaf", line=PULSE, times=None, skip=1),
        SerialFault(kind="deaf", after=2.0, times=None),
        SerialFault(kind="garbled", after=2.0, times=None),
        SerialFault(kind="stuck", after=2.0, times=None),
    ],
    ids=[
        "unplugged",
        "unplugged-at-the-end",
        "deaf-to-sets",
        "off",
        "garbled",
        "stuck",
    ],
)
def test_what_cannot_be_verified_is_not_called_safe(
    tmp_path: Path, fault: SerialFault
) -> None:
    done, samples = run(tmp_path, fault)
    if done.off is not None and done.off.verified:
        # deaf to set-points only: the way out was open and was verified
        assert fault.line == PULSE and done.exit_code == 3
        return
    assert done.exit_code == 4
    assert done.off is not None
    assert "switch the coil source off at the instrument" in done.off.text
    assert samples > 0


@pytest.mark.parametrize(
    "fault",
    [
        SerialFault(kind="unplug", line="IDN"),
        SerialFault(kind="deaf", times=None),
        SerialFault(kind="echo", times=None),
    ],
    ids=lambda fault: fault.kind,
)
def test_faults_before_the_first_sample(tmp_path: Path, fault: SerialFault) -> None:
    done, samples = run(tmp_path, fault)
    assert done.state is RunState.FAULTED
    assert done.exit_code in (3, 4)
    assert samples == 0


def test_a_compliance_that_is_not_taken_energises_nothing(tmp_path: Path) -> None:
    done, _ = run(tmp_path, SerialFault(kind="refused", line="VOLT 14"))
    assert done.exit_code == 3
    assert "-222" in (done.reason or "")
    assert done.off is not None and done.off.verified


def test_a_scene_has_the_plug_pulled_to_practise_on(tmp_path: Path) -> None:
    scene = load("demo", (*OVERRIDES, 'simulated.coil_unplugged="2 s"'))
    done = Execution(scene, tmp_path).run()
    assert done.exit_code == 4, "nobody knows what the coil does"
    assert done.off.verified is False
    assert 0.5 < done.duration < 1.5, "1 s of it went by before the first sample"
    kept = load(done.folder / "scene.toml").simulated
    assert kept.coil_unplugged == 2.0


def test_a_link_lost_as_it_is_switched_on_changes_no_setting(tmp_path: Path) -> None:
    """A warning said that the compliance was another at the end: the run had set it."""
    fault = SerialFault(kind="unplug", amount=0.3, line="^OUTP 1")
    done, _ = run(tmp_path, fault)
    assert done.state is RunState.FAULTED and done.off.verified
    with Run.load(done.folder) as stored:
        assert stored.info["instruments_changed"] == []
