"""What answered when the connect dialog looked for instruments."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QWidget

from gui.look.theme import Theme
from gui.parts import column, empty, label, panel, say, sign

TOP = Qt.AlignmentFlag.AlignTop


class AttachedList(QWidget):
    """A row per port or device: where, what it answered, which row or driver fits."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._found: list[dict[str, Any]] = []
        self.told = label("", "muted", wrap=True)
        self._card = panel("card")
        self._rows = QGridLayout(self._card)
        self._rows.setContentsMargins(12, 9, 12, 9)
        self._rows.setHorizontalSpacing(12)
        self._rows.setVerticalSpacing(9)
        self._rows.setColumnStretch(1, 1)
        self._card.hide()
        column(self, self.told, self._card, spacing=0)
        theme.changed.connect(self._show)

    def say(self, text: str) -> None:
        """Say this instead of a list."""
        say(self.told, text)
        self._found = []
        self._show()

    def show_found(self, found: list[dict[str, Any]]) -> None:
        """Show ports and devices as `drivers.attached.attached` tells them."""
        self.say(
            ""
            if found
            else "No serial port and no known USB device is attached. "
            "Ports can be written by hand, such as socket://192.168.0.7:5025."
        )
        self._found = found
        self._show()

    def _show(self) -> None:
        empty(self._rows)
        tokens = self._theme.tokens
        for row, one in enumerate(self._found):
            good = bool(one["fits"])
            icon, colour = ("check", tokens.green) if good else ("info", tokens.muted)
            mark = sign(icon, colour, "fits" if good else "not known")
            self._rows.addWidget(mark, row, 0, TOP)
            self._rows.addWidget(_words(one), row, 1)
            if good:
                fits = label(", ".join(one["fits"]), "pill-ok")
                self._rows.addWidget(fits, row, 2, TOP | Qt.AlignmentFlag.AlignRight)
        self._card.setVisible(bool(self._found))


def _words(one: dict[str, Any]) -> QWidget:
    """Where it is and who answered; below it what the system and we know of it."""
    made = QWidget()
    words = column(made, spacing=0)
    said = one["identity"] or ("" if one["problem"] else "did not answer")
    name = f" · {said.replace(',', ', ')}" if said else ""
    words.addWidget(label(f"<b>{one['address']}</b>{name}", wrap=True))
    words.addWidget(label(one["title"], "small", wrap=True))
    if one["problem"]:
        words.addWidget(label(one["problem"], "muted", wrap=True))
    return made
