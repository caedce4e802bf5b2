"""The header: identity and SIM badge, instrument chips, state and clock, STOP."""

from __future__ import annotations

from functools import partial

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QFont, QResizeEvent
from PySide6.QtWidgets import QFrame, QLabel

from gui.header.chip import Chip, ChipDetail
from gui.header.stop import StopButton
from gui.look import tokens as look
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import STRETCH, Elided, IconButton, bar, filled, label, lines, row
from gui.state import Snapshot, WindowState, clock_text

_CLOCK_COLOURS = {
    WindowState.DISCONNECTED: look.LAMP_GREY,
    WindowState.CONNECTING: look.LAMP_AMBER,
    WindowState.READY: look.LAMP_GREEN,
    WindowState.RUNNING: look.LAMP_BLUE,
    WindowState.ABORTING: look.LAMP_AMBER,
    WindowState.FAULT: look.LAMP_RED,
}


ROOMS = (
    (ChipDetail.FULL, False),
    (ChipDetail.SHORT, False),
    (ChipDetail.BARE, False),
    (ChipDetail.BARE, True),
    (ChipDetail.LAMP, True),
)
"""What is tried, the widest first: room of each chip, and whether all stands closer."""

WHOLE, SHORT, LEAST = 190, 120, 40
"""Widths of the title, px: that of a run's name, a short one's, and the least."""


class Header(QFrame):
    """Dark in both themes, 68 px high."""

    picture_asked = Signal()
    menu_asked = Signal()
    help_asked = Signal()
    unfold_asked = Signal(int)
    """Unfold a side panel: 0 the left one, 1 the right one."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.setProperty("role", "header")
        self.setFixedHeight(68)
        self.setAccessibleName("Header")
        self.stop = StopButton()
        self.badge = label("SIMULATED BENCH", "sim")
        self.badge.setAccessibleName("This bench is simulated")
        self._name = label("Tactile Lab", "hidentity")
        self._title = Elided("", "hsub")
        self._title.setMinimumWidth(WHOLE)
        self._state = QLabel()
        self._state.setMinimumWidth(112)
        self._clock = label("", "hsub")
        self._chips: list[Chip] = []
        self._shown: WindowState | None = None
        self._coloured = ""
        self._chip_row = row(spacing=6)
        self._buttons = [
            IconButton(theme, name, words, role="hflat", on_header=True)
            for name, words in (
                ("camera", "Copy a picture of the window (Ctrl+Shift+C)"),
                ("settings", "Menu"),
                ("help", "Help and shortcuts (?)"),
            )
        ]
        asks = (self.picture_asked, self.menu_asked, self.help_asked)
        for button, asked in zip(self._buttons, asks, strict=True):
            button.clicked.connect(asked)
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.folds = [
            IconButton(theme, icon, words, role="hflat", on_header=True)
            for icon, words in (
                ("panel-left", "Show protocol and form (F7)"),
                ("panel-right", "Show results, runs and manual control (F8)"),
            )
        ]
        for number, button in enumerate(self.folds):
            button.clicked.connect(partial(self.unfold_asked.emit, number))
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            button.hide()
        self._lay_out()

    def show_folded(self, *folded: bool) -> None:
        """Offer the side panels that are folded: the left one, the right one."""
        for button, offered in zip(self.folds, folded, strict=True):
            button.setVisible(offered)
        self._fit_anew()

    @property
    def chips(self) -> list[Chip]:
        """Chips of the instruments in use."""
        return [chip for chip in self._chips if not chip.isHidden()]

    @property
    def menu_button(self) -> IconButton:
        """The button below which the menu opens."""
        return self._buttons[1]

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Show as much of the chips as fits."""
        super().resizeEvent(event)
        self._fit_anew()

    def _fit_anew(self) -> None:
        for chip in self._chips:
            chip.forget_width()
        self._fit()

    def _fit(self) -> None:
        """Chips at their widest that fit; where it is narrow, no minor button."""
        layout = self._row
        for room, tight in ROOMS:
            for chip in self._chips:
                chip.show_room(room)
            bare = room >= ChipDetail.BARE
            self._buttons[0].setVisible(room is ChipDetail.FULL)
            self._buttons[2].setVisible(not bare)
            self._name.setVisible(not bare)  # six chips, and it is no news
            self._logo.setVisible(not tight)
            self._chip_row.setSpacing(2 if tight else 6)
            layout.setSpacing(6 if tight else 11)
            least = {ChipDetail.FULL: WHOLE, ChipDetail.SHORT: SHORT}.get(room, LEAST)
            self._title.setMinimumWidth(least)
            self.badge.setText("SIMULATED BENCH" if room is ChipDetail.FULL else "SIM")
            layout.invalidate()
            layout.activate()  # nested ones, too
            spare = self.width() - layout.minimumSize().width()
            if spare >= 0:
                self._title.setMinimumWidth(min(WHOLE, least + spare))
                layout.activate()  # else the next picture has the title under a chip
                return

    def render_snapshot(self, snapshot: Snapshot) -> None:
        """Render identity, chips, clock and STOP."""
        self.badge.setVisible(snapshot.simulated)
        self._title.set_whole(snapshot.heading, end=snapshot.title)
        bench = f"Bench: {snapshot.bench}" if snapshot.bench else "No bench"
        self._title.setToolTip(f"{snapshot.heading}\n{bench}")
        while len(self._chips) < len(snapshot.instruments):
            chip = Chip()
            self._chips.append(chip)
            self._chip_row.addWidget(chip)
        if snapshot.state is not self._shown:
            self._shown = snapshot.state
            self._fit_anew()
        wider = False
        for number, chip in enumerate(self._chips):
            used = number < len(snapshot.instruments)
            wider |= used and chip.isHidden()
            chip.setVisible(used)
            if used:
                wider |= chip.show_instrument(snapshot.instruments[number])
        if wider:
            self._fit()
        word, clock = clock_text(snapshot)
        colour = _colour(snapshot)
        if (word, colour) != (self._state.text(), self._coloured):
            self._coloured = colour
            self._state.setText(word)
            self._state.setStyleSheet(
                f"color: {colour}; font-weight: 700; font-size: 15px;"
            )
        if self._clock.text() != clock:
            self._clock.setText(clock)
        self._state.setAccessibleName(f"{word}, {clock}")
        self.stop.show_coil(snapshot.state, snapshot.coil, snapshot.left_unknown)

    def _lay_out(self) -> None:
        self._logo = QLabel()
        self._logo.setPixmap(pixmap("logo", look.LAMP_BLUE, 26))
        self._name.font().setWeight(QFont.Weight.DemiBold)
        first = row(self._name, self.badge, STRETCH, spacing=9)
        words = lines(first, self._title, spacing=3)
        words.setContentsMargins(0, 13, 0, 11)
        clock = lines(self._state, self._clock, spacing=1)
        clock.setContentsMargins(0, 14, 0, 12)
        self._row = bar(
            self, (16, 0, 14, 0), 11, self._logo, words, 8, self._chip_row, STRETCH
        )
        filled(self._row, (*self.folds, *self._buttons, 6, clock, self.stop))


def _colour(snapshot: Snapshot) -> str:
    """Of the state's word: green only where the instruments answered lately."""
    if snapshot.manual:
        return look.LAMP_BLUE
    if snapshot.state is WindowState.READY and not snapshot.known:
        return look.LAMP_AMBER
    return _CLOCK_COLOURS[snapshot.state]
