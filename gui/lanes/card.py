"""The card beside a lane: its name and its numbers, one run's or those of several."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import (
    QColor,
    QContextMenuEvent,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QResizeEvent,
)
from PySide6.QtWidgets import QFrame, QLabel

from gui.lanes.compare import MARKS
from gui.lanes.lane import Lane
from gui.look.theme import Theme
from gui.parts import STRETCH, column, label, row
from gui.plots.numbers import number, signed

CARD = 164
"""Width, px."""

MARGIN, RIGHT = 12, 6
SWATCH, GAP = 10, 7
"""Of the title: its swatch, and what is between its parts, px."""

TITLE = 26
"""Height of the title with the margin above it, px."""

LOW = 40
"""Height below which the value would lie on the title; the tag in the lane has it."""

EDGE = 6
"""Height of its lower edge, which can be dragged, px."""

LINE = 15
"""Height of a line of small text, px."""

Values = Sequence[float | None]


class LaneAct(Enum):
    """What keys do to the lane whose card has the keyboard."""

    ABOVE, BELOW = "go to the lane above", "go to the lane below"
    UP, DOWN = "move the lane up", "move the lane down"
    TALLER, SHORTER = "make the lane higher", "make the lane less high"
    CLOSER, FURTHER = "zoom into its values", "zoom out of its values"
    HIGHER, LOWER = "look at higher values", "look at lower values"


HELD = Qt.KeyboardModifier
KEYS = {
    (HELD.NoModifier, Qt.Key.Key_Up): LaneAct.ABOVE,
    (HELD.NoModifier, Qt.Key.Key_Down): LaneAct.BELOW,
    (HELD.ShiftModifier, Qt.Key.Key_Up): LaneAct.UP,
    (HELD.ShiftModifier, Qt.Key.Key_Down): LaneAct.DOWN,
    (HELD.AltModifier, Qt.Key.Key_Up): LaneAct.SHORTER,
    (HELD.AltModifier, Qt.Key.Key_Down): LaneAct.TALLER,
    (HELD.ControlModifier, Qt.Key.Key_Up): LaneAct.CLOSER,
    (HELD.ControlModifier, Qt.Key.Key_Down): LaneAct.FURTHER,
    (HELD.NoModifier, Qt.Key.Key_PageUp): LaneAct.HIGHER,
    (HELD.NoModifier, Qt.Key.Key_PageDown): LaneAct.LOWER,
}


class LaneCard(QFrame):
    """Swatch, title, value with unit, and a line of small text.

    A drag of its lower edge makes the lane higher, one of the rest moves it. While it
    has the keyboard it stands for its lane: see `KEYS`.
    """

    acted = Signal(object)
    """A key was pressed for the lane; what of `LaneAct` it asks for."""
    menu_asked = Signal()

    resized = Signal(float)
    """Its lower edge was dragged down by so many px."""
    moved = Signal(int)
    """It was dragged up (-1) or down (1) by most of its height."""
    dropped = Signal()

    def __init__(self, lane: Lane, theme: Theme) -> None:
        super().__init__()
        self.lane, self._theme = lane, theme
        self.setProperty("role", "lanecard")
        self.setFixedWidth(CARD)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus)
        self.setAccessibleName(f"Lane {lane.plain}")
        self._swatch = QLabel()
        self._swatch.setFixedSize(QSize(SWATCH, SWATCH))
        self.setMouseTracking(True)
        self._held: tuple[bool, float] | None = None
        self._flat = not lane.valued
        self._value = label("—", "flatvalue" if self._flat else "value")
        self._unit = label(lane.unit, "muted")
        self._more = label("", "small")
        self._more.hide()
        self._runs: tuple[Values, Values | None, str] | None = None
        self._beside = label("", "muted")
        self._beside.hide()
        number_ = (self._value, self._unit)
        self._title = label(lane.title, "strong")
        heading = (self._swatch, self._title, self._beside, STRETCH)
        title = row(*heading, *(number_ if self._flat else ()), spacing=GAP)
        value = row(*(() if self._flat else (*number_, STRETCH)), spacing=5)
        words = column(self, title, value, self._more, STRETCH, spacing=1)
        words.setContentsMargins(MARGIN, 6, RIGHT, 4)

    @property
    def text(self) -> str:
        """All that the card says below its title, as plain text."""
        return self.toolTip() if self._runs else self._value.text()

    @property
    def more(self) -> str:
        """The small text, "" where it is not shown."""
        return self._more.text() if self._more.isVisibleTo(self) else ""

    def show_value(self, value: float | None, unit: str | None = None) -> None:
        """Show the number of one run in shown units; `unit` says it in other words."""
        self._one()
        text, unit = self._text(value), self.lane.unit if unit is None else unit
        if self._value.text() != text:
            self._value.setText(text)
            self._value.setAccessibleName(f"{self.lane.plain} {text} {unit}")
        if self._unit.text() != unit:
            self._unit.setText(unit)

    def show_more(self, words: str) -> None:
        """Show small text below the value; in a low lane in its place."""
        self._one()
        if self._more.text() != words:
            self._more.setText(words)
        below = self.height() >= (44 if self._flat else 66)
        instead = bool(words) and not below and not self._flat
        self._more.setVisible(bool(words) and (below or instead))
        self._beside.setText(self.lane.unit)
        self._beside.setVisible(instead)
        told = self._flat or self.height() >= LOW
        for one in (self._value, self._unit):
            one.setVisible(not instead and told)

    def show_runs(self, values: Values, changes: Values | None, where: str) -> None:
        """Show a line per run: its marker, its value and its change, in shown units.

        Args:
            values: of each run.
            changes: from cursor A to B; None without cursors.
            where: what place the values are of, such as "at A"; "" for the right edge.
        """
        asked = (tuple(values), None if changes is None else tuple(changes), where)
        if asked == self._runs:
            return
        self._runs = asked
        lines = self._lines(values, changes, self.lane.places)
        texts = [f"{m} {' '.join(t)}" for m, t in zip(MARKS, lines, strict=False)]
        first = f"{self.lane.plain}, {self.lane.unit}".rstrip(", ")
        self.setToolTip("\n".join([f"{first} {where or 'at the right'}", *texts]))
        for one in (self._value, self._unit):
            one.hide()
        self._beside.show()
        self._lay_out_runs()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say as much as there is room for."""
        super().resizeEvent(event)
        if self._runs is None:
            self.show_more(self._more.text())
        self._lay_out_runs()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the card, and a frame while it has the keys."""
        super().paintEvent(event)
        if self.hasFocus():
            painter = QPainter(self)
            painter.setPen(QPen(QColor(self._theme.tokens.accent), 2))
            painter.drawRect(self.rect().adjusted(1, 1, -1, -1))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Ask for what a key does to the lane."""
        held = event.modifiers() & ~HELD.KeypadModifier
        act = KEYS.get((held, Qt.Key(event.key())))
        if act is not None:
            self.acted.emit(act)
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not held:
            self.menu_asked.emit()
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Ask for the menu of the lane."""
        self.menu_asked.emit()

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Take hold of the lower edge, or of the lane."""
        if event.button() == Qt.MouseButton.LeftButton:
            self._held = self._at_edge(event), event.globalPosition().y()

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Drag what is held; show what could be."""
        if self._held is None:
            edge = self._at_edge(event)
            way = Qt.CursorShape.SplitVCursor if edge else Qt.CursorShape.OpenHandCursor
            self.setCursor(way)
            return
        edge, since = self._held
        now = event.globalPosition().y()
        if edge:
            self._held = edge, now
            self.resized.emit(now - since)
        elif abs(now - since) > max(0.75 * self.height(), EDGE):
            self._held = edge, now
            self.setCursor(Qt.CursorShape.ClosedHandCursor)
            self.moved.emit(1 if now > since else -1)

    def mouseReleaseEvent(self, event: QMouseEvent) -> None:
        """Let go."""
        if self._held is not None:
            self._held = None
            self.dropped.emit()

    def _at_edge(self, event: QMouseEvent) -> bool:
        return event.position().y() > self.height() - EDGE

    def tint(self, *, grey: bool) -> None:
        """Colour the swatch; `grey` where colour means something else."""
        tokens = self._theme.tokens
        picture = QPixmap(20, 20)
        picture.fill(tokens.border_strong if grey else tokens.trace(self.lane.key))
        picture.setDevicePixelRatio(2)
        self._swatch.setPixmap(picture)
        self._lay_out_runs()

    def _one(self) -> None:
        """Back to the number of one run."""
        if self._runs is not None:
            self._runs = None
            self._swatch.show()
            self._title.show()
            self.setToolTip("")
            self._more.setText("")

    def _lines(
        self, values: Values, changes: Values | None, places: int
    ) -> list[tuple[str, ...]]:
        """Value and change of each run."""
        texts = [self._text(value, places) for value in values]
        if changes is None:
            return [(text,) for text in texts]
        signed = [f"Δ {self._signed(change, places)}" for change in changes]
        return list(zip(texts, signed, strict=True))

    def _lay_out_runs(self) -> None:
        """A row per run; where the lane is low one for all, the changes alone.

        With as many decimals as there is room for.
        """
        if self._runs is None:
            return
        values, changes, where = self._runs
        tall = self.height() >= TITLE + LINE * len(values)
        told = tall or changes is None
        unit = f"{self.lane.unit} {where}" if told else f"Δ {self.lane.unit}"
        below = self.height() >= TITLE + LINE - 3
        counted = self.lane.raster and not below  # a few figures: they fit beside
        self._beside.setText(self._counts(values) if counted else unit.strip())
        # grey beside several runs: it gives way to their figures, then the title does
        wide = self._title.sizeHint().width() + GAP + self._beside.sizeHint().width()
        room = CARD - MARGIN - RIGHT
        self._swatch.setVisible(not counted or SWATCH + GAP + wide <= room)
        self._title.setVisible(not counted or wide <= room)
        self._more.setVisible(below)
        for places in range(self.lane.places, -1, -1):
            lines = self._lines(values, changes, places)
            if not tall:
                lines = [(line[-1].removeprefix("Δ "),) for line in lines]
            self._more.setText(self._table(lines, tall))
            if self._more.sizeHint().width() <= CARD - MARGIN - RIGHT:
                break

    def _table(self, lines: list[tuple[str, ...]], tall: bool) -> str:
        tokens = self._theme.tokens
        near, apart = (4, 8) if tall else (2, 5)
        cells = [
            f'<td style="color:{colour};padding-right:{near}px">{mark}</td>'
            f'<td align="right" style="color:{tokens.text};font-weight:600;'
            f'padding-right:{apart}px">{line[0]}</td>'
            + "".join(f'<td align="right">{text}</td>' for text in line[1:])
            for mark, colour, line in zip(MARKS, tokens.runs, lines, strict=False)
        ]
        rows = "</tr><tr>".join(cells) if tall else "".join(cells)
        return f'<table cellspacing="0" cellpadding="0"><tr>{rows}</tr></table>'

    def _counts(self, values: Values) -> str:
        """Of each run, in its colour, for one line."""
        runs = zip(MARKS, self._theme.tokens.runs, values, strict=False)
        return " ".join(
            f'<span style="color:{colour}">{mark}</span> <b>{self._text(value)}</b>'
            for mark, colour, value in runs
        )

    def _text(self, value: float | None, places: int | None = None) -> str:
        if value is None:
            return "—"
        if self.lane.symmetric and value > 0.5:
            return self._signed(value, places)
        return number(value, self.lane.places if places is None else places)

    def _signed(self, value: float | None, places: int | None = None) -> str:
        if value is None:
            return "—"
        return signed(value, self.lane.places if places is None else places)
