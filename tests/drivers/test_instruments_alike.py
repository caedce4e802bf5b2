"""Two instruments of one kind whose ports were exchanged: told by serial number."""

import pytest

from drivers.registered import (
    SERIAL_METER,
    SERIAL_SOURCE,
    SERIAL_THERMOMETER,
    SERIAL_VOLTAGE_SOURCE,
)
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.wires import plug_in
from sim_backend.teslameter import SimTeslameter
from sim_backend.thermometer import SimThermometer
from sim_backend.voltage_source import voltage_far_end
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import BadReplyError
from tactile_lab.instruments.dialects import load_dialect
from tactile_lab.planning.plan import plan
from tactile_lab.scene.bench_file import (
    CoilSpec,
    FieldMeterSpec,
    ThermometerSpec,
    VoltageSourceSpec,
)
from tactile_lab.scene.load import load
from tactile_lab.voltage_source import VoltageLimits


def kepco(plant, clock):
    return SimCoilSource(plant, "kepco-bop", clock)


def gaussmeter(plant, clock):
    return SimTeslameter(plant, "lakeshore-425", clock)


def monitor(plant, clock):
    plant.temperature = lambda time: 295.15
    return SimThermometer(plant, "lakeshore-218", clock)


def keithley(plant, clock):
    plant.set_voltage = lambda name, time, volts: None
    return voltage_far_end(plant, "V_GS", load_dialect("keithley-2400-voltage"), clock)


@pytest.mark.parametrize(
    ("far_end", "row", "driver", "table", "more"),
    [
        (kepco, "kepco-bop", SERIAL_SOURCE, CoilSpec, {}),
        (gaussmeter, "lakeshore-425", SERIAL_METER, FieldMeterSpec, {}),
        (monitor, "lakeshore-218", SERIAL_THERMOMETER, ThermometerSpec, {}),
        (
            keithley,
            "keithley-2400-voltage",
            SERIAL_VOLTAGE_SOURCE,
            VoltageSourceSpec,
            {"name": "V_GS", "limits": VoltageLimits(highest=2.0)},
        ),
    ],
)
def test_only_the_one_with_that_serial_number_is_opened(
    resistor, far_end, row, driver, table, more
):
    clock = SimulatedClock()
    there = far_end(resistor, clock)
    end = plug_in(there, load_dialect(row).serial, clock, "alike")
    name = there.line(b"*IDN?").decode()
    serial = name.split(",")[2]
    with clock.taking_part("test"):
        right = driver.make(table(port=end.url, serial=serial, **more), clock)
        right.open()
        right.close()
        wrong = driver.make(table(port=end.url, serial="777", **more), clock)
        with pytest.raises(BadReplyError, match=r'not the .* with serial = "777"'):
            wrong.open()
        wrong.close()


TWO = """
name = "two alike"
[coil]
dialect = "keithley-2400"
port = "/dev/ttyUSB0"
limits.current = "1 A"
[voltage_source.V_GS]
port = "/dev/ttyUSB1"
limits.highest = "2 V"
[magnet]
r = "6 mm"
"""
SOURCED = ('sensor.sourced=["V_GS"]', 'record.signals=["force"]')


@pytest.mark.parametrize(
    ("old", "new", "overrides", "told"),
    [
        ("", "", SOURCED, True),
        ("", "", SOURCED[1:], True),  # the coil may be the other one all the same
        ("port =", 'serial = "12"\nport =', SOURCED, False),
        ("USB0", 'USB0"\nserial = "12', SOURCED, True),
        ("USB0", 'USB0"\nserial = "12', SOURCED[1:], False),
        ("/dev/ttyUSB", "/dev/serial/by-id/usb-FTDI_AB12", SOURCED, False),
        ("/dev/ttyUSB", "socket://10.0.0.7:502", SOURCED, False),
        ('"keithley-2400"', '"kepco-bop"', SOURCED, False),
        ("/dev/ttyUSB", "COM1", SOURCED, True),
    ],
)
def test_a_plan_warns_where_nothing_tells_them_apart(
    tmp_path, old, new, overrides, told
):
    file = tmp_path / "two.toml"
    file.write_text(TWO.replace(old, new) if old else TWO)
    found = " ".join(plan(load("demo", overrides, file)).warnings)
    said = "[coil] and [voltage_source.V_GS] are instruments of one kind" in found
    assert said is told
