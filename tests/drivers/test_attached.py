"""What is attached, against served instruments."""

import re
import socket
from importlib import resources

import pytest
from replay import read_transcript

from drivers.attached import ask_name, attached, fitting, try_out
from drivers.diagnosis import diagnose, disk
from drivers.picoscope.sdk import bind
from sim_backend.coil.source import SimCoilSource
from sim_backend.picoscope.scope import UnitModel
from sim_backend.picoscope.sdk import FakePs3000a
from sim_backend.serial_line.wires import plug_in
from sim_backend.serve import Gate, ServedBench
from sim_backend.teslameter import SimTeslameter
from sim_backend.voltage_source import voltage_far_end
from tactile_lab.clock import RealClock, SimulatedClock
from tactile_lab.errors import BadReplyError, InstrumentError, NotFoundError
from tactile_lab.instruments.dialects import load_dialect


@pytest.fixture
def served():
    bench = ServedBench(coil="pty", teslameter="tcp:0")
    bench.start()
    yield bench.addresses
    bench.close()


def test_each_instrument_is_recognised(served):
    coil, meter = attached(ports=[served["coil"], served["teslameter"]])
    assert coil["identity"].startswith("KEPCO") and coil["fits"] == ("kepco-bop",)
    assert meter["identity"].startswith("LSCI")
    assert meter["fits"] == ("lakeshore-425",)
    assert coil["problem"] is None and meter["problem"] is None


def test_a_port_that_is_not_there():
    (found,) = attached(ports=["/dev/ttyUSB77"])
    assert found["identity"] is None and "plugged in" in found["problem"]
    assert "cannot be opened (No such file or directory)." in found["problem"]


def test_an_address_at_which_nobody_listens():
    with socket.create_server(("127.0.0.1", 0)) as free:
        address = f"socket://127.0.0.1:{free.getsockname()[1]}"
    (found,) = attached(ports=[address])
    assert "cannot be opened (Connection refused)." in found["problem"]
    assert "in this network" in found["problem"]


def test_silence_is_told(served):
    bench = ServedBench(coil="pty")  # not started: nobody answers
    name, problem = ask_name(bench.addresses["coil"])
    bench.close()
    assert name is None and "nothing answered" in problem


def test_a_stranger_gets_the_plain_row_only():
    assert fitting("ACME,THING,1,1") == ("scpi-generic",)
    fits = fitting("KEITHLEY INSTRUMENTS INC.,MODEL 2400,1,C30")
    assert fits == ("keithley-2400", "keithley-2400-voltage")


def test_trying_out_switches_nothing_on_and_writes_every_byte(served, tmp_path):
    path = tmp_path / "talk.txt"
    settings = try_out(served["coil"], "kepco-bop", transcript=path)
    assert settings["output"] == "off" and settings["setpoint_A"] == "0"
    assert settings["not_tried"] == "OUTP 1, [list], [analogue]"
    sent = [one.data for one in read_transcript(path) if one.sent]
    assert not any(b"OUTP 1" in data for data in sent)
    sets = [data for data in sent if data.startswith(b"CURR ")]
    assert sets.count(b"CURR 0.01000;:SYST:ERR?\n") == 1
    assert set(sets[sets.index(b"CURR 0.01000;:SYST:ERR?\n") + 1 :]) == {
        b"CURR 0.00000;:SYST:ERR?\n"
    }


def test_the_wrong_row_is_refused(served):
    with pytest.raises(BadReplyError, match="Name the right row"):
        try_out(served["coil"], "keithley-2400")


def test_every_finding_has_a_remedy_unless_it_is_fine(tmp_path):
    findings = diagnose(tmp_path, 1.0)
    assert {"python", "packages", "guard", "disk", "timing"} <= {
        one["topic"] for one in findings
    }
    for one in findings:
        assert one["state"] in ("ok", "note", "problem")
        if one["state"] == "problem":
            assert one["remedy"]
    assert next(o for o in findings if o["topic"] == "guard")["state"] == "ok"


def test_a_disk_that_is_too_slow_or_not_there(tmp_path):
    slow = disk(tmp_path / "not" / "yet", 1e15)
    assert slow.state == "problem" and "faster disk" in slow.remedy
    assert disk(tmp_path, 1.0).state == "ok"


def test_a_port_that_is_gone_tells_those_there_are(monkeypatch):
    from serial.tools import list_ports, list_ports_common

    other = list_ports_common.ListPortInfo("/dev/ttyUSB1")
    other.vid = 0x0403
    monkeypatch.setattr(list_ports, "comports", lambda: [other])
    _, problem = ask_name("/dev/ttyUSB0")
    assert "(there now: /dev/ttyUSB1)" in problem


KEITHLEY, GATE = ("coil", "keithley-2400"), ("voltage_source", "keithley-2400-voltage")
KEPCO, METER = ("coil", "kepco-bop"), ("field_meter", "lakeshore-425")


@pytest.mark.parametrize(
    ("row", "line"),
    [
        (KEPCO, 'set = "CURX {i:.5f}"'),
        (KEPCO, 'set = "VOLT {i:.5f}"'),  # it is taken, and sets something else
        (KEPCO, 'limit = "VOLX {v:.3f}"'),
        (KEPCO, 'measure_voltage = "MEAS:VOLX?"'),
        (METER, 'field = "RDGFIELX?"'),
        (KEITHLEY, 'measure_current = ":REAX?"'),  # it may refuse the right one, too
        (KEITHLEY, 'set = ":SENS:VOLT:PROT {i:.5f}"'),
        (GATE, 'measure_voltage = ":REAX?"'),
        (GATE, 'set = ":SENS:CURR:PROT {v:.5f}"'),
    ],
    ids=lambda value: value if isinstance(value, str) else value[1],
)
def test_a_row_with_a_wrong_line_is_found_out(
    monkeypatch, resistor, tmp_path, row, line
):
    """It passed, and the first run with it failed."""
    (folder, name), clock = row, SimulatedClock()
    shipped, wire = load_dialect(name), load_dialect(name).serial
    far = {
        "coil": lambda: SimCoilSource(resistor, name, clock),
        "field_meter": lambda: SimTeslameter(resistor, name, clock),
        "voltage_source": lambda: voltage_far_end(Gate(), "V_GS", shipped, clock),
    }[folder]()
    rows = resources.files("tactile_lab.instruments") / "rows" / folder
    text = (rows / f"{name}.toml").read_text(encoding="utf-8")
    key = line.split(" ")[0]
    file = tmp_path / "mine.toml"
    file.write_text(re.sub(rf"^{key} = .*$", lambda _: line, text, flags=re.MULTILINE))
    assert line in file.read_text()
    end = plug_in(far, wire, clock)
    monkeypatch.setattr("drivers.attached.RealClock", lambda: clock)
    with clock.taking_part("test"):
        right = try_out(end.url, name)
        is_keithley = row in (KEITHLEY, GATE)
        assert (":READ?" in right.get("not_tried", "")) is is_keithley
        with pytest.raises(InstrumentError):
            try_out(end.url, str(file))


def test_picosdk_is_asked_where_usb_cannot_be_looked_at(monkeypatch):
    def blind():
        raise NotFoundError("no libusb")

    library = FakePs3000a(None, RealClock(), UnitModel(others=("SIM04/0002",)))
    monkeypatch.setattr("drivers.attached.present", blind)
    monkeypatch.setattr("drivers.attached.load", lambda: bind(library))
    found = [one for one in attached(ask=False) if one["fits"] == ("ps3000a",)]
    assert [one["identity"] for one in found] == ["SIM04/0001", "SIM04/0002"]
    assert not library.device.is_open
