"""NWB holds what the other formats hold, at the times that they have."""

from datetime import datetime

import numpy as np
import pytest
from peak_memory import peak, tells_peak

from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load
from tactile_lab.store.export import nwb
from tactile_lab.store.export.content import tables
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.trial import Outcome, Trial
from tactile_lab.voltage_source import HeldVoltage
from tactile_lab.waveform import Waveform

pynwb = pytest.importorskip("pynwb")

MEASURED_I_DS = """
name = "drain current on a scope channel"
simulated = true
[coil]
baud = 19200
[scope]
driver = "ps3000a"
[[scope.channels]]
signal = "V_C1"
input = "A"
range = "2 V"
offset = "-2.5 V"
[[scope.channels]]
signal = "I_DS"
input = "B"
range = "2 V"
scale = 1e-7
[[scope.channels]]
signal = "V_K"
input = "C"
range = "5 V"
[magnet]
r = "6 mm"
"""
DRIFT = 8e-5
"""Of the scope's clock in `recorded`, s/s."""


@pytest.fixture
def recorded(bench, recorder, folder):
    """Eleven stretches of 200 samples at 1 kS/s, two clocks apart, and every table."""
    for number in range(11):
        start = 3.0 * number
        bench.play(
            recorder, bench.codes(200, every=70), 100, start=start,
            source=bench.stream(started=start),
        )  # fmt: skip
        recorder.align(offset=0.0, drift=DRIFT, uncertainty=1e-3)
        if number < 10:
            recorder.pause(start + 0.2, start + 3.0)
    recorder.current(0.5, 0.25, 0.24, asked=0.44, acted=0.47)
    recorder.field(0.06, 11e-3)
    recorder.temperature(0.07, 296.0)
    held = HeldVoltage(time=0.08, setpoint=1.4, voltage=1.4001, current=1e-9)
    recorder.voltage("V_GS", held)
    recorder.event(0.09, "warning", "the table was touched")
    trial = Trial(
        force=Waveform.pulse(0.12, ramp=0.05, hold=0.1), label="120 mN", level=0.12
    )
    nothing = np.empty(0)
    recorder.outcome(
        Outcome(trial=trial, index=0, start=0.0, spike_times=nothing, current=nothing)
    )
    recorder.close("complete", 2200)
    with Run.load(folder.path) as loaded:
        yield loaded


@pytest.fixture(scope="module")
def held(tmp_path_factory):
    """200 mN for 0.8 s, the drain current measured."""
    out = tmp_path_factory.mktemp("runs")
    bench = out / "bench.toml"
    bench.write_text(MEASURED_I_DS)
    asked = (
        'protocol.levels=["200 mN"]', "protocol.hold=0.8 s", "protocol.rest=0.3 s",
        'record.signals=["force", "V_C1", "I_DS", "V_K", "spikes", "rate"]',
        "record.sample_rate=1 MS/s",
    )  # fmt: skip
    done = Execution(load("demo", asked, bench), out / "runs").run()
    assert done.exit_code == 0, done.reason
    with Run.load(done.folder) as run:
        yield run


@pytest.fixture
def session(tmp_path):
    """Exports a part of a run, and opens what was written."""
    opened = []

    def write(run, **part):
        file = tmp_path / f"{len(opened)}.nwb"
        nwb.export(run, file, Selection(**part))
        opened.append(pynwb.NWBHDF5IO(str(file), "r"))
        return opened[-1].read()

    yield write
    for file in opened:
        file.close()


def test_each_table_of_the_run_is_there(recorded, session):
    read, found = session(recorded), tables(recorded, Selection())
    assert set(found) == {
        "spikes", "current", "field", "temperature", "voltages", "events", "trials",
    }  # fmt: skip
    for name in ("field", "temperature"):
        series = read.acquisition[name]
        assert list(series.data) == list(found[name].columns[name])
        assert list(series.timestamps) == list(found[name].columns["time"])
    assert read.acquisition["temperature"].unit == "kelvins"
    for name in ("spikes", "current", "voltages", "events"):
        table = read.processing["misc"][name]
        for column, values in found[name].columns.items():
            held = table["voltage" if column == "name" else column]
            np.testing.assert_array_equal(held.data[:], values)
            unit = found[name].units[column]
            assert held.description.endswith(f", {unit}" if unit else column)
    trials = found["trials"].columns
    for name in ("spikes", "pause", "complete", "level"):
        np.testing.assert_array_equal(read.trials[name].data[:], trials[name])


def test_samples_lie_where_their_clock_puts_them(recorded, session):
    read = session(recorded)
    names = [name for name in read.acquisition if name.startswith("V_K_")]
    assert names == [f"V_K_{number:02}" for number in range(1, 12)]
    times = []
    for name in names:
        series = read.acquisition[name]
        count = series.data.shape[0]
        times.append(series.starting_time + np.arange(count) / series.rate)
    axis = recorded.signal("V_K").time()
    np.testing.assert_allclose(np.concatenate(times), axis, rtol=0, atol=1e-9)


def test_times_are_from_the_moment_of_the_first_sample_on(held, session, monkeypatch):
    """All were early by the time from the folder's making to the first sample."""
    read, info = session(held), held.info
    assert read.acquisition["V_C1"].starting_time == 0.0
    assert read.session_start_time == datetime.fromisoformat(info["time_zero"])
    assert info["time_zero"] > info["started"]
    older = {key: value for key, value in info.items() if key != "time_zero"}
    monkeypatch.setattr(held, "info", older)
    read = session(held)
    assert read.session_start_time == datetime.fromisoformat(info["started"])
    assert "time_zero: not known" in read.notes


def test_silence_is_told_only_of_what_was_listened_to(recorded, session):
    intervals = session(recorded, end=4.0).units["obs_intervals"][0]
    stretch = 200 * 1e-3 * (1 + DRIFT)
    np.testing.assert_allclose(intervals, [[0.0, stretch], [3.0, 3.0 + stretch]])


def test_a_part_without_a_spike_passes_nwb_s_own_inspector(held, session, tmp_path):
    """An empty train ended three of its checks with an error."""
    inspector = pytest.importorskip("nwbinspector")
    first = float(held.spikes["time"][0])
    read = session(held, end=first / 2)
    assert read.units is None
    (silent,) = read.intervals["silence"].to_dataframe().to_numpy()[:, :2]
    np.testing.assert_allclose(silent, [0.0, first / 2], rtol=0, atol=2e-6)
    told = inspector.inspect_nwbfile(nwbfile_path=tmp_path / "0.nwb")
    grave = inspector.Importance.CRITICAL.value
    assert not [one for one in told if one.importance.value >= grave]


def test_a_force_that_rests_in_the_part_is_told(held, session):
    begin = float(held.trials["start"][0])
    start, end = begin + 0.9, begin + 0.91
    read = session(held, start=start, end=end)
    force, rate = read.stimulus["force"], read.processing["ecephys"]["rate"]
    for series in (force, rate):
        assert (series.timestamps[0], series.timestamps[-1]) == (start, end)
    assert force.data[:] == pytest.approx(0.2, rel=0.01)
    _, expected = Selection(start=start, end=end).read(held)
    assert expected["rate"][0] > 5
    assert rate.data[0] == pytest.approx(expected["rate"][0])


def test_nothing_is_told_of_the_time_after_the_run(held, session):
    rate = session(held).processing["ecephys"]["rate"]
    assert (rate.timestamps[0], rate.data[0]) == (0.0, 0.0)
    assert rate.timestamps[-1] == held.duration


def test_a_drain_current_that_was_measured_is_not_derived_as_well(held, session):
    read = session(held)
    assert "I_DS" in read.acquisition
    assert set(read.processing["ecephys"].data_interfaces) == {"rate"}


@tells_peak
def test_samples_are_read_as_they_are_written(bench, recorder, folder, tmp_path):
    made = np.tile(bench.codes(1 << 20), 60)
    recorder.segment(bench.stream(interval=1e-6), 0.0)
    for first in range(0, made.shape[1], 1 << 20):
        recorder.append(bench.block(made, first, 1 << 20))
    recorder.close("complete", made.shape[1])
    with Run.load(folder.path) as run:
        nwb.export(run, tmp_path / "part.nwb", Selection(end=0.01))
        told: list[float] = []
        took, _ = peak(
            lambda: nwb.export(run, tmp_path / "run.nwb", Selection(), told.append)
        )
        assert 2 * run.samples / 1e6 > 120
    assert took < 100
    assert told == sorted(told) and len(told) > 40 and told[-1] == 1.0
