"""What the run waits for a person to do at the bench: move probes, read the field."""

from __future__ import annotations

from PySide6.QtCore import QEvent, QObject, QTimer
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import QApplication, QLabel, QWidget

from gui.dialogs.overlay import Overlay
from gui.interrupted import FIELDS
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import label, line_edit, push, row, say, set_role
from gui.session.session import Session
from tactile_lab.acquisition.asked_field import read_off
from tactile_lab.engine.events import PersonAsked
from tactile_lab.errors import QuantityError
from tactile_lab.quantity import show

TYPING = " Tab goes to the buttons: what is typed on answers nothing."

QUIET = 500
"""Time without a key until a question that came by itself heeds one, ms."""


class QuestionCard(Overlay):
    """Shown from the question until it is done or the run is stopped.

    It comes by itself: where somebody types in a field just then, no button of it gets
    the keyboard, for the next space would say that the probes were moved. Keys meant
    for what had the keyboard do nothing in it, until none came for `QUIET`; those of
    STOP, which never reach it, act.
    """

    def __init__(self, window: QWidget, session: Session, theme: Theme) -> None:
        super().__init__(window, 490)
        self._session, self._theme = session, theme
        self._shown: PersonAsked | None = None
        self._last = ""
        self._quiet = QTimer(self, singleShot=True, interval=QUIET)
        self._sign = QLabel()
        self.text = label("", "big", wrap=True)
        self.doubt = label("", "error", wrap=True)
        self.entry = line_edit("Field that the teslameter shows", "such as 5.4 mT")
        self.entry.setFixedWidth(150)
        self.understood = label("", "muted", wrap=True)
        self.before = label("", "muted", wrap=True)
        self.coil = label("", "muted", wrap=True)
        self.done = push("Done", "primary")
        self.stop = push("Stop the run", "danger")
        self._lay_out()
        for part in (self.card, self.entry, self.done, self.stop):
            part.installEventFilter(self)
        self.entry.textChanged.connect(self._judge)
        self.entry.returnPressed.connect(self._done)
        self.done.clicked.connect(self._done)
        self.stop.clicked.connect(lambda: session.stop("stopped at the bench"))
        session.status.changed.connect(self._follow)

    @property
    def heeds_keys(self) -> bool:
        """Whether what is typed now is meant for the question."""
        return not self._quiet.isActive()

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Keep keys from the card that were meant for what had the keyboard before."""
        if watched is self._window:
            return super().eventFilter(watched, event)
        pressed = isinstance(event, QKeyEvent) and event.type() == QEvent.Type.KeyPress
        if not pressed or self.heeds_keys:
            return False
        self._quiet.start()
        return True

    def _follow(self) -> None:
        asked = self._session.run.asked
        if asked is self._shown:
            return
        self._shown = asked
        if asked is None:
            self.hide()
            return
        typing = isinstance(QApplication.focusWidget(), FIELDS)
        sign = "plug" if asked.current is None else "edit"
        self._sign.setPixmap(pixmap(sign, self._theme.tokens.accent, 28))
        self.text.setText(
            asked.text
            if asked.current is None
            else f"Type the field that is shown at {_amperes(asked.current)}."
        )
        say(self.doubt, asked.doubt)
        reads = asked.current is not None
        self.entry.setVisible(reads)
        self.understood.setVisible(reads)
        self.before.setVisible(reads and bool(self._last))
        self.before.setText(f"Entered last: {self._last}.")
        said = TYPING if typing and not reads else ""
        self.coil.setText(self._coil_words(asked.current) + said)
        self.entry.clear()
        self._judge()
        self.open()
        self._quiet.start()
        (self.entry if reads else self.card if typing else self.done).setFocus()

    def _coil_words(self, current: float | None) -> str:
        """What is true of the coil while the run waits."""
        if current is None:
            return "The coil stays at 0 mA. The run goes on when you say so."
        words = f"The coil holds {_amperes(current)} until you are done."
        limits = self._session.status.coil.limits
        if limits is not None and abs(current) > limits.continuous:
            words += (
                f" That is more than the {_amperes(limits.continuous)} it bears "
                "continuously: once its heat budget is used up, the run ends and the "
                "coil is switched off."
            )
        return words

    def _judge(self) -> None:
        """Say how the entry is understood, or why it cannot be."""
        if self._shown is None or self._shown.current is None:
            self.done.setEnabled(True)
            return
        typed, problem = self.entry.text().strip(), ""
        try:
            understood = f"= {show(read_off(typed), 'T', 5)}"
        except QuantityError as error:
            problem, understood = str(error), ""
        if not typed:
            problem, understood = (
                "",
                "What the teslameter shows, in mT or with its unit.",
            )
            self.done.setToolTip("Type what the teslameter shows.")
        else:
            self.done.setToolTip(problem)
        self.understood.setText(problem or understood)
        set_role(self.understood, "error" if problem else "muted")
        self.done.setEnabled(bool(typed) and not problem)
        if self.isVisible():
            self.open()

    def _done(self) -> None:
        if self._shown is None or not self.done.isEnabled():
            return
        answer = self.entry.text().strip()
        if self._shown.current is not None:
            at = show(self._shown.current, "A")
            self._last = f"{show(read_off(answer), 'T', 5)} at {at}"
        self._session.run.answer(answer)

    def _lay_out(self) -> None:
        typed = row(self.entry, (self.understood, 1), spacing=10)
        self.ask_with(
            self._sign,
            [self.text, self.doubt, typed, self.before, self.coil],
            [self.done, self.stop],
        )


def _amperes(current: float) -> str:
    """A current with its unit on the same line."""
    return show(current, "A").replace(" ", "\u00a0")
