"""A question before something that cannot simply be undone."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtWidgets import QLabel, QWidget

from gui.dialogs.overlay import Overlay
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import label, push


class Confirm(Overlay):
    """Do it, or leave it (the default)."""

    def __init__(self, window: QWidget, theme: Theme) -> None:
        super().__init__(window, 470)
        self._theme = theme
        self._then: Callable[[], object] = lambda: None
        self._sign = QLabel()
        self._title, self._text = label("", "big", wrap=True), label("", "", wrap=True)
        self.leave = push("Leave it", "primary")
        self.do = push("", "danger")
        self.ask_with(self._sign, [self._title, self._text], [self.do, self.leave])
        self.leave.clicked.connect(self.hide)
        self.do.clicked.connect(self._do)

    def ask(self, title: str, text: str, act: str, then: Callable[[], object]) -> None:
        """Ask; `then` is done where the answer is `act`."""
        self._then = then
        self._sign.setPixmap(pixmap("warning", self._theme.tokens.amber, 28))
        self._title.setText(title)
        self._text.setText(text)
        self.do.setText(act)
        self.do.setAccessibleName(act)
        self.open()
        self.leave.setFocus()

    def _do(self) -> None:
        self.hide()
        self._then()
