"""Exports hold the run's numbers, in units other programs expect."""

import csv
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
import scipy.io
from full_disk import full_after
from growing_run import begins_a_trial

from tactile_lab.errors import RunFolderError
from tactile_lab.store.export import csv as to_csv
from tactile_lab.store.export import mat as to_mat
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.trial import Outcome, Trial
from tactile_lab.waveform import Waveform


@pytest.fixture
def run(bench, recorder, folder):
    """Two stretches of 3000 samples at 1 kS/s, the second from 53 s on."""
    made = bench.codes(3000)
    bench.play(recorder, made, 500)
    recorder.pause(3.0, 53.0)
    bench.play(recorder, made, 500, start=53.0, source=bench.stream(started=63.0))
    recorder.current(0.5, 0.25, 0.24, asked=0.44, acted=0.47)
    recorder.current(54.0, 0.5, None)
    recorder.field(0.6, 11e-3)
    trial = Trial(force=Waveform.pulse(0.12, ramp=0.25, hold=2.0), label='the "120"')
    nothing = np.empty(0)
    recorder.outcome(
        Outcome(trial=trial, index=0, start=0.1, spike_times=nothing, current=nothing)
    )
    recorder.close("complete", 6000)
    with Run.load(folder.path) as loaded:
        yield loaded


def test_a_table_is_whole_or_as_it_was(run, tmp_path):
    selection = Selection(rate=1.0)
    to_csv.export(run, tmp_path, selection)
    before = {file: file.read_bytes() for file in tmp_path.glob("*.csv")}
    sizes = {file.stem: len(text) for file, text in before.items()}
    largest = max(sizes, key=lambda name: sizes[name])
    assert largest != "signals"
    with full_after(sizes[largest] - 1), pytest.raises(OSError, match="too large"):
        to_csv.export(run, tmp_path, selection)
    assert {file: file.read_bytes() for file in tmp_path.glob("*.csv")} == before


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.reader(file))


def test_csv_has_units_in_its_header_and_si_values(run, tmp_path):
    files = to_csv.export(run, tmp_path / "csv", Selection())
    names = {file.name for file in files}
    assert names == {
        "signals.csv", "spikes.csv", "current.csv", "field.csv", "trials.csv",
        "about.csv",
    }  # fmt: skip
    head, *body = rows(tmp_path / "csv" / "signals.csv")
    assert head == ["time_s", "V_C1_V", "V_K_V", "rate_Hz"]
    table = np.array(body, dtype=float)
    np.testing.assert_allclose(table[:, 2], run.signal("V_K")[:], rtol=1e-9)
    np.testing.assert_allclose(table[[0, 2999, 3000], 0], [0, 2.999, 53.0])
    head, *body = rows(tmp_path / "csv" / "spikes.csv")
    assert head == ["time_s", "amplitude_V", "width_s"]
    np.testing.assert_allclose([float(x[0]) for x in body], run.spikes["time"])
    assert rows(tmp_path / "csv" / "trials.csv")[1][1] == 'the "120"'
    # a current is dated by when the source acted; of the second nobody knows
    head, *body = rows(tmp_path / "csv" / "current.csv")
    assert head == ["time_s", "setpoint_A", "measured_A", "heard_s"]
    assert body == [["0.47", "0.25", "0.24", "0.5"], ["54", "0.5", "", "54"]]


def test_a_run_that_begins_a_trial_while_it_is_exported(run, tmp_path, monkeypatch):
    before = run.trials.size
    begins_a_trial(monkeypatch)
    to_csv.export(run, tmp_path, Selection())
    assert len(rows(tmp_path / "trials.csv")) == 1 + before


def test_a_part_at_a_lower_rate_is_averaged_and_keeps_gaps_apart(run, tmp_path):
    part = Selection(signals=("V_C1",), start=2.5, end=53.5, rate=100.0)
    to_csv.export(run, tmp_path, part)
    head, *body = rows(tmp_path / "signals.csv")
    assert head == ["time_s", "V_C1_V"]
    table = np.array(body, dtype=float)
    assert table.shape == (100, 2)
    volts = run.signal("V_C1")[2500:3500].reshape(100, 10).mean(axis=1)
    np.testing.assert_allclose(table[:, 1], volts, rtol=1e-9)
    np.testing.assert_allclose(table[[0, 49, 50], 0], [2.5045, 2.9945, 53.0045])


def test_matlab_reads_names_units_and_values(run, tmp_path):
    to_mat.export(run, tmp_path / "run.mat", Selection())
    content = scipy.io.loadmat(tmp_path / "run.mat", simplify_cells=True)
    np.testing.assert_allclose(
        content["V_K"]["values"], run.signal("V_K")[:], rtol=1e-6
    )
    assert content["V_K"]["unit"] == "V"
    np.testing.assert_allclose(content["time"][3000], 53.0)
    np.testing.assert_allclose(content["spikes"]["time"], run.spikes["time"])
    np.testing.assert_allclose(content["current"]["setpoint"], [0.25, 0.5])
    assert content["current"]["units"]["setpoint"] == "A"
    assert content["trials"]["units"]["level"] == "N"


def test_impossible_parts_are_refused(run, tmp_path):
    with pytest.raises(RunFolderError, match="stores no V_C2"):
        to_csv.export(run, tmp_path, Selection(signals=("V_C2",)))
    with pytest.raises(RunFolderError, match="1000 S/s; it cannot"):
        to_csv.export(run, tmp_path, Selection(rate=1e6))


BACKWARDS = "The run has nothing from .* begins before it ends"
PAUSE = "The run has no sample from .*: that is a planned pause"


@pytest.mark.parametrize(
    ("start", "end", "why"),
    [
        (2.0, 1.0, BACKWARDS),
        (1.0, 1.0, BACKWARDS),
        (99.0, None, BACKWARDS),
        (9.0, 12.0, PAUSE),
    ],
)
@pytest.mark.parametrize("form", [to_csv, to_mat])
def test_a_part_with_nothing_in_it_is_refused_and_touches_no_file(
    run, tmp_path, form, start, end, why
):
    """Ends before it begins, is empty, lies behind the run, or in a planned pause."""
    target = tmp_path / "made"
    before = {file: file.read_bytes() for file in form.export(run, target, Selection())}
    with pytest.raises(RunFolderError, match=why):
        form.export(run, target, Selection(start=start, end=end))
    assert {file: file.read_bytes() for file in before} == before


def test_a_refused_rate_touches_no_file(run, tmp_path):
    signals, *_ = to_csv.export(run, tmp_path, Selection())
    before = signals.read_bytes()
    with pytest.raises(RunFolderError, match="cannot be exported at"):
        to_csv.export(run, tmp_path, Selection(rate=1e6))
    assert signals.read_bytes() == before


def test_no_file_of_an_earlier_export_stays(run, tmp_path):
    folder = tmp_path / "csv"
    to_csv.export(run, folder, Selection())
    (folder / "notes.csv").write_text("mine")
    quiet = Selection(start=0.0, end=0.3)
    made = {file.name for file in to_csv.export(run, folder, quiet)}
    assert "spikes.csv" not in made
    assert {file.name for file in folder.iterdir()} == {*made, "notes.csv"}


def test_nwb_passes_its_inspector_with_spikes_in_seconds(run, tmp_path):
    pynwb = pytest.importorskip("pynwb")
    inspector = pytest.importorskip("nwbinspector")
    from tactile_lab.store.export import nwb

    file = tmp_path / "run.nwb"
    nwb.export(run, file, Selection())
    with pynwb.NWBHDF5IO(str(file), "r") as reader:
        session = reader.read()
        np.testing.assert_allclose(
            session.units["spike_times"][0], run.spikes["time"], rtol=1e-12
        )
        series = session.acquisition["V_K_2"]
        assert series.starting_time == pytest.approx(53.0)
        volts = series.data[:] * series.conversion + series.offset
        np.testing.assert_allclose(volts, run.signal("V_K")[3000:6000])
        assert series.unit == "volts"
        assert session.trials["label"][0] == 'the "120"'
        assert list(session.stimulus["applied_current"].timestamps) == [0.47, 54.0]
    messages = list(inspector.inspect_nwbfile(nwbfile_path=file))
    severe = [
        m
        for m in messages
        # a sensor has no species
        if m.check_function_name != "check_subject_species_exists"
        and m.importance.value >= inspector.Importance.BEST_PRACTICE_VIOLATION.value
    ]
    assert not severe, severe


def test_nwb_without_pynwb_says_what_to_install(run, tmp_path, monkeypatch):
    from tactile_lab.store.export import nwb

    monkeypatch.setitem(sys.modules, "pynwb", None)
    with pytest.raises(RunFolderError, match="pip install pynwb"):
        nwb.export(run, tmp_path / "run.nwb", Selection())


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
@pytest.mark.parametrize("form", ["csv", "mat"])
def test_a_signal_that_meets_the_end_of_an_object_is_told_in_no_trace(
    complete, tmp_path, form
):
    program = """
import os
import signal
import sys
from tactile_lab.cli import main
from tactile_lab.store.selection import Selection

whole = Selection.pieces

class Ends:
    met = False  # a second signal ends it at once

    def __del__(self):
        if not Ends.met:
            Ends.met = True
            os.kill(os.getpid(), signal.SIGTERM)

def pieces(self, run):
    for piece in whole(self, run):
        Ends()
        yield piece

Selection.pieces = pieces
main(sys.argv[1:])
"""
    asked = ("export", complete, "--to", form, "--out", tmp_path / "out")
    done = subprocess.run(
        [sys.executable, "-c", program, *asked],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 128 + signal.SIGTERM, done.stderr
    assert "Traceback" not in done.stderr
    assert not list(tmp_path.rglob("*.part*"))
    assert not (tmp_path / "out").is_file()


SWALLOWED = """
import os
import signal
import sys
import time
from tactile_lab.cli import main
from tactile_lab.store.export import csv
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection

class Ends:
    def __del__(self):
        os.kill(os.getpid(), signal.{name})

def wait():
    until = time.monotonic() + {wait}
    while time.monotonic() < until:
        pass

def met(method):
    def ends(*arguments):
        Ends()
        wait()
        return method(*arguments)
    return ends

signal.signal(signal.SIGINT, signal.default_int_handler)  # may be ignored, as by nohup
{meets}
main(sys.argv[1:])
"""


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM"])
@pytest.mark.parametrize("meets", ["Run.load", "Selection.check"])
def test_a_signal_that_an_objects_end_swallowed_ends_it_without_progress(
    complete, tmp_path, name, meets
):
    """It was lost before the progress began, and the export went on."""
    done = export_to_csv(complete, tmp_path / "out", name, meets, wait=60)
    assert done.returncode == 128 + getattr(signal, name), done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
def test_a_signal_that_is_swallowed_after_the_last_update_is_heeded(complete, tmp_path):
    done = export_to_csv(complete, tmp_path / "out", "SIGTERM", "csv.tables", wait=0)
    assert done.returncode == 128 + signal.SIGTERM, done.stderr
    assert done.stdout == done.stderr == ""


def export_to_csv(run, out, name, meets, *, wait):
    """The program, ended: a signal meets an object's end where that is called."""
    program = SWALLOWED.format(name=name, meets=f"{meets} = met({meets})", wait=wait)
    return subprocess.run(
        [sys.executable, "-c", program, "export", run, "--to", "csv", "--out", out],
        capture_output=True, text=True, check=False,
    )  # fmt: skip


TOLD_TO_END = """
import os
import signal
import sys
from tactile_lab.cli import main
from tactile_lab.store.selection import Selection

whole = Selection.pieces
signal.signal(signal.{name}, signal.SIG_DFL)  # nohup has SIGHUP ignored, and is heeded

def pieces(self, run):
    for piece in whole(self, run):
        try:
            if os.path.isdir(sys.argv[-1]):  # once its size is reckoned
                os.kill(os.getpid(), signal.{name})
        except BaseException:
            if not {swallowed}:  # as a callback from C does
                raise
        yield piece

Selection.pieces = pieces
main(sys.argv[1:])
"""


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
@pytest.mark.parametrize("swallowed", [False, True])
@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
def test_an_export_that_is_told_to_end_leaves_nothing(
    complete, tmp_path, name, swallowed
):
    """It left a hidden part, which SIGINT took away."""
    program, out = TOLD_TO_END.format(name=name, swallowed=swallowed), tmp_path / "out"
    asked = ("export", complete, "--to", "csv", "--out", out)
    done = subprocess.run(
        [sys.executable, "-c", program, *asked],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 128 + getattr(signal, name), done.stderr
    assert "Traceback" not in done.stderr
    assert list(out.iterdir()) == []
