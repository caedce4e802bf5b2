"""The program, which opens what it is told to.

    python window_that_opens.py SCENE --out FOLDER --bench FILE

A line on the standard input is the place of one of `whatever_is_open.openers`, which
opens it; "shut", which closes all of them; "where" with a class or what a name begins
with, which asks where that is on the screen; "names"; or "state". A line of JSON on the
standard output then tells the window's state, what is open (a card, or the class of
another window), and what was asked.
"""

import argparse
import json
import os
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QWidget
from whatever_is_open import openers, seen, shut

from gui.app import application, main
from gui.dialogs.overlay import Overlay
from gui.window import Window


class Opens:
    """Opens and shuts in the window's thread, as a person's acts do.

    Args:
        folder: for the files that are opened.
    """

    def __init__(self, folder: Path) -> None:
        self.app, self._folder = application(["tactile-lab"]), folder
        threading.Thread(target=self._listen, daemon=True).start()

    @property
    def window(self) -> Window:
        """The main one."""
        windows = QApplication.topLevelWidgets()
        return next(one for one in windows if isinstance(one, Window))

    def until(self, done: Callable[[], object]) -> None:
        """Let the window live until `done()`."""
        while not done():
            self.app.processEvents()
            time.sleep(0.01)

    def _listen(self) -> None:
        # a read is a word: the next comes after the answer. Not by sys.stdin, whose
        # lock would be held as the program ends
        while word := os.read(0, 4096).decode():
            QTimer.singleShot(0, self.app, lambda word=word: self._act(word.strip()))

    def _act(self, word: str) -> None:
        what, _, name = word.partition(" ")
        told: dict[str, object] = {}
        if what == "shut":
            shut(self.window)
        elif what == "names":
            told["names"] = [name for name, _ in self._openers]
        elif what == "where":
            told["middles"] = self._middles(name)
        elif what.isdecimal():
            self._openers[int(what)][1]()
        self.app.processEvents()
        told |= {
            "open": sorted({kind(one) for one in seen(self.window)}),
            "state": self.window.session.state.value,
        }
        sys.stdout.write(json.dumps(told) + "\n")
        sys.stdout.flush()

    @property
    def _openers(self) -> list[tuple[str, Callable[[], object]]]:
        known = openers(self, self._folder)
        return [
            (f"{file}, {number}", opens)
            for file, each in known.items()
            for number, opens in enumerate(each)
        ]

    def _middles(self, name: str) -> list[tuple[int, int]]:
        """Of what is visible and of that class, or has a name that begins so; px."""
        return [
            one.mapToGlobal(one.rect().center()).toTuple()
            for one in self.window.findChildren(QWidget)
            if one.isVisible()
            and (one.accessibleName().startswith(name) or type(one).__name__ == name)
        ]


def kind(one: QWidget) -> str:
    """All cards are of one kind: they lie in the window, and X knows of none."""
    return "card" if isinstance(one, Overlay) else type(one).__name__


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("scene")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--bench")
    asked = parser.parse_args()
    opens = Opens(asked.out.parent)
    sys.exit(main(asked.scene, out=asked.out, bench=asked.bench))
