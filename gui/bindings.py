"""Keeps Qt's bindings and pyqtgraph from doing what nobody here needs, at each import.

PySide6 reads the source of every module that is imported after it, for one that asks
for its other spellings of Qt's names, and all of it stays in memory: 0.15 s of the
processor and 22 MB. Nobody here asks for them.

pyqtgraph copies all names of three modules of Qt into modules of its own, and PySide6
makes a class when its name is first asked for: 0.12 s and 9 MB for hundreds of classes
of which the window uses a few dozen. What stands here in place of those copies asks Qt
for a name when somebody uses it.

A PySide6 or pyqtgraph that does otherwise is slow, not wrong. Import this first.
"""

from __future__ import annotations

import inspect
import sys
from importlib import import_module
from types import ModuleType
from typing import Any

import PySide6.QtCore  # noqa: F401  which loads what is replaced below

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


def _has_usual_names(module: ModuleType) -> bool:
    """That a module is to see Qt's names as they are, without a look at its source."""
    return True


if (_spellings := sys.modules.get("shibokensupport.feature")) is not None:
    vars(_spellings)["_mod_uses_pyside"] = _has_usual_names

for _name in COPIES:
    sys.modules.setdefault(f"pyqtgraph.Qt.{_name}", Names(_name))
