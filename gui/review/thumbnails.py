"""Small pictures of runs: the force they applied, and the spikes below it."""

from __future__ import annotations

import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PySide6.QtCore import QObject, QPointF, QRectF, Qt, Signal
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPolygonF
from PySide6.QtWidgets import QWidget
from shiboken6 import isValid

from gui.look.theme import Theme
from tactile_lab.arrays import FloatArray
from tactile_lab.engine.threads import start
from tactile_lab.errors import TactileLabError

POINTS = 72
"""Points of the force, and places a spike can be drawn at."""

PAUSE = 0.02
"""Rest between two runs, s: reading them takes no time from a frame."""


@dataclass(frozen=True, eq=False)
class Thumbnail:
    """A run at a glance.

    Attributes:
        force: shape (POINTS,), scaled to its largest magnitude.
        spikes: places from 0 to 1 at which there are any.
    """

    force: FloatArray
    spikes: FloatArray


def thumbnail_of(folder: Path) -> Thumbnail:
    """Read a run's current and spikes.

    Raises:
        RunFolderError, OSError: it cannot be read.
    """
    from tactile_lab.store.run import Run  # heavy: not before there is one

    with Run.load(folder) as run:
        length = max(run.duration, 1e-9)
        (when, amperes), spikes = run.read_back.T, run.spikes["time"] / length
        grid = np.linspace(0.0, length, POINTS)
        if not when.size:
            return Thumbnail(np.zeros(POINTS), _places(spikes))
        at = np.searchsorted(when, grid, side="right") - 1
        force = np.where(at < 0, 0.0, amperes[np.maximum(at, 0)])
        return Thumbnail(force / max(np.max(np.abs(force)), 1e-9), _places(spikes))


def _places(spikes: FloatArray) -> FloatArray:
    return np.unique(np.round(np.clip(spikes, 0, 1) * (POINTS - 1))) / (POINTS - 1)


class Thumbnails(QObject):
    """Reads runs one after another, away from the window's thread, and keeps them."""

    made = Signal(object)
    """The folder whose thumbnail is there now."""

    def __init__(self) -> None:
        super().__init__()
        self._kept: dict[Path, Thumbnail | None] = {}
        self._wanted: list[Path] = []
        self._busy = False
        self._lock = threading.Lock()

    def of(self, folder: Path) -> Thumbnail | None:
        """The thumbnail, if it is there already."""
        return self._kept.get(folder)

    def ask(self, folders: Sequence[Path]) -> None:
        """Have the thumbnails made that are missing, first ones first."""
        with self._lock:
            self._wanted = [folder for folder in folders if folder not in self._kept]
            idle, self._busy = not self._busy, True
        if idle:
            start(self._read, "thumbnails", finishes=True)

    def _read(self) -> None:
        while True:
            with self._lock:
                if not self._wanted:
                    self._busy = False
                    return
                folder = self._wanted.pop(0)
            try:
                self._kept[folder] = thumbnail_of(folder)
            except (TactileLabError, OSError, KeyError, ValueError):
                self._kept[folder] = None  # its card says what is wrong with it
            ended = not threading.main_thread().is_alive()
            if ended or not isValid(self):  # the window has gone meanwhile
                return
            self.made.emit(folder)
            time.sleep(PAUSE)


class ThumbnailView(QWidget):
    """The picture on a run's card."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._theme = theme
        self._shown: Thumbnail | None = None
        self.setFixedSize(84, 42)
        self.setAttribute(Qt.WidgetAttribute.WA_TransparentForMouseEvents)
        theme.changed.connect(self.update)

    def show_thumbnail(self, thumbnail: Thumbnail | None) -> None:
        """Show a run, or an empty field."""
        self._shown = thumbnail
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the force as an area, spikes as strokes."""
        painter, tokens = QPainter(self), self._theme.tokens
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(tokens.plot))
        painter.drawRoundedRect(QRectF(self.rect()), 4, 4)
        if self._shown is None:
            return
        width, height = self.width() - 8.0, self.height() - 16.0
        force = self._shown.force
        below = force.min() < -0.02
        zero = 4 + (height / 2 if below else height)
        scale = height / 2 if below else height
        xs = 4 + np.linspace(0, width, force.size)
        points = [
            QPointF(x, zero - value * scale)
            for x, value in zip(xs.tolist(), force.tolist(), strict=True)
        ]
        soft = QColor(tokens.force)
        soft.setAlpha(60)
        painter.setBrush(soft)
        area = [QPointF(4, zero), *points, QPointF(4 + width, zero)]
        painter.drawPolygon(QPolygonF(area))
        painter.setPen(QColor(tokens.force))
        painter.drawPolyline(QPolygonF(points))
        painter.setRenderHint(QPainter.RenderHint.Antialiasing, on=False)
        painter.setPen(QColor(tokens.muted))
        low = self.height() - 4
        for place in self._shown.spikes.tolist():
            x = round(4 + place * width)
            painter.drawLine(x, low - 6, x, low)
