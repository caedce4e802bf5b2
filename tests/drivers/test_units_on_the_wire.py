"""A source that speaks of milliamperes and millivolts; its row says so."""

import re

import numpy as np
import pytest

from drivers.coil.source import CoilSource
from drivers.voltage_source import STEP_EVERY, SourceMeter
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line.wires import plug_in
from sim_backend.serve import Gate
from sim_backend.voltage_source import Keithley2400
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.current_list import CurrentList
from tactile_lab.errors import SceneError
from tactile_lab.instruments.dialects import (
    coil_dialect,
    parse_dialect,
    voltage_dialect,
)
from tactile_lab.voltage_source import VoltageLimits

IN_MILLI = {"current_unit": 1e-3, "voltage_unit": 1e-3}
NUMBER = re.compile(r"(?<=[ ,])[-+]?\d+\.?\d*(?=[,;]|$)")


class InMilli:
    """A far end whose currents and voltages are thousands of what another speaks.

    Args:
        other: hears what is meant, in A and V, and answers so.
        lines: whose numbers are in mA or mV.
        queries: whose answers are.
    """

    clearing, gap = b"", 0.0

    def __init__(self, other, lines, queries):
        self.other, self.lines, self.queries = other, lines, queries
        self.reply_end = other.reply_end
        self.heard = []

    def line(self, line):
        text = line.decode("ascii")
        self.heard.append(text)
        if text.startswith(self.lines):
            head, _, tail = text.partition(";")
            head = NUMBER.sub(lambda one: f"{float(one[0]) / 1000:.6f}", head)
            text = ";".join(part for part in (head, tail) if part)
        answer = self.other.line(text.encode("ascii"))
        if answer is None or not text.startswith(self.queries):
            return answer
        numbers, *errors = answer.decode("ascii").split(";")
        said = ",".join(f"{1000 * float(one):.4f}" for one in numbers.split(","))
        return ";".join([said, *errors]).encode("ascii")


def test_a_coil_source_in_milliamperes(resistor):
    clock = SimulatedClock()
    row = coil_dialect("kepco-bop").model_copy(
        update=IN_MILLI | {"set": "CURR {i:.2f}", "digits": 2}
    )
    source = SimCoilSource(resistor, "kepco-bop", clock)
    asked = (row.set_query, row.limit_query, row.measure_current, row.measure_voltage)
    far = InMilli(source, ("CURR ", "VOLT ", "LIST:CURR "), asked)
    end = plug_in(far, row.serial, clock, "milli")
    coil = CoilSource(row, end.url, CoilLimits(), clock, guarded=False)
    with clock.taking_part("test"):
        coil.open()
        coil.energise()
        assert source.compliance == 14.0
        while coil.setpoint < 0.25:
            clock.sleep_until(clock.now() + coil.update_interval)
            coil.set_current(0.25)
        clock.sleep_until(clock.now() + 0.2)
        assert any(line.startswith("CURR 250.00") for line in far.heard)
        assert source.setpoint == coil.setpoint == 0.25
        assert coil.read_current().value == pytest.approx(0.25)
        assert coil._wire.voltage() == pytest.approx(1.25)
        assert coil.settings()["setpoint_A"] == "0.25"
        assert coil.safe_off().verified and source.setpoint == 0.0
        coil.energise()
        coil.load_list(CurrentList(np.array([0.005, 0.0]), np.array([0.01, 0.01])))
        assert any(line.startswith("LIST:CURR 5.00,") for line in far.heard)
        coil.start_list()
        clock.sleep_until(clock.now() + 0.1)
        coil.end_list()
        coil.close()
    assert not source.output_on


def test_a_source_meter_in_millivolts_and_milliamperes():
    clock, gate = SimulatedClock(), Gate()
    row = voltage_dialect("keithley-2400-voltage").model_copy(
        update=IN_MILLI | {"digits": 3}
    )
    panel = Keithley2400(gate, "V_GS", clock)
    lines = (":SOUR:VOLT ", ":SOUR:VOLT:RANG ", ":SENS:CURR:PROT ")
    asked = (row.set_query, row.limit_query, row.measure_voltage, row.range_query)
    end = plug_in(InMilli(panel, lines, asked), row.serial, clock, "milli")
    limits = VoltageLimits(lowest=0.5, highest=2.0)
    source = SourceMeter("V_GS", row, end.url, limits, clock)
    with clock.taking_part("test"):
        source.open()
        while not source.step_to(1.234):
            clock.sleep_until(clock.now() + STEP_EVERY)
        clock.sleep_until(clock.now() + 0.3)
        assert panel.setpoint == pytest.approx(1.234, abs=1e-9)
        assert source.read().voltage == pytest.approx(1.234, abs=1e-4)
        assert panel.compliance == pytest.approx(limits.compliance)
        assert source.settings()["setpoint_V"] == "1.234"
        source.go_to_rest()
        source.close()


def test_a_unit_of_another_kind_is_refused():
    with pytest.raises(SceneError, match="current_unit"):
        parse_dialect('role = "coil"\ncurrent_unit = "1 mV"', "own.toml")
