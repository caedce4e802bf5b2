"""Each serial fault, alone and lasting, in the middle of a waveform."""

import itertools
import re
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivers.coil.guard import SILENCE
from drivers.coil.source import CoilSource
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.wires import FarEnd, plug_in, unplug
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import (
    BadReplyError,
    InstrumentError,
    LinkLostError,
    NoReplyError,
    NotFoundError,
    RefusedError,
    UnsafeError,
)
from tactile_lab.instruments.dialects import coil_dialect

PASSING = [
    SerialFault(kind="late", amount=0.3),
    SerialFault(kind="late", amount=1.0),
    SerialFault(kind="missing"),
    *(SerialFault(kind="partial", amount=n) for n in range(14)),
    SerialFault(kind="garbled"),
    SerialFault(kind="echo"),
    SerialFault(kind="no_terminator"),
    SerialFault(kind="carriage_return"),
    SerialFault(kind="flow_control", times=None),
    SerialFault(kind="noise"),
    SerialFault(kind="deaf"),
    SerialFault(kind="stuck"),
    SerialFault(kind="xoff"),
]


def named(fault):
    return f"{fault.kind}-{fault.form}-{fault.amount:g}"


@pytest.mark.parametrize("fault", PASSING, ids=named)
def test_one_bad_exchange_does_not_end_the_run(serial_bench, fault):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(fault)
    it.drive(0.7)
    assert it.end.faults.struck
    assert it.source.setpoint == pytest.approx(0.7)
    it.clock.sleep_until(it.clock.now() + 0.2)
    assert it.coil.read_current().value == pytest.approx(0.7)
    assert it.coil.safe_off().verified


@pytest.mark.parametrize("skip", range(13))
@pytest.mark.parametrize(
    "fault",
    [f for f in PASSING if f.kind in ("late", "garbled", "deaf", "stuck", "xoff")],
    ids=named,
)
def test_one_bad_exchange_does_not_end_the_opening(serial_bench, fault, skip):
    it = serial_bench
    it.end.faults.add(replace(fault, skip=skip))
    it.coil.open()
    assert it.end.faults.struck
    it.coil.energise()
    it.drive(0.5)
    assert it.source.setpoint == pytest.approx(0.5)
    assert it.coil.safe_off().verified


def test_a_source_that_never_says_xon_is_switched_off(serial_bench):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="xoff", line="CURR", times=2))
    with pytest.raises(NoReplyError, match="flow control"):
        it.drive(0.7)
    begun = it.clock.now()
    assert it.coil.safe_off().verified
    assert it.clock.now() - begun < 2
    assert not it.source.output_on


def test_an_answer_that_comes_too_late_faults_and_ends_safely(serial_bench):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="late", amount=3.0))
    nothing = r"answered nothing to 'CURR .*', nor to '\*IDN\?' in the 1 s after it"
    with pytest.raises(NoReplyError, match=nothing):
        it.drive(0.7)
    assert it.coil.safe_off().verified
    assert not it.source.output_on


LASTING = [
    "late",
    "missing",
    "garbled",
    "echo",
    "no_terminator",
    "noise",
    "deaf",
    "stuck",
]


@pytest.mark.parametrize("kind", LASTING)
def test_a_lasting_fault_is_told_and_not_called_safe(serial_bench, kind):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind=kind, times=None, amount=0.5))
    with pytest.raises(InstrumentError, match="coil source at sim"):
        it.drive(0.7)
    begun = it.clock.now()
    report = it.coil.safe_off()
    assert not report.verified
    assert "OUTPUT STATE UNKNOWN" in report.text
    told = [one.partition(": ")[2] for one in report.text.split(" | ")]
    assert len(set(told)) == len(told), "a cause is told once, with all its steps"
    assert it.clock.now() - begun < 10
    if kind not in ("deaf", "stuck"):  # the way out still worked
        assert not it.source.output_on and it.source.setpoint == 0.0
    it.end.faults.clear()
    assert it.coil.safe_off().verified


@pytest.mark.parametrize(
    ("kind", "timeout"),
    [
        ("deaf", 0.2),
        ("stuck", 0.2),
        ("missing", 0.2),
        ("missing", 0.8),
        ("partial", 0.8),
    ],
)
def test_a_silent_source_does_not_make_the_program_look_hung(
    serial_bench, kind, timeout
):
    """The guard killed it while it tried to switch off: exit -9, and no word of why."""
    it, beats = serial_bench, []
    link = it.coil._wire.link
    link.wire = link.wire.model_copy(update={"timeout": timeout})
    it.coil.open()
    it.coil.energise()
    it.coil._wire.link._beat = lambda: beats.append(it.clock.now())
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind=kind, amount=3, times=None))
    with pytest.raises(InstrumentError):
        it.drive(0.7)
    assert not it.coil.safe_off().verified
    beats.append(it.clock.now())
    assert beats[-1] - beats[0] > 5
    assert max(b - a for a, b in itertools.pairwise(beats)) < SILENCE / 2


GONE = r"coil source at sim://\S+ was lost: its port is gone, .*\. Plug it in again"
CLOSED = r"coil source at sim://\S+ was lost: the far end has closed .*\. Check that"
LOST = {"usb": GONE, "windows": GONE, "closed": CLOSED, "reset": CLOSED}


@pytest.mark.parametrize("form", ["usb", "windows", "closed", "reset"])
@pytest.mark.parametrize("line", ["CURR [^M]", "MEAS", "OUTP 0", "OUTP\\?"])
def test_unplugged_for_good(serial_bench, form, line):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="unplug", line=line, form=form))
    if line.startswith("OUTP"):
        report = it.coil.safe_off()
    else:
        with pytest.raises(LinkLostError, match=LOST[form]):
            it.clock.sleep_until(it.clock.now() + 0.2)
            it.coil.read_current()
            it.drive(0.7)
        report = it.coil.safe_off()
    assert not report.verified
    assert "switch the coil source off at the instrument" in report.text
    it.coil.close()
    with pytest.raises(NotFoundError):
        it.coil.open()


@pytest.mark.parametrize("form", ["usb", "windows", "closed", "reset"])
@pytest.mark.parametrize("call", ["read", "waiting"])
def test_unplugged_at_other_calls_than_write(serial_bench, form, call):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    # without an answer the line is drained, which asks what waits
    it.end.faults.add(SerialFault(kind="missing", line="CURR [^M]"))
    it.end.faults.add(
        SerialFault(kind="unplug", line="CURR [^M]", form=form, call=call, amount=0.6)
    )
    with pytest.raises(LinkLostError, match=LOST[form]):
        it.drive(0.7)
    assert it.end.faults.struck >= 1
    assert it.coil.safe_off().verified
    assert not it.source.output_on


@pytest.mark.parametrize("form", ["usb", "windows", "closed", "reset"])
def test_unplugged_again_as_it_is_reopened(serial_bench, form):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="unplug", line="CURR [^M]", amount=0.1))
    it.end.faults.add(
        SerialFault(kind="unplug", form=form, call="reset", after=it.clock.now())
    )
    with pytest.raises(LinkLostError):
        it.drive(0.7)
    report = it.coil.safe_off()
    assert it.end.faults.struck == 2
    assert not report.verified and "OUTPUT STATE UNKNOWN" in report.text
    assert re.search(GONE, report.text) and "rror" not in report.text


@pytest.mark.parametrize("form", ["usb", "windows", "closed", "reset"])
def test_unplugged_and_back_is_made_safe_not_resumed(serial_bench, form):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(
        SerialFault(kind="unplug", line="CURR [^M]", form=form, amount=0.01)
    )
    with pytest.raises(LinkLostError):
        it.drive(0.7)
    assert it.source.output_on  # the source itself goes on while unplugged
    it.clock.sleep_until(it.clock.now() + 0.1)
    assert it.coil.safe_off().verified
    assert not it.source.output_on
    assert it.plant.coil_current(0) == 0.0


def test_a_wrong_digit_in_its_name_is_not_kept(serial_bench):
    """After a lost answer the right name was a stranger's: the coil stayed unknown."""
    it, said = serial_bench, []
    heard = it.source.line

    def line(words):
        answer = heard(words)
        if words == b"*IDN?":
            said.append(answer if said else answer.replace(b"E123456", b"E123466"))
            return said[-1]
        return answer

    it.source.line = line
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="missing"))
    it.drive(0.7)
    assert it.coil.safe_off().verified
    assert b"E123466" in said[0] and "E123456" in it.coil.identity


def test_an_error_of_the_instrument_is_passed_on(serial_bench):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.end.faults.add(SerialFault(kind="refused", line="CURR [^M]"))
    with pytest.raises(RefusedError, match=r"coil source at sim://.* refused .*-222"):
        it.drive(0.7)
    assert it.coil.safe_off().verified


@pytest.mark.parametrize("times", [1, None])
def test_off_with_a_set_point_that_was_refused_says_so(serial_bench, times):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="refused", line=r"^CURR 0\.0{5}", times=times))
    report = it.coil.safe_off()
    assert report.verified and not it.source.output_on
    if times is None:
        assert it.source.setpoint > 0 and "set-point may not be 0 A" in report.text
    else:
        assert it.source.setpoint == 0.0 and "set-point" not in report.text


def test_no_compliance_no_output(serial_bench):
    it = serial_bench
    it.coil.open()
    it.end.faults.add(SerialFault(kind="refused", line="VOLT 14"))
    with pytest.raises(RefusedError):
        it.coil.energise()
    assert not it.source.output_on
    assert not any(d.what == "output" and d.value for d in it.source.changes)


def test_output_that_cannot_be_switched_off_is_unsafe_at_connect(serial_bench):
    it = serial_bench
    it.source.switch(True)
    it.end.faults.add(SerialFault(kind="refused", line="OUTP 0", times=None))
    with pytest.raises(UnsafeError, match="output on"):
        it.coil.open()


def test_echo_at_connect_is_named(serial_bench):
    it = serial_bench
    it.end.faults.add(SerialFault(kind="echo", times=None))
    with pytest.raises(BadReplyError, match="echo = true"):
        it.coil.open()


def test_an_echo_that_does_not_come_is_named(serial_bench):
    it = serial_bench
    row = coil_dialect("kepco-bop")
    wire = row.serial.model_copy(update={"echo": True})
    row = row.model_copy(update={"serial": wire})
    coil = CoilSource(row, it.end.url, CoilLimits(), it.clock, baud=19200)
    with pytest.raises(BadReplyError, match="Leave echo out"):
        coil.open()


@pytest.mark.parametrize("join", [";:", ""])
def test_a_row_with_echo_reads_past_it(serial_bench, join):
    it = serial_bench
    it.end.faults.add(SerialFault(kind="echo", times=None))
    row = coil_dialect("kepco-bop")
    wire = row.serial.model_copy(update={"echo": True})
    row = row.model_copy(update={"serial": wire, "join": join})
    sent = []
    coil = CoilSource(
        row, it.end.url, CoilLimits(), it.clock, baud=19200,
        spy=lambda way, text, _: sent.append(text) if way == ">" else None,
    )  # fmt: skip
    coil.open()
    coil.energise()
    assert coil.safe_off().verified
    coil.close()
    # nothing was taken for a stranger's answer, after which its name is asked again
    assert sent.count(b"*IDN?\n") == 2


def test_another_instrument_on_the_port_is_refused(serial_bench):
    it = serial_bench
    row = coil_dialect("kepco-bop").model_copy(update={"match": "^KEITHLEY"})
    coil = CoilSource(row, it.end.url, CoilLimits(), it.clock, baud=19200)
    with pytest.raises(BadReplyError, match="KEPCO"):
        coil.open()
    assert it.source.changes == []


@settings(
    max_examples=25,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(cuts=st.lists(st.integers(0, 60), max_size=8))
def test_a_far_end_takes_any_split(resistor, cuts):
    row = coil_dialect("kepco-bop")
    message = b"VOLT 5;VOLT?;:CURR 0.25;CURR?;:SYST:ERR?\n\r\nOUTP?\r\n"
    edges = sorted({0, len(message), *(min(c, len(message)) for c in cuts)})
    clock = SimulatedClock()
    end = FarEnd(SimCoilSource(resistor, row.id, clock), row.serial, clock, "x")
    answers = []
    with clock.taking_part("test"):
        for a, b in itertools.pairwise(edges):
            answers += [answer.data for answer in end.take(message[a:b])]
    first = b'5.000;0.25000;0,"No error"\r\n'
    assert answers == [first, b"0\r\n"]


@pytest.mark.parametrize(
    ("model", "name", "other"),
    [("keithley-2400", b"", b""), ("kepco-bop", b"E123456", b"E654321")],
    ids=["another model", "another unit"],
)
def test_a_stranger_found_on_reconnecting_is_told_nothing(
    serial_bench, model, name, other
):
    it = serial_bench
    it.coil.open()
    it.coil.energise()
    it.drive(0.5)
    it.end.faults.add(SerialFault(kind="unplug", line="CURR [^M]", amount=0.3))
    with pytest.raises(LinkLostError):
        it.drive(0.7)
    stranger = SimCoilSource(it.plant, model, it.clock)
    it.end.instrument = stranger
    heard = []

    def line(words):
        heard.append(words)
        answer = SimCoilSource.line(stranger, words)
        return answer and answer.replace(name, other)

    stranger.line = line
    report = it.coil.safe_off()
    assert not report.verified
    assert "reconnect: At sim" in report.text
    assert set(heard) <= {b"\x1b", b"*IDN?"}


def test_a_source_that_was_never_reached_is_not_called_safe(serial_bench):
    it = serial_bench
    it.end.faults.add(SerialFault(kind="deaf", times=None))
    with pytest.raises(NoReplyError):
        it.coil.open()
    begun = it.clock.now()
    report = it.coil.safe_off()
    assert not report.verified and "never reached" in report.text
    assert it.clock.now() == begun


def test_no_answer_is_told_with_what_the_instrument_reports(resistor):
    clock = SimulatedClock()
    row = coil_dialect("keithley-2400")
    source = SimCoilSource(resistor, row.id, clock)
    end = plug_in(source, row.serial, clock, "coil")
    coil = CoilSource(row, end.url, CoilLimits(current=0.5), clock)
    with clock.taking_part("test"):
        coil.open()
        coil.energise()
        source.switch(False)  # at its front panel
        with pytest.raises(NoReplyError, match=r"reports \+?803.*front panel"):
            coil.read_current()
        assert coil.safe_off().verified
        coil.close()
    unplug(end)


def test_a_source_that_answers_late_as_it_is_opened_is_not_said_to_be_on(serial_bench):
    it = serial_bench
    it.end.faults.add(SerialFault(kind="missing", line=r"OUTP\?", skip=1, times=None))
    with pytest.raises(UnsafeError) as failed:
        it.coil.open()
    assert "OUTPUT STATE UNKNOWN" not in str(failed.value)
    assert "when connected" in str(failed.value)
    it.end.faults.clear()
    assert it.coil.safe_off().verified
