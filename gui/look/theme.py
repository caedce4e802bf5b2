"""Which theme is on: the system's, unless the user chose one."""

from __future__ import annotations

from typing import cast

from PySide6.QtCore import QObject, Qt, Signal
from PySide6.QtGui import QColor, QGuiApplication, QPalette
from PySide6.QtWidgets import QApplication, QWidget

from gui.look.style import sheet
from gui.look.tokens import DARK, LIGHT, Tokens


class Theme(QObject):
    """Holds the tokens in force and tells when they change.

    Args:
        choice: "system", "light" or "dark".
    """

    changed = Signal()

    def __init__(self, choice: str = "system") -> None:
        super().__init__()
        self.choice = choice
        self.tokens = self._wanted()
        hints = QGuiApplication.styleHints()
        hints.colorSchemeChanged.connect(self._system_changed)

    def choose(self, choice: str) -> None:
        """Follow the "system", or stay "light" or "dark"."""
        self.choice = choice
        self.apply()

    def apply(self) -> None:
        """Put the palette on the application; who paints listens to `changed`."""
        self.tokens = self._wanted()
        QApplication.setPalette(palette(self.tokens))
        self.changed.emit()

    def dress(self, window: QWidget) -> None:
        """Give a window and all in it the style sheet of each theme, until it goes.

        A style sheet of the application is worked out for a widget as often as it has
        parents: that took a second and more with every change of the theme.
        """
        _WindowStyle(self, window).put_on()

    def _wanted(self) -> Tokens:
        if self.choice != "system":
            return DARK if self.choice == "dark" else LIGHT
        scheme = QGuiApplication.styleHints().colorScheme()
        return DARK if scheme == Qt.ColorScheme.Dark else LIGHT

    def _system_changed(self) -> None:
        if self.choice == "system":
            self.apply()


class _WindowStyle(QObject):
    """The style sheet of one window: Qt disconnects a child that goes with it."""

    def __init__(self, theme: Theme, window: QWidget) -> None:
        super().__init__(window)
        self._theme = theme
        theme.changed.connect(self.put_on)

    def put_on(self) -> None:
        cast("QWidget", self.parent()).setStyleSheet(sheet(self._theme.tokens))


def palette(tokens: Tokens) -> QPalette:
    """Qt's palette, for what style sheets do not reach."""
    role = QPalette.ColorRole
    made = QPalette()
    for where, colour in (
        (role.Window, tokens.page),
        (role.Base, tokens.field),
        (role.AlternateBase, tokens.sunken),
        (role.Text, tokens.text),
        (role.WindowText, tokens.text),
        (role.Button, tokens.panel),
        (role.ButtonText, tokens.text),
        (role.Highlight, tokens.accent),
        (role.HighlightedText, tokens.on_accent),
        (role.PlaceholderText, tokens.faint),
        (role.ToolTipBase, tokens.header),
        (role.ToolTipText, tokens.header_text),
        (role.Link, tokens.accent),
    ):
        made.setColor(where, QColor(colour))
    disabled = QPalette.ColorGroup.Disabled
    for where in (role.Text, role.WindowText, role.ButtonText):
        made.setColor(disabled, where, QColor(tokens.faint))
    return made
