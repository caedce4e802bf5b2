"""Ticks at round numbers, and numbers as people write them."""

from __future__ import annotations

import math

from tactile_lab import quantity
from tactile_lab.quantity import printed

JOINER = "\u2060"


def step_of(span: float, at_most: int) -> float:
    """The 1-2-5 step that gives no more than `at_most` intervals over `span`."""
    if span <= 0 or at_most < 1:
        return 1.0
    rough = span / at_most
    power = 10.0 ** math.floor(math.log10(rough))
    for factor in (1, 2, 5, 10):
        if factor * power >= rough * (1 - 1e-9):
            return factor * power
    return 10 * power


def ticks(low: float, high: float, at_most: int) -> list[float]:
    """Round values in [low, high], ascending."""
    return multiples(step_of(high - low, at_most), low, high)


def multiples(step: float, low: float, high: float) -> list[float]:
    """Those of a step in [low, high], ascending."""
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [number * step for number in range(first, last + 1)]


def value_ticks(low: float, high: float, at_most: int) -> tuple[float, list[float]]:
    """The step, and round values in [low, high], ascending.

    More than `at_most` where else one would stand alone: it says nothing of the scale.
    """
    found = ticks(low, high, at_most)
    if len(found) < 2:
        found = ticks(low, high, at_most := 5)
    return step_of(high - low, at_most), found


def decimals(step: float) -> int:
    """Decimals that tell neighbouring ticks apart."""
    if step <= 0:
        return 0
    return max(0, -math.floor(math.log10(step) + 1e-9))


def number(value: float, places: int) -> str:
    """A number with a true minus and without a negative zero."""
    text = f"{value:.{places}f}"
    if float(text) == 0:
        text = text.replace("-", "")
    return printed(text)


def signed(value: float, places: int) -> str:
    """A difference: with its sign, unless it is zero to so many places."""
    text = number(value, places)
    return f"+{text}" if value > 0 and text.strip("0.") else text


def nice_range(low: float, high: float, least: float) -> tuple[float, float]:
    """A range around [low, high], at least `least` wide, with air and round ends."""
    span = max(high - low, least)
    middle = (low + high) / 2
    low, high = min(low, middle - span / 2), max(high, middle + span / 2)
    step = step_of(high - low, 8) / 2
    return (
        math.floor((low - 0.06 * span) / step) * step,
        math.ceil((high + 0.06 * span) / step) * step,
    )


def unbroken(text: str) -> str:
    """Text in which no line ends between a number and its unit, or inside a unit."""
    return quantity.unbroken(text).replace("/", f"{JOINER}/{JOINER}")
