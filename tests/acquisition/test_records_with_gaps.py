"""Whole runs on a scope that polls: a record, a gap, a record, each at its own time."""

import csv
import json

import numpy as np
import pytest
from benches import WITH_GAPS
from click.testing import CliRunner

from sim_backend.bench import open_bench
from sim_backend.usbtmc.faults import UsbFault
from tactile_lab.acquisition.events import RunState
from tactile_lab.cli import cli
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import SceneError
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.scene.load import load
from tactile_lab.store.certificate import certify
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

TWO = 'record.signals=["V_C1", "V_K"]'
THREE = 'record.signals=["V_C1", "V_K", "coil_current"]'
SHORT = ('protocol.levels=["200 mN"]', "protocol.hold=0.6 s", "protocol.rest=0.2 s")


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    path = tmp_path_factory.mktemp("bench") / "bench.toml"
    path.write_text(WITH_GAPS)
    return path


@pytest.fixture(scope="module")
def told(tmp_path_factory, bench):
    """What a run at 1 MS/s told, and its folder."""
    out = tmp_path_factory.mktemp("runs")
    sets = [f"--set={one}" for one in (*SHORT, THREE, "record.sample_rate=1 MS/s")]
    text = tell("run", "demo", "--bench", bench, *sets, "--out", out)
    (folder,) = out.iterdir()
    return text, folder


@pytest.fixture(scope="module")
def recorded(told):
    """Folder of a run at 1 MS/s."""
    return told[1]


def tell(*arguments):
    answer = CliRunner().invoke(cli, [str(a) for a in arguments])
    assert answer.exit_code == 0, answer.output
    return answer.output


@pytest.mark.parametrize(
    ("rate", "signals", "cover"),
    [
        ("0.5 GS/s", TWO, (1e-3, 0.01)),
        ("10 MS/s", THREE, (0.02, 0.2)),
        ("3.3 MS/s", THREE, (0.1, 0.4)),
        ("0.1 MS/s", THREE, (0.7, 0.99)),
    ],
    ids=["2 ns", "100 ns", "300 ns", "10 us"],
)
def test_gaps_by_design_are_no_loss_at_any_rate(tmp_path, bench, rate, signals, cover):
    asked = (*SHORT, signals, f"record.sample_rate={rate}")
    scene = load("demo", asked, str(bench))
    assert any("gaps between" in text for text in plan(scene, preview=False).warnings)
    folder = Execution(scene, tmp_path / "runs").run().folder
    covered(folder, *cover)


def covered(folder, low, high):
    """The certificate of a run, which is clean and says how much has samples."""
    assert verify(folder).sound
    with Run.load(folder) as run:
        proof = certify(run)
        assert proof.clean and proof.produced == proof.written > 0
        assert low < proof.covered / proof.streamed < high
        # what was streamed is all of the run but its closing
        assert run.trials["end"][-1] < proof.streamed < run.info["duration_s"]
        assert proof.covered == pytest.approx(run.samples * run.signal("V_C1").interval)
        ended = run.records("gaps")["time"][-1]
        assert ended == pytest.approx(proof.streamed, abs=1e-6)
    return proof


def test_a_scene_runs_from_plan_to_export(told, bench):
    text, folder = told
    sets = [f"--set={one}" for one in (*SHORT, THREE, "record.sample_rate=1 MS/s")]
    assert "gaps between" in tell("plan", "demo", "--bench", bench, *sets)
    assert "gaps by design" in text
    proof = covered(folder, 0.3, 0.8)
    for verb in ("verify", "show"):
        assert "loss: 0 of " in tell(verb, folder)
    results = json.loads((folder / "results.json").read_text())
    assert results["loss"]["samples"] == 0
    assert results["loss"]["covered_s"] == proof.covered
    assert f"{proof.covered:.4g} of {proof.streamed:.4g} s; gaps by design" in (
        (folder / "report.html").read_text()
    )
    tell("export", folder, "--to", "csv", "--until", "200 ms")


def test_every_sample_lies_at_its_own_time(recorded):
    with Run.load(recorded) as run:
        shunt, played = run.signal("coil_current"), run.current
        time = shunt.time()
        steps = np.diff(time)
        assert (steps > 0).all()
        assert np.count_nonzero(steps > 2 * shunt.interval) > 20
        # a set-point acts between the one before it and its confirmation
        near = [np.searchsorted(played["time"], time + t) for t in (-0.03, 0.02, 0.06)]
        bounds = np.append(0.0, played["setpoint"])[np.array(near)]
        code = abs(shunt.gain)
        assert (shunt[:] > bounds.min(axis=0) - 2 * code).all()
        assert (shunt[:] < bounds.max(axis=0) + 2 * code).all()


def test_probes_in_the_wrong_place_show(tmp_path, bench):
    mistakes = (
        'simulated.swapped=["V_C1", "V_K"]',
        'simulated.open_probes=["coil_current"]',
        'simulated.noise={ V_C1 = "200 mV" }',
    )
    scene = load(
        "demo", (*SHORT, THREE, "record.sample_rate=1 MS/s", *mistakes), str(bench)
    )
    done = Execution(scene, tmp_path / "runs").run()
    with Run.load(done.folder) as run:
        assert abs(run.signal("V_C1")[:10_000].mean()) < 0.1
        swapped = run.signal("V_K")[:10_000]
        assert swapped.mean() == pytest.approx(4.34, abs=0.1)
        assert swapped.std() == pytest.approx(0.2, rel=0.1)
        assert abs(run.signal("coil_current")[:]).max() < 0.5


def test_a_planned_pause_is_no_gap(tmp_path, bench):
    rate = "record.sample_rate=1 MS/s"
    few = ("protocol.hold=0.3 s", "protocol.gap=1 s")
    scene = load("force_check", (*few, THREE, rate), str(bench))
    done = Execution(scene, tmp_path / "runs").run()
    assert done.state is RunState.COMPLETE, done.reason
    with Run.load(done.folder) as run:
        proof, pauses = certify(run), run.records("pauses")
        silent = float((pauses["end"] - pauses["start"]).sum())
        last = float(run.trials["end"][-1])
        assert silent > 1 and last < proof.streamed + silent < run.info["duration_s"]


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (UsbFault(kind="unplug", call="read", nth=150), "unplugged or switched off"),
        (UsbFault(kind="stall", call="read", nth=150), "refused a transfer"),
        (UsbFault(kind="timeout", call="read", nth=150), "did not answer in time"),
        (UsbFault(kind="hang", call="read", nth=150), "samples behind"),
        (UsbFault(kind="garbled", call="write", nth=400), "garbled"),
    ],
    ids=lambda value: value.kind if isinstance(value, UsbFault) else "",
)
def test_a_fault_on_the_wire_keeps_what_was_recorded(tmp_path, bench, fault, reason):
    rate = "record.sample_rate=1 MS/s"
    scene = load("demo", (*SHORT, THREE, rate), str(bench))
    made = open_bench(scene, needs(scene), scope_faults=[fault])
    done = Execution(scene, tmp_path / "runs", bench=made).run()
    assert done.state is RunState.FAULTED
    assert reason in done.reason
    assert done.off.verified
    with Run.load(done.folder) as run:
        proof = certify(run)
        assert run.samples >= 3 * 30_000
        assert proof.clean and proof.produced == proof.written
    assert verify(done.folder).sound


def test_exports_tell_the_gaps(recorded):
    with Run.load(recorded) as run:
        gaps = run.gaps
    told = tell("export", recorded, "--to", "csv", "--until", "300 ms")
    written = next(recorded.rglob("gaps.csv"))
    assert "gaps.csv" in told
    with written.open() as file:
        rows = list(csv.DictReader(file))
    inside = gaps[gaps["start"] < 0.3]
    assert 5 < inside.size < gaps.size
    for name in ("start", "end"):
        told = [float(row[f"{name}_s"]) for row in rows]
        assert told == pytest.approx(inside[name].tolist())
    with Run.load(recorded) as run:
        half, time = run.signal("V_K").interval / 2, run.to_xarray().time.values
        first = np.searchsorted(time, run.gaps["start"] + half)
        assert (first == np.searchsorted(time, run.gaps["end"] - half)).all()


def test_spikes_are_refused_before_anything_is_opened(bench):
    spikes = 'record.signals=["V_K", "spikes"]'
    with pytest.raises(SceneError, match="has gaps between its records"):
        Execution(load("demo", (*SHORT, spikes), str(bench)), bench.parent)
