"""All lanes above each other, linked in time, with the navigator below."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QFrame

from gui.lanes.lane import Lane
from gui.lanes.navigator import Navigator
from gui.lanes.plot import Options
from gui.lanes.readings import Painted
from gui.lanes.row import LaneRow
from gui.lanes.source import Source
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.parts import column, empty, line


class LaneStack(QFrame):
    """The lanes of one source."""

    box_zoomed = Signal(float, float)

    def __init__(self, view: TimeView, theme: Theme) -> None:
        super().__init__()
        self.view = view
        self.options = Options()
        self.source = Source()
        self.rows: list[LaneRow] = []
        self.navigator = Navigator(view, theme)
        self.show_residual = True
        self._hidden: set[str] = {"coil_current"}  # the force lane says the same
        self._theme = theme
        self._layout = column(self, spacing=0)
        view.changed.connect(self.refresh)
        view.cursors_changed.connect(self.show_values)
        theme.changed.connect(self.refresh)

    def show_lanes(self, lanes: Sequence[Lane]) -> None:
        """Show these lanes; those of the same name keep their range."""
        if [row.lane for row in self.rows] == list(lanes):
            return
        self._layout.removeWidget(self.navigator)
        empty(self._layout)
        self.rows = []
        for lane in lanes:
            row = LaneRow(lane, self.view, self.options, self._theme)
            row.plot.source = self.source
            row.plot.box_zoomed.connect(self.box_zoomed)
            self.rows.append(row)
            self._layout.addWidget(row, round(lane.weight * 100))
            self._layout.addWidget(line())
        self._layout.addWidget(self.navigator)
        self.arrange()

    def show_source(self, source: Source) -> None:
        """Show another source in the same lanes."""
        for row in self.rows:
            row.plot.painter.forget()
        self.exchange_source(source)

    def exchange_source(self, source: Source) -> None:
        """Show another source of the same data: ranges stay."""
        self.source = source
        self.navigator.source = source
        for row in self.rows:
            row.plot.source = source
            row.plot.painter.painted = Painted()
            row.tint()
        self.refresh()
        self.show_values()

    def hide_lane(self, key: str, hidden: bool) -> None:
        """Hide or show one lane."""
        (self._hidden.add if hidden else self._hidden.discard)(key)
        self.arrange()

    def arrange(self) -> None:
        """Show what is wanted; the lowest visible lane carries the time axis."""
        shown = []
        for row in self.rows:
            wanted = row.lane.key not in self._hidden
            if row.lane.key == "residual":
                wanted = wanted and self.show_residual
            row.setVisible(wanted)
            if wanted:
                shown.append(row)
        for row in self.rows:
            painter = row.plot.painter
            painter.top = bool(shown) and row is shown[0]
            painter.bottom = bool(shown) and row is shown[-1]
        self.refresh()

    def refresh(self) -> None:
        """Repaint what is visible."""
        for row in self.rows:
            if row.isVisible():
                row.plot.update()
        self.navigator.update()

    def show_values(self) -> None:
        """Update the numbers on the cards."""
        for row in self.rows:
            if row.isVisible():
                row.show_numbers(self.source)

    def row(self, key: str) -> LaneRow | None:
        """The lane of that key, if the scene has it."""
        return next((row for row in self.rows if row.lane.key == key), None)

    def visible_rows(self) -> list[LaneRow]:
        """Lanes on screen, from the top."""
        return [row for row in self.rows if row.isVisibleTo(self)]

    def is_hidden(self, key: str) -> bool:
        """Whether the user folded this lane away."""
        return key in self._hidden
