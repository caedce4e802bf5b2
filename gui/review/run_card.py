"""One run in the list: name, status, when, how long; a tick to compare."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QContextMenuEvent, QKeyEvent, QMouseEvent
from PySide6.QtWidgets import QCheckBox, QFrame, QLabel

from gui.lanes.compare import MARKS
from gui.look.icons import pixmap
from gui.look.theme import Theme
from gui.parts import Elided, bar, label, lines, row, set_role
from gui.review.thumbnails import ThumbnailView
from gui.setup.parameter import listed
from gui.state import minutes
from tactile_lab.store.summary import RunSummary

PILLS = {
    "complete": ("Complete", "pill-ok"),
    "running": ("Running", "pill"),
    "aborted": ("Aborted", "pill-warn"),
    "cut short": ("Cut short", "pill-bad"),
    "data gone": ("Data gone", "pill-bad"),
    "recovered": ("Recovered", "pill-warn"),
    "faulted": ("Faulted", "pill-bad"),
    "unreadable": ("Unreadable", "pill-bad"),
}


class RunCard(QFrame):
    """What is known of a run without opening it.

    Args:
        entry: the run.
        theme: colours.
        apart: in what it differs from other runs of its protocol; "" where in nothing.
    """

    opened = Signal(object)
    chosen = Signal(object)
    ticked = Signal()
    menu_asked = Signal(object, object)
    stepped = Signal(int)
    """The keyboard goes to the run below (1) or above (-1)."""
    paged = Signal(int)
    """The same by as many as are seen."""

    def __init__(self, entry: RunSummary, theme: Theme, apart: str = "") -> None:
        super().__init__()
        self.entry, self._apart = entry, apart
        self.thumbnail = ThumbnailView(theme)
        self.setProperty("role", "run")
        self.setCursor(Qt.CursorShape.PointingHandCursor)
        self.setToolTip(
            "\n".join(
                (
                    *filter(None, (entry.title, apart, entry.name, *told(entry))),
                    "Enter or double click opens it, Space ticks it, a right click "
                    "offers more",
                )
            )
        )
        self.tick = QCheckBox()
        self.tick.setAccessibleName(f"Compare {entry.name}")
        self.tick.setToolTip("Tick two or three runs to compare them")
        self.tick.setFocusPolicy(Qt.FocusPolicy.ClickFocus)  # the card has a key for it
        self.tick.toggled.connect(self.ticked)
        self._mark = label("")
        self._mark.setFixedWidth(14)
        word, role = PILLS.get(entry.status, (entry.status.capitalize(), "pill"))
        star = "★ " if entry.starred else ""
        first = row((Elided(star + (entry.title or entry.name), "strong"), 1))
        first.addWidget(label(word, role), 0, Qt.AlignmentFlag.AlignVCenter)
        kind = {True: "sim", False: "bench", None: "?"}[entry.simulated]
        when = f"{day(entry.started)} · {_length(entry)} · {kind}"
        self._signs = [QLabel(self), QLabel(self)]  # without, one shown is a window
        self._signs[0].setToolTip("On screen")
        self._signs[1].setToolTip("\n".join(entry.notes))
        self._signs[1].setVisible(bool(entry.notes))
        theme.changed.connect(self._tint)
        self._theme = theme
        self._tint()
        second = row((Elided(when, "muted"), 1), *self._signs, spacing=6)
        words = lines(first, second, spacing=2)
        if apart:
            words.insertWidget(1, Elided(apart, "small"))
        if entry.tags:
            words.addWidget(
                Elided(" · ".join(f"#{tag}" for tag in entry.tags), "small")
            )
        ticks = lines(self.tick, self._mark, spacing=0)
        bar(self, (8, 7, 10, 7), 10, self.thumbnail, (words, 1), ticks)

    def tells(self, entry: RunSummary, apart: str) -> bool:
        """Whether it says just that, so that no new one is needed."""
        return self.entry == entry and self._apart == apart

    def mark(self, *, chosen: bool, shown: bool) -> None:
        """Show whether it is the chosen one, and whether it is on screen."""
        set_role(self, "run-chosen" if chosen else "run")
        self._signs[0].setVisible(shown)
        entry, seen = self.entry, "on screen" if shown else ""
        said = (entry.title, self._apart, entry.status, day(entry.started), seen)
        self.setAccessibleName(", ".join(filter(None, said)))

    def stop_tab(self, stops: bool) -> None:
        """Whether `Tab` comes here: to one card of the list; arrows go on from it."""
        policy = Qt.FocusPolicy.StrongFocus if stops else Qt.FocusPolicy.ClickFocus
        self.setFocusPolicy(policy)

    def show_place(self, number: int | None) -> None:
        """Show marker and colour it would have in a comparison; None: it is not in."""
        runs = self._theme.tokens.runs
        if number is None or number >= len(runs):
            self._mark.setText("")
            return
        self._mark.setText(MARKS[number])
        self._mark.setStyleSheet(f"color: {runs[number]};")

    def _tint(self) -> None:
        for sign, name in zip(self._signs, ("eye", "note"), strict=True):
            sign.setPixmap(pixmap(name, self._theme.tokens.muted, 16))

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the run."""
        self.chosen.emit(self.entry)

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        """Open the run."""
        self.opened.emit(self.entry)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what can be done with it."""
        self.chosen.emit(self.entry)
        self.menu_asked.emit(self.entry, event.globalPos())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Open with Enter, tick with Space, go on with arrows and pages."""
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.opened.emit(self.entry)
        elif event.key() == Qt.Key.Key_Space:
            self.tick.toggle()
        elif event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down):
            self.stepped.emit(1 if event.key() == Qt.Key.Key_Down else -1)
        elif event.key() in (Qt.Key.Key_PageUp, Qt.Key.Key_PageDown):
            self.paged.emit(1 if event.key() == Qt.Key.Key_PageDown else -1)
        else:
            super().keyPressEvent(event)

    def focusInEvent(self, event: object) -> None:
        """Choose the run with the keyboard."""
        self.chosen.emit(self.entry)


def told(entry: RunSummary) -> list[str]:
    """What a catalogue has of a run besides its name, one line each."""
    no_count = " seen, no count" if entry.uncounted else ""
    values = {
        "scene": entry.scene,
        "bench": entry.bench,
        "sensor": entry.sensor,
        "operator": entry.operator,
        "spikes": "" if entry.spikes is None else f"{entry.spikes}{no_count}",
        "": entry.trouble,
    }
    found = [f"{name} {value}".strip() for name, value in values.items() if value]
    return [*found, *entry.notes]


def _length(entry: RunSummary) -> str:
    """How long a run took, or that there is nothing of it."""
    if entry.duration is not None:
        return minutes(entry.duration)
    # its card is not made anew as the first sample of one that goes on is written
    over = entry.status != "running" and not entry.trouble
    return "none recorded" if over and not entry.recorded else "—"


def day(started: str) -> str:
    """When a run began, from its ISO time: "today 14:03"."""
    try:
        at = datetime.fromisoformat(started)
    except ValueError:
        return ""
    days = (datetime.now(at.tzinfo).date() - at.date()).days
    date = {0: "today", 1: "yesterday"}.get(days, f"{at:%d %b %Y}")
    return f"{date} {at:%H:%M}"


def differing(runs: Sequence[RunSummary]) -> list[str]:
    """In which parameters runs differ: "levels 80, 120 mN", a text for each."""
    keys = dict.fromkeys(key for run in runs for key in run.parameters)
    own = [{key: _said(run.parameters.get(key)) for key in keys} for run in runs]
    apart = [key for key in keys if len({one[key] for one in own}) > 1]
    return [
        "; ".join(f"{key.replace('_', ' ')} {one[key]}" for key in apart) for one in own
    ]


def _said(value: object) -> str:
    """A parameter's value, which a file holds in SI, as the form shows it."""
    texts = [
        str(one) for one in (value if isinstance(value, list | tuple) else [value])
    ]
    try:
        numbers, _, units = zip(*(text.partition(" ") for text in texts), strict=True)
        if units[0] and len(set(units)) == 1:
            return listed([float(number) for number in numbers], units[0])
    except ValueError:
        pass  # none, or a name of several words
    return "—" if value is None or not texts else ", ".join(texts)
