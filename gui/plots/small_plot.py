"""Shows the plots that `tactile_lab.plot` describes, live ones and protocols' own."""

from __future__ import annotations

import pickle
from collections.abc import Callable

import pyqtgraph as pg
import shiboken6
from PySide6.QtCore import QSize, Qt, Signal
from PySide6.QtGui import QWheelEvent

from gui.look.theme import Theme
from gui.parts import column, label
from gui.plots.panel_item import FOOT, LOW, PanelItem
from tactile_lab.plot import Plot

PANEL, SMALL = 200, 130
"""Height of a panel, and of one that is low in the report, px."""
LINE = 15
"""Height of a line of text below a panel, px."""
AIR = 6
"""Height above a plot without a heading, for the number at the end of its axis, px."""
BESIDE = 10
"""Margin of the words where there is no plot, px."""
RIGHT = 14
"""Margin on the right, px: half of a number at the end of an axis."""


class SmallPlot(pg.GraphicsLayoutWidget):  # type: ignore[misc]
    """One plot; its panels stand above one another.

    Args:
        theme: of the window.
        nothing: what stands where there is no plot.
        height: px; then the axes have no names. None for what the panels need.

    Attributes:
        plot: shown now, or None.
        panels: of it.
        picked: a point was clicked; see `Series.of`.
        tell: says what such a point is, for a person.
    """

    picked = Signal(int)

    def __init__(
        self, theme: Theme, nothing: str = "", height: int | None = None
    ) -> None:
        super().__init__()
        self._theme, self.nothing, self._fixed = theme, nothing, height
        self.plot: Plot | None = None
        self._told = pickle.dumps((None, nothing))
        self._words = label(nothing, "small", wrap=True)
        self._words.setAlignment(Qt.AlignmentFlag.AlignCenter)
        column(self.viewport(), self._words, margin=BESIDE)
        self.panels: list[PanelItem] = []
        self.tell: Callable[[int], str] = lambda number: ""
        self.setFixedHeight(height) if height else self.setMinimumHeight(PANEL)
        self.setCacheMode(pg.GraphicsView.CacheModeFlag.CacheNone)
        self.setAntialiasing(True)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.ci.setContentsMargins(0, AIR if height else 0, RIGHT, 0)
        self.ci.setSpacing(0)
        theme.changed.connect(self.draw)
        self.draw()

    def show_plot(self, plot: Plot | None) -> None:
        """Show a plot, or nothing; where the user zoomed in the same plot stays.

        One that is as before stays as it is: it costs more than a frame to build.
        """
        told = pickle.dumps((plot, self.nothing))
        if told == self._told:
            return
        self._told = told
        same = (
            plot is not None and self.plot is not None and self.plot.name == plot.name
        )
        looked = [
            (one.panel.label, one.box.viewRange()) if one.box.moved else None
            for one in self.panels
        ]
        self.plot = plot
        if plot is not None and self._fixed is None:
            shown = plot.title or ", ".join(panel.label for panel in plot.panels)
            self.setAccessibleName(f"{shown} against {plot.x_label}")
            self.setToolTip(plot.caption)
            self.setMinimumHeight(sum(_heights(plot)))
        self.draw()
        for one, part in zip(self.panels, looked, strict=False):
            if same and part is not None and part[0] == one.panel.label:
                across, up = part[1]
                one.box.setRange(xRange=across, yRange=up, padding=0)

    def sizeHint(self) -> QSize:
        """As high as its panels need; Qt would ask for room for a whole picture."""
        return QSize(super().sizeHint().width(), self.minimumHeight())

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Zoom with Ctrl; else the page below scrolls."""
        if event.modifiers() & Qt.KeyboardModifier.ControlModifier:
            super().wheelEvent(event)
        else:
            event.ignore()

    def draw(self) -> None:
        """All panels, or why there are none."""
        self.clear()
        for panel in self.panels:
            # at once: a collector that takes it apart piece by piece meets Qt in it
            shiboken6.delete(panel)
        self.panels, plot, tokens = [], self.plot, self._theme.tokens
        self.setBackground(tokens.sunken if self._fixed else tokens.panel)
        self._words.setText(self.nothing)
        self._words.setVisible(plot is None)
        if plot is None:
            return
        for row, height in enumerate(_heights(plot)):
            last = plot.beside or row == len(plot.panels) - 1
            foot = (FOOT if plot.x_label else LOW) if last else 8
            ratio = self.devicePixelRatio()
            item = PanelItem(plot, plot.panels[row], tokens, ratio, foot)
            self.addItem(item, row, 0)
            self.ci.layout.setRowStretchFactor(row, height)
            if self.panels and not plot.beside:
                item.box.setXLink(self.panels[0].box)
            self.panels.append(item)


def _heights(plot: Plot) -> list[int]:
    """Of the panels, px; those with numbers along x are higher."""
    high = [PANEL if panel.height > 1.7 else SMALL for panel in plot.panels]
    texts = [panel.text.count("\n") + 1 for panel in plot.panels]
    high = [h + LINE * (n if n > 2 else 0) for h, n in zip(high, texts, strict=True)]
    last = len(high) - 1
    return [h + FOOT * (plot.beside or i == last) for i, h in enumerate(high)]
