"""Keeps pyqtgraph from making every class of Qt as it is imported.

It copies all names of three modules of Qt into modules of its own, and PySide6 makes a
class when its name is first asked for: 0.12 s of processor time and 9 MB for hundreds
of classes of which the window uses a few dozen. What stands here in place of those
copies asks Qt for a name when somebody uses it. A pyqtgraph that copies otherwise is
slow, not wrong. Import this before pyqtgraph.
"""

from __future__ import annotations

import inspect
import sys
from importlib import import_module
from types import ModuleType
from typing import Any

COPIES = ("QtCore", "QtGui", "QtWidgets")


class Names(ModuleType):
    """One of pyqtgraph's copies, which is filled as its names are used."""

    def __init__(self, name: str) -> None:
        super().__init__(f"pyqtgraph.Qt.{name}")
        self._qt = import_module(f"PySide6.{name}")

    def __getattr__(self, name: str) -> Any:
        """A name of Qt's.

        Raises:
            AttributeError: Qt has none such.
        """
        asking = getattr(inspect.currentframe(), "f_back", None)
        if asking is not None and asking.f_code.co_name == "_copy_attrs":
            return None  # it copies only what is not here yet
        found = getattr(self._qt, name)
        setattr(self, name, found)
        return found


for _name in COPIES:
    sys.modules.setdefault(f"pyqtgraph.Qt.{_name}", Names(_name))
