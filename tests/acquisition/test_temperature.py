"""The sensor's temperature: an analogue thermometer on a scope channel, or a serial."""

from types import SimpleNamespace

import numpy as np
import pytest
from benches import WITH_A_SOURCE_METER

from sim_backend.bench import open_bench
from sim_backend.plant.options import PlantOptions
from sim_backend.plant.plant import Plant
from sim_backend.serial_line.faults import SerialFault
from sim_backend.thermometer import SensorFault
from tactile_lab.acquisition.events import RunState, TemperatureRead
from tactile_lab.engine.execution import Execution
from tactile_lab.engine.jobs import InstrumentAnswer
from tactile_lab.errors import SceneError
from tactile_lab.magnetics import Magnet
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest_V_C1
from tactile_lab.model.temperature import at_temperature, temperature
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.report.from_run import read
from tactile_lab.scene.load import load
from tactile_lab.scope import Channel
from tactile_lab.store.folder import read_info
from tactile_lab.store.run import Run

THERMOMETER = """
[[scope.channels]]
signal = "temperature"
input = "B"
range = "500 mV"
kelvin_per_volt = "100 K/V"
zero_at = "273.15 K"
[magnet]
"""
QUIET = (
    "protocol.duration=4 s",
    "record.sample_rate=20 kS/s",
    'record.signals=["V_C1", "temperature"]',
)


@pytest.fixture
def scene(tmp_path):
    file = tmp_path / "bench.toml"
    file.write_text(WITH_A_SOURCE_METER.replace("[magnet]", THERMOMETER))
    return lambda *overrides: load("monitor", (*QUIET, *overrides), file)


def test_volts_become_kelvin():
    channel = Channel(
        signal="temperature", input="B", kelvin_per_volt=100.0, zero_at=273.15
    )
    assert channel.scale == 100.0
    assert (0.25 - channel.zero) * channel.scale == pytest.approx(298.15)
    low, high = channel.span
    assert low < 273.15 < high


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ('kelvin_per_volt = "100 K/V"', "temperature needs kelvin_per_volt"),
        ('signal = "temperature"', "belongs to"),
    ],
)
def test_a_channel_without_its_conversion_is_refused(tmp_path, line, said):
    file = tmp_path / "bench.toml"
    text = WITH_A_SOURCE_METER.replace("[magnet]", THERMOMETER)
    file.write_text(text.replace(line, 'signal = "I_DS"' if "signal" in line else ""))
    with pytest.raises(SceneError, match=said):
        load("monitor", (), file)


def test_it_is_read_kept_and_exported_and_its_samples_are_not_stored(scene, tmp_path):
    seen = []
    made = scene()
    done = Execution(made, tmp_path / "runs", emit=seen.append).run()
    assert done.state is RunState.COMPLETE, done.reason
    believed = temperature(made.circuit)
    with Run.load(done.folder) as run:
        assert "temperature" not in run.signals
        rows = run.temperature
        assert len(rows) >= 15
        # one code is 0.4 K: a mean over 200 ms is finer where noise smooths it
        assert rows["temperature"] == pytest.approx(believed, abs=0.4)
        assert len(run.to_pandas("temperature")) == len(rows)
    assert sum(isinstance(one, TemperatureRead) for one in seen) == len(rows)
    measured = read(done.folder)
    assert measured.temperature.shape == (len(rows), 2)
    told = dict(plan(made).uses)
    assert told["channel B: temperature"] == "kept as means of 200 ms"


def test_it_is_left_out_where_the_scene_does_not_record_it(scene):
    quiet = scene('record.signals=["V_C1"]')
    assert [c.signal for c in needs(quiet).channels] == ["V_C1"]


def test_a_bench_without_a_thermometer_is_told_so(tmp_path):
    with pytest.raises(
        SceneError, match=r"neither \[thermometer\] nor a scope channel"
    ):
        needs(load("monitor", QUIET))


SERIAL = """
[thermometer]
dialect = "lakeshore-335"
input = "A"
[magnet]
"""


@pytest.fixture
def serial(tmp_path):
    file = tmp_path / "serial.toml"
    file.write_text(WITH_A_SOURCE_METER.replace("[magnet]", SERIAL))
    return lambda *overrides: load("monitor", (*QUIET, *overrides), file)


def test_a_serial_one_is_read_kept_and_exported(serial, tmp_path):
    seen, made = [], serial()
    done = Execution(made, tmp_path / "runs", emit=seen.append).run()
    assert done.state is RunState.COMPLETE, done.reason
    believed = temperature(made.circuit)
    with Run.load(done.folder) as run:
        rows = run.temperature
        assert len(rows) >= 8
        assert rows["temperature"] == pytest.approx(believed, abs=0.03)
        assert len(run.to_pandas("temperature")) == len(rows)
    assert sum(isinstance(one, TemperatureRead) for one in seen) == len(rows)
    info = read_info(done.folder)
    assert info["temperature"]["from"] == "thermometer"
    assert info["temperature"]["K"] == pytest.approx(believed, abs=0.03)
    assert info["instruments"]["thermometer"]["identity"].startswith("LSCI,MODEL335")
    assert info["instruments_planned"].keys() == info["instruments"].keys()
    assert info["instruments_changed"] == []  # it is no setting that moved
    found = dict(plan(made).uses)
    assert found["thermometer"] == "lakeshore-335 reads the sensor's temperature"


def test_a_serial_one_is_left_out_where_the_scene_does_not_record_it(serial):
    quiet = serial('record.signals=["V_C1"]')
    assert not needs(quiet).thermometer
    assert ("thermometer", "temperature is not recorded") in plan(quiet).leaves_out
    made = open_bench(quiet, needs(quiet))
    assert made.thermometer is None


def test_a_serial_ones_input_is_checked_before_anything_is_opened(serial):
    with pytest.raises(SceneError, match=r'\[thermometer\] input = "E".* Known: A, B'):
        needs(serial("bench.thermometer.input=E"))


def test_the_temperature_is_not_measured_twice(tmp_path):
    file = tmp_path / "bench.toml"
    both = WITH_A_SOURCE_METER.replace("[magnet]", THERMOMETER)
    file.write_text(both.replace("[magnet]", SERIAL))
    with pytest.raises(SceneError, match="the temperature is measured twice"):
        load("monitor", QUIET, file)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        (SensorFault(after=2.0), "480 K at its input A is no reading"),
        (SerialFault(kind="unplug", after=2.0, times=None), "link to the thermometer"),
        (SerialFault(kind="missing", after=2.0, times=None), "thermometer at"),
    ],
)
def test_a_thermometer_that_fails_ends_the_run_with_what_was_read(
    serial, tmp_path, fault, said
):
    made = serial('record.signals=["V_C1", "temperature"]')

    bench = open_bench(made, needs(made), thermometer_faults=(fault,))
    done = Execution(made, tmp_path / "runs", bench=bench).run()
    assert done.state is RunState.FAULTED
    assert said in done.reason
    assert done.off.verified
    with Run.load(done.folder) as run:
        kelvin = run.temperature["temperature"]
        assert len(kelvin) >= 3
        assert kelvin == pytest.approx(temperature(made.circuit), abs=0.03)


def test_the_simulated_sensor_warms_and_its_voltages_follow(scene, tmp_path):
    warm = scene("simulated.warming=45 K", "simulated.warming_time=1 s")
    done = Execution(warm, tmp_path / "runs").run()
    with Run.load(done.folder) as run:
        rows = run.temperature["temperature"]
        assert rows[-1] - rows[0] > 1.0
        last = run.signal("V_C1")[-2000:].mean()
    believed = warm.circuit
    hot = at_temperature(believed, temperature(believed) + 45 * 0.98)
    assert abs(rest_V_C1(hot) - rest_V_C1(believed)) > 0.03
    assert last == pytest.approx(rest_V_C1(hot), abs=0.015)


def test_slices_of_any_size_show_the_same_warming_world():
    wiring = (
        Channel(signal="V_C1", input="A", range=5.0),
        Channel(signal="temperature", input="B", range=5.0, kelvin_per_volt=100.0),
    )

    def rendered(size):
        options = PlantOptions(warming=5.0, warming_time=0.5)
        plant = Plant(Circuit(), Magnet(r=6e-3), options)
        parts = [
            plant.render(i, size, 1e-4, 0.0, wiring, 32512, 8)[0]
            for i in range(0, 20_000, size)
        ]
        return np.concatenate(parts, axis=1)

    one, other = rendered(20_000).astype(int), rendered(2_500).astype(int)
    assert np.abs(one - other)[0].max() <= 256  # a code


def test_its_chip_tells_who_it_is_and_what_it_reads(serial):
    from gui.session.chips import Chips
    from gui.session.expectation import expect
    from gui.session.heard import Heard
    from gui.session.log import Log
    from gui.session.status import Status
    from gui.state import Lamp, WindowState

    answers = (InstrumentAnswer("thermometer", "LSCI,MODEL335,12/0,1.0", ""),)
    status = Status(Log())
    status.state = WindowState.READY
    bench = SimpleNamespace(answers=answers, age=0.0, known=True, field=None)
    answered = {"thermometer": Heard()}
    run = SimpleNamespace(voltages={}, kelvin=None, agreement=None, answered=answered)
    chips = Chips(status, bench, run, SimpleNamespace(alive=False))
    plan = expect(serial())

    def chip():
        found = {view.name: view for view in chips.views(plan, None)}
        return found["Thermometer"]

    assert (chip().detail, chip().value) == ("LSCI MODEL335", "—")
    status.state, run.kelvin = WindowState.RUNNING, 295.153
    assert (chip().lamp, chip().value) == (Lamp.ACTIVE, "295.15 K")


def test_a_bench_file_that_the_window_writes_keeps_it(serial, tmp_path):
    from gui.dialogs.bench_text import bench_text, show_bench, start_choice
    from tactile_lab.scene.write_bench import write_bench

    choice = start_choice()
    show_bench(choice, serial().bench)
    assert (
        write_bench(bench_text(choice), tmp_path / "a.toml").thermometer is None
    )  # simulated
    wired = serial("bench.thermometer.port=/dev/ttyUSB3", "bench.thermometer.input=B")
    show_bench(choice, wired.bench)
    kept = write_bench(bench_text(choice), tmp_path / "b.toml").thermometer
    assert (kept.port, kept.input) == ("/dev/ttyUSB3", "B")
