"""Run and Queue; Save and Cancel in their place while a queued run is edited."""

from __future__ import annotations

from PySide6.QtGui import QIcon
from PySide6.QtWidgets import QWidget

from gui.look.icons import icon, pixmap
from gui.look.theme import Theme
from gui.parts import bar, push
from gui.state import WindowState

WORDS = {WindowState.RUNNING: "Running …", WindowState.ABORTING: "Stopping …"}


class Buttons(QWidget):
    """The four buttons below the form."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self.run = push("Run", "primary")
        self.queue = push("Queue")
        self.save = push("Save to queue", "primary")
        name, tip = "Cancel the edit of the queued run", "The queued run stays as it is"
        self.cancel = push("Cancel", name=name, tip=tip)
        parts = (self.run, 3), (self.queue, 2), (self.save, 3), (self.cancel, 2)
        bar(self, (0, 0, 0, 0), 8, *parts)
        theme.changed.connect(self._tint)
        self._tint()
        self.show_next(WindowState.DISCONNECTED, "", cannot_wait="", planning="")

    def show_next(
        self, state: WindowState, problem: str, *, cannot_wait: str, planning: str
    ) -> None:
        """Offer the form's run.

        Args:
            state: of the window.
            problem: why it cannot start now, "" if it can.
            cannot_wait: why it cannot wait in the queue, "" if it can.
            planning: for how long it is planned already, "" where it is not.
        """
        self._swap(editing=False)
        self.run.setEnabled(not problem)
        self.run.setToolTip(problem or _told("Run what the form says", "R", planning))
        self.run.setText(WORDS.get(state) or planning or "Run")
        self.queue.setEnabled(not cannot_wait)
        wait = _told("Have it wait for its turn", "Return", planning)
        self.queue.setToolTip(cannot_wait or wait)
        self.queue.setText(planning if planning and state in WORDS else "Queue")

    def show_edit(self, problem: str, planning: str) -> None:
        """Offer to save the edited run.

        Args:
            problem: why that cannot be done, "" if it can.
            planning: for how long it is planned already, "" where it is not.
        """
        self._swap(editing=True)
        self.save.setEnabled(not problem)
        replace = _told("Replace the queued run's parameters", "Return", planning)
        self.save.setToolTip(problem or replace)
        self.save.setText(planning or "Save to queue")

    def _swap(self, *, editing: bool) -> None:
        for button in (self.run, self.queue):
            button.setVisible(not editing)
        for button in (self.save, self.cancel):
            button.setVisible(editing)

    def _tint(self) -> None:
        tokens = self._theme.tokens
        play = icon("play", tokens.on_accent)
        play.addPixmap(pixmap("play", tokens.faint), QIcon.Mode.Disabled)
        self.run.setIcon(play)
        self.queue.setIcon(icon("queue", tokens.text))


def _told(act: str, key: str, planning: str) -> str:
    """What a button does, and when, where the plan is still computed."""
    return f"{act}{', once it is planned' if planning else ''} (Ctrl+{key})"
