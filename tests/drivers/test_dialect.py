from importlib import resources

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.coil.source import CoilSource
from sim_backend.coil.source import MODELS, SimCoilSource
from sim_backend.serial_line.wires import plug_in
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import BadReplyError, LimitError, SceneError
from tactile_lab.instruments.dialects import (
    coil_dialect,
    dialect_ids,
    load_dialect,
    parse_dialect,
    teslameter_dialect,
)
from tactile_lab.instruments.serial_dialect import SerialDialect

COILS = dialect_ids("coil")


def test_every_coil_row_has_a_far_end():
    assert sorted(COILS) == sorted(MODELS)


@pytest.mark.parametrize("name", COILS)
def test_each_row_drives_its_far_end(name, resistor):
    row = coil_dialect(name)
    clock = SimulatedClock()
    source = SimCoilSource(resistor, name, clock)
    end = plug_in(source, row.serial, clock, name)
    coil = CoilSource(row, end.url, CoilLimits(), clock)
    with clock.taking_part("test"):
        coil.open()
        coil.energise()
        assert source.output_on
        assert source.compliance == min(14.0, row.voltage)
        for _ in range(15):
            clock.sleep_until(clock.now() + coil.update_interval)
            coil.set_current(0.4)
        assert resistor.coil_current(clock.now()) == pytest.approx(0.4)
        clock.sleep_until(clock.now() + 0.2)
        assert coil.read_current().value == pytest.approx(0.4)
        assert coil._wire.voltage() == pytest.approx(2.0)
        assert coil.settings()["output"] == "on"
        assert coil.safe_off().verified
        assert not source.output_on
        coil.close()
        assert coil.warnings == []
    errors = [e for e in source.parser.errors if "Undefined" in e[1]]
    assert errors == []


@pytest.mark.parametrize("name", COILS)
def test_the_planned_interval_is_what_is_measured(name, resistor):
    row = coil_dialect(name)
    clock = SimulatedClock()
    end = plug_in(SimCoilSource(resistor, name, clock), row.serial, clock, name)
    coil = CoilSource(row, end.url, CoilLimits(), clock)
    with clock.taking_part("test"):
        coil.open()
        assert coil.update_interval == pytest.approx(row.promised_interval(), rel=0.25)
        coil.close()


def test_a_source_of_one_polarity_refuses_the_other_sign(resistor):
    row = coil_dialect("aim-tti-pl")
    clock = SimulatedClock()
    source = SimCoilSource(resistor, row.id, clock)
    coil = CoilSource(row, plug_in(source, row.serial, clock).url, CoilLimits(), clock)
    with clock.taking_part("test"):
        coil.open()
        coil.energise()
        with pytest.raises(LimitError, match="cannot reverse its current"):
            coil.set_current(-0.1)
        coil.close()


def test_an_unknown_row_names_the_nearest():
    with pytest.raises(SceneError, match='did you mean "kepco-bop"'):
        load_dialect("kepko-bop")


def test_a_row_of_the_wrong_role():
    with pytest.raises(SceneError, match="is a field meter"):
        coil_dialect("lakeshore-425")
    with pytest.raises(SceneError, match="is a coil"):
        teslameter_dialect("kepco-bop")


def text_of(name="kepco-bop"):
    folder = resources.files("tactile_lab.instruments") / "rows" / "coil"
    return folder.joinpath(f"{name}.toml").read_text()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('set = "CURR {i:.5f}"', 'set = "CURR {amps:.5f}"'),
        ('set = "CURR {i:.5f}"', 'sett = "CURR {i:.5f}"'),
        ("baud = 9600", 'baud = "fast"'),
        ("baud = 9600", "baud = 9600\nspeed = 1"),
        ('current = "5 A"', "current = 5"),
        ('current = "5 A"', 'current = "5 V"'),
        ("match = '^KEPCO'", "match = '^(KEPCO'"),
        ("max_line = 127", "max_line = 20"),
        ('role = "coil"', 'role = "pump"'),
        ("id =", "id"),
    ],
)
def test_a_row_with_a_mistake_is_refused(old, new):
    text = text_of()
    assert old in text
    with pytest.raises(SceneError):
        parse_dialect(text.replace(old, new), "mine.toml")


def test_a_row_of_ones_own(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text_of().replace("kepco-bop", "mine"))
    assert load_dialect(str(path)).id == "mine"
    with pytest.raises(SceneError, match="cannot be read"):
        load_dialect(str(tmp_path / "missing.toml"))


@pytest.mark.parametrize("name", COILS)
@given(share=st.floats(-1, 1, allow_subnormal=True))
def test_numbers_on_the_wire_are_plain(name, share):
    row = coil_dialect(name)
    line = row.set_line(share * row.current)
    number = line.split()[-1]
    assert "e" not in number.lower() and "inf" not in number and "nan" not in number
    assert float(number) == pytest.approx(share * row.current, abs=10.0**-row.digits)
    assert not (float(number) == 0 and "-" in number)
    assert len(number.lstrip("-").split(".")[0]) <= 4


def test_limits_beyond_the_rating_are_refused():
    row = coil_dialect("keithley-2400")
    row.check_limits(CoilLimits(current=1.0))
    with pytest.raises(SceneError, match=r"2 A is beyond the 1\.05 A of Keithley"):
        row.check_limits(CoilLimits(current=2.0))
    with pytest.raises(SceneError, match="compliance = 40 V"):
        row.check_limits(CoilLimits(current=1.0, compliance=40.0))


def test_dialects_are_listed_by_role():
    coils, meters = dialect_ids("coil"), dialect_ids("field meter")
    assert "kepco-bop" in coils and "lakeshore-425" in meters
    others = map(dialect_ids, ("scope", "thermometer", "voltage source"))
    every = [*coils, *meters, *(name for one in others for name in one)]
    assert sorted(every) == list(dialect_ids())


@pytest.mark.parametrize("name", dialect_ids())
def test_a_dialects_file_bears_its_id(name):
    assert load_dialect(name).id == name


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            'set = "CURR {i:.5f}"',
            'sett = "CURR {i:.5f}"',
            'mine.toml: the file has no key "sett"; did you mean "set"? Known: id, ',
        ),
        (
            "baud = 9600",
            "baud = 9600\nspeed = 1",
            'mine.toml: [serial] has no key "speed"; Known: baud, ',
        ),
        ("baud = 9600", 'baud = "fast"', 'mine.toml: [serial] baud = "fast": a whole'),
        ('current = "5 A"', "current = 5", "mine.toml: current: 5 has no unit"),
        ('role = "coil"', 'role = "pump"', 'role = "pump" is not known; write one of'),
        (
            "VOLT {v:.3f}",
            "VOLT {volts:.3f}",
            'mine.toml: limit = "VOLT {volts:.3f}": {volts:.3f} cannot be filled in; '
            "what can is {v}.",
        ),
        ("{v:.3f}", "{v.real}", "{v.real} cannot be filled in; what can is {v}."),
        ("VOLT {v:.3f}", "VOLT 20", 'limit = "VOLT 20": {v} must stand in it once.'),
        ("{v:.3f}", "{v:g}", "write {v:.5f} for five decimals."),
        ("{v:.3f}", "{v:999999999.3f}", "write {v:.5f} for five decimals."),
        ("{v:.3f}", "{v", '"VOLT {v": its braces cannot be read: expected'),
        ("{i:.5f}", "{i:.2f}", "has 2 decimals, less than digits = 5. Write as many."),
        ("COUN {n}", "COUN 0", '[list] count = "LIST:COUN 0": {n} must stand in it'),
        ('"OUTP 1"', '"OUTP 1\\n"', r"on number 1 = "),
        (
            '"OUTP 1"',
            '"OUTP \u2460"',
            "on number 1 = \"OUTP \u2460\": '\u2460' is no ASCII",
        ),
        ("baud = 9600", 'baud = 9600\ntimeout = "2 s"', "[serial] timeout"),
        (
            "[confirm]",
            "voltage_match = 'V=.*'\n[confirm]",
            'voltage_match = "V=.*": it picks',
        ),
        (
            "'(?i)^\\+?(1|CURR)'",
            "true",
            "[confirm] FUNC:MODE? = true: a pattern is needed, a number, or an array",
        ),
    ],
)
def test_a_mistake_is_told_with_file_key_and_what_is_allowed(old, new, told):
    assert old in text_of()
    with pytest.raises(SceneError) as refused:
        parse_dialect(text_of().replace(old, new), "mine.toml")
    assert told in str(refused.value)
    assert "http" not in str(refused.value)


@pytest.mark.parametrize(
    ("query", "answer", "taken"),
    [
        (":SENS:VOLT:RANG?", "21.00000", True),
        (":SENS:VOLT:RANG?", "+2.100000E+01", True),
        (":SENS:VOLT:RANG?", "2.1", False),
        (":SENS:VOLT:RANG?", "210", False),
        (":SOUR:CURR:RANG?", "1.050000", True),
        (":SENS:CURR:NPLC?", "1.000000E-01", True),
        (":SENS:CURR:NPLC?", "1.00", False),
    ],
)
def test_what_is_read_back_as_a_number_is_compared_as_one(
    resistor, query, answer, taken
):
    """A range of 21 V that was answered as 21.00000 was refused."""
    clock = SimulatedClock()
    row = coil_dialect("keithley-2400")
    source = SimCoilSource(resistor, row.id, clock)
    heard, asked = source.line, query.encode()
    source.line = lambda line: answer.encode() if line == asked else heard(line)
    end = plug_in(source, row.serial, clock, "coil")
    coil = CoilSource(row, end.url, CoilLimits(current=0.5), clock)
    with clock.taking_part("test"):
        if taken:
            coil.open()
        else:
            with pytest.raises(BadReplyError, match=f"settings: .*{answer!r}"):
                coil.open()
        coil.close()


@pytest.mark.parametrize("name", dialect_ids())
def test_every_setting_of_a_row_is_read_back(name):
    row = load_dialect(name)
    if not isinstance(row, SerialDialect):
        return
    asked = {query.removesuffix("?") for query in row.confirm}
    assert {line.split(" ")[0] for line in row.init} <= asked
