"""The wire inside this process."""

import gc
import weakref

import pytest
import serial

from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.wires import plug_in, unplug
from sim_backend.serve import CoilOnly
from tactile_lab.clock import SimulatedClock
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.magnetics import Magnet

WIRE = coil_dialect("kepco-bop").serial


@pytest.fixture
def wired():
    clock = SimulatedClock()
    source = SimCoilSource(CoilOnly(Magnet(r=6e-3)), "kepco-bop", clock)
    end = plug_in(source, WIRE, clock, "coil")
    with clock.taking_part("test"):
        yield clock, source, end
    unplug(end)


def opened(end, **settings):
    fitting = {"baudrate": WIRE.baud, "timeout": 0.2, "write_timeout": 0.2}
    return serial.serial_for_url(end.url, **(fitting | settings))


def test_bytes_take_the_time_of_the_wire(wired):
    clock, source, end = wired
    with opened(end) as port:
        begun = clock.now()
        port.write(b"CURR 0.10000\n")
        taken = 13 * 10 / 9600 + WIRE.latency
        assert clock.now() - begun == pytest.approx(taken)
        assert source.changes[-1].time - begun == pytest.approx(taken)
        port.write(b"CURR?\n")
        asked = clock.now()
        assert port.read_until(b"\n") == b"0.10000\r\n"
        assert clock.now() - asked == pytest.approx(9 * 10 / 9600)


def test_an_answer_arrives_byte_by_byte(wired):
    clock, _, end = wired
    with opened(end) as port:
        port.write(b"CURR?\n")
        assert port.in_waiting == 0
        clock.sleep_until(clock.now() + 2.5 * 10 / 9600)
        assert port.in_waiting == 2
        assert port.read(2) == b"0."
        assert port.read(100) == b"00000\r\n"


def test_silence_takes_the_timeout(wired):
    clock, _, end = wired
    with opened(end) as port:
        begun = clock.now()
        assert port.read_until(b"\n") == b""
        assert clock.now() - begun == pytest.approx(0.2)


@pytest.mark.parametrize(
    "settings", [{"baudrate": 19200}, {"parity": "O"}, {"bytesize": 7}]
)
def test_other_settings_are_not_heard(wired, settings):
    _, source, end = wired
    with opened(end, **settings) as port:
        port.write(b"CURR 0.1;CURR?\n")
        assert port.read_until(b"\n") == b""
    assert source.changes == []


def test_escape_clears_what_was_half_sent(wired):
    _, source, end = wired
    with opened(end) as port:
        port.write(b"CURR 9\x1bCURR?\n")
        assert port.read_until(b"\n") == b"0.00000\r\n"
    assert not source.parser.errors


@pytest.mark.parametrize(
    ("line", "error"),
    [
        (b"CURRE 1", -113),
        (b"CURR", -109),
        (b"CURR one", -120),
        (b"CURR 6", -222),
        (b"OUTP maybe", -224),
        (b"LIST:CLE 1", -108),
        (b"CURR:MODE LIST", -221),
        (b"CURR 0;" * 30, -400),
        (b"CURR?;CURR?;CURR?;CURR?;CURR?", -400),
    ],
)
def test_what_a_source_does_not_understand_is_an_error(wired, line, error):
    _, source, _ = wired
    source.line(line)
    assert source.line(b"SYST:ERR?").startswith(f"{error},".encode())
    assert source.line(b"SYST:ERR?") == b'0,"No error"'


def test_short_and_long_forms_and_paths(wired):
    _, source, _ = wired
    source.line(b"source:current:level 0.25;:volt 3")
    assert source.line(b"CURR?;VOLT?") == b"0.25000;3.000"
    assert source.line(b"MEAS:CURR?;VOLT?") == b"0.00000;0.0000"  # MEAS:VOLT?


def test_long_numbers_are_cut_as_a_kepco_cuts_them(wired):
    _, source, _ = wired
    source.line(b"VOLT 10012.3")  # the four digits before the point
    assert source.compliance == 12.3


def test_an_address_keeps_its_far_end_and_nothing_else_does():
    clock = SimulatedClock()
    source = SimCoilSource(CoilOnly(Magnet(r=6e-3)), "kepco-bop", clock)
    address = plug_in(source, WIRE, clock).url
    gone = weakref.ref(address.far_end)
    gc.collect()
    assert gone() is not None
    del address
    gc.collect()
    assert gone() is None
