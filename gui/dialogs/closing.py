"""The question asked when the window is closed over what would be ended or lost."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QDialog, QLabel, QWidget

from gui.dialogs.overlay import Overlay
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import label, push
from gui.state import CoilKnowledge, Snapshot, minutes, stop_text, truth

NAMED, LENGTH = 3, 60
"""How many queued runs and notes are named, and how many letters of each."""


class Closing(Overlay):
    """Keep the window (the default, and Esc), or stop, verify off and close."""

    stopped = Signal()

    def __init__(self, window: QWidget, theme: Theme) -> None:
        super().__init__(window, 490)
        self._asking = False
        self._theme = theme
        self._sign = QLabel()
        self._title = label("", "big", wrap=True)
        self.text = label("", "", wrap=True)
        self.now = label("", "muted", wrap=True)
        self.keep = push("Keep running", "primary")
        self.stop = push("Stop, coil off and close", "danger")
        self.ask_with(
            self._sign, [self._title, self.text, self.now], [self.stop, self.keep]
        )
        self.keep.clicked.connect(self._keep)
        self.stop.clicked.connect(self._stop)

    def ask(self, snapshot: Snapshot, *, busy: bool) -> None:
        """Ask; says what happens to coil and data, and what is lost."""
        for dialog in QApplication.topLevelWidgets():
            if isinstance(dialog, QDialog) and dialog.isVisible():
                dialog.close()  # a desktop keeps it above its window, and the question
        self._sign.setPixmap(pixmap("warning", self._theme.tokens.amber, 28))
        self.keep.show()
        self.stop.setEnabled(True)
        self._asking = True
        self.render_snapshot(snapshot, busy=busy)
        self.open()
        self._window.activateWindow()
        self.keep.setDefault(True)
        self.keep.setFocus()

    def render_snapshot(self, snapshot: Snapshot, *, busy: bool) -> None:
        """While it asks, tell what is so now; go where nothing is in use or lost.

        Args:
            snapshot: what is so now.
            busy: whether something has the coil, or is about to.
        """
        if not self._asking:
            return
        lost = _lost(snapshot)
        if not busy and not lost:
            self._keep()
            return
        title, text, keep, stop = _question(snapshot, busy=busy)
        text = "<br>".join(part for part in (text, lost) if part)
        grows = text != self.text.text()
        self._title.setText(title)
        self.text.setText(text)
        self.keep.setText(keep)
        self.stop.setText(stop)
        self.now.setVisible(busy)
        self.now.setText(_now(snapshot))
        if grows and self.isVisible():
            self._place()

    def say(self, title: str, text: str) -> None:
        """Tell how the closing goes, without a question."""
        self._asking = False
        self._title.setText(title)
        self.text.setText(text)
        self.now.setText("")
        self.keep.hide()
        self.stop.setEnabled(False)
        self._place()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Esc keeps the window; the arrows move between the buttons."""
        if event.key() == Qt.Key.Key_Escape:
            self._keep()
        elif event.key() in (Qt.Key.Key_Left, Qt.Key.Key_Right):
            (self.stop if self.keep.hasFocus() else self.keep).setFocus()
        else:
            super().keyPressEvent(event)

    def _keep(self) -> None:
        self._asking = False
        self.hide()

    def _stop(self) -> None:
        self.stopped.emit()


def _question(snapshot: Snapshot, *, busy: bool) -> tuple[str, str, str, str]:
    """Title, text, and the words on both buttons."""
    if not busy:
        return "Not all of it is kept. Close anyway?", "", "Keep window", "Close anyway"
    stop = "Stop, coil off and close"
    if snapshot.manual:
        title = "The coil is driven by hand. Close anyway?"
        text = (
            "Closing ramps the coil to <b>0 mA</b>, switches the output off and "
            "verifies it by read-back."
        )
        return title, text, "Keep open", stop
    text = (
        f"Closing stops <b>{escape(snapshot.title)}</b> where it is, "
        "ramps the coil to <b>0 mA</b>, verifies it by read-back, and keeps "
        "the data so far as an <i>aborted</i> run."
    )
    return "A run is in progress. Close anyway?", text, "Keep running", stop


def _now(snapshot: Snapshot) -> str:
    """What the coil does, and how long the run still takes."""
    left = ""
    if snapshot.expected is not None and not snapshot.manual:
        rest = max(0.0, snapshot.expected - snapshot.elapsed)
        left = f" · remaining {minutes(rest)}"
    text = stop_text(snapshot.state, snapshot.coil)
    if truth(snapshot.state, snapshot.coil) is CoilKnowledge.UNKNOWN:
        return f"{text.spoken}{left}"
    return f"Coil: {text.detail}{left}"


def _lost(snapshot: Snapshot) -> str:
    """What closing loses, named; "" where all is kept."""
    queued = _named("queued run", snapshot.queued)
    notes = _named("note", snapshot.notes, " for the next run")
    parts = [f"<br>• {part}" for part in (queued, notes) if part]
    return f"Closing loses{''.join(parts)}" if parts else ""


def _named(noun: str, texts: Sequence[str], which: str = "") -> str:
    """How many there are, and what the first of them are."""
    if not texts:
        return ""
    count = f"a {noun}" if len(texts) == 1 else f"{len(texts)} {noun}s"
    short = [t if len(t) <= LENGTH else f"{t[:LENGTH]} …" for t in texts[:NAMED]]
    named = ", ".join(f"“{escape(text)}”" for text in short)
    more = len(texts) - NAMED
    named += f" and {more} more" if more > 0 else ""
    return f"<b>{count}{which}</b>: {named}"
