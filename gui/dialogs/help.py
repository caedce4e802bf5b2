"""Help: what each panel is for, and every shortcut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pyqtgraph
import PySide6
from PySide6.QtCore import Qt, qVersion
from PySide6.QtWidgets import QGridLayout, QLabel, QLayout, QStackedWidget, QWidget

from gui.dialogs.overlay import Overlay
from gui.parts import (
    STRETCH,
    Segments,
    column,
    label,
    push,
    row,
    scrolling,
    with_gutter,
)
from tactile_lab.engine.provenance import environment
from tactile_lab.notebook import facts

PANELS = (
    (
        "STOP",
        "Top right, always enabled; Esc or F12. It goes straight to the coil's own "
        "thread: 0 A, output off, read back. Its words come from the read-back. "
        "<b>COIL STATE UNKNOWN</b> (yellow and black) is worse than live: switch the "
        "source off at its front panel. Only hardware is a real interlock.",
    ),
    (
        "Protocol",
        "Choose a protocol; its form is made from its typed parameters. A blue mark "
        "is a value changed from its default, red says why a value cannot be used. The "
        "star keeps the parameters under a name, as a scene in the folder presets. The "
        "form is yours during a run, too: change it and queue the next one; a line "
        "above it says what it shows. The "
        "preview is the force as the coil will really play it; below the form stands "
        "what the run costs.",
    ),
    (
        "Queue",
        "Queue has a run wait for its turn; so does a scene or a run dropped while one "
        "is in progress. Where nothing is, <b>Start the queue</b> begins. Waiting "
        "runs show their cost and can be moved and taken out. A "
        "click, or Enter, puts one's parameters into the form, also during a run; "
        "<b>Save to queue</b> replaces them at its place. After a STOP or a fault the "
        "queue is held until you resume it.",
    ),
    (
        "Lanes",
        "Colour: measured, thin grey: what the model expects, also ahead of now. V_C1, "
        "V_C2 and V_K show the mean of each pixel column over a tint of its extremes, "
        "so that nothing is hidden. Wheel zooms, Shift+wheel or dragging pans, double "
        "click shows all. On its axis, or with Ctrl, the wheel zooms the values of a "
        "lane; a drag there moves them, a double click makes it automatic again. "
        "A right click has what else a lane can do, Backspace goes back to the view "
        "before. By keyboard, Tab to the card of a lane: up and down go to the next, "
        "with Shift they move it, with Ctrl they zoom its values, Page Up and Down "
        "move them, Enter opens its menu. What the scene does not record has no lane. "
        "The residual is measured V_C1 less the model's; the green band is ±50 mV.",
    ),
    (
        "Monitor",
        "Between runs: V_C1, V_C2, the rate and the distance to the threshold with the "
        "coil off, for trimming V_GS by hand. Record keeps what was seen, up to the "
        "last 60 s, as a run. Results shows the noise meanwhile: its density, its rms "
        "value, and what the mains put into it, of 50 or 60 Hz and their multiples.",
    ),
    (
        "Steps and log",
        "One block per step, with the time left. The log tells what happened; filter "
        "it, or add a note: it is stamped with the run's time and kept with the run. "
        "A click, or the arrow keys, open a long line in full; Ctrl+C copies it.",
    ),
    (
        "Results",
        "Fits are preliminary while the run lasts: the force of onset, the slope of "
        "the peak rate, the adaptation's time constant and the fall in the hold, each "
        "beside the model's. Bars tell how far the run is from the model: the root "
        "mean square over the range of each voltage (NRMSE), and the median offset of "
        "spikes. The header's Model chip has that of V_C1: in step while the residual "
        "keeps to its band by and large, else beside the run.",
    ),
    (
        "Runs",
        "Enter or double click opens a run in the same lanes; the one on screen has an "
        "eye. Re-run puts its settings into the form, or into the queue while a run is "
        "in progress. Tick two or three to compare them: stacked, laid over each "
        "other, or less the first; aligned by start, by step, or by cursor A.",
    ),
    (
        "Manual",
        "Drives the coil within its limits, reads the field, and sets range, offset "
        "and coupling of the scope's inputs for all runs that follow. If this window "
        "hangs for 2 s, the coil is switched off.",
    ),
    (
        "Spikes",
        "Next and Previous go from spike to spike, in the lanes too. The first plot "
        "lays the stored samples of up to 100 spikes over each other where they cross "
        "the threshold; below it is how often each interval comes, and how intervals "
        "follow each other. Silences are no intervals. Choose whether all spikes "
        "count, those in view, or those between the cursors.",
    ),
    (
        "Connect instruments",
        "Asks ports and devices for their names, suggests driver and row, tests, and "
        "saves a bench file. Its other pages run the wiring check and the field "
        "calibration, show verdicts and loop, and put the calibration into the bench. "
        "Where a person moves probes or reads the teslameter, the run asks and waits.",
    ),
    (
        "Command line",
        "Everything the window does has a command: menu, Copy command line.",
    ),
)
"""Title and text of each topic; panels open the help at theirs."""

LICENCES = (
    "MIT licence. The sensor and its equations are from Birkoben et al., Scientific "
    "Reports 2020, CC BY 4.0. Qt and PySide6 are used under the LGPL 3, pyqtgraph "
    "under the MIT licence, the typeface Inter under the SIL Open Font License 1.1."
)


class Help(Overlay):
    """Two pages: panels and shortcuts, given as (keys, words)."""

    def __init__(self, window: QWidget, keys: Sequence[tuple[str, str]]) -> None:
        super().__init__(window, 760)
        self.topic = ""
        self._titles: dict[str, QLabel] = {}
        choice = Segments(["Panels", "Shortcuts", "About"], "Help page")
        choice.group.idClicked.connect(self._show)
        self._choice = choice
        self.close_button = push("Close", "primary")
        self.close_button.clicked.connect(self.hide)
        self._pages = QStackedWidget()
        self.give_room(self._pages, 430)
        areas = [
            with_gutter(scrolling(page), inside)
            for page, inside in (self._panels(), self._shortcuts(keys), self._about())
        ]
        self._area = areas[0]
        for area in areas:
            self._pages.addWidget(area)
        head = row(label("Help", "big"), STRETCH, choice)
        foot = row(STRETCH, self.close_button)
        column(self.card, head, self._pages, foot, margin=22, spacing=14)
        self._show(0)

    def show_topic(self, topic: str, page: int = 0) -> None:
        """Open a page, the first at a topic; "" is its start."""
        self.topic = topic
        self._show(page)
        title = self._titles.get(topic)
        top = 0 if title is None else title.y()
        self._area.verticalScrollBar().setValue(top)

    def _show(self, number: int) -> None:
        self._choice.choose(number)
        self._pages.setCurrentIndex(number)

    def _panels(self) -> tuple[QWidget, QLayout]:
        page = QWidget()
        rows = column(page, spacing=4)
        for title, text in PANELS:
            self._titles[title] = label(title, "title")
            rows.addWidget(self._titles[title])
            words = label(text, "", wrap=True)
            words.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
            rows.addWidget(words)
            rows.addSpacing(8)
        rows.addStretch(1)
        return page, rows

    def _about(self) -> tuple[QWidget, QLayout]:
        """Which versions of what this is."""
        page = QWidget()
        drawn = {"Qt": qVersion(), "PySide6": PySide6.__version__}
        drawn["pyqtgraph"] = pyqtgraph.__version__
        found = facts("Tactile Lab", _flat({**environment(), **drawn}))
        said = label(f"{found}<p>{LICENCES}</p>", "", wrap=True)
        said.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        return page, column(page, said, STRETCH)

    def _shortcuts(self, own: Sequence[tuple[str, str]]) -> tuple[QWidget, QLayout]:
        page = QWidget()
        grid = QGridLayout(page)
        grid.setHorizontalSpacing(24)
        grid.setVerticalSpacing(5)
        listed = [("Esc, F12", "STOP: coil off"), *own]
        listed += [("Wheel", "Zoom time"), ("Shift+wheel", "Pan")]
        half = -(-len(listed) // 2)
        for number, (keys, words) in enumerate(listed):
            at, side = number % half, 2 * (number // half)
            grid.addWidget(label(keys, "strong"), at, side)
            grid.addWidget(label(words, wrap=True), at, side + 1)
            grid.setColumnStretch(side + 1, 1)
        grid.setRowStretch(half, 1)
        return page, grid


def _flat(found: Mapping[str, Any]) -> list[tuple[str, object]]:
    """A mapping of mappings as rows."""
    rows: list[tuple[str, object]] = []
    for name, value in found.items():
        rows += _flat(value) if isinstance(value, Mapping) else [(name, value)]
    return rows


def show_help(
    window: QWidget, keys: Sequence[tuple[str, str]], topic: str = "", page: int = 0
) -> None:
    """Open a page of the help, the first at a topic."""
    found = window.findChild(Help)
    shown = found if isinstance(found, Help) else Help(window, keys)
    shown.open()
    shown.show_topic(topic, page)
    shown.close_button.setFocus()
