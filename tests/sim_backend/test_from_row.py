"""Far ends made from rows alone, driven by the unchanged drivers."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from resistor import Resistor

from drivers.coil.source import CoilSource
from drivers.teslameter import Teslameter
from sim_backend.coil.source import RowCoil, coil_far_end
from sim_backend.serial_line.from_row import RowParser, invented
from sim_backend.serial_line.wires import plug_in
from sim_backend.serve import ServedBench
from sim_backend.teslameter import meter_far_end, row_teslameter
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.dialects import dialect_ids, load_dialect
from tactile_lab.instruments.serial_dialect import CoilDialect

SERIAL = (*dialect_ids("coil"), *dialect_ids("field meter"))
ROWS = [load_dialect(name) for name in SERIAL]
COILS = [row for row in ROWS if isinstance(row, CoilDialect)]
METERS = [row for row in ROWS if not isinstance(row, CoilDialect)]


def wired(row, far_end, clock):
    return plug_in(far_end, row.serial, clock, "row").url


def odd_row():
    """A row that echoes each line and speaks of mA."""
    row = next(row for row in COILS if row.id == "scpi-generic")
    changed = {
        "id": "odd", "current_unit": 1e-3, "digits": 2,
        "serial": row.serial.model_copy(update={"echo": True}),
    }  # fmt: skip
    return row.model_copy(update=changed)


@pytest.mark.parametrize("row", [*COILS, odd_row()], ids=lambda row: row.id)
def test_a_source_made_from_its_row_plays_a_session(row):
    clock, plant = SimulatedClock(), Resistor()
    source = RowCoil(plant, row, clock)
    coil = CoilSource(row, wired(row, source, clock), CoilLimits(current=1.0), clock)
    with clock.taking_part("test"):
        coil.open()
        coil.energise()
        assert source.output_on and source.compliance == pytest.approx(14.0)
        for _ in range(4):
            clock.sleep_until(clock.now() + 0.1)
            coil.set_current(0.25)
        assert plant.amperes == pytest.approx(0.25)
        clock.sleep_until(clock.now() + 0.3)
        assert coil.read_current().value == pytest.approx(0.25, abs=1e-3)
        assert coil._wire.voltage() == pytest.approx(1.25, abs=1e-3)
        assert coil.safe_off().verified
        assert not source.output_on and source.setpoint == 0.0
        coil.close()
    assert coil.warnings == []


@pytest.mark.parametrize("row", METERS, ids=lambda row: row.id)
def test_a_meter_made_from_its_row_reads_the_field(row):
    clock, plant = SimulatedClock(), Resistor()
    plant.amperes, plant.on = -0.5, True
    meter = Teslameter(row, wired(row, row_teslameter(plant, row, clock), clock), clock)
    with clock.taking_part("test"):
        meter.open()
        assert meter.read().value == pytest.approx(-5.5e-3, rel=1e-3)
        assert set(row.report) <= set(meter.settings())
        meter.close()


def test_what_the_row_does_not_say_is_an_error():
    row = next(row for row in COILS if row.id == "kepco-bop")
    clock = SimulatedClock()
    source = RowCoil(Resistor(), row, clock)
    assert source.line(b"OUTP:PROT?") is None
    assert source.line(b"SYST:ERR?").startswith(b"-113")
    assert source.line(b"CURR 99.00000;:SYST:ERR?").startswith(b"-222")
    assert source.line(b"VOLT 99.000;:SYST:ERR?").startswith(b"-222")
    assert source.line(b"SYST:ERR?") == b"0"
    assert source.setpoint == 0.0


def test_rows_that_ship_keep_the_far_ends_written_from_manuals():
    clock = SimulatedClock()
    for row in COILS:
        assert not isinstance(coil_far_end(Resistor(), row, clock), RowCoil)
    for row in METERS:
        assert not isinstance(meter_far_end(Resistor(), row, clock), RowParser)


def test_one_polarity_is_refused_by_the_far_end_too():
    row = next(row for row in COILS if row.polarity == "positive")
    source = RowCoil(Resistor(), row, SimulatedClock())
    source.line(row.set_line(-0.5).encode())
    assert source.setpoint == 0.0
    assert re.search(row.error_ok, source.line(row.error.encode()).decode()) is None


def test_a_row_whose_answers_cannot_be_made_is_named(tmp_path):
    path = tmp_path / "odd.toml"
    text = (
        'id = "odd"\nrole = "field meter"\ntitle = "Odd"\nmatch = "(?!x)y(?<=z)"\n'
        'field = "F?"\n'
    )
    path.write_text(text)
    with pytest.raises(SceneError, match="No simulated answer"):
        ServedBench(coil=None, teslameter="tcp:0", meter_row=str(path))


@given(
    number=st.decimals(-99, 99, places=4).map(lambda d: f"{d:.4f}"),
    pattern=st.sampled_from([row.number for row in ROWS]),
)
def test_a_number_is_found_where_the_pattern_has_it(number, pattern):
    assert re.search(pattern, invented(pattern, number)).group(1) == number


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        (r"HAMEG|ROHDE.*HMP4040", "HAMEG"),
        (r"^ACME.{2}\d+[^a]?(X|Y)$", "ACMExx1X"),
        (r"^[+-]?0\b", "0"),
    ],
)
def test_texts_from_patterns(pattern, text):
    assert invented(pattern) == text
