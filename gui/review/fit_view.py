"""Cards with fitted numbers, and bars with the distance to the model."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from gui.lanes.lane import title_of
from gui.look.theme import Theme
from gui.parts import STRETCH, column, label, panel, row
from gui.plots.numbers import unbroken
from gui.session.fit import Bar, Card

ROW = 19
"""Height of a bar's row, px."""

HOW = {
    "Onset": "Between the largest force that stayed silent and the least that fired.",
    "Slope of the peak rate": "Median of the slopes between neighbouring forces, with "
    "the least and the largest of them.",
    "Adaptation 1/|β|": "Of α exp(βt) + γ fitted to the rate in the hold, with its "
    "95 % interval.",
    "Fall in the hold": "From the highest to the last rate in the hold.",
}
"""How each number was obtained, for its tool tip."""


class FitCards(QWidget):
    """Two by two; hidden while there is nothing to fit.

    Attributes:
        old: whether a step has ended that is not in them yet; they are pale then.
    """

    def __init__(self) -> None:
        super().__init__()
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(6)
        self._labels = []
        for number in range(4):
            card = panel("card")
            small = label("", "small", wrap=True)
            parts = label("", "small"), label("—", "value"), small
            column(card, *parts, STRETCH, margin=8, spacing=0)
            grid.addWidget(card, *divmod(number, 2))
            self._labels.append((card, *parts))
        grid.setColumnStretch(0, 1)
        grid.setColumnStretch(1, 1)
        self.mark_old(False)
        self.hide()

    def mark_old(self, old: bool) -> None:
        """A step that is not in them has ended, or all are in them."""
        self.old = old
        self.setEnabled(not old)  # pale
        self.setToolTip("Without the newest step: it is being fitted" if old else "")

    def show_cards(self, cards: tuple[Card, ...]) -> None:
        """Show up to four fitted numbers."""
        self.mark_old(False)
        for (frame, name, value, detail), card in zip(
            self._labels, cards, strict=False
        ):
            name.setText(card.name)
            value.setText(unbroken(card.value))
            small = [text for text in (card.detail, card.model) if text]
            detail.setText(unbroken("\n".join(small)))
            spoken = ", ".join(small)
            frame.setAccessibleName(f"{card.name}: {card.value}. {spoken}")
            frame.setToolTip("\n".join(filter(None, (spoken, HOW.get(card.name)))))
        self.setVisible(bool(cards))


class TwinBars(QWidget):
    """One bar per signal: short is good."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._rows: list[tuple[QLabel, _Gauge, QLabel]] = []
        title = label("Model beside the run", "title")
        full = label("NRMSE · full bar 10 % or 20 ms", "small")
        head = row(title, STRETCH, full, spacing=6)
        self._grid = QGridLayout()
        self._grid.setHorizontalSpacing(10)
        self._grid.setVerticalSpacing(3)
        self._grid.setColumnStretch(1, 1)
        column(self, head, self._grid, spacing=4)
        self.hide()

    def show_bars(self, bars: tuple[Bar, ...]) -> None:
        """Show the distances, or hide where there is no model."""
        while len(self._rows) < len(bars):
            self._add_row()
        for number, (name, gauge, text) in enumerate(self._rows):
            for part in (name, gauge, text):
                part.setVisible(number < len(bars))
            if number < len(bars):
                bar = bars[number]
                name.setText(title_of(bar.signal))
                gauge.show_share(bar.share, bar.signal)
                text.setText(unbroken(bar.text))
        spoken = ", ".join(f"{bar.name} {bar.text}" for bar in bars)
        self.setAccessibleName(f"Measured less model: {spoken}")
        self.setVisible(bool(bars))

    def _add_row(self) -> None:
        parts = label(""), _Gauge(self._theme), label("")
        side = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        parts[2].setAlignment(side)
        at = len(self._rows)
        for where, part in enumerate(parts):
            part.setFixedHeight(ROW)
            self._grid.addWidget(part, at, where)
        self._rows.append(parts)


class _Gauge(QWidget):
    """A bar in a signal's colour."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme, self._share, self._signal = theme, 0.0, "V_C1"
        theme.changed.connect(self.update)

    def show_share(self, share: float, signal: str) -> None:
        """Show a length from 0 to 1."""
        self._share, self._signal = share, signal
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the bar in its trough."""
        painter, tokens = QPainter(self), self._theme.tokens
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        middle = self.height() / 2 - 3
        painter.setBrush(QColor(tokens.sunken))
        painter.drawRoundedRect(QRectF(0, middle, self.width(), 6), 3, 3)
        painter.setBrush(QColor(tokens.trace(self._signal)))
        length = max(self._share * self.width(), 6.0)
        painter.drawRoundedRect(QRectF(0, middle, length, 6), 3, 3)
