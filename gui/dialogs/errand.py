"""What the run waits for a person to do at the bench, such as moving the probes."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QHBoxLayout, QLabel, QVBoxLayout, QWidget

from gui.dialogs.overlay import Overlay
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import label, push
from gui.session.session import Session


class ErrandCard(Overlay):
    """Shown from the question until it is done or the run is stopped."""

    def __init__(self, window: QWidget, session: Session, theme: Theme) -> None:
        super().__init__(window, 490)
        self._session, self._theme = session, theme
        self._sign = QLabel()
        self.text = label("", "big", wrap=True)
        self.done = push("Done", "primary")
        self.stop = push("Stop the run", "danger")
        buttons = QHBoxLayout()
        buttons.addStretch(1)
        buttons.addWidget(self.stop)
        buttons.addWidget(self.done)
        words = QVBoxLayout()
        words.setSpacing(8)
        words.addWidget(self.text)
        words.addWidget(
            label("The coil stays at 0 mA. The run goes on when you say so.", "muted")
        )
        words.addSpacing(8)
        words.addLayout(buttons)
        row = QHBoxLayout(self.card)
        row.setContentsMargins(24, 22, 22, 20)
        row.setSpacing(16)
        row.addWidget(self._sign, 0, Qt.AlignmentFlag.AlignTop)
        row.addLayout(words, 1)
        self.done.clicked.connect(session.errand_done)
        self.stop.clicked.connect(lambda: session.stop("stopped at the bench"))
        session.changed.connect(self._follow)

    def _follow(self) -> None:
        errand = self._session.errand
        if errand is None:
            self.hide()
        elif self.isHidden():
            self._sign.setPixmap(pixmap("plug", self._theme.tokens.accent, 28))
            self.text.setText(errand.text)
            self.open()
            self.done.setFocus()
