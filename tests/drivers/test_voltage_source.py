"""A source meter that holds V_GS: limits, slew, read-back, rest, and what it left."""

import itertools
import time
from dataclasses import dataclass, replace

import pytest

from drivers.voltage_source import STEP_EVERY, SourceMeter
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.scpi import ScpiParser, numeric
from sim_backend.serial_line.wires import FarEnd, plug_in
from sim_backend.serve import Gate, ServedBench
from sim_backend.voltage_source import (
    Keithley2400,
    LoadFault,
    RowVoltageSource,
    VoltagePanel,
)
from tactile_lab.clock import RealClock, SimulatedClock
from tactile_lab.errors import (
    BadReplyError,
    InterlockError,
    LimitError,
    LinkLostError,
    NoReplyError,
    RefusedError,
    SceneError,
)
from tactile_lab.instruments.dialects import voltage_dialect
from tactile_lab.voltage_source import VoltageLimits

ROW = voltage_dialect("keithley-2400-voltage")
LIMITS = VoltageLimits(lowest=0.5, highest=2.0)


@dataclass
class Wired:
    clock: SimulatedClock
    gate: Gate
    panel: VoltagePanel
    end: FarEnd
    source: SourceMeter

    def go(self, volts):
        while not self.source.step_to(volts):
            self.clock.sleep_until(self.clock.now() + STEP_EVERY)
        self.wait(0.3)

    def wait(self, seconds):
        self.clock.sleep_until(self.clock.now() + seconds)

    def again(self, limits=LIMITS):
        """Another program at the same instrument."""
        return SourceMeter("V_GS", ROW, self.end.url, limits, self.clock)


@pytest.fixture
def wired():
    clock, gate = SimulatedClock(), Gate()
    panel = Keithley2400(gate, "V_GS", clock)
    end = plug_in(panel, ROW.serial, clock, "V_GS")
    source = SourceMeter("V_GS", ROW, end.url, LIMITS, clock)
    with clock.taking_part("test"):
        yield Wired(clock, gate, panel, end, source)
        source.close()


def test_it_ramps_within_its_slew_holds_and_goes_to_rest(wired):
    wired.source.open()
    assert not wired.panel.output_on  # nothing asked for yet
    assert wired.panel.compliance == pytest.approx(100e-6)
    wired.go(1.405)
    held = wired.source.read()
    assert held.setpoint == 1.405
    assert held.voltage == pytest.approx(1.405, abs=1e-4)
    assert wired.gate.volts["V_GS"] == pytest.approx(1.405)
    assert wired.source.go_to_rest().verified
    assert not wired.panel.output_on and wired.gate.volts["V_GS"] == 0.0
    sets = [(at, value) for what, at, value in wired.panel.changes if what == "set"]
    for (before, one), (at, two) in itertools.pairwise(sets):
        # what was rounded to the range's step may exceed it by as much
        assert abs(two - one) <= LIMITS.slew * (at - before) + 50e-6
    limit = next(i for i, one in enumerate(wired.panel.changes) if one[0] == "limit")
    on = wired.panel.changes.index(next(c for c in wired.panel.changes if c[2] == 1.0))
    assert limit < on, "the compliance comes before the output"


def test_a_range_that_was_not_taken_is_sent_again_and_then_refused(wired):
    """Steps of 500 uV stood as 50 uV; nobody asked."""
    panel, choose, lost = wired.panel, wired.panel._choose, [1]

    def loses(volts):
        if lost.pop() if lost else False:
            return
        choose(volts)

    panel._range = 21.0
    panel.parser = ScpiParser(
        {**panel._commands(), "SOURce:VOLTage:RANGe": numeric(loses, -210.0, 210.0)}
    )
    wired.source.open()
    assert panel._range == 2.1
    wired.source.close()
    panel._range, lost[:] = 21.0, [1, 1]
    with pytest.raises(
        RefusedError, match="stays in its range of 21 V where that of 2"
    ):
        wired.again().open()


def test_what_lies_beyond_the_limits_is_never_sent(wired):
    wired.source.open()
    for volts in (0.4, 2.01, -1.0, float("nan"), float("inf")):
        with pytest.raises(LimitError, match=r"\[voltage_source.V_GS.limits\]"):
            wired.source.step_to(volts)
    assert not wired.panel.output_on


@pytest.mark.parametrize(
    ("limits", "said"),
    [
        (VoltageLimits(highest=30.0), "beyond the 21 V"),
        (VoltageLimits(highest=2.0, compliance=2.0), r"2 A is beyond the 1\.05 A"),
    ],
)
def test_limits_beyond_the_model_are_refused(limits, said):
    with pytest.raises(SceneError, match=said):
        SourceMeter("V_GS", ROW, "sim://none", limits, SimulatedClock())


def test_limits_that_contradict_each_other_are_refused():
    with pytest.raises(ValueError, match="lowest must be below"):
        VoltageLimits(lowest=2.0, highest=1.0)
    with pytest.raises(ValueError, match="rest must be 0 V or lie within"):
        VoltageLimits(lowest=1.0, highest=2.0, rest=0.5)


@pytest.mark.parametrize("ohms", [0.0, 1e3])
def test_a_gate_held_down_is_noticed(wired, ohms):
    wired.source.open()
    wired.go(1.4)
    wired.source.read()
    wired.panel.fault = LoadFault(resistance=ohms)
    with pytest.raises(InterlockError, match=r"set to 1\.4 V but .* 100 µA flows"):
        for _ in range(3):
            wired.source.read()
            wired.wait(0.2)


@pytest.mark.parametrize(
    "fault",
    [
        SerialFault(kind="missing", line=":SOUR:VOLT 1"),
        SerialFault(kind="late", amount=0.25, line=":SOUR:VOLT 1"),
        SerialFault(kind="garbled", line="READ"),
        SerialFault(kind="partial", amount=3, line="READ"),
        SerialFault(kind="missing", line="OUTP 1"),
        SerialFault(kind="noise", line=":SOUR:VOLT 1"),
    ],
    ids=lambda fault: f"{fault.kind} {fault.line}",
)
def test_one_lost_answer_costs_nothing(wired, fault):
    wired.end.faults.add(fault)
    wired.source.open()
    wired.go(1.4)
    assert wired.source.read().voltage == pytest.approx(1.4, abs=1e-3)
    assert wired.source.go_to_rest().verified and not wired.panel.output_on
    assert wired.end.faults.struck == 1


def test_a_pulled_plug_is_told_and_rest_is_not_claimed(wired):
    wired.source.open()
    wired.go(1.4)
    wired.end.faults.add(SerialFault(kind="unplug", times=None))
    with pytest.raises(LinkLostError):
        wired.source.read()
    report = wired.source.go_to_rest()
    assert not report.verified and "unknown" in report.text
    assert wired.panel.output_on  # the gate keeps what it had


def test_a_plug_put_back_is_found_and_it_goes_to_rest(wired):
    wired.source.open()
    wired.go(1.4)
    wired.end.faults.add(SerialFault(kind="unplug", amount=0.4))
    with pytest.raises(LinkLostError):
        wired.source.read()
    assert wired.source.go_to_rest().verified and not wired.panel.output_on


def test_a_source_that_stops_answering_is_told(wired):
    wired.source.open()
    wired.go(1.4)
    wired.end.faults.add(SerialFault(kind="missing", times=None))
    with pytest.raises(NoReplyError):
        wired.source.read()
    assert not wired.source.go_to_rest().verified


def test_what_a_dead_program_left_is_taken_over_without_a_jump(wired):
    wired.source.open()
    wired.go(1.4)
    wired.source.close()  # as the system does when a program dies
    assert wired.panel.output_on and wired.gate.volts["V_GS"] == pytest.approx(1.4)
    wired.panel.changes.clear()
    after = wired.again()
    after.open()
    assert wired.panel.output_on, "it is not switched off on the way"
    after.step_to(1.41)
    wired.wait(0.1)
    after.step_to(1.41)
    sets = [value for what, _, value in wired.panel.changes if what == "set"]
    assert min(sets) >= 1.4 - 1e-9 and max(sets) <= 1.41 + 1e-9
    assert after.go_to_rest().verified
    after.close()


def test_a_rest_other_than_0_V_stays_on_and_is_read_back(wired):
    limits = replace(LIMITS, rest=1.2)
    source = wired.again(limits)
    source.open()
    while not source.step_to(1.4):
        wired.wait(STEP_EVERY)
    report = source.go_to_rest()
    assert report.verified and "its rest" in report.text
    source.close()
    assert wired.panel.output_on and wired.gate.volts["V_GS"] == pytest.approx(1.2)


def test_an_output_that_is_on_and_not_ours_is_left_alone(wired):
    wired.panel.output_on = True  # it sources a current
    with pytest.raises(RefusedError, match="Switch it off at its front panel"):
        wired.source.open()
    assert wired.source.go_to_rest().text.startswith("This program did not switch")
    assert wired.panel.output_on
    wired.panel.output_on = False


def test_a_voltage_that_no_run_may_leave_is_not_taken_over(wired):
    """It was refused, to be switched off by hand, and then driven to 0 V."""
    wired.source.open()
    wired.go(1.4)
    wired.source.close()
    other = wired.again(VoltageLimits(highest=1.0))
    with pytest.raises(RefusedError, match=r"it holds 1\.4 V"):
        other.open()
    assert other.go_to_rest().text.startswith("This program did not switch")
    assert wired.panel.output_on and wired.gate.volts["V_GS"] == pytest.approx(1.4)


def test_an_output_that_was_switched_off_by_hand_is_known_to_be_off(wired):
    """Whether it went to rest was unknown, for what is off measures nothing."""
    wired.source.open()
    wired.go(1.4)
    wired.panel.switch(False)
    report = wired.source.go_to_rest()
    assert report.verified and "was off already" in report.text


def test_a_voltage_set_by_hand_is_no_short(wired):
    wired.source.open()
    wired.go(1.4)
    wired.panel.set(1.2)
    with pytest.raises(InterlockError, match=r"1\.2\d* V is.* It was set by hand"):
        for _ in range(3):
            wired.source.read()
            wired.wait(0.2)


@pytest.mark.parametrize("leaves", [False, True])
def test_one_wrong_digit_is_no_output_that_is_off(wired, leaves):
    """A gate at 1.4 V fell to 0 V as it was taken over, or was left, called off."""
    wired.source.open()
    wired.go(1.4)
    source = wired.source
    if not leaves:
        wired.source.close()
        source = wired.again()
    heard, wrong = wired.panel.line, [b"0"]
    wired.panel.line = lambda line: (
        wrong.pop() if wrong and line == b":OUTP?" else heard(line)
    )
    before = len(wired.panel.changes)
    if leaves:
        assert source.go_to_rest().text.endswith("V, output off.")
        assert not wired.panel.output_on
    else:
        source.open()
        assert not [one for one in wired.panel.changes[before:] if one[0] == "set"]
        assert source.go_to_rest().verified
        source.close()
    assert not wrong


def test_one_wrong_digit_is_no_voltage_to_go_on_from(wired):
    """A gate at 1.4 V was ramped from 1.9 V on, as the next run took it over."""
    wired.source.open()
    wired.go(1.4)
    wired.source.close()
    heard, wrong = wired.panel.line, [b"+1.900000E+00"]
    wired.panel.line = lambda line: (
        wrong.pop() if wrong and line == b":SOUR:VOLT?" else heard(line)
    )
    before, next_run = len(wired.panel.changes), wired.again()
    next_run.open()
    while not next_run.step_to(1.5):
        wired.wait(STEP_EVERY)
    sets = [volts for what, _, volts in wired.panel.changes[before:] if what == "set"]
    assert not wrong and 1.4 < min(sets) and max(sets) < 1.51
    assert next_run.go_to_rest().verified
    next_run.close()


@pytest.mark.parametrize("answer", ["+1.4..00E+00,+1.0E-09", "+9.91E37,+9.91E37", "."])
def test_one_answer_that_is_no_number_is_asked_for_again(wired, answer):
    """A doubled dot ended the run: could not convert string to float."""
    wired.source.open()
    wired.go(1.4)
    heard, wrong = wired.panel.line, [answer.encode()]
    wired.panel.line = lambda line: (
        wrong.pop() if wrong and line == b":READ?" else heard(line)
    )
    assert wired.source.read().voltage == pytest.approx(1.4, abs=1e-3)
    assert not wrong


def test_a_current_source_of_the_same_name_is_no_voltage(wired):
    """Settings that are lost twice are found by their read-back."""
    fault = SerialFault(kind="deaf", line="SOUR:FUNC VOLT", times=2)
    wired.end.faults.add(fault)
    with pytest.raises((BadReplyError, RefusedError, NoReplyError)):
        wired.source.open()
    assert not wired.panel.output_on


def test_a_source_made_from_its_row_plays_a_session():
    clock, gate = SimulatedClock(), Gate()
    panel = RowVoltageSource(gate, "V_GS", ROW, clock)
    url = plug_in(panel, ROW.serial, clock, "row").url
    source = SourceMeter("V_GS", ROW, url, LIMITS, clock)
    with clock.taking_part("test"):
        source.open()
        while not source.step_to(1.0):
            clock.sleep_until(clock.now() + STEP_EVERY)
        clock.sleep_until(clock.now() + 0.3)
        assert source.read().voltage == pytest.approx(1.0, abs=1e-3)
        assert source.go_to_rest().verified and not panel.output_on
        source.close()


@pytest.mark.parametrize("where", ["pty", "tcp:0"])
def test_over_a_wire_of_its_own(where):
    served = ServedBench(coil=None, voltage_source=where)
    served.start()
    wire = ROW.serial.model_copy(update={"timeout": 5.0})
    row = ROW.model_copy(update={"serial": wire})
    limits = VoltageLimits(highest=2.0, slew=50.0)
    address = served.addresses["voltage_source"]
    source = SourceMeter("V_GS", row, address, limits, RealClock())
    try:
        source.open()
        while not source.step_to(1.4):
            time.sleep(STEP_EVERY)
        assert source.read().voltage == pytest.approx(1.4, abs=1e-3)
        assert served.gate.volts["V_GS"] == pytest.approx(1.4)
        assert source.go_to_rest().verified
        assert served.gate.volts["V_GS"] == 0.0
    finally:
        source.close()
        served.close()
