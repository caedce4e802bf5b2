"""The unchanged driver over a pseudo-terminal and TCP, on the real clock."""

import itertools
import socket
import time

import pytest
import serial
from resistor import Resistor

from drivers.coil.source import CoilSource
from drivers.teslameter import Teslameter
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.servers import PtyServer, TcpServer
from sim_backend.serial_line.wires import FarEnd
from sim_backend.teslameter import SimTeslameter
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.errors import InstrumentError, LinkLostError, NotFoundError
from tactile_lab.instruments.dialects import coil_dialect, teslameter_dialect

KEPCO = coil_dialect("kepco-bop")
TIMEOUT = 1.5
"""Longer than a far end on a busy machine takes, s."""

FAST = KEPCO.serial.model_copy(update={"latency": 0.0, "timeout": TIMEOUT})
ROW = KEPCO.model_copy(update={"serial": FAST})
PATIENCE = 60.0
"""Longest wait for what a busy machine does late, s."""


@pytest.fixture(params=["pty", "tcp"])
def served(request):
    clock = RealClock()
    source = SimCoilSource(Resistor(), "kepco-bop", clock)
    end = FarEnd(source, FAST, clock, "coil")
    server = PtyServer(end) if request.param == "pty" else TcpServer(end)
    server.start()
    coil = CoilSource(ROW, server.url, CoilLimits(), clock, guarded=False)
    yield clock, source, end, server, coil
    coil.close()
    server.close()


def drive(clock, coil, current, updates=10):
    for _ in range(updates):
        clock.sleep_until(clock.now() + 0.02)
        coil.set_current(current)


def reach(clock, coil, current):
    """Play until `current` (A) is reached, however slow the machine is now."""
    give_up = clock.now() + PATIENCE
    while coil.setpoint != pytest.approx(current):
        assert clock.now() < give_up
        drive(clock, coil, current, 1)


def fastest(changes, uncertain):
    """Largest slew among the set-points as they arrived, A/s, but for rounding."""
    sets = [change for change in changes if change.what == "set"]
    rounding = 2e-5
    slews = (
        (abs(after.value - before.value) - rounding)
        / (after.time - before.time + uncertain)
        for before, after in itertools.pairwise(sets)
    )
    return max(slews, default=0.0)  # where exchanges are slow, one step may do


def test_plays_and_ends_safely(served):
    clock, source, _end, _server, coil = served
    coil.open()
    coil.energise()
    reach(clock, coil, 0.1)
    assert coil.read_current().value == pytest.approx(0.1)
    played = len(source.changes)
    assert coil.safe_off().verified
    assert not source.output_on
    slew = coil.limits.slew
    # a set-point is taken at some time within its exchange
    assert fastest(source.changes[:played], coil.update_interval) <= slew
    assert fastest(source.changes[played - 1 :], coil.update_interval) <= slew
    assert fastest(source.changes[played:], 0.0) <= slew


@pytest.mark.parametrize(
    "kind", ["missing", "partial", "garbled", "noise", "late", "xoff"]
)
def test_one_bad_exchange_does_not_end_the_run(served, kind):
    clock, source, end, _server, coil = served
    coil.open()
    coil.energise()
    end.faults.add(SerialFault(kind=kind, line="CURR", amount=1.5 * TIMEOUT))
    drive(clock, coil, 0.05)
    assert end.faults.struck == 1
    assert source.setpoint == pytest.approx(coil.setpoint, abs=1e-5)
    assert coil.safe_off().verified


@pytest.mark.parametrize("form", ["closed", "reset", "half"])
def test_unplugged_while_playing(served, form, monkeypatch):
    # long enough, and another test may be given the lost pseudo-terminal's name
    monkeypatch.setattr("drivers.coil.wire.RECONNECT", 0.0)
    clock, source, end, server, coil = served
    coil.open()
    coil.energise()
    end.faults.add(SerialFault(kind="unplug", line="CURR", form=form))
    with pytest.raises(LinkLostError, match="was lost: "):
        drive(clock, coil, 0.05)
    report = coil.safe_off()
    if isinstance(server, PtyServer):  # the adapter is gone, its name too
        assert not report.verified
        coil.close()
        with pytest.raises(NotFoundError):
            coil.open()
    else:  # a network source takes the next connection
        assert report.verified
        assert not source.output_on


def test_a_stuck_peer_does_not_hang_us(served, monkeypatch):
    monkeypatch.setattr("drivers.coil.wire.VERIFICATIONS", 1)
    clock, _source, end, server, coil = served
    coil.open()
    coil.energise()
    link = coil._wire.link  # no answer is awaited any more
    link.wire = link.wire.model_copy(update={"timeout": 0.1})
    link._serial.timeout = link._serial.write_timeout = 0.1
    end.faults.add(SerialFault(kind="stuck", line="CURR", amount=600.0))
    begun = time.monotonic()
    with pytest.raises(InstrumentError):
        drive(clock, coil, 0.05)
    assert not coil.safe_off().verified
    assert time.monotonic() - begun < PATIENCE
    server.close()


def test_a_second_program_is_kept_out(served):
    clock, _source, _end, server, coil = served
    coil.open()
    second = CoilSource(ROW, server.url, CoilLimits(), clock, guarded=False)
    why = "Another program" if isinstance(server, PtyServer) else "no other program"
    with pytest.raises(InstrumentError, match=why):
        second.open()


def test_the_address_of_a_server_that_ended_is_not_given_again():
    """A guard tries its port for a minute: it once locked the next test's source."""
    clock = RealClock()
    given = set()
    for _ in range(3):
        source = SimCoilSource(Resistor(), "kepco-bop", clock)
        server = PtyServer(FarEnd(source, FAST, clock, "coil"))
        server.start()
        given.add(server.url)
        server.close()
    assert len(given) == 3


def test_seven_bits_on_a_pty_open_again_and_again():
    clock = RealClock()
    row = teslameter_dialect("lakeshore-425")
    wire = row.serial.model_copy(update={"latency": 0.0})
    end = FarEnd(SimTeslameter(Resistor(), row.id, clock), wire, clock, "meter")
    server = PtyServer(end)
    server.start()
    for _ in range(3):
        meter = Teslameter(row, server.url, clock)
        meter.open()
        assert meter.read().value == 0.0
        meter.close()
    server.close()


def test_seven_odd_one_reaches_pyserial(monkeypatch):
    asked = {}

    def seen(url, **settings):
        asked.update(settings)
        raise serial.SerialException(2, "no such port")

    monkeypatch.setattr(serial, "serial_for_url", seen)
    meter = Teslameter(teslameter_dialect("lakeshore-425"), "/dev/ttyUSB9", RealClock())
    with pytest.raises(NotFoundError):
        meter.open()
    assert (asked["bytesize"], asked["parity"], asked["stopbits"]) == (7, "O", 1)
    assert asked["write_timeout"] and asked["exclusive"]


def test_a_network_source_that_does_not_accept_holds_nobody_up(monkeypatch):
    waited = []

    def no_answer(address, timeout):
        waited.append(timeout)
        raise TimeoutError("timed out")

    monkeypatch.setattr(socket, "create_connection", no_answer)
    coil = CoilSource(ROW, "socket://bench.invalid:5025", CoilLimits(), RealClock())
    with pytest.raises(NotFoundError, match="timed out"):
        coil.open()
    assert waited == [0.25]


def test_pacing_takes_the_time_of_the_wire():
    clock = RealClock()
    wire = KEPCO.serial.model_copy(update={"latency": 0.0, "baud": 9600})
    end = FarEnd(SimCoilSource(Resistor(), "kepco-bop", clock), wire, clock, "coil")
    server = PtyServer(end, paced=True)
    server.start()
    with serial.serial_for_url(server.url, timeout=PATIENCE) as port:
        begun = time.monotonic()
        port.write(b"CURR 0.10000;:SYST:ERR?\n")
        assert port.read_until(b"\n") == b'0,"No error"\r\n'
        assert time.monotonic() - begun >= (24 + 14) * 10 / 9600
    server.close()


def test_a_line_without_end_takes_no_memory_and_the_next_is_heard():
    clock = RealClock()
    end = FarEnd(SimCoilSource(Resistor(), "kepco-bop", clock), FAST, clock, "coil")
    for _ in range(30):
        assert end.take(b"x" * 10_000) == []
    assert len(end._partial) < 100_000
    assert end.take(b"\n*IDN?\n")[-1].data.startswith(b"KEPCO")
