"""What the run gives: live and marked preliminary, final after its report."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from gui.lanes import paint
from gui.lanes.axis import nice_range
from gui.lanes.decimate import FloatArray
from gui.lanes.paint import Frame
from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.parts import column, label, panel, push, scrolling, set_role
from gui.review.finding import Finding
from gui.review.fit import Fit
from gui.review.fit_view import FitCards, TwinBars
from gui.review.loop import LoopPlot, axes

HEADINGS = ("Step", "Spikes", "First\nms", "Peak\nHz", "Final\nHz", "Fall\n%")


class RatePlot(QWidget):
    """Peak and final rate of each step against its force."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._points: list[tuple[float, float, float]] = []
        self._model: tuple[tuple[float, float], ...] = ()
        self.setMinimumHeight(190)
        self.setMaximumHeight(300)
        self.setAccessibleName("Rate against force")
        theme.changed.connect(self.update)

    def show_points(self, points: list[tuple[float, float, float]]) -> None:
        """Show (force mN, peak rate Hz, final rate Hz) points."""
        if points != self._points:
            self._points, self._model = points, ()
            self.update()

    def show_model(self, model: tuple[tuple[float, float], ...]) -> None:
        """Show the model's (force N, peak rate Hz) beside them."""
        self._model = model
        self.update()

    @property
    def has_points(self) -> bool:
        """Whether there is anything to draw."""
        return bool(self._points)

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw axes, both rates and their legend."""
        painter = QPainter(self)
        tokens = self._theme.tokens
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(sized(11))
        silent = not any(peak or final for _, peak, final in self._points)
        if silent:
            painter.setPen(QColor(tokens.muted))
            text = (
                "No step has fired."
                if self._points
                else "The rate of each step appears here."
            )
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, text)
            return
        rows = np.array(self._points)
        x_low, x_high = nice_range(min(0.0, rows[:, 0].min()), rows[:, 0].max(), 20.0)
        highest = max(float(rows[:, 1:].max()), *(rate for _, rate in self._model), 0.0)
        y_high = nice_range(0.0, highest, 2.0)[1]
        x_low = 0.0 if rows[:, 0].min() >= 0 else x_low
        frame = Frame(
            44, self.width() - 12, 24, self.height() - 36, x_low, x_high, 0.0, y_high
        )
        axes(painter, frame, tokens, "force / mN", "rate / Hz")
        if self._model:
            line = frame.x(np.array([1e3 * f for f, _ in sorted(self._model)]))
            high = frame.y(np.array([rate for _, rate in sorted(self._model)]))
            paint.polyline(painter, line, high, paint.pen(tokens.twin))
            key = frame.left + 148
            painter.drawLine(QPointF(key, 10), QPointF(key + 16, 10))
            painter.setPen(QColor(tokens.text))
            legend = QRectF(key + 21, 2, 80, 16)
            painter.drawText(legend, Qt.AlignmentFlag.AlignLeft, "model")
        for index, name, colour in (
            (1, "peak", tokens.rate),
            (2, "final", tokens.force),
        ):
            x, y = frame.x(rows[:, 0]), frame.y(rows[:, index])
            order = np.argsort(rows[:, 0], kind="stable")
            paint.polyline(painter, x[order], y[order], paint.pen(colour))
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(colour))
            for a, b in zip(x.tolist(), y.tolist(), strict=True):
                if index == 1:
                    painter.drawEllipse(QPointF(a, b), 3.8, 3.8)
                else:
                    painter.drawRect(QRectF(a - 3.3, b - 3.3, 6.6, 6.6))
            left = frame.left + 8 + 74 * (index - 1)
            if index == 1:
                painter.drawEllipse(QPointF(left, 10), 3.8, 3.8)
            else:
                painter.drawRect(QRectF(left - 3.3, 6.7, 6.6, 6.6))
            painter.setPen(QColor(tokens.text))
            painter.drawText(
                QRectF(left + 9, 2, 60, 16), Qt.AlignmentFlag.AlignLeft, name
            )


class ResultsView(QWidget):
    """Rates against force, a table of steps, and what the report adds."""

    report_asked = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._title = label("Rate against force", "title")
        self._mark = label("", "pill")
        self._mark.hide()
        self._mark.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self.plot = RatePlot(theme)
        self.loop = LoopPlot(theme)
        self.loop.hide()
        self.cards = FitCards()
        self.bars = TwinBars(theme)
        self.table = QTableWidget(0, len(HEADINGS))
        self._facts = panel("card")
        self._facts_text = label("", "", wrap=True)
        column(self._facts, margin=10).addWidget(self._facts_text)
        self._facts.hide()
        self.report = push("Open report")
        self.report.hide()
        self.report.clicked.connect(self.report_asked)
        self._set_up_table()
        head = QHBoxLayout()
        head.addWidget(self._title)
        head.addStretch(1)
        head.addWidget(self._mark)
        inner = QWidget()
        middle = column(inner, spacing=9)
        middle.addWidget(self.cards)
        middle.addWidget(self.plot, 2)
        middle.addWidget(self.loop, 2)
        middle.addWidget(self.table, 3)
        middle.addWidget(self.bars)
        whole = column(self, spacing=9)
        whole.addLayout(head)
        whole.addWidget(scrolling(inner), 1)
        whole.addWidget(self._facts)
        whole.addWidget(self.report)

    @property
    def mark(self) -> str:
        """The words that say whether the results are final."""
        return self._mark.text()

    def show_findings(
        self, findings: Sequence[Finding], *, total: int, running: bool, whole: bool
    ) -> None:
        """Show what the steps so far gave; `whole` is whether the run was completed."""
        points = [
            (f.level * 1e3, f.peak_rate or 0.0, f.final_rate or 0.0)
            for f in findings
            if f.level is not None
        ]
        self.plot.show_points(points)
        self._fill(findings)
        self._mark.setVisible(bool(findings) or running)
        steps = f"{len(findings)} step{'' if len(findings) == 1 else 's'}"
        if running:
            of = f" of {total}" if total else ""
            self._mark.setText(f"preliminary · {len(findings)}{of} steps")
            set_role(self._mark, "pill-warn")
        elif not whole:
            self._mark.setText(f"partial · {steps}")
            set_role(self._mark, "pill-warn")
        else:
            self._mark.setText(f"final · {steps}")
            set_role(self._mark, "pill-ok")

    def show_fit(self, found: Fit | None) -> None:
        """Show what the steps say together, beside the model; None clears it."""
        self.cards.show_cards(() if found is None else found.cards)
        self.bars.show_bars(() if found is None else found.bars)
        self.plot.show_model(() if found is None else found.model)

    def show_loop(self, loop: FloatArray) -> None:
        """Show the field against the current where a calibration reads it."""
        steps = np.unique(np.round(loop[:, 0], 2)).size
        wanted = steps > 4 and not self.plot.has_points
        self.loop.show_loop(loop)
        self.loop.setVisible(wanted)
        self.plot.setVisible(not wanted)
        self.table.setVisible(not wanted)
        self._title.setText("Field against current" if wanted else "Rate against force")

    def show_facts(self, text: str, *, report: bool) -> None:
        """Show statements on the whole run, and whether there is a report."""
        self._facts_text.setText(text)
        self._facts.setVisible(bool(text))
        self.report.setVisible(report)

    def _fill(self, findings: Sequence[Finding]) -> None:
        table = self.table
        if table.rowCount() > len(findings):
            table.setRowCount(0)
        for row in range(table.rowCount(), len(findings)):
            table.insertRow(row)
            for where, text in enumerate(findings[row].cells()):
                item = QTableWidgetItem(text)
                side = (
                    Qt.AlignmentFlag.AlignLeft
                    if where == 0
                    else Qt.AlignmentFlag.AlignRight
                )
                item.setTextAlignment(side | Qt.AlignmentFlag.AlignVCenter)
                table.setItem(row, where, item)
        if findings:
            table.scrollToBottom()

    def _set_up_table(self) -> None:
        table = self.table
        table.setAccessibleName("Results of each step")
        table.setStyleSheet("font-size: 12px;")
        table.setHorizontalHeaderLabels(list(HEADINGS))
        table.verticalHeader().hide()
        table.verticalHeader().setDefaultSectionSize(26)
        table.setShowGrid(False)
        table.setMinimumHeight(150)
        table.setAlternatingRowColors(True)
        table.setTabKeyNavigation(False)
        table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        table.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        header = table.horizontalHeader()
        header.setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
        header.setMinimumSectionSize(36)
        header.setDefaultAlignment(
            Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
        )
        first = table.horizontalHeaderItem(0)
        if first is not None:
            first.setTextAlignment(
                Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
            )
