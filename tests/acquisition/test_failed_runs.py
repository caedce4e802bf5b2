"""Whole runs that fail, or are refused: the coil ends off, what was stored is kept."""

import shutil
import signal
from pathlib import Path
from types import SimpleNamespace

import pytest

from tactile_lab.acquisition import events
from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.events import RunState
from tactile_lab.bench import OffReport
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.planning.needs import needs
from tactile_lab.scene.load import load
from tactile_lab.store import folder
from tactile_lab.store.columns import SampleColumn
from tactile_lab.store.recover import recover
from tactile_lab.store.verify import verify


@pytest.mark.parametrize("length", ["float('nan')", "float('inf')", "-1.0"])
def test_a_trial_without_an_end_is_refused_on_the_bench_too(
    run_scene, tmp_path, length
):
    file = tmp_path / "endless.py"
    file.write_text(
        "from typing import ClassVar\n"
        "from tactile_lab.trial import Protocol, Trial\n"
        "from tactile_lab.waveform import Waveform\n"
        "class Endless(Protocol):\n"
        "    name: ClassVar[str] = 'endless'\n"
        "    title: ClassVar[str] = 'Endless'\n"
        "    def trials(self):\n"
        "        wave = Waveform.pulse(0.1, ramp=0.1, hold=0.2)\n"
        "        done = yield Trial(force=wave, label='one')\n"
        f"        length = {length} if type(done).__name__ == 'Outcome' else 1.0\n"
        "        yield Trial(force=wave, duration=length, label='two')\n"
    )
    ran = run_scene(scene=str(file))
    assert ran.done.state is RunState.FAULTED
    assert ran.done.reason.startswith('trial "two" lasts')
    assert ran.done.off.verified


def test_a_scope_unplugged_in_the_middle_faults_the_run_with_the_coil_off(
    run_scene, short
):
    from sim_backend.bench import open_bench
    from sim_backend.picoscope.faults import ScopeFault

    ran = run_scene(
        *short,
        bench=lambda scene: open_bench(
            scene,
            needs(scene),
            scope_faults=[ScopeFault(kind="unplug", sample=700_000)],
        ),
    )
    assert ran.done.state is RunState.FAULTED
    assert ran.done.exit_code == 3
    assert "scope" in ran.done.reason.lower()
    with ran.stored() as run:
        assert run.info["status"] == "faulted"
        assert len(run.signal("V_K")) >= 600_000


def test_a_protocol_that_fails_in_the_middle_leaves_the_coil_off(run_scene, tmp_path):
    file = tmp_path / "broken.py"
    file.write_text(
        "from typing import ClassVar\n"
        "from tactile_lab.trial import Protocol, Trial\n"
        "from tactile_lab.waveform import Waveform\n"
        "class Broken(Protocol):\n"
        "    name: ClassVar[str] = 'broken'\n"
        "    title: ClassVar[str] = 'Broken'\n"
        "    def trials(self):\n"
        "        wave = Waveform.pulse(0.1, ramp=0.1, hold=0.2)\n"
        "        done = yield Trial(force=wave, label='one')\n"
        "        if hasattr(done, 'rest') and type(done).__name__ == 'Outcome':\n"
        "            raise RuntimeError('the protocol has a bug')\n"
    )
    ran = run_scene(scene=str(file))
    assert ran.done.state is RunState.FAULTED
    assert ran.done.off.verified
    line = (
        file.read_text()
        .splitlines()
        .index("            raise RuntimeError('the protocol has a bug')")
    )
    told = f"{file.name}, line {line + 1}: RuntimeError: the protocol has a bug"
    assert ran.done.reason == told
    assert "in trials" in (ran.folder / "traceback.txt").read_text()


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("yield 'a pulse'", "TypeError: trials gave str; yield a Trial"),
        ("yield None", "TypeError: trials gave NoneType; yield a Trial"),
        (
            "yield Trial(force=wave, label='two', duration=-1.0)",
            'trial "two" lasts -1 s; it must be longer than 0 s, and end.',
        ),
        ("raise MemoryError", "asked.py, line 11: MemoryError"),
    ],
)
def test_what_a_protocol_asks_for_only_in_a_run_is_judged_as_in_its_plan(
    run_scene, tmp_path, line, told
):
    """A trial of -1 s was complete, None had "no attribute 'pause'"."""
    file = tmp_path / "asked.py"
    file.write_text(
        "from typing import ClassVar\n"
        "from tactile_lab.trial import Protocol, Trial\n"
        "from tactile_lab.waveform import Waveform\n"
        "class Asked(Protocol):\n"
        "    name: ClassVar[str] = 'asked'\n"
        "    title: ClassVar[str] = 'Asked'\n"
        "    def trials(self):\n"
        "        wave = Waveform.pulse(0.1, ramp=0.1, hold=0.2)\n"
        "        done = yield Trial(force=wave, label='one')\n"
        "        if type(done).__name__ == 'Outcome':\n"
        f"            {line}\n"
    )
    ran = run_scene(scene=str(file))
    assert ran.done.state is RunState.FAULTED
    assert ran.done.off.verified
    assert ran.done.reason == told


def test_a_full_disk_ends_the_run_with_the_coil_off_and_the_data_kept(
    run_scene, short, monkeypatch
):
    def usage(path):
        """The writer's own look: it may come late behind the run's clock."""
        stored = sum(file.stat().st_size for file in Path(path).rglob("data.h5"))
        full = stored > 100_000
        return SimpleNamespace(free=1_000_000 if full else 10**12)

    monkeypatch.setattr(shutil, "disk_usage", usage)
    ran = run_scene(*short)
    assert ran.done.exit_code == 3
    assert ran.done.off.verified
    assert "Free some space" in ran.done.reason
    with ran.stored() as run:
        assert run.status == "faulted"
        assert len(run.signal("V_K")) > 0
    # the last spikes may have waited for the disk when it gave up: that is told
    found = {finding.where for finding in verify(ran.folder).findings}
    assert found <= {"data.h5 /spikes"}


@pytest.mark.parametrize("at", ["connecting", "running", "stopping", "complete"])
def test_a_watcher_that_fails_is_dropped_and_not_the_run(run_scene, short, at):
    told = []

    def break_down(execution, event):
        told.append(event)
        if isinstance(event, events.StateChanged) and event.state == at:
            raise BrokenPipeError(32, "Broken pipe")

    ran = run_scene(*short, watch=break_down)
    assert ran.done.exit_code == 0 and ran.done.off.verified
    assert told[-1].state == at  # and it is told nothing more
    with ran.stored() as run:
        assert run.status == "complete"
        assert run.info["coil_verified_off"] is True
    log = (ran.folder / "log.jsonl").read_text(encoding="utf-8")
    assert "What watched this run failed" in log and "Broken pipe" in log


def test_a_disk_that_fails_at_the_very_end_is_no_complete_run(
    run_scene, short, monkeypatch
):
    def refuse(self):
        raise OSError(28, "No space left on device")

    def fail_last(execution, event):
        if isinstance(event, events.StateChanged) and event.state == "stopping":
            monkeypatch.setattr(SampleColumn, "write_pyramid", refuse)

    ran = run_scene(*short, watch=fail_last)
    assert ran.done.exit_code == 3
    assert "No space left" in ran.done.reason
    assert ran.stored().info["status"] == "faulted"


def test_a_run_whose_end_cannot_be_noted_tells_how_it_is_closed(
    run_scene, short, monkeypatch
):
    written = folder.write_text

    def refuse(path, *how, **named):
        if path.name == "run.json":
            raise PermissionError(13, "Permission denied")
        written(path, *how, **named)

    def fail_last(execution, event):
        if isinstance(event, events.StateChanged) and event.state == "stopping":
            monkeypatch.setattr(folder, "write_text", refuse)

    ran = run_scene(*short, watch=fail_last)
    assert ran.done.exit_code == 3 and ran.done.off.verified
    assert "Permission denied" in ran.done.reason
    assert "run `tactile-lab recover` on it" in ran.done.reason
    monkeypatch.setattr(folder, "write_text", written)
    recover(ran.folder)
    assert not verify(ran.folder).findings


def test_a_mistake_after_the_run_does_not_hide_how_the_coil_was_left(
    run_scene, short, monkeypatch
):
    def mistaken(folder):
        raise ValueError("a certificate with a bug")

    monkeypatch.setattr("tactile_lab.engine.execution.write_certificate", mistaken)
    ran = run_scene(*short)
    assert ran.done.exit_code == 3 and ran.done.off.verified
    assert "a certificate with a bug" in ran.done.reason


def test_a_force_beyond_the_coil_is_refused_before_anything_exists(tmp_path):
    scene = load("demo", ['protocol.levels=["900 mN"]'])
    with pytest.raises(LimitError, match="reachable"):
        Execution(scene, tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


def test_an_unknown_signal_is_refused():
    with pytest.raises(SceneError, match="V_C1"):
        load("demo", ['record.signals=["V_C11"]'])


def test_a_hung_loop_loses_its_lease_and_the_coil_is_made_safe(run_scene, short):
    hung = []

    def hang_once(execution, event):
        if isinstance(event, events.Progress) and event.elapsed > 0.4 and not hung:
            hung.append(True)
            clock = execution.bench.clock
            clock.sleep_until(clock.now() + 3.0)

    ran = run_scene(*short, watch=hang_once)
    assert ran.done.state is RunState.FAULTED
    assert "lease" in ran.done.reason
    assert ran.done.off.verified


def test_a_fault_keeps_its_exit_code_whatever_signal_comes_after():
    """A script took a run that had faulted for one that was stopped."""
    off = OffReport(True, 0.0, "Output off, 0 A read back.")
    codes = [
        Ending(state, off, signal=signal.SIGTERM).exit_code
        for state in (RunState.FAULTED, RunState.ABORTED, RunState.COMPLETE)
    ]
    assert codes == [3, 143, 0]
