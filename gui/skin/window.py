"""The window of an array: map and raster while it is computed, and played after."""

from __future__ import annotations

import time as wall
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QCloseEvent, QKeySequence, QShortcut
from PySide6.QtWidgets import QProgressBar, QSlider, QSplitter, QWidget

from gui.look.theme import Theme
from gui.parts import Combo, Elided, IconButton, Part, column, label, row, say
from gui.screen.stop_bar import StopBar
from gui.skin.computing import Failed, SkinComputation, TrainsFound
from gui.skin.film import Dots, Film
from gui.skin.views import MapView, Raster
from tactile_lab.errors import RunFolderError
from tactile_lab.quantity import count, show
from tactile_lab.skin.events import FILE, Events
from tactile_lab.skin.layout import Array
from tactile_lab.skin.skin import Skin, load_skin

if TYPE_CHECKING:
    from gui.screen.panels import Panels

FRAME = 33
"""Time between two pictures, ms."""
SPEEDS = {"1/100 speed": 0.01, "1/10 speed": 0.1, "real time": 1.0, "10 × faster": 10.0}
STEPS = 2000
"""Of the slider."""


def open_skin(path: Path, out: Path) -> Callable[[Theme, Panels | None], SkinWindow]:
    """Read a skin file, which is computed then, or events on disk.

    Takes seconds, most of all the first time on a computer: for a thread of its own
    wherever a window has to answer.

    Args:
        path: a skin file (TOML), a folder with events, or their file.
        out: where the folder of a skin that is computed is put.

    Returns:
        Makes the window on it, from a theme and the panels of the main window it goes
        with, if any.

    Raises:
        SceneError, ParameterError: the skin cannot be used as written.
        RunFolderError: there are no events.
    """
    if not path.exists():
        raise RunFolderError(f"{path} does not exist; give a skin's file or folder.")
    warnings: tuple[str, ...] = ()
    if path.is_dir() or path.suffix == Path(FILE).suffix:
        events = Events.read(path)
        skin = load_skin(events.about["skin"], events.about["name"], folder=path)
        computed, folder = None, path
    else:
        from tactile_lab.skin.press import highest

        computed = skin = load_skin(path)
        _, warnings = highest(skin)
        folder = out / skin.name

    def made(theme: Theme, panels: Panels | None) -> SkinWindow:
        computing = SkinComputation(computed, folder)
        return SkinWindow(skin, computing, theme, panels, warnings)

    return made


class SkinWindow(QWidget):
    """Map and raster of one array; with the bench window, whose STOP it may cover, one.

    Attributes:
        film: to be played; None while it is computed.
    """

    def __init__(
        self,
        skin: Skin,
        computing: SkinComputation,
        theme: Theme,
        panels: Panels | None = None,
        warnings: tuple[str, ...] = (),
    ) -> None:
        parent = None if panels is None else panels.header.window()
        super().__init__(parent, Qt.WindowType.Window)
        self.setWindowTitle(f"{skin.title} · Tactile Lab")
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self.setProperty("role", "page")
        self.resize(1180, 640)
        theme.dress(self)
        self._skin, self._computing = skin, computing
        self.film: Film | None = None
        self._dots, self._rates = Dots(), np.full(skin.array.size, np.nan)
        self._at, self._last = 0.0, 0.0
        self.map = MapView(theme, skin.array)
        self.raster = Raster(theme, skin.duration, skin.array.size)
        self.play = IconButton(theme, "play", "Play (Space)", checkable=True)
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(0, STEPS)
        self.slider.setAccessibleName("Time")
        self.speed = Combo()
        self.speed.addItems(list(SPEEDS))
        self.speed.setCurrentText("1/10 speed")
        self.speed.setAccessibleName("Speed")
        self.progress = QProgressBar()
        self.progress.setRange(0, skin.array.size)
        self.progress.setTextVisible(False)
        self.when, self.numbers = label("", "value"), Elided("", "muted")
        self.when.setMinimumWidth(150)
        self.warning = label(" ".join(warnings), "warning", wrap=True)
        if not warnings:
            self.warning.hide()
        about = f"{skin.array.size:,} taxels · {show(skin.duration, 's')} · simulated"
        both = QSplitter(Qt.Orientation.Horizontal)
        left = QWidget()
        self.marks = label(marked(skin.array), "muted", wrap=True)
        if not self.marks.text():
            self.marks.hide()
        column(left, (self.map, 1), self.marks)
        both.addWidget(left)
        both.addWidget(self.raster)
        both.setSizes([520, 640])
        self._head = None if panels is None else StopBar(panels, skin.title)
        heads = () if self._head is None else (self._head,)
        title: tuple[Part, ...] = () if heads else (label(skin.title, "big"), 12)
        inner = QWidget()
        column(self, *heads, (inner, 1), spacing=0)
        column(
            inner,
            row(*title, (label(about, "muted"), 1)),
            self.warning,
            (both, 1),
            self.progress,
            row(self.play, (self.slider, 1), self.when, self.speed),
            self.numbers,
            margin=14,
            spacing=8,
        )
        self.slider.valueChanged.connect(self._slid)
        self.raster.picked.connect(self.show_time)
        self.play.toggled.connect(self._toggled)
        QShortcut(QKeySequence("Space"), self).activated.connect(self.play.click)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self._look)
        self._timer.start(FRAME)
        self._enable(False)
        say(self.when, "computing …")
        self.setFocus()  # not STOP, which Space would press

    def show_time(self, at: float) -> None:
        """Show the spikes in the stretch before `at` s."""
        film = self.film
        if film is None:
            return
        self._at = min(max(at, 0.0), self._skin.duration)
        self.slider.blockSignals(True)
        self.slider.setValue(round(self._at / self._skin.duration * STEPS))
        self.slider.blockSignals(False)
        self.raster.show_time(self._at)
        counts = film.counts(self._at)
        self.map.show_rates(counts / film.stretch, film.most / film.stretch)
        say(self.when, f"{self._at:.3f} of {self._skin.duration:.3f} s")
        self.numbers.set_whole(
            f"{count(int(counts.sum()), 'spike')} of "
            f"{count(int((counts > 0).sum()), 'taxel')} in the "
            f"{show(film.stretch, 's')} before; {count(film.dots.seen, 'spike')} of "
            f"{count(int((film.events.count > 0).sum()), 'taxel')} in all"
            f"{self._thinned}"
        )

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stop computing."""
        if self._head is not None:
            self._head.leave()
        self._timer.stop()
        self._computing.leave()
        super().closeEvent(event)

    @property
    def _thinned(self) -> str:
        every = (self.film.dots if self.film is not None else self._dots).every
        return "" if every == 1 else f" · the raster draws one of {every}"

    def _look(self) -> None:
        """Show what has come, or the next picture."""
        fresh = False
        for told in self._computing.told():
            if isinstance(told, Film):
                self._computed(told)
            elif isinstance(told, Failed):
                self._enable(False)
                self.progress.hide()
                say(self.when, "not computed")
                self.warning.setText(told.text)
                self.warning.show()
            else:
                self._take(told)
                fresh = True
        if fresh and self.film is None:
            self._show_computed()
        if self.play.isChecked():
            now = wall.monotonic()
            speed = SPEEDS[self.speed.currentText()]
            at = self._at + (now - self._last) * speed
            self._last = now
            if at >= self._skin.duration:
                self.play.setChecked(False)
            self.show_time(at)

    def _take(self, told: TrainsFound) -> None:
        taxels = told.first + np.arange(told.count.size)
        self._rates[taxels] = told.count / self._skin.duration
        self._dots.add(told.time, np.repeat(taxels, told.count))
        self.progress.setValue(int(taxels[-1]) + 1)

    def _show_computed(self) -> None:
        """Mean rates and spikes of the taxels that are computed so far."""
        free = self._rates[~self._skin.array.named(self._skin.array.stuck)]
        most = np.nanmax(free, initial=1.0)
        self.map.show_rates(self._rates, float(most))
        self.raster.show_dots(*self._dots.points)
        self.numbers.set_whole(
            f"{self.progress.value():,} of {self._skin.array.size:,} taxels computed, "
            f"{self._dots.seen:,} spikes; the map shows the mean rate of each"
            + self._thinned
        )

    def _computed(self, film: Film) -> None:
        self.film = film
        self.progress.hide()
        self.raster.show_dots(*film.dots.points)
        self._enable(True)
        self.show_time(film.stretch)

    def _enable(self, on: bool) -> None:
        for part in (self.play, self.slider, self.speed):
            part.setEnabled(on)

    def _slid(self, value: int) -> None:
        self.play.setChecked(False)
        self.show_time(value / STEPS * self._skin.duration)

    def _toggled(self, on: bool) -> None:
        self.play.set_icon("freeze" if on else "play")
        self._last = wall.monotonic()
        if on and self._at >= self._skin.duration:
            self.show_time(0.0)


def marked(array: Array) -> str:
    """What the marks of a map mean; "" where nothing is marked."""
    dead, stuck = len(array.dead), len(array.stuck)
    said = [f"✕ dead ({dead:,})"] if dead else []
    if stuck:
        said.append(f"▢ stuck ({stuck:,}), left out of full colour")
    return " · ".join(said)
