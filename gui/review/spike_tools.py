"""Goes from spike to spike of what is on screen, and has their shape read."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PySide6.QtCore import QObject, QTimer

from gui.lanes.expected import starts
from gui.lanes.source import Source
from gui.lanes.stack import LaneStack
from gui.plots.numbers import number
from gui.review.spike_plots import (
    Intervals,
    interval_plot,
    shape_plot,
    succession_plot,
)
from gui.review.spikes import SpikesView
from gui.session.session import Session
from tactile_lab.arrays import FloatArray
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.jobs import shapes_of_run
from tactile_lab.quantity import show
from tactile_lab.spikes.rate import begins

if TYPE_CHECKING:
    from tactile_lab.store.spike_shapes import SpikeShapes

LOOKED = 500
"""Milliseconds after which it is looked anew what there is to show."""

MOST = 100
"""Most spikes that are laid over each other."""

CLOSE = 16
"""Widths of a spike that are shown of it where it is zoomed to."""

NOT_STORED = "The shape of spikes is read\nfrom the run's folder; it has none yet."


class SpikeTools(QObject):
    """Keeps the page on spikes up to date while it is seen.

    Args:
        view: the page.
        lanes: what is on screen; the chosen spike is marked there.
        session: its desk reads samples, away from the window and from the bench.
    """

    def __init__(self, view: SpikesView, lanes: LaneStack, session: Session) -> None:
        super().__init__(view)
        self._view, self._lanes, self._session = view, lanes, session
        self._shapes: SpikeShapes | None = None
        self._shown: tuple[object, ...] = ()
        self._asked: tuple[object, ...] = ()
        self._reading = False
        view.stepped.connect(self.step)
        view.zoomed.connect(self._zoom)
        view.scopes.group.idClicked.connect(lambda _: self.look())
        timer = QTimer(self)
        timer.timeout.connect(self.look)
        timer.start(LOOKED)

    @property
    def _source(self) -> Source:
        return self._lanes.source

    @property
    def _folder(self) -> Path | None:
        """Where samples can be read: of a run on disk, or of that in progress."""
        source, run = self._source, self._session.run
        return run.folder if source.of is run.source else source.members[0].source.path

    @property
    def _span(self) -> tuple[float, float]:
        """From when to when spikes are looked at, s."""
        view = self._lanes.view
        if self._view.scopes.chosen == 1:
            return view.start, view.end
        if self._view.scopes.chosen == 2 and view.cursors is not None:
            a, b = sorted(view.cursors)
            return a, b
        return -np.inf, np.inf

    def step(self, way: int) -> None:
        """On to the next spike (1), or back to the one before (-1).

        From the chosen one while that is in view, else from an edge of the view: first
        the first spike in it, or the last.
        """
        view, spikes = self._lanes.view, self._source.spikes
        if not spikes.size:
            return
        at = view.spike
        if at is None or not view.start <= at <= view.end:
            at = view.start if way > 0 else view.end
        if way > 0:
            found = int(np.searchsorted(spikes, at, side="right"))
        else:
            found = int(np.searchsorted(spikes, at, side="left")) - 1
        chosen = float(spikes[min(max(found, 0), spikes.size - 1)])
        view.show_spike(chosen)
        self.look()

    def look(self) -> None:
        """Show what has changed since this was last called."""
        if not self._view.isVisible():
            return
        spikes, view = self._source.spikes, self._lanes.view
        now = (self._source, self._folder, spikes.size, self._span, view.spike)
        if now == self._shown:
            return
        if now[:2] != self._shown[:2]:
            self._shapes, self._asked = None, ()
        self._shown = now
        within = Intervals.of(spikes, starts(self._source.holds)).between(*self._span)
        plots = interval_plot(within), succession_plot(within, view.spike)
        why = self._source.why_unrated(*self._span)
        said = f"No count: {why}.\n{within.text}" if why else within.text
        self._view.show_intervals(said, *plots)
        self._show_shape()
        self._read()

    def _wanted(self) -> FloatArray:
        """Times of the spikes to be laid over each other; the chosen one is in it."""
        spikes, (start, end) = self._source.spikes, self._span
        inside = spikes[(spikes >= start) & (spikes <= end)]
        if inside.size > MOST:
            inside = inside[np.linspace(0, inside.size - 1, MOST).astype(np.intp)]
        chosen = self._lanes.view.spike
        return inside if chosen is None else np.union1d(inside, chosen)

    def _read(self) -> None:
        """Have samples read, unless that is on its way or nothing else is wanted."""
        folder, wanted = self._folder, self._wanted()
        asked = (folder, wanted.tobytes())
        if folder is None or self._reading or asked == self._asked or not wanted.size:
            return
        self._asked, self._reading = asked, True
        self._session.desk.ask(
            partial(self._arrived, folder), shapes_of_run, folder, wanted
        )

    def _arrived(self, folder: Path, reply: Reply[SpikeShapes]) -> None:
        self._reading = False
        if folder == self._folder:
            self._shapes = reply.value
            self._show_shape(reply.problem)
            self._read()  # what is wanted may have changed meanwhile

    def _show_shape(self, problem: str = "") -> None:
        spikes, chosen = self._source.spikes, self._lanes.view.spike
        shapes = self._shapes
        found = None if shapes is None else shape_plot(shapes, chosen)
        nothing = problem or (NOT_STORED if self._folder is None else "reading …")
        self._view.show_shape(found, "" if not spikes.size else nothing)
        self._view.show_facts(
            self._facts(chosen), any_spikes=spikes.size > 0, chosen=chosen is not None
        )

    def _facts(self, chosen: float | None) -> str:
        """What is known of the chosen spike."""
        spikes, shapes = self._source.spikes, self._shapes
        if not spikes.size:
            return "No spikes on screen."
        if chosen is None:
            return f"{spikes.size} spikes. Next and Previous ( . and , ) go to each."
        at = int(np.argmin(np.abs(spikes - chosen)))
        said = f"Spike {at + 1} of {spikes.size} at {chosen:.6f} s"
        if at:
            isi = chosen - float(spikes[at - 1])
            if begins(spikes, starts(self._source.holds))[at]:
                said += f"\nafter {show(isi, 's', 4)} of silence"
            else:
                said += f"\n{show(isi, 's', 4)} after the one before"
                if not self._source.why_unrated(chosen - isi, chosen):
                    said += f" ({number(1 / isi, 2)} Hz)"
        if shapes is not None:
            near = int(np.argmin(np.abs(shapes.times - chosen)))
            peak, width = shapes.peaks[near], shapes.widths[near]
            said += f"\npeak {show(peak, 'V', 3)}"
            if np.isfinite(width):
                said += f", {show(width, 's', 3)} beyond the threshold"
        return said

    def _zoom(self) -> None:
        view, shapes = self._lanes.view, self._shapes
        if view.spike is None:
            return
        widths = np.empty(0) if shapes is None else shapes.widths
        known = widths[np.isfinite(widths)]
        width = CLOSE * float(np.median(known)) if known.size else 0.01
        view.show_span(view.spike - width / 4, width)
