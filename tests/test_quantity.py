"""Quantities: text with units outside, exact SI floats inside."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError

from tactile_lab.errors import QuantityError
from tactile_lab.quantity import (
    PREFIXES,
    Duration,
    Force,
    Unit,
    parse,
    plus_minus,
    rounded,
    show,
)

finite = st.floats(allow_nan=False, allow_infinity=False)
POWERS = {k: round(math.log10(v)) for k, v in PREFIXES.items()}


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("50 mN", "N", 0.05),
        ("2 s", "s", 2.0),
        ("2s", "s", 2.0),
        ("1.41e-15 A", "A", 1.41e-15),
        ("-1.5E+2 V", "V", -150.0),
        ("−2 V", "V", -2.0),
        (".5 V", "V", 0.5),
        ("5. V", "V", 5.0),
        ("  3 ms ", "s", 0.003),
        ("100 MOhm", "Ohm", 1e8),
        ("100 MΩ", "Ohm", 1e8),
        ("1 MS/s", "S/s", 1e6),
        ("0.039 V m/N", "V m/N", 0.039),
        ("39 mV m/N", "V m/N", 0.039),
        ("0.039 V·m/N", "V m/N", 0.039),
        ("11 mT/A", "T/A", 0.011),
        ("225 mm^2", "m^2", 2.25e-4),
        ("225 mm²", "m^2", 2.25e-4),
        ("2.25 cm^2", "m^2", 2.25e-4),
        ("30 A^2 s", "A^2 s", 30.0),
        ("1 µs", "s", 1e-6),
        ("1 us", "s", 1e-6),
        ("7 m", "m", 7.0),
        ("7 mm", "m", 0.007),
        ("1 T", "T", 1.0),
    ],
)
def test_text_becomes_si(text, unit, value):
    assert parse(text, unit) == pytest.approx(value, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    "text",
    [
        "", " ", "N", "mN 50", "50", "5 0 N", "50 mV", "50 N N", "50 N/s", "50 mmN",
        "50 xN", "nan N", "inf N", "1e400 N", "-1e400 N", "0x10 N", "1_000 N", "1,5 N",
        "50 mN\n20 N", "50 N^2", "1e N", "+-1 N", "٣ N", "50 mＮ",
    ],
)  # fmt: skip
def test_anything_else_is_refused_with_an_example(text):
    with pytest.raises(QuantityError, match="N"):
        parse(text, "N")


def test_the_message_says_what_is_needed():
    with pytest.raises(QuantityError, match=r'"50 mV" has the unit mV; N .*"50 mN"'):
        parse("50 mV", "N")


@given(finite, st.sampled_from(["N", "s", "V m/N", "A^2 s", "S/s"]))
def test_written_quantities_read_back_exactly(value, unit):
    assert parse(Unit(unit).write(value), unit) == value


@given(st.integers(-(10**6), 10**6), st.sampled_from(sorted(PREFIXES)))
def test_a_prefix_shifts_the_decimal_point_and_rounds_once(number, prefix):
    assert parse(f"{number} {prefix}N", "N") == float(f"{number}e{POWERS[prefix]}")


@given(st.text(max_size=30), st.sampled_from(["N", "s", "V m/N", "m^2", "Ohm"]))
def test_any_text_is_a_finite_number_or_a_refusal(text, unit):
    try:
        assert math.isfinite(parse(text, unit))
    except QuantityError as refused:
        assert str(refused)


@given(st.floats(1e-14, 1e11) | st.floats(-1e11, -1e-14))
def test_what_is_shown_is_right_to_its_digits(value):
    shown = show(value, "N").replace("−", "-")
    assert parse(shown, "N") == pytest.approx(value, rel=6e-4)


@pytest.mark.parametrize(
    ("value", "unit", "shown"),
    [
        (0.05, "N", "50 mN"),
        (0, "N", "0 N"),
        (-0.2, "A", "−200 mA"),
        (999.96, "V", "1 kV"),
        (1e6, "S/s", "1 MS/s"),
        (2.25e-4, "m^2", "225 mm^2"),
        (-8.3e-20, "T", "0 T"),
        (1.41e-15, "A", "1.41 fA"),
        (float("inf"), "s", "inf s"),
        (0.102, "", "0.102"),
        (-5.85e-5, "", "−5.85e−05"),
        (52000, "", "52000"),
    ],
)
def test_shown_for_people(value, unit, shown):
    assert show(value, unit) == shown


class Pulse(BaseModel):
    level: Force
    hold: Duration = 1.0


def test_a_field_takes_text_or_si_from_code_but_only_text_from_files():
    assert Pulse(level="50 mN").level == Pulse(level=0.05).level == 0.05
    with pytest.raises(ValidationError, match="has no unit"):
        Pulse.model_validate({"level": 0.05}, context={"text_only": True})


@pytest.mark.parametrize(
    "bad", [True, None, [1], {}, math.nan, math.inf, "1 s", b"1 N", 10**400]
)
def test_a_field_refuses_what_is_no_quantity(bad):
    with pytest.raises(ValidationError):
        Pulse(level=bad)


@pytest.mark.parametrize("bad", ["0 s", "-1 s", 0.0, -1])
def test_a_field_keeps_its_range_and_says_it(bad):
    with pytest.raises(ValidationError, match="above 0 s"):
        Pulse(level=0.1, hold=bad)


@given(finite)
def test_a_dumped_field_validates_to_the_same(value):
    dumped = Pulse(level=value).model_dump()
    assert isinstance(dumped["level"], str)
    again = Pulse.model_validate(dumped, context={"text_only": True})
    assert again.level == value


@pytest.mark.parametrize(
    ("text", "unit", "hint"),
    [
        ("80", "N", '"80 mN"'),
        ("0.08", "N", '"0.08 N"'),
        ("2", "s", '"2 s"'),
        ("1", "S/s", '"1 MS/s"'),
        ("23.5 C", "K", '"23.5 °C"'),
        ("23.5", "K", '"23.5 °C"'),
    ],
)
def test_a_number_without_unit_is_answered_with_what_it_may_mean(text, unit, hint):
    with pytest.raises(QuantityError) as why:
        parse(text, unit)
    assert hint in str(why.value)


@pytest.mark.parametrize(
    ("value", "half", "unit", "told"),
    [
        (0.05, 25e-6, "N", "50.000 ± 0.025 mN"),
        (2.741e-3, 8.4e-7, "T", "2.74100 ± 0.00084 mT"),
        (-1.37e-6, 14e-6, "V", "−1 ± 14 µV"),
        (-1.37e-6, 20e-3, "V", "0 ± 20 mV"),
        (1.12679, 0.00088, "V/N", "1.12679 ± 0.00088 V/N"),
        (-118.742, 0.0321, "", "−118.742 ± 0.032"),
        (12345.6, 123.0, "", "12350 ± 120"),
        (0.2, 8.5e-3, "N", "200.0 ± 8.5 mN"),
        (1.0, 0.0996, "", "1.00 ± 0.10"),
        (0.05, 0.0, "N", "50 mN"),
        (0.05, math.nan, "N", "50 mN"),
        (4.506e-3, 8.7e-19, "T", "4.506 mT"),  # standard deviation of equal readings
    ],
)
def test_a_value_is_told_as_far_as_it_is_known(value, half, unit, told):
    assert plus_minus(value, half, unit) == told


@pytest.mark.parametrize(
    ("value", "sign", "told"),
    [
        (263.7, "-", "260"),
        (-0.0437, "+", "−0.044"),
        (7.61, "+", "+7.6"),
        (0.0, "-", "0"),
        (6.64e-5, "-", "6.6e−05"),
    ],
)
def test_two_digits_are_written_out(value, sign, told):
    """The largest offset of a run stood as 2.6e+02 ms in its report."""
    assert rounded(value, sign) == told


@pytest.mark.parametrize("text", ["2,5 s", "1.000,5 s", "1,000 s", "2,5"])
def test_a_comma_in_a_number_is_named(text: str) -> None:
    with pytest.raises(QuantityError, match="comma in its number"):
        parse(text, "s")
