"""Opening what belongs to another program: a report, a folder."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import QUrl
from PySide6.QtGui import QDesktopServices


def open_on_desktop(path: Path) -> str:
    """Have the desktop open a file or folder with what it keeps for it.

    Returns:
        What is to be told where nothing opens: that it is not there, or that this
        computer has no program for it; "" where it was handed over.
    """
    place = path.resolve()
    if not place.exists():
        return f"There is no {place.name} in {place.parent}."
    if QDesktopServices.openUrl(QUrl.fromLocalFile(str(place))):
        return ""
    return f"No program of this computer opens it; it is at {place}."
