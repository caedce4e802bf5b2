"""The line that says whose parameters the form shows, and whether they are locked."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel

from gui.parts import set_role
from gui.session.session import Session
from gui.setup.subject import Subject


class Strip(QLabel):
    """Hidden while the form simply holds the next run's parameters."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "strip")
        self.setWordWrap(True)
        self.hide()

    @property
    def words(self) -> str:
        """What it says, "" where it is hidden."""
        return "" if self.isHidden() else self.text()

    def say(self, words: str, *, warning: bool = False) -> None:
        """Say something; "" hides the strip."""
        self.setText(words)
        set_role(self, "strip-warn" if warning else "strip")
        self.setVisible(bool(words))

    def show_subject(
        self, subject: Subject, session: Session, *, locked: bool, shown: bool
    ) -> None:
        """Say what the form is about.

        Args:
            subject: what fills the form.
            session: with the queue and the run in progress.
            locked: whether a run is in progress.
            shown: whether that run is the one in the form.
        """
        item, queue = subject.edited, session.queue.items
        if item is not None:
            place = f"{queue.index(item) + 1} of {len(queue)} in the queue"
            self.say(f"Editing {item.title}, {place}")
        elif subject.lost:
            self.say(subject.lost, warning=True)
        elif locked and shown:
            self.say("The run in progress · locked")
        elif locked:
            name = session.run.title
            self.say(f"Your next run · locked while {name} is in progress")
        else:
            self.say("")
