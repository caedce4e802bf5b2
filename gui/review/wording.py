"""How results are worded: a number and its unit are never parted. No Qt here."""

from __future__ import annotations

from tactile_lab import quantity

JOINER = "\u2060"


def unbroken(text: str) -> str:
    """Text in which no line ends between a number and its unit, or inside a unit."""
    return quantity.unbroken(text).replace("/", f"{JOINER}/{JOINER}")
