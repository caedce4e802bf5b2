"""Steps of the run as a bar of blocks, with time left in words."""

from __future__ import annotations

from datetime import datetime, timedelta

from PySide6.QtCore import QEvent, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QHelpEvent, QMouseEvent, QPainter, QPaintEvent
from PySide6.QtWidgets import QToolTip, QWidget

from gui.lanes.expected import Stretch
from gui.look.theme import Theme
from gui.parts import Elided, column, label, row
from gui.state import Snapshot, WindowState, minutes

CUT = ("Cut", "Broke")
"""First words of how a run ended that nobody completed on disk."""

ENDS = {
    "Complete": "green",
    "Aborted": "amber",
    **dict.fromkeys(("Faulted", *CUT), "red"),
}
"""Colour of a run that is over, by the first word of how it ended."""


STOPPING = "Stopping: the coil goes to 0 A and is read back"


class Blocks(QWidget):
    """One block per step; done ones are filled. A click shows one in the lanes."""

    chosen = Signal(float, float)
    """Start and length of the step that was clicked, s."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._holds: list[Stretch] = []
        self._length = 1.0
        self._at = 0.0
        self._colour = "accent"
        self.setFixedHeight(12)
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        theme.changed.connect(self.update)

    def show_steps(
        self, holds: list[Stretch], length: float, at: float, colour: str
    ) -> None:
        """Show where the run is; `colour` is the name of a token."""
        shown = (holds, length, at, colour)
        if shown != (self._holds, self._length, self._at, self._colour):
            self._holds, self._length, self._at, self._colour = shown
            self.update()

    def step_at(self, x: float) -> Stretch | None:
        """The step under a pixel."""
        time = x / max(self.width(), 1) * self._length
        return next((one for one in self._holds if one.start <= time < one.end), None)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Show the step in the lanes."""
        step = self.step_at(event.position().x())
        if step is not None:
            self.chosen.emit(step.start, step.end - step.start)

    def event(self, event: QEvent) -> bool:
        """Name the step under the pointer."""
        if isinstance(event, QHelpEvent):
            step = self.step_at(event.pos().x())
            words = step and f"{step.label}, {step.start:.1f} to {step.end:.1f} s"
            QToolTip.showText(event.globalPos(), words or "", self)
            return True
        return super().event(event)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the blocks and the head."""
        painter = QPainter(self)
        tokens = self._theme.tokens
        width, height = self.width(), self.height()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(tokens.sunken))
        painter.drawRoundedRect(QRectF(0, 0, width, height), 3, 3)
        done = QColor(getattr(tokens, self._colour))
        per = width / max(self._length, 1e-9)
        for number, hold in enumerate(self._holds):
            left, right = hold.start * per, hold.end * per
            box = QRectF(left + 1, 0, max(right - left - 1, 1), height)
            rest = QColor(tokens.border)
            painter.fillRect(box, rest)
            reached = min(self._at * per, right)
            if reached > left:
                part = QColor(done)
                part.setAlpha(130 if hold.pause or number % 2 else 255)
                painter.fillRect(
                    QRectF(left + 1, 0, max(reached - left - 1, 0), height), part
                )
        if self._at > 0:
            painter.fillRect(
                QRectF(min(self._at * per, width - 2), 0, 2, height),
                QColor(tokens.text),
            )


class ProgressStrip(QWidget):
    """Step, label and time left above the blocks."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._left = Elided("No run")
        self._right = label("", "muted")
        self._begins = False
        self.blocks = Blocks(theme)
        column(self, row((self._left, 1), self._right), self.blocks)

    @property
    def text(self) -> str:
        """Both texts, for tests and screen readers."""
        return f"{self._left.whole} | {self._right.text()}"

    def show_run(
        self,
        snapshot: Snapshot,
        holds: list[Stretch],
        length: float,
        reach: float,
        trial: tuple[int, str] | None,
        ending: str,
        *,
        kept: bool = True,
    ) -> None:
        """Show where the run is, or how the last one ended; `kept`: it is on disk."""
        state, self._begins = snapshot.state, False
        colour = {WindowState.FAULT: "red", WindowState.ABORTING: "amber"}.get(
            state, "accent"
        )
        if state.in_run:
            self._running(snapshot, holds, length, reach, trial)
        else:
            colour = ENDS.get(ending.partition(" ")[0], colour)
            self._say(ending or "No run yet")
            # how much of a run that was cut is on disk is told once it is recovered
            word = "seen" if ending.partition(" ")[0] in CUT else "kept"
            shown = ending and kept
            self._right.setText(f"{reach:.1f} s {word}" if shown else "")
        self.blocks.show_steps(list(holds), length, reach, colour)
        self.setAccessibleName(self.text)

    def show_beginning(self, snapshot: Snapshot, title: str) -> None:
        """Show that a run begins of which nothing is known yet, or that it did not."""
        if snapshot.state.in_run:
            stopping = snapshot.state is WindowState.ABORTING
            self._say(STOPPING if stopping else f"{title} begins")
        elif self._begins:
            self._say(f"{title} did not begin")
        else:
            return
        self._begins = snapshot.state.in_run
        self._right.setText("")
        self.blocks.show_steps([], 1.0, 0.0, "accent")
        self.setAccessibleName(self.text)

    def _running(
        self,
        snapshot: Snapshot,
        holds: list[Stretch],
        length: float,
        reach: float,
        trial: tuple[int, str] | None,
    ) -> None:
        if snapshot.state is WindowState.ABORTING:
            self._say(STOPPING)
            self._right.setText(f"stopped at <b>{minutes(reach)}</b>")
            return
        if trial is None:
            self._say("Opening instruments")
        else:
            total = f" of {len(holds)}" if trial[0] < len(holds) else ""
            self._say(f"Step {trial[0] + 1}{total} · {trial[1]}")
        left = max(0.0, length - reach)
        share = 100 * reach / max(length, 1e-9)
        at = datetime.now() + timedelta(seconds=left)
        self._right.setText(
            f"{min(share, 100):.0f} % · elapsed <b>{minutes(reach)}</b> · remaining "
            f"<b>{minutes(left)}</b> · done at <b>{at:%H:%M:%S}</b>"
        )

    def _say(self, text: str) -> None:
        """On the left: what does not fit is in the tool tip, and widens nothing."""
        if text != self._left.whole:
            self._left.set_whole(text)
            self._left.setToolTip(text)
