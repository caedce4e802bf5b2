"""The centre: tools, lanes, navigator; below them progress and log."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QEvent, QObject, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QLabel, QSplitter, QWidget

from gui.lanes.lane import Lane
from gui.lanes.source import Source
from gui.lanes.stack import LaneStack
from gui.lanes.tools import Tools
from gui.lanes.view import TimeView
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import STRETCH, column, empty, label, line, panel, push, row
from gui.record.log import LogView
from gui.record.monitor_bar import MonitorBar
from gui.record.progress import ProgressStrip
from gui.screen.compare_bar import CompareBar
from gui.screen.notice import Notice

LATER = 0.05
"""By how much the record may have a step begin later than was told live, s."""

STRIP, LOGGED = 56, 151
"""Heights of the progress alone, and with the log, px."""

NARROW, LOW, LOWEST = 1000, 640, 500
"""Width and heights of the window, px, below which not all of the centre is shown."""

MOST = 520
"""Width of the card of the empty state, px."""

FOLLOWED = 5.0
"""Visible time of a run that begins, s."""


EXPLORE = (
    "Explore with the simulated bench: same drivers, same protocols, same files, no "
    "hardware. Or connect your own coil source, oscilloscope and teslameter."
)
REFUSED = "{} is not connected. See to {}, then connect it again."


class EmptyCard(QFrame):
    """What to do where there is no bench: again or simulated, connect, open, recent.

    Args:
        parent: what it lies on.
        above: what it leaves free at the foot of that.
        theme: of the window.
    """

    simulated_asked = Signal()
    again_asked = Signal()
    """The bench that could not be connected."""
    connect_asked = Signal()
    open_asked = Signal()
    recent_asked = Signal(object)

    def __init__(self, parent: QWidget, above: QWidget, theme: Theme) -> None:
        super().__init__(parent)
        self.setProperty("role", "dialog")
        self.setAccessibleName("No bench connected")
        self._below, self._above, self._theme = parent, above, theme
        self._picture = QLabel()
        title = label("No bench connected", "big")
        self.text = text = label(EXPLORE, wrap=True)
        self.again = push("Connect again", "primary")
        self.simulated = push("Use simulated bench", "primary")
        self._connect = connect = push("Connect instruments …")
        scene = push("Open scene …")
        offers = (self.again, self.simulated, connect, scene)
        buttons = row(STRETCH, *offers, STRETCH, spacing=8)
        self._listed = QWidget()
        self._recent = column(self._listed, spacing=2)
        self._hint = hint = label("or drop a scene or a run anywhere", "small")
        for words in (self._picture, title, text, hint):
            words.setAlignment(Qt.AlignmentFlag.AlignCenter)
        parts = (self._picture, title, text, buttons, self._listed, hint)
        self._rows = column(self, *parts, margin=26, spacing=12)
        self.again.clicked.connect(self.again_asked)
        self.simulated.clicked.connect(self.simulated_asked)
        connect.clicked.connect(self.connect_asked)
        scene.clicked.connect(self.open_asked)
        theme.changed.connect(self._tint)
        self._tint()
        parent.installEventFilter(self)
        self.offer("")

    def offer(self, refused: str, see_to: str = "") -> None:
        """Offer the bench that could not be connected before a simulated one.

        Args:
            refused: its name; "" for none.
            see_to: what kept it from being connected.
        """
        self.again.setVisible(bool(refused))
        self.again.setToolTip(refused)
        self.simulated.setHidden(bool(refused))  # the menu has it, too
        self.text.setText(REFUSED.format(refused, see_to) if refused else EXPLORE)

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:
        """Stay in the middle of what it lies on."""
        if event.type() == QEvent.Type.Resize and self.isVisible():
            self.place()
        return False

    def _wanted_height(self) -> int:
        self._rows.activate()
        return self._rows.totalHeightForWidth(self.width())

    def place(self) -> None:
        """Lie in the middle; where there is little room, say and offer less."""
        below, minor = (
            self._below,
            (self._hint, self._picture, self._listed, self.text),
        )
        narrow = below.width() < MOST + 40
        self._connect.setText("Connect …" if narrow else "Connect instruments …")
        margin = 12 if narrow else 26
        self._rows.setContentsMargins(margin, margin, margin, margin)
        self.setFixedWidth(min(MOST, below.width() - 16))
        for part in minor:
            part.show()
        height = below.height()
        if self._above.isVisible():
            height -= self._above.height()
        room = height - 16
        for part in minor:
            if self._wanted_height() <= room:
                break
            part.hide()
        self.setFixedHeight(min(self._wanted_height(), room))
        self.move(
            (below.width() - self.width()) // 2,
            max((height - self.height()) // 2, 8),
        )
        self.raise_()

    def show_recent(self, folders: list[tuple[str, Path]]) -> None:
        """Offer recent runs as (title, folder)."""
        empty(self._recent)
        if folders:
            self._recent.addWidget(label("RECENT RUNS", "section"))
        for title, folder in folders[:4]:
            button = push(title)
            button.setStyleSheet("text-align: left; border: 0;")
            button.clicked.connect(
                lambda _=False, folder=folder: self.recent_asked.emit(folder)
            )
            self._recent.addWidget(button)
        if self.isVisible():
            for one in self._listed.findChildren(QWidget):
                one.show()  # or they would not count yet in the height that is wanted
            self.place()

    def _tint(self) -> None:
        self._picture.setPixmap(pixmap("bench", self._theme.tokens.accent, 44))


class RecordPanel(QFrame):
    """Progress, and the log where it has room for a line."""

    def __init__(self, progress: ProgressStrip, log: LogView) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self._log = log
        column(self, progress, (log, 1), spacing=7).setContentsMargins(12, 10, 12, 10)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave the log out rather than cut it."""
        super().resizeEvent(event)
        self._log.setVisible(self.height() >= LOGGED - 15)


class Centre(QWidget):
    """Lanes above, record below, a movable border between."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.view = TimeView()
        self.stack = LaneStack(self.view, theme)
        self.tools = Tools(self.stack, self.view, theme)
        self.progress = ProgressStrip(theme)
        self.log = LogView(theme)
        self.lanes = panel()
        self.notice = Notice()
        self.compare_bar = CompareBar(self.stack, self.view, theme)
        self.monitor_bar = MonitorBar()
        bars = (self.tools, line(), self.notice, self.compare_bar, self.monitor_bar)
        column(self.lanes, *bars, (self.stack, 1), margin=1, spacing=0)
        self.record = RecordPanel(self.progress, self.log)
        self.splitter = QSplitter(Qt.Orientation.Vertical)
        self.splitter.addWidget(self.lanes)
        self.splitter.addWidget(self.record)
        self.splitter.setStretchFactor(0, 4)
        self.splitter.setStretchFactor(1, 1)
        self.splitter.setHandleWidth(8)
        self.splitter.setSizes([780, 200])
        self.splitter.setChildrenCollapsible(False)
        self._low = False
        self.show_room(NARROW, LOW)
        column(self).addWidget(self.splitter)
        self.empty = EmptyCard(self.stack, self.stack.navigator, theme)
        self.progress.blocks.chosen.connect(self.view.show_step)
        self.log.step_chosen.connect(self._show_step)

    def show_room(self, width: int, height: int) -> None:
        """Leave out of a small window what has a key; its width and height, px."""
        narrow, low = width < NARROW, height < LOW
        self.stack.navigator.setVisible(height >= LOWEST)
        self.log.title.setVisible(not narrow)
        self.lanes.setMinimumHeight(200 if low else 320)
        self.record.setMinimumHeight(STRIP if low else LOGGED)
        if low is not self._low:
            self._low = low
            self.splitter.setSizes([780, STRIP if low else 200])

    def open_log(self) -> None:
        """Give the log room where it had none."""
        if self.log.isHidden():
            self.splitter.setSizes([self.height() - LOGGED, LOGGED])

    def show_safety(self) -> None:
        """Show the last lines about the coil."""
        self.open_log()
        self.log.show_safety()

    def write_note(self) -> None:
        """Put the keyboard into the field for notes."""
        self.open_log()
        self.log.note.setFocus()

    def show_source(self, source: Source, lanes: Sequence[Lane] | None) -> None:
        """Show another source, whole; `lanes`: None keeps those shown."""
        self.tools.freeze.setChecked(False)
        self._show_lanes(lanes)
        self.stack.show_source(source)
        self.view.set_now(source.reach, source.length)
        self.view.show_all()
        self.stack.show_values()

    def follow_source(self, source: Source, lanes: Sequence[Lane] | None) -> None:
        """Show a source that grows, and follow it."""
        self.tools.freeze.setChecked(False)
        self._show_lanes(lanes)
        self.stack.show_source(source)
        self.view.clear_cursors()
        self.view.set_follow(True)
        self.view.set_width(FOLLOWED)

    def exchange_source(self, source: Source, lanes: Sequence[Lane] | None) -> None:
        """Show another source of the same data: view and ranges stay."""
        self.tools.freeze.setChecked(False)
        self.view.set_now(source.reach, source.length)
        self._show_lanes(lanes)
        self.stack.exchange_source(source)

    def refresh(self, lanes: Sequence[Lane] | None) -> None:
        """More has come of what is shown."""
        self._show_lanes(lanes)
        self.stack.refresh()
        self.stack.show_values()

    def _show_step(self, time: float, run: Path | None) -> None:
        """Show the step that a time of a run is in, or that time itself."""
        seen = self.stack.source.members
        of = next((one for one in seen if run in (None, one.source.folder)), None)
        if of is None:
            assert run is not None, "a line of no run is of what is shown"
            self.say(f"{run.name} is not on screen; open it in Runs.")
            return
        for one in reversed(of.source.holds):
            if one.start - LATER <= time < one.end:
                self.view.show_step(one.start + of.shift, one.end - one.start)
                return
        middle = time + of.shift
        self.view.show_span(middle - self.view.width / 2, self.view.width)

    def say(self, problem: str) -> None:
        """Say something above the lanes; "" takes it away."""
        self.notice.say(problem)

    def _show_lanes(self, lanes: Sequence[Lane] | None) -> None:
        if lanes is not None:
            self.stack.show_lanes(lanes)
            self.empty.raise_()  # the cards of new lanes lie above what was there

    def show_empty(self, wanted: bool, refused: str = "", see_to: str = "") -> None:
        """Show or hide the card of the empty state.

        Args:
            wanted: whether there is no bench, and no run on screen.
            refused: name of the bench that could not be connected; "" for none.
            see_to: what kept it from that.
        """
        self.empty.setVisible(wanted)
        if wanted:
            self.empty.offer(refused, see_to)
            self.empty.place()
