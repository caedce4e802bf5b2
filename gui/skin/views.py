"""The map and the raster of an array."""

from __future__ import annotations

import numpy as np
import pyqtgraph as pg
from PySide6.QtCore import QRectF, Signal
from PySide6.QtGui import QColor

from gui.look.fonts import sized
from gui.look.theme import Theme
from gui.plots.axis import GuardedLine, RoundAxis, guarded, stroke
from gui.skin.film import pixels
from tactile_lab.arrays import FloatArray
from tactile_lab.skin.layout import Array

MM = 1e3
FOOT, LEFT, BAR = 38, 56, 62
"""Height and width of the axes, and width of the colour bar, px."""


class GuardedImage(pg.ImageItem):  # type: ignore[misc]
    """An image that may fail alone."""

    paint = guarded(pg.ImageItem.paint)


class View(pg.GraphicsLayoutWidget):  # type: ignore[misc]
    """One box between two axes, in the theme's colours."""

    def __init__(self, theme: Theme, x: str, y: str, name: str) -> None:
        super().__init__()
        self._theme, self._labels = theme, (y, x)
        self.setAccessibleName(name)
        self.setMinimumSize(280, 220)
        self.ci.setContentsMargins(4, 8, 12, 2)
        self.ci.setSpacing(0)
        self.axes = RoundAxis("left", 34), RoundAxis("bottom", 70)
        self.box = pg.ViewBox(enableMenu=False)
        left, bottom = self.axes
        self.ci.addItem(left, 0, 0)
        self.ci.addItem(self.box, 0, 1)
        self.ci.addItem(bottom, 1, 1)
        left.setWidth(LEFT)
        bottom.setHeight(FOOT)
        for axis in self.axes:
            axis.linkToView(self.box)
        theme.changed.connect(self.dress)

    def dress(self) -> None:
        """Take on the theme's colours."""
        tokens = self._theme.tokens
        self.setBackground(tokens.panel)
        self.box.setBackgroundColor(tokens.plot)
        for axis, text in zip(self.axes, self._labels, strict=True):
            axis.tint(tokens)
            axis.setLabel(text, color=tokens.muted, **{"font-size": "12px"})


class MapView(View):
    """Every taxel where it lies, coloured by its rate; with the bar of colours.

    What is dead has no colour and is crossed out, what is stuck is framed: shapes can
    be told apart without colours, and of the two tones of a frame one stands out from
    any colour of the map.
    """

    def __init__(self, theme: Theme, array: Array) -> None:
        super().__init__(theme, "x (mm)", "y (mm)", "Map of the taxels")
        places, side = array.places, array.side
        self._which, (x, y, wide, high) = pixels(places, side)
        self._blank = (self._which < 0) | array.named(array.dead)[self._which]
        self.picture = GuardedImage(axisOrder="col-major")
        self.picture.setColorMap(pg.colormap.get("viridis"))
        self._place = QRectF(MM * x, MM * y, MM * wide, MM * high)
        self.box.addItem(self.picture)
        self.box.setAspectLocked(True)
        air = 0.04 * MM * max(wide, high)
        self.box.setRange(
            xRange=(MM * x - air, MM * (x + wide) + air),
            yRange=(MM * y - air, MM * (y + high) + air),
            padding=0,
        )
        self.bar = pg.ColorBarItem(
            values=(0.0, 1.0), width=14, colorMap="viridis", interactive=False
        )
        self.bar.setMinimumWidth(BAR)
        self.ci.addItem(self.bar, 0, 2)
        mm = MM * side
        self.cross = self._marks("x", 0.5 * mm, MM * places[array.named(array.dead)])
        stuck = MM * places[array.named(array.stuck)]
        self.frames = [self._marks("s", part * mm, stuck) for part in (0.92, 0.76)]
        self.dress()

    def _marks(
        self, symbol: str, size: float, places: FloatArray
    ) -> pg.ScatterPlotItem:
        """Marks at places, mm, that grow with the map."""
        made = pg.ScatterPlotItem(symbol=symbol, size=size, pxMode=False)
        made.setData(places[:, 0], places[:, 1])
        self.box.addItem(made, ignoreBounds=True)
        return made

    def dress(self) -> None:
        """Take on the theme's colours."""
        super().dress()
        tokens = self._theme.tokens
        axis = self.bar.getAxis("right")
        axis.setStyle(tickFont=sized(11))
        axis.setTextPen(tokens.muted)
        axis.setPen(tokens.border_strong)
        axis.setLabel("Rate (Hz)", color=tokens.muted, **{"font-size": "12px"})
        self.cross.setPen(None)
        self.cross.setBrush(QColor(tokens.muted))
        for frame, colour in zip(self.frames, (tokens.text, tokens.plot), strict=True):
            frame.setPen(stroke(colour, 2.0))
            frame.setBrush(None)

    def show_rates(self, rates: FloatArray, most: float) -> None:
        """Show the rate of each taxel, Hz, NaN for none yet; `most` is full colour."""
        image = rates[self._which]
        image[self._blank] = np.nan
        self.picture.setImage(
            image, levels=(0.0, most), autoLevels=False, rect=self._place
        )
        if self.bar.levels() != (0.0, most):
            self.bar.setLevels((0.0, most))


class Raster(View):
    """Every spike by time and taxel, and the moment the map shows.

    Attributes:
        picked: somebody points at a time, s.
    """

    picked = Signal(float)

    def __init__(self, theme: Theme, duration: float, taxels: int) -> None:
        super().__init__(theme, "Time (s)", "Taxel", "Raster of the spikes")
        self.dots = pg.ScatterPlotItem(size=3.0, pen=None, pxMode=True)
        self.now = GuardedLine(angle=90)
        self.now.setVisible(False)
        self.box.addItem(self.dots)
        self.box.addItem(self.now)
        self.box.setRange(xRange=(0, duration), yRange=(-1, taxels), padding=0)
        self.box.setMouseEnabled(x=False, y=False)
        self.scene().sigMouseClicked.connect(self._clicked)
        self.dress()

    def dress(self) -> None:
        """Take on the theme's colours."""
        super().dress()
        tokens = self._theme.tokens
        self.dots.setBrush(QColor(tokens.V_K))
        self.now.setPen(stroke(tokens.accent, self.devicePixelRatio()))

    def show_dots(self, time: FloatArray, taxel: FloatArray) -> None:
        """Show these spikes."""
        self.dots.setData(time, taxel)

    def show_time(self, at: float) -> None:
        """Mark the moment, s."""
        self.now.setVisible(True)
        self.now.setPos(at)

    def _clicked(self, event: object) -> None:
        at = event.scenePos()  # type: ignore[attr-defined]
        if self.box.sceneBoundingRect().contains(at):
            self.picked.emit(float(self.box.mapSceneToView(at).x()))
