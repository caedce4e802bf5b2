"""A cable pulled and put back: Linux may give its port another name, and another's.

Adapters are links to pseudo-terminals here, as those in `/dev/serial/by-id` are to
devices.
"""

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from patient import patient

from drivers.coil.source import CoilSource
from drivers.teslameter import Teslameter
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.servers import PtyServer
from sim_backend.serial_line.wires import FarEnd
from sim_backend.teslameter import meter_far_end
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.errors import BadReplyError, LinkLostError, NotFoundError
from tactile_lab.instruments import port as ports
from tactile_lab.instruments.dialects import coil_dialect, teslameter_dialect
from tactile_lab.instruments.port import lasting_name

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs pseudo-terminals")

ROW = patient(coil_dialect("kepco-bop"))
SERIAL = "E123456"
PATIENCE = 60.0
"""Longest wait for what a busy machine does late, s."""


class Plugs:
    """Instruments, adapters and the names that a computer gives them."""

    def __init__(self, folder):
        self.ports = folder / "dev"
        self.by_id = folder / "by-id"
        self.ports.mkdir()
        self.by_id.mkdir()
        self._servers = {}

    def put(self, instrument, name, adapter, row=ROW):
        """Plug an adapter in, with what is behind it; the port's path."""
        wire = row.serial.model_copy(update={"latency": 0.0})
        server = PtyServer(FarEnd(instrument, wire, RealClock(), adapter))
        server.start()
        self._servers[name] = server, adapter
        port, lasting = self.ports / name, self.by_id / adapter
        port.symlink_to(server.url)
        lasting.symlink_to(server.url)
        return str(port)

    def pull(self, name):
        """Pull it out: its names go with it."""
        server, adapter = self._servers.pop(name)
        server.close()
        (self.ports / name).unlink()
        (self.by_id / adapter).unlink()

    def close(self):
        for name in list(self._servers):
            self.pull(name)


class Stranger(SimCoilSource):
    """Another source of the same kind; it notes what it is told."""

    def __init__(self, plant):
        super().__init__(plant, ROW.id, RealClock())
        self.told = []

    def line(self, line):
        self.told.append(line.decode())
        return b"KEPCO,BIT 4886 20-05,E999999,3.05-1.83" if b"*IDN?" in line else b"0"


@pytest.fixture
def plugs(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    made = Plugs(tmp_path)
    monkeypatch.setattr(ports, "BY_ID", made.by_id)
    yield made
    made.close()


@pytest.fixture
def source(resistor):
    return SimCoilSource(resistor, ROW.id, RealClock())


def coil_at(port):
    return CoilSource(ROW, port, CoilLimits(), RealClock(), guarded=False)


def test_a_port_is_named_so_that_the_name_stays(plugs, source, monkeypatch, tmp_path):
    port = plugs.put(source, "ttyUSB0", "usb-FTDI_AB12-if00")
    assert lasting_name(port) == str(plugs.by_id / "usb-FTDI_AB12-if00")
    assert lasting_name("/dev/null") is None
    monkeypatch.setattr(ports, "BY_ID", tmp_path / "no such")
    assert lasting_name(port) is None


def test_a_source_put_back_under_another_name_is_switched_off_there(
    plugs, source, resistor
):
    coil = coil_at(plugs.put(source, "ttyUSB0", "usb-A"))
    coil.open()
    coil.energise()
    plugs.pull("ttyUSB0")
    with pytest.raises(LinkLostError):
        coil.set_current(0.01)
    stranger = Stranger(resistor)
    plugs.put(stranger, "ttyUSB0", "usb-B")
    plugs.put(source, "ttyUSB1", "usb-A")
    report = coil.safe_off()
    assert report.verified and not source.output_on
    assert "no longer at" in report.text and str(plugs.by_id / "usb-A") in report.text
    assert set(stranger.told) == {"*IDN?"}
    coil.close()


def test_the_next_program_finds_it_and_says_what_to_write(plugs, source, resistor):
    port = plugs.put(source, "ttyUSB0", "usb-A")
    coil = coil_at(port)
    coil.open()
    assert "moved" not in coil.settings()
    coil.close()
    plugs.pull("ttyUSB0")
    with pytest.raises(NotFoundError):
        coil_at(port).open()
    plugs.put(source, "ttyUSB1", "usb-A")
    for stranger in (None, Stranger(resistor)):
        if stranger is not None:
            plugs.put(stranger, "ttyUSB0", "usb-B")
        row = ROW.of_one(serial=SERIAL, timeout=None)
        coil = CoilSource(row, port, CoilLimits(), RealClock(), guarded=False)
        coil.open()
        told = coil.settings()
        assert told["port"] == str(plugs.by_id / "usb-A")
        assert f'Write port = "{told["port"]}"' in told["moved"]
        coil.close()


def test_another_instrument_at_the_same_adapter_is_refused(plugs, source, resistor):
    port = plugs.put(source, "ttyUSB0", "usb-A")
    coil = coil_at(port)
    coil.open()
    coil.close()
    plugs.pull("ttyUSB0")
    stranger = Stranger(resistor)
    plugs.put(stranger, "ttyUSB1", "usb-A")
    with pytest.raises(NotFoundError, match="plugged in"):
        coil_at(port).open()
    assert set(stranger.told) == {"*IDN?"}


def test_source_and_meter_that_changed_names_are_told_apart(plugs, source, resistor):
    row = patient(teslameter_dialect("lakeshore-425"), min_gap=0.0)
    meter = meter_far_end(resistor, row, RealClock(), noise=0.0, seed=1)
    meter_port = plugs.put(meter, "ttyUSB1", "usb-M", row)
    coil_port = plugs.put(source, "ttyUSB0", "usb-A")
    for _ in range(2):
        coil, field = coil_at(coil_port), Teslameter(row, meter_port, RealClock())
        with ThreadPoolExecutor() as pool:  # each is at the other's port for a moment
            for opening in [pool.submit(coil.open), pool.submit(field.open)]:
                opening.result()
        assert "KEPCO" in coil.identity and "LSCI" in field.identity
        field.close()
        coil.close()
        plugs.close()
        plugs.put(source, "ttyUSB1", "usb-A")
        plugs.put(meter, "ttyUSB0", "usb-M", row)


def test_without_a_kept_name_it_is_refused_as_before(plugs, source, resistor):
    plugs.put(source, "ttyUSB1", "usb-A")
    with pytest.raises(NotFoundError):
        coil_at(str(plugs.ports / "ttyUSB0")).open()
    port = plugs.put(Stranger(resistor), "ttyUSB0", "usb-B")
    row = ROW.of_one(serial=SERIAL, timeout=None)
    with pytest.raises(BadReplyError, match="another of its kind"):
        CoilSource(row, port, CoilLimits(), RealClock(), guarded=False).open()


OWNER = """
import sys, time
from pathlib import Path
from drivers.coil import guard
from drivers.coil.source import CoilSource
from patient import patient
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.instruments import port
from tactile_lab.instruments.dialects import coil_dialect
guard.SILENCE = 60.0
port.BY_ID = Path(sys.argv[2])
coil = CoilSource(
    patient(coil_dialect("kepco-bop"), 0.5), sys.argv[1], CoilLimits(), RealClock()
)
coil.open()
coil.energise()
print("live", flush=True)
sys.stdin.readline()
"""


@pytest.mark.parametrize("old_name", ["gone", "another's"])
def test_the_guard_switches_it_off_at_its_new_name(
    plugs, source, resistor, tmp_path, old_name
):
    port = plugs.put(source, "ttyUSB0", "usb-A")
    log = tmp_path / "state" / "tactile-lab" / "guard.log"
    stranger = Stranger(resistor)
    with subprocess.Popen(
        [sys.executable, "-c", OWNER, port, str(plugs.by_id)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    ) as owner:
        assert owner.stdout.readline() == "live\n"
        plugs.pull("ttyUSB0")
        if old_name == "another's":
            plugs.put(stranger, "ttyUSB0", "usb-B")
        plugs.put(source, "ttyUSB1", "usb-A")
        assert source.output_on
        owner.kill()
    until = time.monotonic() + PATIENCE
    while not (log.exists() and " after " in log.read_text()):
        assert time.monotonic() < until, "the guard did nothing"
        time.sleep(0.01)
    assert not source.output_on
    told = log.read_text()
    assert f"port {plugs.by_id / 'usb-A'}, off after" in told
    assert set(stranger.told) <= {"*IDN?"}
