"""Cards with fitted numbers, and bars with the distance to the model."""

from __future__ import annotations

from PySide6.QtCore import QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QWidget

from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.parts import column, label, panel
from gui.review.fit import Bar, Card

ROW = 22


class FitCards(QWidget):
    """Two by two; hidden while there is nothing to fit."""

    def __init__(self) -> None:
        super().__init__()
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 0, 0, 0)
        grid.setSpacing(6)
        self._labels = []
        for number in range(4):
            card = panel("card")
            inside = column(card, margin=8, spacing=0)
            parts = label("", "small"), label("—", "value"), label("", "small")
            parts[2].setWordWrap(True)
            for part in parts:
                inside.addWidget(part)
            inside.addStretch(1)
            grid.addWidget(card, *divmod(number, 2))
            self._labels.append((card, *parts))
        grid.setColumnStretch(0, 1)
        grid.setColumnStretch(1, 1)
        self.hide()

    def show_cards(self, cards: tuple[Card, ...]) -> None:
        """Show up to four fitted numbers."""
        for (frame, name, value, detail), card in zip(
            self._labels, cards, strict=False
        ):
            name.setText(card.name)
            value.setText(card.value)
            detail.setText(card.detail)
            frame.setAccessibleName(f"{card.name}: {card.value}. {card.detail}")
            frame.setToolTip(card.detail)
        self.setVisible(bool(cards))

    @property
    def texts(self) -> list[tuple[str, str]]:
        """Names and values shown."""
        return [(name.text(), value.text()) for _, name, value, _ in self._labels]


class TwinBars(QWidget):
    """One bar per signal: short is good."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        head = QHBoxLayout()
        head.addWidget(label("Model beside the run", "title"))
        head.addStretch(1)
        head.addWidget(label("NRMSE · full bar 10 % or 20 ms", "small"))
        self._bars = _Bars(theme)
        whole = column(self, spacing=4)
        whole.addLayout(head)
        whole.addWidget(self._bars)
        self.hide()

    def show_bars(self, bars: tuple[Bar, ...]) -> None:
        """Show the distances, or hide where there is no model."""
        self._bars.show_bars(bars)
        self.setVisible(bool(bars))


class _Bars(QWidget):
    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._bars: tuple[Bar, ...] = ()
        theme.changed.connect(self.update)

    def show_bars(self, bars: tuple[Bar, ...]) -> None:
        self._bars = bars
        self.setFixedHeight(ROW * max(len(bars), 1))
        spoken = ", ".join(f"{bar.name} {bar.text}" for bar in bars)
        self.setAccessibleName(f"Measured less model: {spoken}")
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw name, bar and number of each signal."""
        painter, tokens = QPainter(self), self._theme.tokens
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(sized(12))
        left, right = 58.0, self.width() - 112.0
        for row, bar in enumerate(self._bars):
            top = float(ROW * row)
            painter.setPen(QColor(tokens.text))
            side = Qt.AlignmentFlag.AlignVCenter
            painter.drawText(QRectF(0, top, left, ROW), side, bar.name)
            painter.drawText(
                QRectF(right + 6, top, self.width() - right - 6, ROW),
                side | Qt.AlignmentFlag.AlignRight,
                bar.text,
            )
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(tokens.sunken))
            middle = top + ROW / 2 - 3
            painter.drawRoundedRect(QRectF(left, middle, right - left, 6), 3, 3)
            painter.setBrush(QColor(tokens.trace(bar.signal)))
            length = max(bar.share * (right - left), 3.0)
            painter.drawRoundedRect(QRectF(left, middle, length, 6), 3, 3)
