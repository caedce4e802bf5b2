"""The frame loop: polls the session, repaints what moved, keeps to its budget.

Lanes, numbers and what a step's end lays out anew take turns: all in one, the longest
frame was twice the usual one, and a press of STOP waited as long.
"""

from __future__ import annotations

import time

from PySide6.QtCore import QObject, Qt, QTimer, Signal

from gui.lanes.live import LiveSource
from gui.screen.panels import Panels
from gui.screen.screen import Screen
from gui.session.session import BY_HAND, MONITOR

FAST, SLOW = 33, 100
"""Milliseconds between frames, at least and at most."""

NUMBERS = 0.1
"""Seconds between updates of the numbers: faster cannot be read."""

BUDGET = 0.3
"""Share of a core that this thread may take before frames come less often."""

MUCH = 0.2
"""Share of a usual frame from which what was told comes first, lanes a frame later."""

USUAL, STEP = 0.1, 2
"""Weight of the newest frame in the usual cost; finest change of the interval, ms."""

UNKEPT = {
    MONITOR: "Monitor: only Record keeps what is seen",
    BY_HAND: "By hand: nothing of it is kept",
}
"""What stands below the lanes where no run is in them."""


class FrameLoop(QObject):
    """Moves what is on screen.

    Attributes:
        frozen: whether the lanes stand still.
        behind: whether lanes wait for the next frame to show what was told.
        between: runs out halfway to the next frame where numbers are to be shown.
    """

    told = Signal(object)
    """The newest snapshot, as often as numbers can be read."""

    def __init__(self, panels: Panels, screen: Screen) -> None:
        super().__init__(panels.centre)
        self._panels, self._screen = panels, screen
        self.frozen = False
        self._numbers = self._drawn = 0.0
        self._used, self._usual = time.thread_time(), 0.0
        self.behind = False
        self._timer = QTimer(self)
        self._timer.setTimerType(Qt.TimerType.PreciseTimer)
        self._timer.timeout.connect(self.tick)
        self._timer.start(FAST)
        self.between = QTimer(self)
        self.between.setSingleShot(True)
        self.between.timeout.connect(self.show_numbers)
        panels.centre.tools.freeze.toggled.connect(self.freeze)

    def freeze(self, on: bool) -> None:
        """Let the lanes stand still; acquisition goes on, and they catch up later."""
        self.frozen = on
        live = self._screen.live
        if live is not None:
            shown = live.frozen() if on else live
            self._panels.centre.stack.exchange_source(shown)
            self._show_newest(shown)

    @property
    def interval(self) -> int:
        """From one frame to the next, ms."""
        return self._timer.interval()

    def stop(self) -> None:
        """End the loop."""
        self._timer.stop()
        self.between.stop()

    def tick(self) -> None:
        """One frame."""
        self._keep_budget()
        panels, session = self._panels, self._panels.session
        self.behind |= session.poll()
        much = time.thread_time() - self._used > MUCH * self._usual
        for stop in panels.stops:
            left = session.status.coil.left_unknown
            stop.show_coil(session.state, session.coil_view(), left)
        now = time.monotonic()
        source, seen = self._screen.live, not panels.centre.lanes.window().isMinimized()
        late = now - self._drawn >= SLOW / 1e3
        if source is not None and self.behind and (late or not much):
            self.behind = False
            if seen and not self.frozen:
                self._drawn = now
                self._show_newest(source)
        self._screen.take_fetched()
        if now - self._numbers >= NUMBERS:
            self._numbers = now
            self.between.start(self.interval // 2)

    def _show_newest(self, source: LiveSource) -> None:
        centre = self._panels.centre
        centre.view.set_now(source.reach, source.length)
        centre.stack.refresh()

    def show_numbers(self) -> None:
        """Tell the newest numbers, on cards and in the lines below and above."""
        panels, session = self._panels, self._panels.session
        snapshot = session.snapshot()
        self.told.emit(snapshot)
        self._show_monitor()
        source = self._screen.live
        if source is not None:
            if not self.frozen:
                panels.centre.stack.show_values()
            planned = source.preview.holds if source.preview else []
            holds = planned if source.running and planned else source.holds
            unkept = session.unkept
            ending = UNKEPT[unkept] if unkept else self._screen.ending
            trial = session.run.trial
            panels.centre.progress.show_run(
                snapshot,
                holds,
                source.length,
                source.reach,
                trial,
                ending,
                kept=not unkept,
            )
            panels.setup.show_head(source.reach if session.state.in_run else None)
        else:
            panels.centre.progress.show_beginning(snapshot, session.run.title)

    def _show_monitor(self) -> None:
        panels, monitor = self._panels, self._panels.session.monitor
        bar = panels.centre.monitor_bar
        if monitor.alive:
            bar.show_sensor(monitor.sensor, recording=monitor.recording)
        elif bar.isVisible():
            bar.hide()
        panels.centre.tools.show_monitor(on=monitor.alive)
        # also once it has ended: results of a run would lie beside lanes of none
        seen = panels.centre.stack.source.of is monitor.source
        panels.review.show_monitor(on=monitor.alive or seen)

    def _keep_budget(self) -> None:
        """Come as often as the budget allows: painting counts, waiting does not."""
        used = time.thread_time()
        cost = min(used - self._used, SLOW / 1e3)  # one that hung is not usual
        self._used = used
        self._usual += USUAL * (cost - self._usual)
        wanted = round(min(max(1e3 * self._usual / BUDGET, FAST), SLOW))
        # to set it begins the interval anew
        if abs(wanted - self.interval) >= STEP:
            self._timer.setInterval(wanted)
