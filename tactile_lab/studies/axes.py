"""What varies in a study: a key of the scene, and the values it takes."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import QuantityError, SceneError
from tactile_lab.quantity import SIFloat, parse, show
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene

MOST_VALUES = 1_000_000
"""Most values of one axis."""
_PERCENT = re.compile(r"\s*([0-9.eE+-]+)\s*%\s*")


@dataclass(frozen=True)
class Spread:
    """How a quantity is distributed.

    Attributes:
        kind: "normal" (about `centre`, standard deviation `width`) or "uniform" (from
            `centre` - `width` to `centre` + `width`).
        centre, width: SI.
    """

    kind: str
    centre: float
    width: float

    def at(self, part: FloatArray) -> FloatArray:
        """The values below which these parts of the distribution lie, 0 to 1."""
        if self.kind == "uniform":
            return self.centre + self.width * (2 * part - 1)
        from scipy.special import ndtri

        found: FloatArray = self.centre + self.width * ndtri(part)
        return found


@dataclass(frozen=True, kw_only=True)
class Axis:
    """One key of the scene that varies.

    Attributes:
        key: ``table.key``.
        unit: SI; "" without one.
        values: what it takes, in order: SI numbers, or whatever a file holds there.
            Empty where it is drawn.
        spread: what it is drawn from; None where it has values.
        listed: whether the key takes a list, and each value stands for a list of one.
        group: axes of one group go through their values together; None for one of its
            own.
    """

    key: str
    unit: str
    values: tuple[Any, ...] = ()
    spread: Spread | None = None
    listed: bool = False
    group: str | None = None

    @property
    def numeric(self) -> bool:
        """Whether each value is a number."""
        return self.spread is not None or all(
            isinstance(value, int | float) and not isinstance(value, bool)
            for value in self.values
        )

    def shown(self, value: Any) -> str:
        """One of its values, for a person."""
        if self.numeric:
            return show(value, self.unit)
        return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)

    def change(self, value: Any) -> str:
        """``key=value`` of one of its values, exactly, as ``--set`` takes it."""
        if isinstance(value, tuple):
            return f"{self.key}={json.dumps(value)}"
        if isinstance(value, bool):
            return f"{self.key}={json.dumps(value)}"
        if self.listed:
            return f'{self.key}=["{value} {self.unit}"]'
        return f"{self.key}={value} {self.unit}".rstrip()


def axis(key: str, given: Mapping[str, Any], scene: Scene) -> Axis:
    """The axis that a study's table describes, its units those of the scene's key.

    Args:
        key: ``table.key``, or the name of a key of the protocol or sensor.
        given: exactly one of ``values``, ``normal`` and ``uniform``; maybe ``zip``.
        scene: what varies; tells the unit, and what "1 %" is of.

    Raises:
        SceneError: the values cannot be read.
    """
    now, unit = _at(scene, key)
    try:
        if "values" in given:
            values = _values(given["values"], unit)
            return Axis(
                key=key,
                unit=unit,
                values=values,
                listed=bool(unit)
                and isinstance(now, list | tuple)
                and all(isinstance(one, float) for one in values),
                group=given.get("zip"),
            )
        kind = next(kind for kind in ("normal", "uniform") if kind in given)
        return Axis(key=key, unit=unit, spread=_spread(kind, given[kind], now, unit))
    except QuantityError as reason:
        if now is None:  # maybe there is no such key, which says more
            load(scene, {key: 0})
        raise SceneError(f"axis {key}: {reason}") from reason


def changed(axes: Sequence[Axis], values: Sequence[Any]) -> dict[str, Any]:
    """Changes of the scene's keys, as `load` takes them, numbers in SI."""
    changes = {}
    for axis, value in zip(axes, values, strict=True):
        number = SIFloat(value) if isinstance(value, float) else value
        changes[axis.key] = [number] if axis.listed else number
    return changes


def _at(scene: Scene, key: str) -> tuple[Any, str]:
    """What the scene has at `key`, in SI if it is a quantity, and the unit."""
    table: Any = scene.to_dict()
    for part in key.split("."):
        table = table.get(part) if isinstance(table, dict) else None
    first = table[0] if isinstance(table, list | tuple) and table else table
    if not isinstance(first, str):
        return table, ""
    number, _, unit = first.partition(" ")
    try:
        value = float(number)
    except ValueError:
        return table, ""
    return (value if first is table else table), unit


def _values(given: Any, unit: str) -> tuple[Any, ...]:
    if isinstance(given, str):
        given = _ranged(given, unit)
    if not given:
        raise QuantityError("values has none; give one or more.")
    return tuple(_value(value, unit) for value in given)


def _value(given: Any, unit: str) -> Any:
    """SI where it is a quantity of that unit; else as a file would hold it."""
    if isinstance(given, str) and unit:
        return parse(given, unit)
    if isinstance(given, list | tuple):
        return tuple(given)
    if unit and isinstance(given, int) and not isinstance(given, bool):
        return float(given)
    return given


def _ranged(text: str, unit: str) -> list[float]:
    """``from : to : step``, the end included where the steps reach it."""
    parts = [part.strip() for part in text.split(":")]
    if len(parts) != 3:
        raise QuantityError(
            f'"{text}" is no range; write from : to : step, such as '
            '"80 mN : 200 mN : 20 mN", or a list of values.'
        )
    low, high, step = (parse(part, unit) if unit else _number(part) for part in parts)
    count = (high - low) / step if step else math.inf
    if not count >= 0:
        raise QuantityError(
            f'"{text}" has no values: its step leads away from the end.'
        )
    if count >= MOST_VALUES:
        raise QuantityError(
            f'"{text}" has more than {MOST_VALUES} values; take larger steps.'
        )
    # in decimals, so that 1.38 V is the same point in every range
    begin, by = Decimal(repr(low)), Decimal(repr(step))
    steps = math.floor(count * (1 + 1e-12) + 1e-9) + 1
    return [float(begin + i * by) for i in range(steps)]


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError as reason:
        raise QuantityError(f'"{text}" is not a number.') from reason


def _spread(kind: str, given: Any, now: Any, unit: str) -> Spread:
    if isinstance(given, str) and (percent := _PERCENT.fullmatch(given)):
        if not isinstance(now, int | float) or not now:
            raise QuantityError(
                f'"{given}" of what? The scene has {now!r} there; give two quantities.'
            )
        return _wide(kind, now, abs(now) * _number(percent[1]) / 100, given)
    if isinstance(given, str):
        if not isinstance(now, int | float):
            raise QuantityError(
                f'"{given}" about what? The scene has {now!r} there; give two '
                "quantities."
            )
        return _wide(kind, now, float(_value(given, unit)), given)
    if not isinstance(given, list | tuple) or len(given) != 2:
        raise QuantityError(
            f'{kind} = {given!r}: write a tolerance, such as "1 %" or a quantity, or '
            + ("[centre, deviation]." if kind == "normal" else "[least, most].")
        )
    first, second = (float(_value(part, unit)) for part in given)
    if kind == "normal":
        return _wide(kind, first, second, given)
    return _wide(kind, (first + second) / 2, (second - first) / 2, given)


def _wide(kind: str, centre: float, width: float, given: Any) -> Spread:
    if not (math.isfinite(width) and width > 0):
        raise QuantityError(f"{kind} = {given!r} does not spread; give more than 0.")
    return Spread(kind, centre, width)
