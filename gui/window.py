"""The bench window: puts the parts together and renders the one state."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QSettings, Qt, QTimer
from PySide6.QtGui import (
    QCloseEvent,
    QDragEnterEvent,
    QDropEvent,
    QKeyEvent,
    QResizeEvent,
)
from PySide6.QtWidgets import QApplication, QMainWindow, QSplitter, QWidget

from gui.actions import Actions
from gui.banner import Banner
from gui.dialogs.closing import Closing
from gui.dialogs.overlay import Overlay
from gui.dialogs.question import QuestionCard
from gui.habits import Habits
from gui.header.header import Header
from gui.interrupted import Interrupted
from gui.look.theme import Theme
from gui.parts import column
from gui.preferences import Preferences
from gui.review.cursor_statistics import CursorStatistics
from gui.review.panel import ReviewPanel
from gui.review.spike_tools import SpikeTools
from gui.run_actions import RunActions
from gui.screen.centre import Centre
from gui.screen.frames import FrameLoop
from gui.screen.panels import Panels
from gui.screen.screen import Screen
from gui.session.session import Session
from gui.setup.panel import SetupPanel
from gui.state import Snapshot, WindowState
from gui.tab_order import move_on

if TYPE_CHECKING:
    from gui.lanes_window import LanesWindow

NARROW = 1280
"""Window width, px, below which there is room for one side panel."""

LEAST = 844, 440
"""Size of the window, px, at which it fits a screen of 1280 x 720 at 150 %."""

OFF_TIMEOUT = 3000
"""Milliseconds a closing window waits for the coil to be verified off."""


class Window(QMainWindow):
    """Header, three columns, banner; one `render_state` for everything.

    Args:
        session: what runs behind the window.
        theme: colours.
        settings: where geometry is kept; None keeps nothing.
        preferences: of the user; None for those in `settings`.
    """

    def __init__(
        self,
        session: Session,
        theme: Theme,
        settings: QSettings | None = None,
        preferences: Preferences | None = None,
    ) -> None:
        super().__init__()
        self.setMinimumSize(*LEAST)
        self.setAcceptDrops(True)
        self.session, self.theme, self._settings = session, theme, settings
        theme.dress(self)
        self.preferences = preferences or Preferences(settings)
        self.page = QWidget()
        self.header = Header(theme)
        self.banner = Banner(theme)
        self.setup = SetupPanel(session, theme)
        self.centre = Centre(theme)
        self.review = ReviewPanel(theme)
        self._folds: dict[QWidget, bool | None] = {self.setup: None, self.review: None}
        self.columns = QSplitter(Qt.Orientation.Horizontal)
        self._lay_out()
        self.closing = Closing(self, theme)
        self.question = QuestionCard(self, session, theme)
        self.panels = Panels(
            session, theme, self.header, self.setup, self.centre, self.review
        )
        self.screen_ = Screen(self.panels)
        self.frames = FrameLoop(self.panels, self.screen_)
        self.runs = RunActions(self, self.panels, self.screen_)
        self.actions_ = Actions(
            self, self.panels, self.screen_, self.runs, self.closing, self.preferences
        )
        self._habits = Habits(
            session, self.preferences, self.screen_, self.centre.stack
        )
        self.spikes = SpikeTools(self.review.spikes, self.centre.stack, session)
        self.review.noise.follow(session)
        CursorStatistics(self.centre.stack, session)
        self.interrupted = Interrupted(self.page, self.centre.say)
        self._leaving = False
        self.apart: LanesWindow | None = None
        self._connect()
        self.render_state()

    # --- rendering

    def render_state(self) -> None:
        """Render everything from the session's snapshot."""
        snapshot = self.session.snapshot()
        self.header.render_snapshot(snapshot)
        named = dict.fromkeys((snapshot.heading, snapshot.bench, "Tactile Lab"))
        self.setWindowTitle(" · ".join(name for name in named if name))
        self.banner.render_snapshot(snapshot)
        self.setup.render_snapshot(snapshot)
        self._render_manual(snapshot)
        if self._bench_changed():
            self.review.manual.show_bench(self.session.bench.spec)
        self.centre.show_empty(
            snapshot.state is WindowState.DISCONNECTED and self.screen_.run is None,
            self.session.bench.refused,
            self.session.bench.see_to,
        )
        self.centre.log.note.setPlaceholderText(self.runs.note_goes_to)
        tools = self.centre.tools
        watching = self.session.monitor.alive
        tools.monitor.setEnabled(watching or snapshot.state is WindowState.READY)
        self._render_tools()
        self._render_closing(snapshot)

    def render_clock(self, snapshot: Snapshot) -> None:
        """Render what changes all the time: header, STOP, manual."""
        self.header.render_snapshot(snapshot)
        self._render_manual(snapshot)
        self._render_tools()
        self._render_closing(snapshot)

    def _render_tools(self) -> None:
        live = self.screen_.live
        self.centre.tools.show_possible(growing=live is not None and live.running)

    def _render_closing(self, snapshot: Snapshot) -> None:
        self.closing.render_snapshot(snapshot, busy=self.session.busy)
        self._close_when_off()

    def _render_manual(self, snapshot: Snapshot) -> None:
        session = self.session
        self.review.manual.render_snapshot(
            snapshot, session.bench.field, reading=session.bench.reading
        )
        self.review.manual.follow(session.manual)

    def fold(self, side: QWidget, folded: bool) -> None:
        """Fold a side panel by hand; the window's width no longer decides."""
        self._folds[side] = folded
        side.setVisible(not folded)
        self.interrupted.end()  # who folds a field away types on in none
        if not folded and self.width() < NARROW:  # there is room for one of them
            other = self.setup if side is self.review else self.review
            other.setVisible(False)
        elif folded and side is self.review and self._folds[self.setup] is not True:
            self.setup.setVisible(True)  # it only made room
        self._show_folds()

    def _show_folds(self) -> None:
        self.header.show_folded(self.setup.isHidden(), self.review.isHidden())

    def part_lanes(self) -> None:
        """Put the lanes into a window of their own, or back."""
        from gui.lanes_window import LanesWindow

        if self.apart is not None:
            self.apart.close()
            return
        kept = self._settings.value("lanes") if self._settings is not None else None
        self.apart = LanesWindow(self, self.panels, self.actions_, kept)
        self.apart.closed.connect(self._lanes_back)
        self.apart.show()

    def _lanes_back(self) -> None:
        if self.apart is not None:
            if self._settings is not None:
                self._settings.setValue("lanes", self.apart.saveGeometry())
            self.apart.deleteLater()
            self.apart = None

    # --- closing

    def closeEvent(self, event: QCloseEvent) -> None:
        """Close at once where nothing drives the coil, or would be lost; else ask."""
        session = self.session
        snapshot = session.snapshot()
        lost = snapshot.queued or snapshot.notes
        if (session.busy or lost) and not self._leaving:
            event.ignore()
            self.closing.ask(snapshot, busy=session.busy)
            return
        if session.occupied:
            session.show_monitor(False)
            self._leaving = True
            event.ignore()
            return
        self.frames.stop()
        apart = self.apart is not None
        if self.apart is not None:
            self.apart.close()
        if self._settings is not None:
            self._settings.setValue("apart", apart)
            self._settings.setValue("geometry", self.saveGeometry())
            self._settings.setValue("columns", self.columns.saveState())
            self._settings.setValue("centre", self.centre.splitter.saveState())
        event.accept()
        app = QApplication.instance()
        if app is not None:
            app.quit()

    def leave(self) -> None:
        """Close without a question.

        What drives the coil is stopped, and the window closes once that is verified
        off, or its failure was shown.
        """
        self._leaving = True
        if not self.session.busy:
            self.session.queue.hold()  # it would begin once the monitor has let go
            self.close()
            return
        self.session.stop("the window is closed")
        self.closing.say("Stopping", "The coil goes to 0 mA and is read back.")
        QTimer.singleShot(OFF_TIMEOUT, self._off_late)

    def _close_when_off(self) -> None:
        if not self._leaving or self.session.occupied:
            return
        if self.session.state is not WindowState.FAULT:
            self.close()
        else:
            self.closing.hide()  # the banner has to be read
        self._leaving = False

    def _off_late(self) -> None:
        if self._leaving and self.session.busy:
            self.closing.say(
                "COIL STATE UNKNOWN",
                "The source did not confirm within 3 s that it is off. Switch it off "
                "at its front panel. The window closes when the run has ended.",
            )

    # --- events

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Fold what does not fit."""
        super().resizeEvent(event)
        width = self.width()
        self.centre.show_room(width, self.height())
        for side, limit in ((self.review, NARROW + 40), (self.setup, 0)):
            if self._folds[side] is None:
                side.setVisible(width >= limit)
        if width < NARROW and self.setup.isVisible():  # whatever was unfolded by hand
            self.review.setVisible(False)
        self._show_folds()

    def focusNextPrevChild(self, forward: bool) -> bool:
        """Tab goes as one reads; below an open card it reaches the header only."""
        cards = [one for one in self.findChildren(Overlay) if one.isVisible()]
        if cards:
            card = cards[-1].card
            return move_on([card, self.header], card, forward=forward)
        self.interrupted.mind()
        return move_on([self.page], self.page, forward=forward)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Take the single-key shortcuts, but none meant for a field that has gone."""
        if not (self.interrupted.takes(event) or self.actions_.take_key(event)):
            super().keyPressEvent(event)

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take scenes and runs."""
        if event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open what was dropped."""
        for url in event.mimeData().urls()[:1]:
            self.screen_.open_path(Path(url.toLocalFile()))
        event.acceptProposedAction()

    # --- assembly

    def _bench_changed(self) -> bool:
        spec = self.session.bench.spec
        changed = spec is not getattr(self, "_shown_spec", 0)
        self._shown_spec = spec
        return changed

    def _connect(self) -> None:
        session = self.session
        session.status.changed.connect(self.render_state)
        self.screen_.changed.connect(self.render_state)
        self.frames.told.connect(self.render_clock)
        self.frames.told.connect(self._habits.mind_coil)
        self.actions_.fold_asked.connect(self.fold)
        self.actions_.lanes_asked.connect(self.part_lanes)
        sides = (self.setup, self.review)
        self.header.unfold_asked.connect(lambda n: self.fold(sides[n], False))
        for line in session.log.lines:  # the bench may have been asked already
            self.centre.log.add(line)
        session.log.added.connect(self.centre.log.add)
        session.log.told.connect(self.centre.say)
        self.setup.star.asked.connect(self.runs.confirm.ask)
        session.plan.arrived.connect(self.screen_.plan_arrived)
        session.source_changed.connect(self.screen_.follow_run)
        session.run.trial_ended.connect(self.screen_.trial_ended)
        session.run.ended.connect(self.screen_.run_ended)
        session.run.cut.connect(self.screen_.run_cut)
        session.run.reported.connect(self.screen_.reported)
        self.header.stop.clicked.connect(lambda: session.stop())
        self.banner.acknowledged.connect(session.acknowledge)
        self.banner.switched_off.connect(session.take_as_off)
        self.banner.log_asked.connect(self.centre.show_safety)
        self.centre.empty.simulated_asked.connect(lambda: session.connect_bench("sim"))
        self.centre.empty.again_asked.connect(session.connect_again)
        self.centre.empty.open_asked.connect(self.screen_.ask_scene)
        self.centre.empty.connect_asked.connect(self.actions_.connect_dialog)
        self.centre.empty.recent_asked.connect(self.screen_.open_run)
        self.closing.stopped.connect(self.leave)
        self.centre.tools.export_asked.connect(self.actions_.export_view)
        self.centre.tools.monitor.clicked.connect(session.show_monitor)
        self.centre.monitor_bar.record_asked.connect(session.record)
        self.centre.monitor_bar.closed.connect(lambda: session.show_monitor(False))
        session.monitor.recorded.connect(lambda folder: self.screen_.list_runs())
        self.setup.scene_wanted.connect(self.screen_.ask_scene)
        manual = self.review.manual
        manual.begun.connect(session.begin_manual)
        manual.field_asked.connect(session.read_field)
        manual.inputs.asked.connect(self._set_inputs)
        manual.set_asked.connect(session.manual.hold)
        manual.off_asked.connect(lambda: session.stop("manual off"))
        manual.checked.connect(
            lambda: session.connect_bench(session.bench.choice or "sim")
        )

    def _set_inputs(self, channels: str) -> None:
        problem = self.session.set_inputs(channels)
        self.review.manual.inputs.say(problem)
        if not problem:
            self.setup.plan_now()

    def _lay_out(self) -> None:
        page = self.page
        page.setObjectName("page")
        page.setFocusPolicy(Qt.FocusPolicy.ClickFocus)
        whole = column(page, spacing=0)
        whole.addWidget(self.header)
        below = QWidget()
        inner = column(below, margin=8, spacing=8)
        inner.addWidget(self.banner)
        for part in (self.setup, self.centre, self.review):
            self.columns.addWidget(part)
        self.columns.setStretchFactor(0, 0)
        self.columns.setStretchFactor(1, 1)
        self.columns.setStretchFactor(2, 0)
        self.columns.setSizes([316, 1100, 362])
        self.columns.setHandleWidth(8)
        self.columns.setChildrenCollapsible(False)
        inner.addWidget(self.columns, 1)
        whole.addWidget(below, 1)
        self.setCentralWidget(page)
        self.resize(1720, 1080)
        if self._settings is not None:
            for name, restore in (
                ("geometry", self.restoreGeometry),
                ("columns", self.columns.restoreState),
                ("centre", self.centre.splitter.restoreState),
            ):
                kept = self._settings.value(name)
                if kept is not None:
                    restore(kept)
            if self._settings.value("apart", False, bool):
                QTimer.singleShot(0, self.part_lanes)
