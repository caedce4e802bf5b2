"""The serial thermometers: every row against its far end, on wires that fail."""

import pytest

from drivers.thermometer import Thermometer
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.wires import plug_in
from sim_backend.thermometer import MODELS, SensorFault, thermometer_far_end
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import (
    BadReplyError,
    InstrumentError,
    LimitError,
    NoReplyError,
    SceneError,
)
from tactile_lab.instruments.dialects import (
    dialect_ids,
    parse_dialect,
    thermometer_dialect,
)

ROWS = dialect_ids("thermometer")


class Bath:
    kelvin = 295.15

    def temperature(self, time):
        return self.kelvin


class Bench:
    """A thermometer in a bath, on a wire that takes its time."""

    def __init__(self, row):
        self.row, self.clock, self.bath = row, SimulatedClock(), Bath()
        self.far = thermometer_far_end(self.bath, row, self.clock)
        self.end = plug_in(self.far, row.serial, self.clock, "thermometer")
        self.it = Thermometer(row, self.end.url, self.clock)


@pytest.fixture(params=ROWS)
def bench(request):
    made = Bench(thermometer_dialect(request.param).at(None))
    with made.clock.taking_part("test"):
        made.it.open()
        yield made
        made.it.close()


def test_every_row_has_a_far_end():
    assert sorted(ROWS) == sorted(MODELS)


@pytest.mark.parametrize("kelvin", [253.15, 273.15, 295.15, 373.15])
def test_reads_kelvin(bench, kelvin):
    bench.bath.kelvin = kelvin
    assert bench.it.read().value == pytest.approx(kelvin, abs=0.03)
    settings = bench.it.settings()
    assert float(settings["temperature"]) == pytest.approx(kelvin - 273.15, abs=0.03)
    assert settings["identity"].startswith("LSCI")


def test_an_open_sensor_is_no_temperature(bench):
    """A Lake Shore goes on to answer: 480 K, and a status nobody would ask for."""
    bench.far.fault = SensorFault(after=bench.clock.now())
    with pytest.raises(LimitError, match=r"480 K at its input \w is no reading: RDGST"):
        bench.it.read()


def test_an_input_without_a_sensor_is_told(bench):
    row = thermometer_dialect(bench.row.id)
    bench.it.close()
    other = Thermometer(row.at(row.inputs[1]), bench.end.url, bench.clock)
    other.open()
    with pytest.raises(LimitError, match="Check that a sensor is connected"):
        other.read()
    other.close()


def test_what_comes_before_its_time_is_not_heard(bench):
    """A row that forgets the rest a Lake Shore wants reads nothing from it."""
    bench.it.close()
    hasty = bench.row.serial.model_copy(update={"min_gap": 0.0})
    row = bench.row.model_copy(update={"serial": hasty})
    other = Thermometer(row, bench.end.url, bench.clock)
    other.open()  # a single question
    with pytest.raises(NoReplyError):
        other.settings()
    other.close()


@pytest.mark.parametrize("kind", ["missing", "partial", "garbled", "noise", "late"])
@pytest.mark.parametrize("line", ["KRDG", "RDGST"])
def test_one_bad_exchange_is_repeated(bench, kind, line):
    bench.end.faults.add(SerialFault(kind=kind, amount=0.35, line=line))
    assert bench.it.read().value == pytest.approx(295.15, abs=0.03)
    assert bench.end.faults.struck == 1


def test_it_does_not_answer_for_ever(bench):
    bench.end.faults.add(SerialFault(kind="missing", times=None))
    with pytest.raises(InstrumentError, match="thermometer"):
        bench.it.read()


def test_another_instrument_is_refused(bench):
    bench.it.close()
    (other,) = (name for name in ROWS if name != bench.row.id)
    asked = thermometer_dialect(other).at(None)
    asked = asked.model_copy(update={"serial": bench.row.serial})
    stranger = Thermometer(asked, bench.end.url, bench.clock)
    with pytest.raises(BadReplyError, match="Name the right row"):
        stranger.open()


OWN = """
id = "bath"
role = "thermometer"
title = "bath thermometer"
match = '^BATH'
temperature = "T{input}?"
inputs = ["1", "2"]
zero = "273.15 K"
"""


def test_a_row_of_ones_own_in_celsius_at_another_input():
    bench = Bench(parse_dialect(OWN, "bath.toml").at("2"))
    with bench.clock.taking_part("test"):
        bench.it.open()
        assert bench.it.read().value == pytest.approx(295.15, abs=1e-3)
        bench.bath.kelvin = -1.0
        with pytest.raises(LimitError, match="no temperature is so low"):
            bench.it.read()
        bench.it.close()


@pytest.mark.parametrize(
    ("answer", "kelvin"),
    [
        ("21.3", 294.45),
        ("21.3 C", 294.45),
        ("+21.3degC", 294.45),
        ("294.1 K", 294.1),
        ("77.0 F", 298.15),
        ("-4F", 253.15),
        ("21.3 mV", None),
    ],
)
def test_a_unit_behind_the_number_is_heeded(answer, kelvin):
    """77 F were kept as 77 C."""
    bench = Bench(parse_dialect(OWN, "bath.toml").at("1"))
    heard = bench.far.line
    bench.far.line = lambda line: answer.encode() if line == b"T1?" else heard(line)
    with bench.clock.taking_part("test"):
        bench.it.open()
        if kelvin is None:
            with pytest.raises(BadReplyError, match=f"'{answer}'.* none of K, C and F"):
                bench.it.read()
        else:
            assert bench.it.read().value == pytest.approx(kelvin)
        bench.it.close()


def test_mistakes_in_a_row_are_told():
    with pytest.raises(
        SceneError, match=r'temperature = "T\{chan\}\?": .*is \{input\}'
    ):
        parse_dialect(OWN.replace("{input}", "{chan}"), "bath.toml")
    with pytest.raises(SceneError, match="would read the same of 2 inputs"):
        parse_dialect(OWN.replace("{input}", ""), "bath.toml")
    with pytest.raises(SceneError, match=r'input = "3".* Known: 1, 2'):
        parse_dialect(OWN, "bath.toml").at("3")
