"""How results are worded: a number and its unit are never parted. No Qt here."""

from __future__ import annotations

import re

_UNIT = r"(?:[pnµmkMG]?(?:Hz/m?N|Hz|N|V|A|s|T|B|S/s)|%)"
_BETWEEN = re.compile(rf"(?<=[\d?]) (?={_UNIT}(?:\W|$))|(?<=±) ")
SPACE, JOINER = "\u00a0", "\u2060"


def unbroken(text: str) -> str:
    """Text in which no line ends between a number and its unit, or inside a unit."""
    return _BETWEEN.sub(SPACE, text).replace("/", f"{JOINER}/{JOINER}")
