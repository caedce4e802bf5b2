"""What a sensor is wanted to do, and which of its parts may be chosen for it."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from tactile_lab.complaint import validated
from tactile_lab.errors import QuantityError, SceneError, choices
from tactile_lab.model.circuit import Circuit, units
from tactile_lab.quantity import Unit, parse, show
from tactile_lab.scene.load import load, read_toml
from tactile_lab.table import SceneTable

E24 = (
    1.0, 1.1, 1.2, 1.3, 1.5, 1.6, 1.8, 2.0, 2.2, 2.4, 2.7, 3.0,
    3.3, 3.6, 3.9, 4.3, 4.7, 5.1, 5.6, 6.2, 6.8, 7.5, 8.2, 9.1,
)  # fmt: skip
E96 = tuple(round(10 ** (i / 96), 2) for i in range(96))
SERIES: Mapping[str, tuple[float, ...]] = {"E24": E24, "E96": E96}
"""Values of a decade, IEC 60063."""
STEP = 1e-3
"""To which a voltage is set by hand, V."""
DEFAULT_PARTS = ("R1", "R_L", "C1", "C2", "V_GS")
"""What is chosen unless a specification says what."""
_PERCENT = re.compile(r"\s*([0-9.eE+-]+)\s*%\s*")


def _share(value: Any) -> float:
    """A percentage, such as "5 %", as 0.05."""
    found = _PERCENT.fullmatch(value) if isinstance(value, str) else None
    if found is None:
        raise ValueError('a percentage is needed, such as "5 %"')
    share = float(found[1]) / 100
    if not 0 < share <= 1:
        raise ValueError("more than 0 % and at most 100 % is needed")
    return share


Share = Annotated[float, Unit("", above=0.0, most=1.0), BeforeValidator(_share)]
IS = Field(alias="is")
"""In a file; Python cannot name a field so."""
Newton = Annotated[float, Unit("N", above=0.0)]
Series = Literal["E24", "E96"]


@dataclass(frozen=True, kw_only=True)
class Threshold(SceneTable):
    """The least force that makes it spike, pushed within 10 ms and held.

    Attributes:
        value: N (``is`` in a file).
        within: relative.
    """

    value: Annotated[Newton, IS]
    within: Share = 0.05


@dataclass(frozen=True, kw_only=True)
class Rate(SceneTable):
    """Mean rate of the first second under a force, between first and last spike there.

    Attributes:
        force: pushed within 10 ms and held, N.
        value: Hz.
        within: relative.
    """

    force: Newton
    value: Annotated[float, Unit("Hz", above=0.0), IS]
    within: Share = 0.1


@dataclass(frozen=True, kw_only=True)
class Silence(SceneTable):
    """Time from a push to its last spike.

    Attributes:
        force: pushed within 10 ms and held, N.
        value: s.
        within: relative.
    """

    force: Newton
    value: Annotated[float, Unit("s", above=0.0, most=600.0), IS]
    within: Share = 0.1


@dataclass(frozen=True, kw_only=True)
class Unsaturated(SceneTable):
    """Up to a force V_C1 stays above V_fire - 0.5 V, where a real T1 would saturate.

    Attributes:
        force: N.
    """

    force: Newton


@dataclass(frozen=True, kw_only=True)
class Wants(SceneTable):
    """``[want]``: at least one."""

    threshold: Threshold | None = None
    rate: Rate | None = None
    silence: Silence | None = None
    unsaturated: Unsaturated | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Those that are wanted."""
        return tuple(n for n in WANTS if getattr(self, n) is not None)


WANTS = ("threshold", "rate", "silence", "unsaturated")


@dataclass(frozen=True, kw_only=True)
class PartTable(SceneTable):
    """``[parts.NAME]``: a part that may be chosen.

    Attributes:
        least, most: quantities; a tenth and ten times the scene's value unless given,
            for a voltage 0.3 V less and more.
        series: of resistors and capacitors, E96 and E24 unless given.
        tolerance: two standard deviations, "1 %" or a quantity; 1 % for resistors, 5 %
            for capacitors, 2 mV for voltages unless given.
    """

    least: str | None = None
    most: str | None = None
    series: Series | None = None
    tolerance: str | None = None


@dataclass(frozen=True, kw_only=True)
class SpecificationFile(SceneTable):
    """What a specification's TOML file holds; see docs/how-to/choose-parts.md."""

    want: Wants
    title: str = ""
    scene: str = "demo"
    seed: int = 1
    parts: dict[str, PartTable] = field(default_factory=dict)


@dataclass(frozen=True)
class Part:
    """A part that may be chosen.

    Attributes:
        name: of the circuit's number.
        unit: SI.
        least, most: SI.
        values: that can be bought, within these; empty for what is set by hand.
        tolerance: two standard deviations: a part of the value, or SI.
        relative: which of them.
    """

    name: str
    unit: str
    least: float
    most: float
    values: tuple[float, ...]
    tolerance: float
    relative: bool

    @property
    def by_hand(self) -> bool:
        """Whether it is a voltage, set by hand to a millivolt."""
        return not self.values

    def spread(self, value: float) -> float:
        """Standard deviation of the part where its nominal value is this, SI."""
        return self.tolerance / 2 * (value if self.relative else 1.0)


@dataclass(frozen=True, kw_only=True)
class Specification:
    """What is wanted of a sensor.

    Attributes:
        title: for people.
        circuit: where the search begins, and what is not chosen.
        wants: behaviour.
        parts: what may be chosen.
        seed: of the search and of the tolerances' draws.
    """

    title: str
    circuit: Circuit
    wants: Wants
    parts: tuple[Part, ...]
    seed: int


def load_specification(given: str | Path | Mapping[str, Any]) -> Specification:
    """A specification, validated; computes nothing.

    Args:
        given: a TOML file, or what one would hold.

    Raises:
        SceneError: something cannot be used as written.
    """
    if isinstance(given, Mapping):
        origin = name = "specification"
        data, folder = dict(given), Path.cwd()
    else:
        path = Path(given)
        if not path.is_file():
            raise SceneError(f"Specification {path} does not exist.")
        origin, name, folder = str(path), path.stem, path.parent
        data = read_toml(path, "Specification")
    table = validated(SpecificationFile, data, (), lambda at: origin, None)
    if not table.want.names:
        raise SceneError(
            f"{origin}: [want] is empty; want at least one of {', '.join(WANTS)}."
        )
    beside = folder / table.scene
    circuit = load(beside if beside.is_file() else table.scene).sensor.circuit
    if circuit.saturation:
        raise SceneError(
            f"{origin}: the scene's sensor says saturation = true; parts are chosen "
            "without it, and the answer is checked with it. Leave it out."
        )
    asked = table.parts or {part: PartTable() for part in DEFAULT_PARTS}
    parts = tuple(_part(one, given, circuit, origin) for one, given in asked.items())
    return Specification(
        title=table.title or name,
        circuit=circuit,
        wants=table.want,
        parts=parts,
        seed=table.seed,
    )


def _part(name: str, given: PartTable, circuit: Circuit, origin: str) -> Part:
    where = f"{origin}: [parts.{name}]"
    now = getattr(circuit, name, None) if name in units() else None
    if not isinstance(now, float):
        told = choices(name, [n for n in units() if n[0] in "RCV"])
        raise SceneError(f"{where} is no part of the circuit; {told}")
    unit = units()[name].symbol
    if unit not in ("Ohm", "F", "V"):
        raise SceneError(
            f"{where}: only resistors, capacitors and voltages can be chosen."
        )
    read = partial(_quantity, where, unit)
    by_hand = unit == "V"
    low, high = (now - 0.3, now + 0.3) if by_hand else (now / 10, now * 10)
    least = low if given.least is None else read(given.least)
    most = high if given.most is None else read(given.most)
    if not (least < most and (by_hand or least > 0)):
        raise SceneError(
            f"{where}: least = {show(least, unit)} must be below most = "
            f"{show(most, unit)}{'' if by_hand else ' and above 0'}."
        )
    if by_hand and given.series is not None:
        raise SceneError(f"{where}: a voltage is set by hand; leave series out.")
    series = given.series or ("E96" if unit == "Ohm" else "E24")
    values = () if by_hand else _values(SERIES[series], least, most)
    if not by_hand and not values:
        raise SceneError(
            f"{where}: {series} has no value from {show(least, unit)} to "
            f"{show(most, unit)}; widen the range."
        )
    return Part(name, unit, least, most, values, *_tolerance(where, given, unit, read))


def _tolerance(
    where: str, given: PartTable, unit: str, read: Callable[[str], float]
) -> tuple[float, bool]:
    """Two standard deviations, and whether they are a part of the value."""
    if given.tolerance is None:
        return {"Ohm": 0.01, "F": 0.05, "V": 2e-3}[unit], unit != "V"
    percent = _PERCENT.fullmatch(given.tolerance) if unit != "V" else None
    found = float(percent[1]) / 100 if percent else read(given.tolerance)
    if not 0 < found < math.inf or (percent and found > 1):
        raise SceneError(
            f"{where}: tolerance = {given.tolerance!r} is no tolerance; give more than "
            "0 and at most 100 %, or leave it out."
        )
    return found, percent is not None


def _quantity(where: str, unit: str, text: str) -> float:
    try:
        return parse(text, unit)
    except QuantityError as reason:
        raise SceneError(f"{where}: {reason}") from reason


def _values(decade: tuple[float, ...], least: float, most: float) -> tuple[float, ...]:
    powers = range(math.floor(math.log10(least)), math.ceil(math.log10(most)) + 1)
    every = [float(f"{value}e{power}") for power in powers for value in decade]
    found = np.array(every)
    return tuple(found[(found >= least) & (found <= most)].tolist())
