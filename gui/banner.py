"""The banner of a fault or an unknown coil: what, consequence, what to do next."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame, QLabel

from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import bar, label, lines, push
from gui.state import FaultNotice, Snapshot, left_notice


class Banner(QFrame):
    """Shown from the fault until it is acknowledged, then for what was left unknown.

    Attributes:
        met: whether a key has led to it since this fault.
    """

    acknowledged = Signal()
    switched_off = Signal()
    """A person has switched off what was left unknown."""
    log_asked = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.setProperty("role", "banner")
        self._theme = theme
        self._fault: FaultNotice | None = None
        self.met = False
        self._sign = QLabel()
        self._title = label("", "bannertitle", wrap=True)
        self._text = label("", "", wrap=True)
        words = lines(self._title, self._text, spacing=2)
        self.show_log = push("Show in log")
        self.acknowledge = push("Acknowledge and reset", "primary")
        self.is_off = push("It is switched off")
        # what a second click on Acknowledge may meet says nothing of a coil
        buttons = (self.is_off, self.show_log, self.acknowledge)
        parts = (self._sign, (words, 1), *buttons)
        bar(self, (16, 9, 12, 9), 12, *parts)
        self.show_log.clicked.connect(self.log_asked)
        self.acknowledge.clicked.connect(self.acknowledged)
        self.is_off.clicked.connect(self.switched_off)
        self.hide()

    def render_snapshot(self, snapshot: Snapshot) -> None:
        """Show the fault, else which coils were left unknown, or hide."""
        fault = snapshot.fault or left_notice(snapshot.left_unknown)
        self.acknowledge.setVisible(snapshot.fault is not None)
        self.is_off.setVisible(snapshot.fault is None)
        self.met = self.met and fault == self._fault
        self._fault = fault
        self.setVisible(fault is not None)
        if fault is not None:
            self._sign.setPixmap(pixmap("warning", self._theme.tokens.red, 26))
            self._title.setText(fault.title)
            # a driver tells every step it tried: the first says what happened
            first, _, rest = fault.consequence.partition(" | ")
            self._text.setText(f"{first} …" if rest else first)
            self._text.setToolTip(fault.consequence)
            self.setAccessibleName(f"Fault: {fault.title} {fault.consequence}")
