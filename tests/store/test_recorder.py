"""What goes into a run comes out of it, sample by sample and spike by spike."""

import json
import tracemalloc

import h5py
import hdf5plugin  # noqa: F401
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tactile_lab.errors import RecordingError, RunFolderError
from tactile_lab.scope import Block
from tactile_lab.store.applied import BY_HOST, BY_SAMPLES
from tactile_lab.store.folder import RunFolder, read_info
from tactile_lab.store.layout import Layout
from tactile_lab.store.overrange import told, unsearched
from tactile_lab.store.recorder import Recorder
from tactile_lab.store.run import Run
from tactile_lab.store.stored_run import ended
from tactile_lab.trial import Outcome, Trial
from tactile_lab.waveform import Waveform


@settings(
    max_examples=25,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    samples=st.integers(1, 6000),
    size=st.integers(1, 3000),
    shift=st.sampled_from([0, 8]),
)
def test_every_sample_comes_back_for_any_block_size(
    bench, tmp_path, samples, size, shift
):
    folder = RunFolder.create(tmp_path, "any", {})
    layout = Layout(signals=bench.SIGNALS, detection=bench.DETECTION, simulated=True)
    recorder = Recorder(folder, layout, reserve=0)
    made = bench.codes(samples) + np.int16(0 if shift else 3)
    spikes = bench.play(recorder, made, size, source=bench.stream(shift=shift))
    recorder.close("complete", produced=samples)
    with Run.load(folder.path) as run:
        assert run.samples == samples
        for row, name in enumerate(bench.SIGNALS):
            signal = run.signal(name)
            np.testing.assert_array_equal(signal.scope_codes(0, samples), made[row])
            np.testing.assert_allclose(
                signal[:], made[row] / 32512 * 5.0 - 0.5 * row, atol=1e-12
            )
        assert run.spikes.size == spikes
    info = json.loads((folder.path / "run.json").read_text())
    assert info["status"] == "complete"
    assert info["samples"]["V_K"] == {"produced": samples, "written": samples}


def test_spikes_are_at_the_stored_samples_they_came_from(bench, recorder, folder):
    made = bench.codes(10_000)
    bench.play(recorder, made, 777, start=2.0)
    recorder.close("complete", 10_000)
    with Run.load(folder.path) as run:
        where = np.arange(701, 10_000, 701)
        np.testing.assert_array_equal(np.ceil(run.spikes["sample"]), where)
        np.testing.assert_allclose(
            run.spikes["time"], 2.0 + run.spikes["sample"] * 1e-3
        )
        np.testing.assert_allclose(run.spikes["amplitude"], 25600 / 32512 * 5.0 - 0.5)
        assert run.detection == bench.DETECTION


def test_a_gap_is_recorded_and_time_goes_on_right(bench, recorder, folder):
    made = bench.codes(5000)
    recorder.segment(bench.stream(), 0.0)
    recorder.append(bench.block(made, 0, 2000))
    recorder.append(bench.block(made, 2500, 2500))
    recorder.close("faulted", 5000)
    with Run.load(folder.path) as run:
        assert run.samples == 4500
        gap = run.records("gaps")
        assert gap["sample"].tolist() == [2000]
        assert gap["missing"].tolist() == [500]
        time = run.signal("V_C1").time()
        np.testing.assert_allclose(time[[0, 1999, 2000, -1]], [0, 1.999, 2.5, 4.999])


def test_a_spike_ended_by_a_gap_keeps_its_place(bench, recorder, folder):
    made = np.zeros((2, 300), np.int16)
    made[1, 100:] = 25600
    recorder.segment(bench.stream(), 0.0)
    recorder.append(bench.block(made, 0, 200))
    recorder.append(bench.block(made, 250, 50))
    found = np.array(
        [(99.5, 25600, np.nan)],
        dtype=[("sample", "f8"), ("amplitude", "i2"), ("width", "f4")],
    )
    recorder.spikes(found["sample"] * 1e-3, found)
    recorder.close("faulted", 300)
    with Run.load(folder.path) as run:
        assert run.spikes["sample"].tolist() == [99.5]


def test_samples_that_come_twice_are_refused(bench, recorder):
    made = bench.codes(100)
    recorder.segment(bench.stream(), 0.0)
    recorder.append(bench.block(made, 0, 100))
    with pytest.raises(RecordingError, match="came twice"):
        recorder.append(bench.block(made, 50, 50))
    recorder.close("faulted")


def test_codes_that_need_more_than_8_bits_are_refused(bench, recorder):
    recorder.segment(bench.stream(), 0.0)
    with pytest.raises(RecordingError, match="V_C1 use more than"):
        recorder.append(bench.block(bench.codes(100) + np.int16(1), 0, 100))
    recorder.close("faulted")


def test_pause_makes_two_segments_and_no_gap(bench, recorder, folder):
    made = bench.codes(3000)
    bench.play(recorder, made, 500, start=0.0)
    recorder.pause(3.0, 53.0)
    bench.play(recorder, made, 500, start=53.0, source=bench.stream(started=63.0))
    recorder.close("complete", 6000)
    with Run.load(folder.path) as run:
        assert run.records("gaps").size == 0
        assert run.records("pauses").tolist() == [(3.0, 53.0)]
        signal = run.signal("V_K")
        np.testing.assert_allclose(signal.time()[[2999, 3000]], [2.999, 53.0])
        part = signal.between(53.0, 53.01)
        assert (part.start, part.stop) == (3000, 3010)
        where = np.arange(701, 3000, 701)
        samples = np.ceil(run.spikes["sample"])
        np.testing.assert_array_equal(samples, [*where, *(3000 + where)])
        np.testing.assert_allclose(
            run.spikes["time"][where.size :], 53.0 + run.spikes["time"][: where.size]
        )


def test_slow_records_events_and_trials_come_back(bench, recorder, folder):
    recorder.event(0.0, "opened", "coil: µ source")
    bench.play(recorder, bench.codes(100), 100)
    recorder.current(0.5, 1.0, None)
    recorder.current(0.6, 1.0, 0.99)
    recorder.field(0.7, 11e-3)
    trial = Trial(
        force=Waveform.pulse(0.12, ramp=0.25, hold=2.0), label="120 mN", level=0.12
    )
    nothing = np.empty(0)
    recorder.outcome(
        Outcome(trial=trial, index=3, start=1.0, spike_times=nothing, current=nothing)
    )
    recorder.event(9.0, "running", "x" * 159 + "µ")
    recorder.close("complete", 100)
    with Run.load(folder.path) as run:
        assert np.isnan(run.current["measured"][0])
        assert run.current["measured"][1] == pytest.approx(0.99)
        assert run.read_back.tolist() == [[0.5, 1.0], [0.6, 0.99]]
        assert run.field.tolist() == [(0.7, 11e-3)]
        assert run.trials["label"].tolist() == [b"120 mN"]
        assert run.trials[0]["end"] == pytest.approx(3.5)
        assert np.isnan(run.trials[0]["hold_start"])
        assert run.events["text"][0].decode() == "coil: µ source"
        assert run.events["text"][1].decode() == "x" * 159
    lines = [
        json.loads(x) for x in (folder.path / "log.jsonl").read_text().split("\n")[:-1]
    ]
    assert lines[1]["text"] == "x" * 159 + "µ"


def test_a_trial_has_one_row_from_its_begin_on(bench, recorder, folder):
    push = Waveform.pulse(0.12, ramp=0.25, hold=2.0)
    trial = Trial(force=push, label="120 mN", level=0.12, hold=(0.25, 2.25))
    nothing = np.empty(0)
    recorder.begun(0, trial, 0.0)
    recorder.outcome(
        Outcome(trial=trial, index=0, start=0.0, spike_times=nothing, current=nothing)
    )
    recorder.begun(1, trial, 2.5)
    bench.play(recorder, bench.codes(4000), 500)  # 4 s, a spike every 0.701 s
    recorder.close("aborted", 4000)
    with Run.load(folder.path) as run:
        assert ended(run.records("trials")).tolist() == [True, False]
        assert run.duration == pytest.approx(4.0)
        assert run.trials["end"] == pytest.approx([2.5, 4.0])
        assert run.trials["hold_end"] == pytest.approx([2.25, 1.5])
        assert run.trials["spikes"].tolist() == [3, 2]


def test_alignment_moves_the_segment(bench, recorder, folder):
    bench.play(recorder, bench.codes(2000), 500)
    recorder.align(offset=0.25, drift=1e-4, uncertainty=1e-5)
    recorder.close("complete", 2000)
    with Run.load(folder.path) as run:
        time = run.signal("V_C1").time()
        assert time[1000] == pytest.approx(0.25 + 1.0001, abs=1e-12)
        assert run.records("segments")["uncertainty"].tolist() == [1e-5]


def test_points_of_a_list_move_with_the_samples_that_dated_them(
    bench, recorder, folder
):
    bench.play(recorder, bench.codes(2000), 500)
    for time, listed in (
        (0.4, 0),
        (0.5, BY_SAMPLES),
        (1.5, BY_SAMPLES),
        (1.6, BY_HOST),
    ):
        recorder.current(time, time, None, listed=listed)
    recorder.align(offset=0.25, drift=1e-4, uncertainty=1e-5)
    recorder.close("complete", 2000)
    with Run.load(folder.path) as run:
        moved = [0.4, 0.75 + 0.5e-4, 1.75 + 1.5e-4, 1.6]
        assert run.current["time"] == pytest.approx(moved, abs=1e-12)


def test_over_range_is_flagged_per_block_and_channel(bench, recorder, folder):
    made = bench.codes(300)
    recorder.segment(bench.stream(), 0.0)
    for first, over in ((0, (False, False)), (100, (False, True)), (200, (True, True))):
        recorder.append(bench.block(made, first, 100, over=over))
    recorder.close("complete", 300)
    with Run.load(folder.path) as run:
        assert run.records("overrange").tolist() == [(100, 100, 2), (200, 100, 3)]
        np.testing.assert_allclose(run.overrange("V_K"), [[0.1, 0.3]])
        np.testing.assert_allclose(run.overrange("V_C1"), [[0.2, 0.3]])
        assert [line.split(",")[0] for line in told(run)] == [
            "V_C1 left the range of scope input A",
            "V_K left the range of scope input B",
        ]
        assert "−5 V to 5 V, at 0.2 to 0.3 s (100 ms in all)" in told(run)[0]


@pytest.mark.parametrize(
    ("rests", "peak", "told_whole"),
    [(0, 127, True), (120, 127, False), (-127, 100, False)],
    ids=["cut off at its top", "never below the threshold", "at the other end"],
)
def test_spikes_cut_off_at_their_top_are_told_and_no_others(
    bench, recorder, folder, rests, peak, told_whole
):
    made = np.zeros((2, 300), np.int16)
    made[1] = rests * 256
    made[1, 150::40] = peak * 256
    recorder.segment(bench.stream(), 0.0)
    for first in range(0, 300, 100):
        over = (False, first == 100)
        recorder.append(bench.block(made, first, 100, over=over))
    recorder.close("complete", 300)
    with Run.load(folder.path) as run:
        assert unsearched(run).tolist() == ([] if told_whole else [[0.1, 0.2]])
        (text,) = told(run)
        assert ("spikes are counted and timed" in text) is told_whole


def test_a_shunt_beyond_its_range_dates_no_step(bench, folder):
    layout = Layout(signals=("coil_current",), simulated=True)
    recorder = Recorder(folder, layout, reserve=0)
    recorder.segment(bench.stream(names=("coil_current",)), 0.0)
    steps = np.repeat(np.arange(8) % 2, 100)[None].astype(np.int16) * np.int16(25600)
    for first in range(0, 800, 100):
        part = steps[:, first : first + 100]
        recorder.append(
            Block(first=first, codes=part, overrange=(first == 300,), received=0.0)
        )
    recorder.close("complete", 800)
    with Run.load(folder.path) as run:
        assert run.shunt(0.35, 0.36)[0].size == 0
        assert run.shunt(0.45, 0.46)[0].size > 0


def test_only_asked_signals_are_stored(bench, folder):
    layout = Layout(signals=("V_C1",), detection=bench.DETECTION, simulated=False)
    recorder = Recorder(folder, layout, reserve=0)
    bench.play(recorder, bench.codes(3000), 100)
    recorder.close("complete", 3000)
    with Run.load(folder.path) as run:
        assert run.signals == ("V_C1",)
        assert run.spikes.size == 4
        with pytest.raises(RunFolderError, match="stores no V_K; it stores V_C1"):
            run.signal("V_K")


def test_spikes_alone_have_times(bench, folder):
    layout = Layout(signals=(), detection=bench.DETECTION, simulated=False)
    recorder = Recorder(folder, layout, reserve=0)
    recorder.event(0.0, "opened", "scope")
    bench.play(recorder, bench.codes(3000), 100)
    recorder.close("complete", 3000)
    with Run.load(folder.path) as run:
        assert run.signals == ()
        np.testing.assert_allclose(
            np.ceil(run.spikes["time"] * 1000), [701, 1402, 2103, 2804]
        )


def test_signal_that_is_not_streamed_is_refused(bench, folder):
    layout = Layout(signals=("V_C2",), detection=None, simulated=True)
    recorder = Recorder(folder, layout, reserve=0)
    with pytest.raises(RecordingError, match="V_C2 shall be stored"):
        recorder.segment(bench.stream(), 0.0)
    recorder.close("faulted")


def test_plain_h5py_reads_what_the_documentation_says(bench, recorder, folder):
    made = bench.codes(3000)
    bench.play(recorder, made, 100)
    recorder.close("complete", 3000)
    with h5py.File(folder.path / "data.h5") as file:
        samples = file["samples/V_K"]
        volts = samples.attrs["gain"] * samples[:] + samples.attrs["offset"]
        np.testing.assert_allclose(volts, made[1] / 32512 * 5.0 - 0.5)
        assert samples.attrs["unit"] == "V"


def test_envelope_shows_every_spike_at_any_zoom(bench, recorder, folder):
    made = bench.codes(60_000)
    bench.play(recorder, made, 5000)
    recorder.close("complete", 60_000)
    with Run.load(folder.path) as run:
        signal = run.signal("V_K")
        volts = made[1] / 32512 * 5.0 - 0.5
        for start, stop, cells in ((0, None, 50), (100, 59_000, 7), (690, 720, 1000)):
            picture = signal.trace(start, stop, cells=cells)
            assert picture.low.size <= 2 * cells
            assert picture.high.max() == pytest.approx(volts[start:stop].max())
            assert picture.low.min() == pytest.approx(volts[start:stop].min())
            assert np.all(
                (picture.low <= picture.mean) & (picture.mean <= picture.high)
            )
        assert signal.trace(cells=1).mean == pytest.approx(volts.mean())
        whole = signal.trace(cells=40)
        spikes = np.searchsorted(
            whole.time, np.arange(701, 60_000, 701) * 1e-3, "right"
        )
        assert np.all(whole.high[spikes - 1] > 3.0)


def test_a_long_signal_is_seen_whole_in_little_memory(
    bench, recorder, folder, monkeypatch
):
    """The cells of an hour at 1 MS/s took 148 MB to read, and kept 85 of them."""
    bench.play(recorder, np.zeros((2, 1 << 22), np.int16), 1 << 20)
    recorder.close("complete", 1 << 22)
    with Run.load(folder.path) as run:
        taken = []
        # what is loaded first stays; a dict of h5py's for all files may grow once
        for bins in (64, 64, 64, 1 << 20, 1 << 20):
            monkeypatch.setattr("tactile_lab.store.signal.AT_ONCE", bins)
            signal = run.signal("V_K")
            tracemalloc.start()
            signal.trace(cells=50)
            taken.append(tracemalloc.get_traced_memory())
            tracemalloc.stop()
    _, *parts, one, other = taken
    kept, most = map(min, zip(*parts, strict=True))
    whole_kept, whole = map(min, zip(one, other, strict=True))
    assert most < 0.5 * whole
    assert kept < 0.5 * whole_kept


@pytest.mark.parametrize("kept_out", [0, 3, 60])
def test_a_part_of_the_pyramid_is_that_of_the_whole(bench, recorder, folder, kept_out):
    """Also where a crash kept the last entries out of it."""
    bench.play(recorder, bench.codes(60_000), 5000)
    recorder.close("complete", 60_000)
    with h5py.File(folder.path / "data.h5", "r+") as file:
        pyramid = file["pyramid/V_K"]
        pyramid.resize((len(pyramid) - kept_out,))
    with Run.load(folder.path) as run:
        whole = run.signal("V_K")
        whole.trace(cells=50)
        for start, stop in ((0, 5120), (30_000, 40_000), (50_000, 60_000)):
            one = run.signal("V_K").trace(start, stop, cells=8)
            other = whole.trace(start, stop, cells=8)
            for name in ("time", "low", "high", "mean"):
                np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_xarray_has_units_and_time(bench, recorder, folder):
    pytest.importorskip("xarray")
    bench.play(recorder, bench.codes(3000), 100)
    recorder.close("complete", 3000)
    with Run.load(folder.path) as run:
        data = run.to_xarray(1.0, 2.0)
    assert data["V_C1"].attrs["units"] == "V"
    assert data["time"].size == 1000
    assert float(data["time"][0]) == pytest.approx(1.0)


def test_a_run_whose_data_was_deleted_meanwhile_is_faulted(bench, recorder, folder):
    bench.play(recorder, bench.codes(5000), 500)
    (folder.path / "data.h5").unlink()
    with pytest.raises(RecordingError, match="deleted while the run was recorded"):
        recorder.close("complete", 5000)
    assert read_info(folder.path)["status"] == "faulted"
