"""What the run gives: live and marked preliminary, final after its report."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np
from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QAction, QGuiApplication, QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHeaderView,
    QSizePolicy,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Combo,
    column,
    empty,
    label,
    lines,
    panel,
    push,
    row,
    say,
    scrolling,
    set_role,
    stack,
    with_gutter,
)
from gui.plots.numbers import unbroken
from gui.plots.small_plot import SmallPlot
from gui.review.fit_view import FitCards, TwinBars
from gui.review.live_plots import (
    COLUMNS,
    column_plot,
    loop_plot,
    rate_plot,
    train_plot,
)
from gui.session.fit import SILENT, Fit, FittedRate
from gui.session.steps import cells
from gui.table_keys import is_the_windows
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Table
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.plot import Plot
from tactile_lab.quantity import count

HEAD, ROW = 52, 26
"""Heights of the table's head and of a row, px."""

LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter

NO_STEPS = (
    "No steps yet. Rate, onset, slope and adaptation\n"
    "are told here, step by step, as a run goes on."
)
NO_LEVELS = (
    "These steps are no levels of force: what they give\n"
    "is told by the report, at the end of the run."
)
NO_SPIKES = (
    "Spikes are not looked for in this run: what it\n"
    "gives is told by the report, at its end."
)
SEVERAL = (
    "Results are of one run: choose it in Runs.\n"
    "Those of several, side by side, are written\n"
    "by tactile-lab report RUN RUN."
)

HEADINGS = ("Step", "Spikes", "First\nms", "Peak\nHz", "Final\nHz", "Fall\n%")


class _Steps(QTableWidget):
    """A table that is gone through line by line."""

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Leave to the window what moves no line."""
        if is_the_windows(event):
            event.ignore()
        else:
            super().keyPressEvent(event)


class ResultsView(QWidget):
    """Rates against force, a table of steps, and what the report adds."""

    report_asked = Signal()
    step_chosen = Signal(float, float)
    """A step of the table was chosen: its start and its length, s."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._title = label("Rate against force", "title")
        self.mark = label("", "pill")
        self.mark.hide()
        self.mark.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._theme = theme
        self.plot = SmallPlot(theme)
        self.trains = SmallPlot(theme)
        self.trains.hide()
        self._later = QTimer(self)  # steps and their fit may come in one frame
        self._later.setSingleShot(True)
        self._later.timeout.connect(self._draw_rates)
        self.loop = SmallPlot(theme)
        self.loop.hide()
        self.answers: list[SmallPlot] = []
        """Of the report: the protocol's own plots."""
        self._steps: Sequence[MeasuredTrial] = ()
        self._told: list[tuple[str, ...]] = []
        self._model: tuple[tuple[float, float], ...] = ()
        self._laws: tuple[FittedRate, ...] = ()
        self._fires, self._loops, self._several = True, False, False
        self.drawn, self.against = Combo(), Combo()
        self.drawn.addItems(["rates", *COLUMNS])
        self.against.addItems(list(COLUMNS))
        for combo, name in ((self.drawn, "Drawn"), (self.against, "Drawn against")):
            combo.setAccessibleName(f"{name}: a column of the steps")
            combo.currentIndexChanged.connect(self._choose_columns)
        self._axes = QWidget()
        offered = (self.drawn, 1), label("against", "muted"), (self.against, 1)
        column(self._axes).addLayout(row(*offered, spacing=8))
        self._show_rates()
        self.cards = FitCards()
        self.bars = TwinBars(theme)
        self.statements = label("", "", wrap=True)
        self.statements.hide()
        self.tables = label("", "", wrap=True)
        self.tables.setTextFormat(Qt.TextFormat.RichText)
        self.tables.hide()
        self.table = _Steps(0, len(HEADINGS))
        self._facts = panel("card")
        self._facts_text = label("", "", wrap=True)
        column(self._facts, self._facts_text, margin=10)
        self._facts.hide()
        self.report = push("")
        self.show_report("")
        self.report.clicked.connect(self.report_asked)
        self._set_up_table()
        head = row(self._title, STRETCH, self.mark)
        inner = QWidget()
        self._drawn = lines()
        rates = (self.plot, 2), self._axes, (self.trains, 2), (self.loop, 2)
        plots = (*rates, (self._drawn, 2), (self.table, 3))
        said = (self.statements, self.tables, (STRETCH, 0))  # plots take room first
        parts = (self.cards, *plots, *said, self.bars, self._facts, self.report)
        page = with_gutter(scrolling(inner), column(inner, *parts, spacing=9))
        stack(self, (head, page), page, spacing=9)
        self._arrange()

    def show_steps(
        self, steps: Sequence[MeasuredTrial], *, total: int, running: bool, whole: bool
    ) -> None:
        """Show what the steps so far gave; `whole` is whether the run was completed."""
        if len(steps) != len(self._steps):  # the same ones again are not yet fitted
            self.cards.mark_old(len(steps) > len(self._steps))
        self._steps, self._model, self._laws = tuple(steps), (), ()
        if not running:  # each fit of a run draws the rates, and is on its way
            self._show_rates()
        # while a run goes on, what lies below moves for no step of the first four
        self._fill(steps, max(len(steps), min(total or 4, 4) if running else 0))
        self._arrange()
        self.mark.setVisible(bool(steps) or running)
        many = count(len(steps), "step")
        if running:
            # a protocol may go on for longer than was planned
            known = 0 < total >= len(steps)
            of = f"{len(steps)} of {total} steps" if known else many
            self.mark.setText(f"preliminary · {of}")
        else:
            self.mark.setText(f"{'final' if whole else 'partial'} · {many}")
        set_role(self.mark, "pill-ok" if whole and not running else "pill-warn")

    def show_fit(self, found: Fit | None) -> None:
        """Show what the steps say together, beside the model; None clears it."""
        rates = self._fires and not self._loops
        self.cards.show_cards(found.cards if found and rates else ())
        self.bars.show_bars(() if found is None else found.bars)
        self._model = () if found is None else found.model
        self._laws = () if found is None else found.rates
        self._show_rates()
        self._arrange()

    def show_kind(self, *, fires: bool, several: bool = False) -> None:
        """Say whether spikes are looked for: without them there are no rates.

        Of several runs that are compared nothing is told here.
        """
        self._fires, self._loops, self._several = fires, False, several
        self._show_rates()
        self._arrange()

    def show_loop(self, loop: FloatArray) -> None:
        """Show the field against the current where a calibration reads it."""
        steps = np.unique(np.round(loop[:, 0], 2)).size
        self._loops = steps > 4 and not self._levelled
        self.loop.show_plot(loop_plot(loop))
        self._arrange()

    def show_statements(
        self,
        statements: Sequence[str],
        tables: Sequence[Table] = (),
        plots: Sequence[Plot] = (),
    ) -> None:
        """Show what the report concludes, its tables, and the protocol's own plots."""
        say(self.statements, unbroken("\n".join(statements)))
        say(self.tables, "".join(_html(table) for table in tables))
        empty(self._drawn)
        self.answers = [SmallPlot(self._theme) for _ in plots]
        for view, plot in zip(self.answers, plots, strict=True):
            view.show_plot(plot)
            self._drawn.addWidget(view)
        self._arrange()

    def _show_rates(self) -> None:
        """Draw the rates, and in a turn of their own the trains: each takes 10 ms."""
        self.plot.nothing = self._nothing
        self._later.start()

    def _draw_rates(self) -> None:
        y, x = self.drawn.currentText(), self.against.currentText()
        if not self._fires:
            shown = None
        elif (y, x) == ("rates", "force"):
            shown = rate_plot(self._steps, self._model)
        else:
            shown = column_plot(self._steps, y, x)
        self.plot.show_plot(shown)
        QTimer.singleShot(0, self, self._draw_trains)

    def _draw_trains(self) -> None:
        self.trains.show_plot(train_plot(self._steps, self._laws))
        self._arrange()

    @property
    def _nothing(self) -> str:
        """What is said where no rates can be drawn."""
        if self._several:
            return SEVERAL
        if not self._fires:
            return NO_SPIKES
        if self._levelled:
            why_not = next((s.uncounted for s in self._steps if s.uncounted), "")
            return f"No rates: {why_not}." if why_not else SILENT
        return NO_LEVELS if self._steps else NO_STEPS

    def _choose_columns(self) -> None:
        """Draw what was chosen; the rates of both kinds go with the force alone."""
        if self.drawn.currentText() == "rates" and self.against.currentIndex():
            if self.sender() is self.drawn:
                self.against.setCurrentText("force")
            else:
                self.drawn.setCurrentText("peak rate")
        self._show_rates()
        self._arrange()

    @property
    def _levelled(self) -> bool:
        """Whether a step so far has a force it is filed under."""
        return any(f.level is not None for f in self._steps)

    def _arrange(self) -> None:
        rates = self._fires and not self._loops
        self.loop.setVisible(self._loops and not self.answers)
        untold = self._fires or self.statements.isHidden()
        self.plot.setVisible(untold and not self._loops and not self.answers)
        self.trains.setVisible(rates and self.trains.plot is not None)
        self.table.setVisible(rates and self._levelled)
        self._axes.setVisible(not self.table.isHidden() and not self.answers)
        if not rates:
            self.cards.hide()
        self._title.setText(
            "Field against current"
            if self._loops and not self.answers
            else self._drawn_title
            if rates and not self.answers
            else "Results"
        )

    @property
    def _drawn_title(self) -> str:
        y, x = self.drawn.currentText(), self.against.currentText()
        return f"{'Rate' if y == 'rates' else y.capitalize()} against {x}"

    def show_facts(self, text: str) -> None:
        """Show statements on the whole run."""
        self._facts_text.setText(text)
        self._facts.setVisible(bool(text))

    def show_report(self, offer: str, *, ready: bool = True) -> None:
        """Show what can be done about the report, if it can be by now; "": nothing."""
        self.report.setText(offer)
        self.report.setAccessibleName(offer or "Report")
        self.report.setVisible(bool(offer))
        self.report.setEnabled(ready)

    def _fill(self, steps: Sequence[MeasuredTrial], rows: int) -> None:
        table, told = self.table, [cells(step) for step in steps]
        if self._told != told[: len(self._told)]:  # of another run
            table.setRowCount(0)
        self._told = told
        for at in range(table.rowCount(), len(told)):
            table.insertRow(at)
            for where, text in enumerate(told[at]):
                item = QTableWidgetItem(text)
                item.setTextAlignment(RIGHT if where else LEFT)
                item.setToolTip(steps[at].uncounted if where else text)
                table.setItem(at, where, item)
        table.setFixedHeight(HEAD + ROW * max(rows, 1))  # the page scrolls

    def _choose(self, row: int) -> None:
        step = self._steps[row]
        self.step_chosen.emit(step.start, step.duration)

    def copy_table(self) -> None:
        """Put the table of steps on the clipboard, as a spreadsheet takes it."""
        rows = [tuple(heading.replace("\n", " / ") for heading in HEADINGS)]
        rows += [cells(step) for step in self._steps]
        QGuiApplication.clipboard().setText("\n".join("\t".join(row) for row in rows))

    def _set_up_table(self) -> None:
        table = self.table
        table.setAccessibleName("Results of each step")
        table.setStyleSheet("font-size: 12px;")
        table.setHorizontalHeaderLabels(list(HEADINGS))
        table.verticalHeader().hide()
        table.verticalHeader().setDefaultSectionSize(ROW)
        table.setShowGrid(False)
        table.verticalHeader().setMinimumSectionSize(ROW)
        table.setFixedHeight(HEAD + 4 * ROW)
        table.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        table.setAlternatingRowColors(True)
        table.setTabKeyNavigation(False)
        table.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        table.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        table.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        table.setToolTip("A click, or Enter, shows the step in the lanes")
        table.cellClicked.connect(self._choose)
        table.cellActivated.connect(self._choose)
        copy = QAction("Copy table", table)
        copy.setShortcut(QKeySequence.StandardKey.Copy)
        copy.setShortcutContext(Qt.ShortcutContext.WidgetShortcut)
        copy.triggered.connect(self.copy_table)
        table.addAction(copy)
        table.setContextMenuPolicy(Qt.ContextMenuPolicy.ActionsContextMenu)
        header = table.horizontalHeader()
        # what is left out of a long name is in its middle: "90 m…0625 V"
        table.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        table.setWordWrap(False)  # else it is of two lines, of which one is seen
        header.setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        header.setMinimumSectionSize(36)
        header.setStyleSheet("QHeaderView::section { padding: 4px 2px; }")
        header.setDefaultAlignment(RIGHT)
        first = table.horizontalHeaderItem(0)
        if first is not None:
            first.setTextAlignment(LEFT)


def _html(table: Table) -> str:
    """A table as rich text, in columns as narrow as their numbers."""
    rows = [
        "".join(f'<td style="padding-right: 6px">{_cell(cell)}</td>' for cell in row)
        for row in (table.headings, *table.rows)
    ]
    cells = "".join(f"<tr>{row}</tr>" for row in rows)
    title, note = escape(table.title), escape(table.note)
    small = f'<table cellspacing="0" style="font-size: 11px">{cells}</table>'
    return f"<p><b>{title}</b></p>{small}{note}"


def _cell(text: str) -> str:
    """What stands in a cell; a line ends before ±, not behind it."""
    return escape(unbroken(text)).replace("± ", "±&nbsp;")
