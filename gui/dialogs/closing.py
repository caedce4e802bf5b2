"""The question asked when the window is closed while the coil is in use."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QLabel, QWidget

from gui.dialogs.overlay import Overlay
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import label, push
from gui.state import Snapshot, minutes, stop_text


class Closing(Overlay):
    """Keep running (the default, and Esc) or stop, verify off and close."""

    stopped = Signal()

    def __init__(self, window: QWidget, theme: Theme) -> None:
        super().__init__(window, 490)
        self._asking = False
        self._theme = theme
        self._sign = QLabel()
        self._title = label("", "big", wrap=True)
        self._text = label("", "", wrap=True)
        self.now = label("", "muted", wrap=True)
        self.keep = push("Keep running", "primary")
        self.stop = push("Stop, coil off and close", "danger")
        self.ask_with(
            self._sign, [self._title, self._text, self.now], [self.stop, self.keep]
        )
        self.keep.clicked.connect(self._keep)
        self.stop.clicked.connect(self._stop)

    def ask(self, snapshot: Snapshot) -> None:
        """Ask; says what happens to coil and data."""
        self._sign.setPixmap(pixmap("warning", self._theme.tokens.amber, 28))
        if snapshot.manual:
            self._title.setText("The coil is driven by hand. Close anyway?")
            self._text.setText(
                "Closing ramps the coil to <b>0 mA</b>, switches the output off and "
                "verifies it by read-back."
            )
            self.keep.setText("Keep open")
        else:
            self._title.setText("A run is in progress. Close anyway?")
            self._text.setText(
                f"Closing stops <b>{snapshot.title}</b> where it is, "
                "ramps the coil to <b>0 mA</b>, verifies it by read-back, and keeps "
                "the data so far as an <i>aborted</i> run."
            )
            self.keep.setText("Keep running")
        self.keep.show()
        self.stop.setEnabled(True)
        self.open()
        self._asking = True
        self.render_snapshot(snapshot, busy=True)
        self.keep.setDefault(True)
        self.keep.setFocus()

    def render_snapshot(self, snapshot: Snapshot, *, busy: bool) -> None:
        """While it asks, tell what the coil does now; go where nothing is in use."""
        if not self._asking:
            return
        if not busy:
            self._keep()
            return
        said = stop_text(snapshot.state, snapshot.coil).detail
        left = ""
        if snapshot.expected is not None and not snapshot.manual:
            rest = max(0.0, snapshot.expected - snapshot.elapsed)
            left = f" · remaining {minutes(rest)}"
        self.now.setText(f"Coil: {said}{left}")

    def say(self, title: str, text: str) -> None:
        """Tell how the closing goes, without a question."""
        self._asking = False
        self._title.setText(title)
        self._text.setText(text)
        self.now.setText("")
        self.keep.hide()
        self.stop.setEnabled(False)
        self._place()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Esc keeps running; the arrows move between the buttons."""
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
