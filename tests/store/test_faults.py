"""Full disks, slow disks and crowded folders end in a message, with the data kept."""

import os
import shutil
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from tactile_lab.errors import RecordingError
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.recover import recover
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

HERE = Path(__file__).parent


class SlowRecorder(Recorder):
    """A recorder whose disk takes its time."""

    def _append(self, block):
        time.sleep(0.02)
        super()._append(block)


class FailingRecorder(Recorder):
    """A recorder whose disk gives up at the third block."""

    def _append(self, block):
        if block.first >= 2048:
            raise RecordingError("the disk gave up")
        super()._append(block)


def test_thread_stores_what_the_recorder_stores(bench, folder, layout):
    recorder = Recorder(folder, layout, reserve=0, when_full="wait")
    made = bench.codes(20_000)
    bench.play(recorder, made, 333)
    recorder.event(1.0, "opened", "scope")
    recorder.close("complete", 20_000)
    assert recorder.queued == 20_000
    assert verify(folder.path).sound
    with Run.load(folder.path) as run:
        np.testing.assert_array_equal(run.signal("V_K").scope_codes(0, 20_000), made[1])
        assert run.info["queued"] == 20_000


def test_a_slow_disk_holds_up_a_simulated_run_but_loses_nothing(bench, folder, layout):
    recorder = SlowRecorder(
        folder, layout, reserve=0, when_full="wait", capacity=20_000
    )
    bench.play(recorder, bench.codes(20_000), 1000)
    recorder.close("complete", 20_000)
    assert verify(folder.path).sound


def test_a_slow_disk_ends_a_real_run_and_keeps_what_came(bench, folder, layout):
    recorder = SlowRecorder(
        folder, layout, reserve=0, when_full="error", capacity=20_000
    )
    with pytest.raises(RecordingError, match="does not keep up"):
        bench.play(recorder, bench.codes(20_000), 1000)
    recorder.close("faulted", 20_000)
    verdict = verify(folder.path)
    assert verdict.sound
    assert verdict.certificate.samples > 0
    assert "of 40,000 samples" in str(verdict.certificate)


def test_what_goes_wrong_in_the_thread_reaches_the_caller(bench, folder, layout):
    recorder = FailingRecorder(
        folder, layout, reserve=0, when_full="wait", capacity=20_000
    )
    with pytest.raises(RecordingError, match="gave up"):
        bench.play(recorder, bench.codes(20_000), 1024)
    with pytest.raises(RecordingError, match="gave up"):
        recorder.close("complete", 20_000)
    with Run.load(folder.path) as run:
        assert run.status == "faulted"
        assert run.info["reason"] == "the disk gave up"
        assert run.samples == 2048


def test_a_waiting_caller_is_woken_by_a_failure(bench, folder, layout):
    class Stuck(Recorder):
        def _append(self, block):
            released.wait(5)
            raise RecordingError("pulled out")

    released = threading.Event()
    recorder = Stuck(folder, layout, when_full="wait", capacity=5000)
    threading.Timer(0.1, released.set).start()
    with pytest.raises(RecordingError, match="pulled out"):
        bench.play(recorder, bench.codes(20_000), 1000)
    with pytest.raises(RecordingError, match="pulled out"):
        recorder.close("complete")


def test_no_room_is_refused_before_anything_is_made(tmp_path):
    with pytest.raises(
        RecordingError, match="GB are needed for the run and its reserve"
    ):
        RunFolder.create(tmp_path, "big", {}, needed=10**18)
    assert list(tmp_path.iterdir()) == []


def test_the_reserve_stops_a_run_and_keeps_its_data(bench, folder, layout, monkeypatch):
    recorder = Recorder(folder, layout, reserve=1)
    made = bench.codes(5000)
    recorder.segment(bench.stream(), 0.0)
    recorder.append(bench.block(made, 0, 2048))
    usage = type("Usage", (), {"free": 0})
    monkeypatch.setattr(shutil, "disk_usage", lambda path: usage)
    with pytest.raises(RecordingError, match="Free some space"):
        recorder.append(bench.block(made, 2048, 2500))
    monkeypatch.undo()
    recorder.close("faulted", 4548)
    with Run.load(folder.path) as run:
        assert run.samples == 4548
        assert run.status == "faulted"


@pytest.mark.skipif(sys.platform == "win32", reason="file size limits are POSIX")
def test_a_full_disk_ends_with_a_message_and_keeps_the_data(bench, tmp_path):
    script = f"""
import resource, runpy, signal
from pathlib import Path
from tactile_lab.errors import RecordingError
bench = runpy.run_path({str(HERE / "conftest.py")!r})
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.store.recorder import Recorder
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, resource.RLIM_INFINITY))
folder = RunFolder.create(Path({str(tmp_path)!r}), "full", {{}})
layout = Layout(signals=bench["SIGNALS"], detection=bench["DETECTION"], simulated=True)
recorder = Recorder(folder, layout, reserve=0)
try:
    bench["play"](recorder, bench["codes"](500_000), 1024)
except RecordingError as error:
    print(error)
    try:
        recorder.close("faulted", 500_000, reason=str(error))
    except RecordingError:
        pass
"""
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False
    )
    # without HDF5's own sentence: descriptor, buffer, offset
    said = "data.h5 cannot be written: File too large. The first"
    assert said in done.stdout, done.stderr
    assert "Traceback" not in done.stderr
    (path,) = tmp_path.iterdir()
    made = bench.codes(500_000)
    with Run.load(path) as run:
        assert run.status == "faulted"
        assert run.samples > 50_000
        np.testing.assert_array_equal(
            run.signal("V_C1").scope_codes(0, run.samples), made[0, : run.samples]
        )
    # as the message says; it was refused, and the file stayed damaged
    found = recover(path)
    assert found.samples > 50_000 and verify(path).sound
    with Run.load(path) as run:
        assert (run.status, run.samples) == ("recovered", found.samples)
        assert "File too large" in run.info["reason"]


def test_an_unwritable_place_is_refused(tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(RecordingError, match="Choose a writable folder"):
        RunFolder.create(tmp_path / "file", "x", {})
    if hasattr(os, "geteuid") and os.geteuid() != 0:
        closed = tmp_path / "closed"
        closed.mkdir(mode=0o500)
        with pytest.raises(RecordingError, match="Choose a writable folder"):
            RunFolder.create(closed, "x", {})


def test_two_runs_at_once_get_folders_of_their_own(bench, layout, tmp_path):
    folders = [RunFolder.create(tmp_path, "pulses", {}) for _ in range(3)]
    assert len({folder.path for folder in folders}) == 3
    recorders = [Recorder(folder, layout, reserve=0) for folder in folders]
    for recorder in recorders:
        bench.play(recorder, bench.codes(2000), 500)
    for recorder in recorders:
        recorder.close("complete", 2000)
    assert all(verify(folder.path).sound for folder in folders)


def test_a_second_recorder_in_one_folder_is_refused(bench, folder, layout):
    one, other = (Recorder(folder, layout, reserve=0) for _ in range(2))
    one.segment(bench.stream(), 0.0)
    with pytest.raises(RecordingError, match="exists"):
        other.segment(bench.stream(), 0.0)
    one.close("complete")


def test_wall_clock_jumps_do_not_touch_the_record(bench, recorder, folder, monkeypatch):
    monkeypatch.setattr(time, "time", lambda: 0.0)
    recorder.segment(bench.stream(), 0.0)
    made = bench.codes(4000)
    recorder.append(bench.block(made, 0, 2000, received=5.0))
    recorder.append(bench.block(made, 2000, 2000, received=-1e9))
    recorder.close("complete", 4000)
    with Run.load(folder.path) as run:
        np.testing.assert_allclose(np.diff(run.signal("V_C1").time()), 1e-3)
        assert run.samples == 4000


def test_memory_is_bounded_by_the_queue(bench, folder, layout):
    recorder = SlowRecorder(
        folder,
        Layout(signals=("V_C1",), simulated=True),
        reserve=0,
        when_full="wait",
        capacity=50_000,
    )
    recorder.segment(bench.stream(), 0.0)
    made = bench.codes(10_000)
    fullest = 0.0
    for first in range(0, 10_000, 500):
        recorder.append(bench.block(made, first, 500))
        fullest = max(fullest, recorder._queue._bytes)
    recorder.close("complete", 10_000)
    assert 0 < fullest <= 50_000
