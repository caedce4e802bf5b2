import pytest

from drivers.teslameter import Teslameter
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.wires import plug_in
from sim_backend.teslameter import MODELS, SimTeslameter
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import BadReplyError, LimitError, NoReplyError
from tactile_lab.instruments.dialects import dialect_ids, load_dialect

METERS = dialect_ids("field meter")


def test_every_row_has_a_far_end():
    assert sorted(METERS) == sorted(MODELS)


@pytest.fixture(params=METERS)
def meter(request, resistor):
    row = load_dialect(request.param)
    clock = SimulatedClock()
    resistor.output(0, True)
    end = plug_in(SimTeslameter(resistor, row.id, clock), row.serial, clock, "meter")
    meter = Teslameter(row, end.url, clock)
    with clock.taking_part("test"):
        meter.open()
        yield clock, resistor, end, meter
        meter.close()


@pytest.mark.parametrize("amperes", [0.0, 0.5, -0.5, 2.0, 20.0, 50.0])
def test_reads_tesla(meter, amperes):
    _, plant, _, it = meter
    plant.set_current(0, amperes)
    assert it.read().value == pytest.approx(11e-3 * amperes, rel=1e-3, abs=1e-6)
    assert it.settings()["identity"].startswith(("LSCI", "Lake"))


def test_a_change_of_range_between_field_and_multiplier_is_noticed(meter):
    """A 421 says value and prefix in two answers: 40 mT is not 40 T."""
    _, plant, _, it = meter
    for amperes in (0.5, 50.0, 0.5):
        plant.set_current(0, amperes)
        assert it.read().value == pytest.approx(11e-3 * amperes, rel=1e-3)


def test_what_comes_before_its_time_is_not_heard(meter):
    """A row that forgets the rest a Lake Shore wants cannot open it."""
    clock, _, end, it = meter
    it.close()
    hasty = it.dialect.serial.model_copy(update={"min_gap": 0.0})
    row = it.dialect.model_copy(update={"serial": hasty})
    other = Teslameter(row, end.url, clock)
    if it.dialect.serial.min_gap == 0:
        other.open()
    else:
        with pytest.raises(NoReplyError):
            other.open()
    other.close()


def test_a_425_tells_its_unit_and_a_field_beyond_its_range(resistor):
    clock, plant = SimulatedClock(), resistor
    plant.output(0, True)
    plant.set_current(0, 0.5)
    row = load_dialect("lakeshore-425")
    end = plug_in(SimTeslameter(plant, row.id, clock), row.serial, clock, "meter")
    meter = Teslameter(row, end.url, clock)
    with clock.taking_part("test"):
        meter.open()
        assert meter.read().value == pytest.approx(5.5e-3, rel=1e-3)
        assert meter.settings()["unit"] == "2"
        plant.set_current(0, 1000.0)
        with pytest.raises(LimitError, match="range"):
            meter.read()
        meter.close()


def test_overload_is_told(meter):
    _, plant, _, it = meter
    plant.set_current(0, 1000.0)
    with pytest.raises((LimitError, BadReplyError)):
        it.read()


@pytest.mark.parametrize(
    ("answer", "scale", "tesla"),
    [
        ("2.75E-03T", 1.0, 2.75e-3),
        ("0.00275 TESLA", 1.0, 2.75e-3),
        ("2.75 mT", 1e-3, 2.75e-3),
        ("27.5G", 1e-4, 2.75e-3),
        ("27.5", 1e-4, 2.75e-3),
        ("27.5G", 1.0, None),
        ("2.75 mT", 1.0, None),
        ("0.00275T", 1e-4, None),
    ],
)
def test_a_unit_behind_the_number_must_be_the_rows(resistor, answer, scale, tesla):
    """A meter that had not heard its init gave gauss, and 27.5 T were kept."""
    row = load_dialect("lakeshore-f41").model_copy(update={"scale": scale})
    clock = SimulatedClock()
    sim = SimTeslameter(resistor, row.id, clock)
    meter = Teslameter(row, plug_in(sim, row.serial, clock, "unit").url, clock)
    heard = sim.line
    sim.line = lambda line: answer.encode() if b"FETCH:DC" in line else heard(line)
    with clock.taking_part("test"):
        meter.open()
        if tesla is None:
            with pytest.raises(BadReplyError, match=f"{answer}.* units of"):
                meter.read()
        else:
            assert meter.read().value == pytest.approx(tesla)
        meter.close()


@pytest.mark.parametrize("kind", ["missing", "partial", "garbled", "noise", "late"])
def test_one_bad_exchange_is_repeated(meter, kind):
    _, plant, end, it = meter
    plant.set_current(0, 0.5)
    end.faults.add(SerialFault(kind=kind, amount=0.35, line="FIELD|FETCH"))
    assert it.read().value == pytest.approx(5.5e-3, rel=1e-3)
    assert end.faults.struck == 1


@pytest.fixture(params=METERS)
def closed(request, resistor):
    """A meter as it comes: in gauss, not yet opened."""
    row = load_dialect(request.param)
    clock = SimulatedClock()
    resistor.output(0, True)
    resistor.set_current(0, 0.5)
    end = plug_in(SimTeslameter(resistor, row.id, clock), row.serial, clock, "meter")
    with clock.taking_part("test"):
        yield end, Teslameter(row, end.url, clock)


LINES = r"^(UNIT|RDGMODE|ACDC|AUTO|SENSE:MODE|UNIT:FIELD)\b[^?]*$"


@pytest.mark.parametrize("kind", ["late", "missing", "deaf"])
@pytest.mark.parametrize("skip", range(6))
def test_one_bad_exchange_does_not_end_the_opening(closed, kind, skip):
    end, meter = closed
    end.faults.add(SerialFault(kind=kind, amount=0.35, skip=skip))
    meter.open()
    assert meter.read().value == pytest.approx(5.5e-3, rel=1e-3)
    assert end.faults.struck == 1
    meter.close()


@pytest.mark.parametrize("which", range(3))
def test_a_setting_that_was_lost_is_sent_again(closed, which):
    end, meter = closed
    end.faults.add(SerialFault(kind="deaf", line=LINES, skip=which))
    meter.open()
    assert meter.read().value == pytest.approx(5.5e-3, rel=1e-3)
    meter.close()


def test_a_meter_that_does_not_take_its_unit_is_refused(closed):
    """It would store 74 T for 7.4 mT."""
    end, meter = closed
    end.faults.add(SerialFault(kind="deaf", line=r"^UNIT[^?]*$", times=None))
    with pytest.raises(BadReplyError, match=r"UNIT\S*\? answers .* in another unit"):
        meter.open()
    meter.close()


def test_readings_repeat_from_their_seed(resistor):
    clock = SimulatedClock()
    resistor.output(0, True)
    both = []
    for _ in range(2):
        far = SimTeslameter(resistor, "lakeshore-425", clock, noise=1e-5, seed=3)
        far.autorange = True
        both.append([far.reading() for _ in range(5)])
    assert both[0] == both[1]
    assert len(set(both[0])) > 1
