"""Quantities: a number and a unit as text at the user's side, SI floats inside."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, Literal

from tactile_lab.errors import QuantityError

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, ValidationInfo
    from pydantic_core import CoreSchema

PREFIXES = {
    "": 1.0, "q": 1e-30, "r": 1e-27, "y": 1e-24, "z": 1e-21, "a": 1e-18,
    "f": 1e-15, "p": 1e-12, "n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3,
    "c": 1e-2, "d": 1e-1, "h": 1e2, "k": 1e3, "M": 1e6, "G": 1e9, "T": 1e12,
    "P": 1e15, "E": 1e18,
}  # fmt: skip
_NUMBER = re.compile(
    r"\s*([-+−]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+−]?[0-9]+)?)\s*(\S.*?)?\s*$"
)
DECIMAL_COMMA = re.compile(r"\d,\d")
"""What may be a decimal comma, or none."""
ROUNDING = 1e-14
"""Part of a value within which equal numbers differ by how they were computed."""
_UNIT = r"[fpnµmkMG]?(?:Hz/m?N|Hz|N|V|A|s|T|K|F|Ohm|B|S/s)(?!\w)|[%°]"
_BETWEEN = re.compile(rf"(?<=[\d?]) (?={_UNIT})|(?<=±) ")
_FACTOR = re.compile(r"^(?P<symbol>[^\^/ ]+?)(?:\^(?P<power>\d+)|(?P<square>²))?$")


def parse(text: str, unit: str) -> float:
    """The SI value of `text`, which must be in `unit` with any SI prefix.

    Args:
        text: number (exponents allowed), space, unit, such as "50 mN" or "1.2e-12 A".
        unit: the SI unit it must have, such as "N", "V m/N" or "m^2".

    Raises:
        QuantityError: not a number and unit, another unit, or not finite.
    """
    match = _NUMBER.match(text)
    if match is None:
        raise QuantityError(
            f'"{text}" is not a quantity; write a number, a space and a unit in '
            f"{unit}, such as {example(unit)}."
        )
    digits, written = typed(match.group(1)), match.group(2)
    if written is None:
        raise QuantityError(
            f'"{text}" has no unit; write for example {example(unit, digits)}.'
        )
    if DECIMAL_COMMA.search(text):
        raise QuantityError(
            f'"{text}" has a comma in its number; write a decimal point, and nothing '
            f"between thousands, such as {example(unit)}."
        )
    factor = _factor(written, unit)
    if factor is None:
        raise QuantityError(
            f'"{text}" has the unit {written}; {unit} is needed here (any SI prefix), '
            f"such as {example(unit, digits if unit == 'K' else '')}."
        )
    value = _scaled(digits, factor)
    if not math.isfinite(value):
        raise QuantityError(f'"{text}" is not finite; give a finite number in {unit}.')
    if value == 0 and any(one in "123456789" for one in digits.lower().split("e")[0]):
        raise QuantityError(
            f'"{text}" is less than any number here can be; write 0 {unit}, or more.'
        )
    return value


def _scaled(digits: str, factor: float) -> float:
    """Digits times a power of ten, rounded once where the factor allows it."""
    power = round(math.log10(factor))
    if math.isclose(factor, 10.0**power, rel_tol=1e-12):
        mantissa, _, exponent = digits.lower().partition("e")
        return float(f"{mantissa}e{int(exponent or 0) + power}")
    return float(digits) * factor


def example(unit: str, digits: str = "") -> str:
    """A quantity of that unit, to show in a message.

    Args:
        unit: SI.
        digits: a number that was given without unit: what it may have meant. A number
            of 1 or more is taken for one of the unit as it is used here.
    """
    usual, prefix = {
        "N": ("50", "m"), "s": ("2", ""), "V": ("1.4", ""), "S/s": ("1", "M"),
        "A": ("0.5", ""), "Ohm": ("100", "M"), "F": ("150", "p"), "m": ("6", "m"),
        "T": ("163", "m"),
    }.get(unit, ("1", ""))  # fmt: skip
    if unit == "K":
        return f'"{digits or 23.5} °C"'
    if digits and abs(float(digits)) < 1 and prefix == "m":
        prefix = ""  # more likely SI
    return f'"{digits or usual} {prefix}{unit}"'


def _factor(written: str, unit: str) -> float | None:
    """Scale from the written unit to `unit`, or None if it is another unit."""
    written = written.replace("Ω", "Ohm").replace("Ω", "Ohm").replace("·", " ")
    written = re.sub(r"\s+", " ", written).replace(" / ", "/")
    over, under = _split(unit), _split(written)
    if [len(part) for part in over] != [len(part) for part in under]:
        return None
    total = 1.0
    for wanted_part, given_part, sign in zip(over, under, (1, -1), strict=True):
        for wanted, given in zip(wanted_part, given_part, strict=True):
            one = _prefix(given, wanted)
            if one is None:
                return None
            total *= one**sign
    return total


def _split(unit: str) -> tuple[list[str], list[str]]:
    over, _, under = unit.partition("/")
    return over.split(), under.split()


def _prefix(given: str, wanted: str) -> float | None:
    got, need = _FACTOR.match(given), _FACTOR.match(wanted)
    if got is None or need is None:
        return None
    power = int(need["power"] or (2 if need["square"] else 1))
    if int(got["power"] or (2 if got["square"] else 1)) != power:
        return None
    symbol, base = got["symbol"], need["symbol"]
    if not symbol.endswith(base):
        return None
    prefix = PREFIXES.get(symbol[: len(symbol) - len(base)])
    return None if prefix is None else prefix**power


_SHOWN = {-15: "f", -12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G"}


def show(
    value: float, unit: str, digits: int = 4, sign: Literal["-", "+"] = "-"
) -> str:
    """`value` (SI) for a person: "50 mN", with a prefix that keeps 1 to 999 in front.

    Areas are in m^2 or mm^2; other powers, compound units and numbers without a unit
    get no prefix. A true minus is used, with `sign` "+" a plus where it is positive,
    too. Below 1e-18 it is a rounding error, and 0 for a person.
    """
    if not math.isfinite(value):
        return f"{value} {unit}"
    if abs(value) < 1e-18:
        value = 0.0
    prefix, number = "", value
    if unit in ("m^2", "m²") and 0 < abs(value) < 0.01:
        prefix, number = "m", value * 1e6
    elif value != 0 and unit and not any(c in unit for c in " ^²"):
        power = _power(value)
        number = value / 10.0**power
        if float(f"{abs(number):.{digits}g}") >= 1000 and power < 9:
            power, number = power + 3, number / 1000
        prefix = _SHOWN[power]
    text = f"{number:.{digits}g}"
    if "e+" in text and abs(number) < (1e4 if unit else 1e9):
        text = f"{float(text):.0f}"
    plus = "+" if sign == "+" and value > 0 else ""
    return plus + printed(f"{text} {prefix}{unit}").rstrip()


def plus_minus(value: float, half: float, unit: str = "", digits: int = 2) -> str:
    """A value and half of its band (SI) for a person: "50.000 ± 0.025 mN".

    Both have one prefix and end at the same digit, the `digits`-th of the band. One
    that is but the rounding of equal values is no band.
    """
    if not ROUNDING * abs(value) < half < math.inf:
        return show(value, unit)
    size = max(abs(value), half)
    prefix = prefix_of(size, unit)
    scale = 10.0 ** (_power(size) if prefix else 0)
    last = int(f"{half / scale:.{digits - 1}e}".partition("e")[2]) - digits + 1
    # what rounds to nothing is shown without its sign
    number, known = (round(x / scale, -last) + 0.0 for x in (value, half))
    places = max(-last, 0)
    text = f"{number:.{places}f} ± {known:.{places}f} {prefix}{unit}"
    return printed(text).rstrip()


def show_within(value: float, error: float, unit: str = "") -> str:
    """A value (SI) down to the second digit of its error, and to four at least."""
    if not ROUNDING * abs(value) < error < math.inf or value == 0:
        return show(value, unit)
    first, last = (math.floor(math.log10(abs(x))) for x in (value, error))
    return show(value, unit, max(4, first - last + 2))


def rounded(value: float, sign: Literal["-", "+"] = "-") -> str:
    """Two significant digits, written out: "260" and "−0.044", not "2.6e+02".

    Args:
        value: in the unit that stands behind it.
        sign: "+" puts one before what is positive, too.
    """
    return printed(f"{float(f'{value:.2g}'):{sign}g}")


def unbroken(text: str) -> str:
    """Text in which no line ends between a number, its sign and its unit."""
    return _BETWEEN.sub("\u00a0", text)


def exact(value: float, unit: str) -> str:
    """The shortest text with a prefix that `parse` reads back to the same value."""
    for digits in range(4, 18):
        text = show(value, unit, digits)
        if parse(text, unit) == value:
            return text
    return f"{value!r} {unit}"


def printed(text: str) -> str:
    """`text` with the true minus, as it is shown."""
    return text.replace("-", "−")


def typed(text: str) -> str:
    """`text` with the minus that keyboards and files have."""
    return text.replace("−", "-")


def count(number: int, what: str) -> str:
    """A number of things: "1 trial", "4 trials"."""
    return f"{number} {what}{'' if number == 1 else 's'}"


def looked_for(number: int | None, what: str) -> str:
    """What was found: "5 spikes", or "spikes not looked for" for None."""
    return f"{what}s not looked for" if number is None else count(number, what)


class SIFloat(float):
    """A float given in Python: SI, also where a file must write the unit."""


class SIInt(int):
    """A whole number given in Python: SI, also where a file must write the unit."""


def bytes_text(count: float) -> str:
    """A number of bytes for people: "1.7 GB"."""
    units = iter(("B", "kB", "MB", "GB", "TB", "PB"))
    unit = next(units)
    while count >= 999.5 and (larger := next(units, None)) is not None:
        count, unit = count / 1000, larger
    return f"{count:.3g} {unit}"


def prefix_of(value: float, unit: str) -> str:
    """The prefix that keeps 1 to 999 in front of `unit`; "" for a compound unit."""
    if value == 0 or not unit.isalpha():
        return ""
    return _SHOWN[_power(value)]


def _power(value: float) -> int:
    """Power of ten of the prefix that keeps 1 to 999 in front."""
    return min(max(3 * math.floor(math.log10(abs(value)) / 3 + 1e-12), -15), 9)


@dataclass(frozen=True)
class Unit:
    """Of a field: SI float inside, quantity text in files and on the wire.

    Text is parsed; a bare number is taken as SI from Python code but refused where
    the validation context says ``{"text_only": True}`` (scene files), unless it is
    marked as one of Python's.

    Attributes:
        symbol: SI unit; "" for a bare number without a dimension.
        above, least, most: open lower, closed lower and closed upper limit, SI.
    """

    symbol: str
    above: float | None = None
    least: float | None = None
    most: float | None = None

    def limits(self) -> str:
        """The allowed range for a person."""
        parts = []
        if self.above is not None:
            parts.append(f"above {show(self.above, self.symbol)}")
        if self.least is not None:
            parts.append(f"at least {show(self.least, self.symbol)}")
        if self.most is not None:
            parts.append(f"at most {show(self.most, self.symbol)}")
        return " and ".join(parts)

    def validate(self, value: Any, info: ValidationInfo) -> float:
        """The SI value, or an error that says what is allowed."""
        text_only = self.symbol and (info.context or {}).get("text_only")
        if isinstance(value, str) and self.symbol:
            number = parse(value, self.symbol)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            if not self.symbol:
                raise QuantityError("a number is needed")
            raise QuantityError(
                f"{value!r} is no quantity; write for example {example(self.symbol)}."
            )
        elif text_only and not isinstance(value, SIFloat | SIInt):
            raise QuantityError(
                f"{value!r} has no unit; write for example "
                f"{example(self.symbol, str(value))}."
            )
        else:
            try:
                number = float(value)
            except OverflowError:  # a whole number of hundreds of digits
                number = math.inf
            if not math.isfinite(number):
                raise QuantityError(f"{number} {self.symbol} is not finite.")
        if not self.allows(number):
            raise QuantityError(
                f"{show(number, self.symbol)} is out of range; allowed is "
                f"{self.limits()}."
            )
        return number

    def allows(self, number: float) -> bool:
        """Whether `number`, SI, lies within the limits."""
        return (
            (self.above is None or number > self.above)
            and (self.least is None or number >= self.least)
            and (self.most is None or number <= self.most)
        )

    def write(self, value: Any) -> Any:
        """What a file holds: exact text that `parse` reads back to the same float.

        A number without a dimension stays one; None stays None.
        """
        return value if value is None or not self.symbol else f"{value!r} {self.symbol}"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.with_info_plain_validator_function(
            self.validate,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write),
        )


Force = Annotated[float, Unit("N")]
Current = Annotated[float, Unit("A")]
Voltage = Annotated[float, Unit("V")]
Duration = Annotated[float, Unit("s", above=0.0)]
Pause = Annotated[float, Unit("s", least=0.0)]
SampleRate = Annotated[float, Unit("S/s", above=0.0)]
