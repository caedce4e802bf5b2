"""Help: what each panel is for, and every shortcut."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QWidget

from gui.dialogs.overlay import Overlay
from gui.parts import Segments, column, label, push, scrolling

PANELS = (
    (
        "STOP",
        "Top right, always enabled; Esc or F12. It goes straight to the coil's own "
        "thread: 0 A, output off, read back. Its words come from the read-back. "
        "<b>COIL STATE UNKNOWN</b> (yellow and black) is worse than live: switch the "
        "source off at its front panel. Only hardware is a real interlock.",
    ),
    (
        "Protocol (left)",
        "Choose a protocol; its form is made from its typed parameters. A blue mark "
        "is a value changed from its default, red says why a value cannot be used. The "
        "form is locked while running; Queue has a run follow. The preview is the "
        "force as the coil will really play it.",
    ),
    (
        "Lanes (centre)",
        "Colour: measured, thin grey: what the model expects, also ahead of now. V_C1, "
        "V_C2 and V_K show the mean of each pixel column over a tint of its extremes, "
        "so that nothing is hidden. Wheel zooms, Shift+wheel or dragging pans, double "
        "click shows all. What the scene does not record has no lane.",
    ),
    (
        "Residual",
        "Measured V_C1 less the model's, averaged; the green band is ±50 mV.",
    ),
    (
        "Results, Runs, Manual (right)",
        "Results are preliminary while the run lasts. Runs opens old runs in the same "
        "lanes, runs them again or compares two or three. Manual drives the coil by "
        "hand within its limits; if this window hangs, the coil is switched off.",
    ),
    (
        "Command line",
        "Everything the window does has a command: menu, Copy command line.",
    ),
)


class Help(Overlay):
    """Two pages: panels and shortcuts, given as (keys, words)."""

    def __init__(self, window: QWidget, keys: Sequence[tuple[str, str]]) -> None:
        super().__init__(window, 640)
        self._pages = (self._panels(), self._shortcuts(keys))
        choice = Segments(["Panels", "Shortcuts"], "Help page")
        choice.group.idClicked.connect(self._show)
        self._choice = choice
        self.close_button = push("Close", "primary")
        self.close_button.clicked.connect(self.hide)
        head = QHBoxLayout()
        head.addWidget(label("Help", "big"))
        head.addStretch(1)
        head.addWidget(choice)
        foot = QHBoxLayout()
        foot.addStretch(1)
        foot.addWidget(self.close_button)
        whole = column(self.card, margin=22, spacing=14)
        whole.addLayout(head)
        self._areas = [scrolling(page) for page in self._pages]
        for area in self._areas:
            area.setMinimumHeight(430)
            whole.addWidget(area)
        whole.addLayout(foot)
        self._show(0)

    def _show(self, number: int) -> None:
        self._choice.choose(number)
        for at, area in enumerate(self._areas):
            area.setVisible(at == number)

    def _panels(self) -> QWidget:
        page = QWidget()
        rows = column(page, spacing=4)
        for title, text in PANELS:
            rows.addWidget(label(title, "title"))
            words = label(text, "", wrap=True)
            words.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            rows.addWidget(words)
            rows.addSpacing(8)
        rows.addStretch(1)
        return page

    def _shortcuts(self, own: Sequence[tuple[str, str]]) -> QWidget:
        page = QWidget()
        grid = QGridLayout(page)
        grid.setHorizontalSpacing(24)
        grid.setVerticalSpacing(5)
        listed = [("Esc, F12", "STOP: coil off"), *own]
        listed += [("Wheel", "Zoom time"), ("Shift+wheel", "Pan")]
        half = -(-len(listed) // 2)
        for number, (keys, words) in enumerate(listed):
            row, side = number % half, 2 * (number // half)
            grid.addWidget(label(keys, "strong"), row, side)
            grid.addWidget(label(words), row, side + 1)
        grid.setRowStretch(half, 1)
        return page


def show_help(window: QWidget, keys: Sequence[tuple[str, str]]) -> None:
    """Open the help."""
    found = window.findChild(Help)
    shown = found if isinstance(found, Help) else Help(window, keys)
    shown.open()
    shown.close_button.setFocus()
