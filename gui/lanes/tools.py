"""The bar above the lanes: follow, width, fit, zoom, cursors, model, residual."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QPoint, Qt, Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLabel, QSizePolicy, QWidget

from gui.lanes.compare import MARKS
from gui.lanes.stack import LaneStack
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.parts import IconButton, Segments, bar
from gui.plots.numbers import decimals
from gui.popup_menu import Menu
from tactile_lab.quantity import show

WIDTHS = (1.0, 5.0, 10.0)

SPACING, AROUND = 5, 33
"""Between two buttons, and beside all of them with the gap among them, px."""

WIDE = 1150
"""Width from which on there is room for words and the read-out of the cursors, px.

The same with cursors and without: no button moves away under the pointer.
"""


class _ReadOut(QLabel):
    """Says as much of the cursors as there is room for: buttons come and go beside."""

    resized = Signal()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Tell that there is more room, or less."""
        super().resizeEvent(event)
        self.resized.emit()


class Tools(QWidget):
    """Buttons that change the view, and the cursors' times as text."""

    export_asked = Signal()

    def __init__(self, stack: LaneStack, view: TimeView, theme: Theme) -> None:
        super().__init__()
        self._stack, self._view, self._theme = stack, view, theme
        self.follow = self._toggle("follow", "Follow the newest data (F)", "Follow")
        self.freeze = self._toggle(
            "freeze", "Freeze the display; acquisition goes on (Space)"
        )
        self.widths = Segments(["1 s", "5 s", "10 s", "Run"], "Visible time")
        self.fit = IconButton(theme, "fit", "Fit the whole run (A)")
        self.zoom = self._toggle("zoom", "Zoom to a box (Z)")
        self.cursors = self._toggle("cursors", "Cursors A and B (C)", "Cursors")
        self.twin = self._toggle("twin", "Show what the model expects (M)", "Model")
        self.residual = self._toggle(
            "residual", "Show measured less model (Shift+M)", "Residual"
        )
        self.monitor = self._toggle(
            "eye",
            "Monitor: watch the sensor between runs, coil off (Ctrl+M)",
            "Monitor",
        )
        self.lanes = IconButton(theme, "layers", "Choose lanes (L)")
        self.export = IconButton(theme, "export", "Export this view (Ctrl+E)")
        self.help = IconButton(theme, "help", "Help on the lanes (F1 from a lane)")
        self.readout = _ReadOut()
        self._lay_out()
        self._connect()

    def _toggle(self, icon: str, tip: str, text: str = "") -> IconButton:
        return IconButton(
            self._theme, icon, tip, text=text, role="toggle", checkable=True
        )

    def set_width(self, width: int) -> None:
        """Text beside the icons where there is room, else icons alone."""
        wide = width > WIDE
        for button in self.findChildren(IconButton):
            button.set_wide(wide)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Leave out what there is no room for."""
        super().resizeEvent(event)
        self.set_width(self.width())
        self._leave_out()

    def _leave_out(self) -> None:
        """Leave out, one by one, buttons whose keys the help and the menu tell."""
        buttons = self.findChildren(IconButton)
        needed = self.widths.sizeHint().width() + AROUND
        needed += sum(one.sizeHint().width() + SPACING for one in buttons)
        for one in (self.help, self.export, self.zoom, self.fit):
            one.setVisible(needed <= self.width())
            if one.isHidden():
                needed -= one.sizeHint().width() + SPACING

    def toggle_cursors(self, on: bool) -> None:
        """Put the cursors into view, or take them away."""
        if on and self._view.cursors is None:
            start, width = self._view.start, self._view.width
            self._view.place_cursors(start + 0.35 * width, start + 0.65 * width)
        elif not on:
            self._view.clear_cursors()

    def show_monitor(self, *, on: bool) -> None:
        """Whether the sensor is being watched."""
        if self.monitor.isChecked() is not on:
            self.monitor.setChecked(on)

    def show_possible(self, *, growing: bool) -> None:
        """Offer what means something for what the lanes show; `growing`: it goes on."""
        model = self._stack.source.has_model
        if not growing and self.freeze.isChecked():
            self.freeze.setChecked(False)  # it could not be taken back
        for button, possible in (
            (self.follow, growing),
            (self.freeze, growing),
            (self.twin, model),
            (self.residual, model and self._stack.row("residual") is not None),
        ):
            if button.isEnabled() is not possible:
                button.setEnabled(possible)

    def bring(self, which: int) -> None:
        """Bring cursor A (0) or B (1) to the middle of the view."""
        if self._view.cursors is None:
            self.toggle_cursors(True)
        self._view.move_cursor(which, self._view.start + self._view.width / 2)

    def _connect(self) -> None:
        self.follow.clicked.connect(self._view.set_follow)
        self._view.follow_changed.connect(self.follow.setChecked)
        self._view.changed.connect(self._mark_width)
        self.widths.group.idClicked.connect(self._width_chosen)
        self.fit.clicked.connect(self._view.show_all)
        self.zoom.toggled.connect(self._box)
        self._stack.scene.box_zoomed.connect(self._boxed)
        self.cursors.clicked.connect(self.toggle_cursors)
        self.twin.toggled.connect(self._twin)
        self.residual.toggled.connect(self._residual)
        self.lanes.clicked.connect(self._choose_lanes)
        self.export.clicked.connect(self.export_asked)
        self._stack.export_asked.connect(self.export_asked)
        self._view.cursors_changed.connect(self.show_cursors)
        self.readout.resized.connect(self.show_cursors)
        self.follow.setChecked(True)
        self.widths.choose(1)
        self.twin.setChecked(True)
        self.residual.setChecked(True)

    def _width_chosen(self, number: int) -> None:
        if number == len(WIDTHS):
            self._view.show_all()
        else:
            self._view.set_width(WIDTHS[number])

    def _mark_width(self) -> None:
        """Mark the button of the visible time, if it is one of theirs."""
        view, marked = self._view, -1
        for number_, width in enumerate(WIDTHS):
            if abs(view.width - width) < 1e-6 * width:
                marked = number_
        whole = max(view.length, view.now)
        if marked < 0 and view.start == 0.0 and abs(view.width - whole) < 0.05 * whole:
            marked = len(WIDTHS)
        if marked != self.widths.chosen:
            self.widths.choose(marked)

    def _box(self, on: bool) -> None:
        self._stack.stage.zoom_box = on

    def _boxed(self, start: float, end: float) -> None:
        self.zoom.setChecked(False)
        self._view.show_span(start, end - start)

    def _twin(self, on: bool) -> None:
        self._stack.stage.twin = on
        self._stack.refresh()

    def _residual(self, on: bool) -> None:
        self._stack.show_residual = on
        self._stack.arrange()

    def _choose_lanes(self) -> None:
        menu = Menu(self)
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        for row in self._stack.rows:
            key = row.lane.key
            one = menu.addAction(row.lane.name)
            one.setCheckable(True)
            one.setChecked(not self._stack.is_hidden(key))
            one.toggled.connect(lambda on, key=key: self._stack.hide_lane(key, not on))
        menu.popup(self.lanes.mapToGlobal(QPoint(0, self.lanes.height())))

    def show_cursors(self) -> None:
        """Times of A and B, their difference, and the mean rate between, as text."""
        cursors = self._view.cursors
        self.cursors.setChecked(cursors is not None)
        if cursors is None:
            self.readout.setText("")
            return
        tokens = self._theme.tokens
        low, high = sorted(cursors)
        places = min(6, max(2, decimals(self._view.width / 2000)))
        spikes = self._stack.source.spikes
        count = int(np.diff(np.searchsorted(spikes, [low, high]))[0])
        span = high - low
        whose = f"{MARKS[0]} " if len(self._stack.source.members) > 1 else ""
        told = span > 0 and not self._stack.source.why_unrated(low, high)
        rate = f" · {whose}<b>{count / span:.3g} Hz</b>" if told else ""
        boxes = [
            f'<span style="background:{colour};color:{tokens.on_accent};'
            f'font-weight:700">&nbsp;{name}&nbsp;</span> <b>{time:.{places}f} s</b>'
            for name, time, colour in zip(
                "AB", cursors, (tokens.accent, tokens.V_C1), strict=True
            )
        ]
        apart = f"Δt <b>{show(span, 's')}</b>"
        between = apart + rate
        whole = f"{boxes[0]} &nbsp; {boxes[1]} &nbsp; {between}"
        self.readout.setToolTip(whole)
        for words in (whole, between, apart):
            self.readout.setText(words)
            if self.readout.sizeHint().width() <= self.readout.width():
                break

    def _lay_out(self) -> None:
        views = (self.follow, self.freeze, self.widths, self.fit, self.zoom)
        shown = (self.cursors, self.twin, self.residual)
        rest = (self.monitor, self.lanes, self.export, self.help)
        bar(self, (10, 7, 10, 7), SPACING, *views, *shown, 8, (self.readout, 1), *rest)
        self.readout.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Fixed)
        self.readout.setAccessibleName("Cursors")
