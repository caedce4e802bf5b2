"""The window's typeface: Inter (OFL, beside this file), with tabular figures."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from PySide6.QtGui import QFont, QFontDatabase

FOLDER = Path(__file__).parent / "fonts"
FAMILY = "Inter"


def load() -> QFont:
    """Register the bundled font and return the window's basic font, 13 px."""
    for file in sorted(FOLDER.glob("*.otf")):
        QFontDatabase.addApplicationFont(str(file))
    return sized(13)


@lru_cache(maxsize=64)
def sized(pixels: int, weight: QFont.Weight = QFont.Weight.Normal) -> QFont:
    """The window's font at a size in px."""
    font = QFont(FAMILY)
    font.setPixelSize(pixels)
    font.setWeight(weight)
    font.setFeature(QFont.Tag("tnum"), 1)
    font.setFeature(QFont.Tag("cv05"), 0)
    return font
