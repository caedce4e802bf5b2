"""A run on disk as a source: pyramids in memory, samples fetched when zoomed in."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gui.lanes.decimate import Drawn, FloatArray, cut, line_between, middle, stepped
from gui.lanes.expected import Hold, settled
from gui.lanes.recorded_twin import RecordedTwin
from gui.lanes.twinned import TwinSlice
from tactile_lab.store.layout import BIN
from tactile_lab.store.run import Run
from tactile_lab.store.signal import StoredSignal

BRANCH = 16
"""Bins joined into one on the next level."""

MARGIN, FINER = 0.5, 2
"""Part of a view's width that is read on either side of it, and columns a pixel."""

PICTURE = 100
"""Columns from which on samples are read; for a number, what is in memory does."""

DETAILS = 4
"""Views of a signal's samples kept."""


FINEST = 1 << 17
"""Most bins of a signal held in memory."""


@dataclass(frozen=True, eq=False)
class Level:
    """Bins of equal length: rows are time, least, largest, mean."""

    rows: FloatArray
    width: float


class Pyramid:
    """One stored signal at several resolutions; what is finer is fetched."""

    def __init__(self, signal: StoredSignal) -> None:
        whole = signal.envelope(cells=min(max(1, -(-len(signal) // BIN)), FINEST))
        rows = np.array([whole.time, whole.low, whole.high, whole.mean])
        self.levels = [Level(rows, typical_step(whole.time))]
        while self.levels[-1].rows.shape[1] > 4096:
            last = self.levels[-1]
            self.levels.append(Level(joined(last.rows), last.width * BRANCH))

    def between(self, start: float, end: float, count: int) -> Drawn:
        """What lies in [start, end] s in about `count` columns."""
        level = self.levels[0]
        for coarser in self.levels[1:]:
            if (end - start) / coarser.width < 2 * count:
                break
            level = coarser
        return cut(level.rows, level.width, start, end, count)

    def coarse(self, start: float, end: float, count: int) -> bool:
        """Whether samples would show more than bins do."""
        return (end - start) / self.levels[0].width < count


@dataclass(frozen=True, eq=False)
class Detail:
    """A part of a signal, read more finely than the pyramid has it.

    Attributes:
        rows: time, least, largest, mean.
        width: of one entry, s.
        start, end: what was asked for, s.
        exact: whether each entry is a sample.
    """

    rows: FloatArray
    width: float
    start: float
    end: float
    exact: bool

    def covers(self, start: float, end: float) -> bool:
        """Whether it has all of [start, end] s."""
        return self.start <= start and end <= self.end


def typical_step(time: FloatArray) -> float:
    """Time from one entry to the next, s; gaps do not count."""
    return middle(np.diff(time[:10_001])) if time.size > 1 else 1.0


def joined(rows: FloatArray) -> FloatArray:
    """Every `BRANCH` bins as one."""
    edges = np.arange(0, rows.shape[1], BRANCH)
    counts = np.diff(np.append(edges, rows.shape[1]))
    return np.array(
        [
            rows[0, edges],
            np.minimum.reduceat(rows[1], edges),
            np.maximum.reduceat(rows[2], edges),
            np.add.reduceat(rows[3], edges) / counts,
        ]
    )


class RunSource:
    """A run on disk. Opening reads the pyramids: do that away from the window's thread.

    Args:
        path: folder of the run.

    Raises:
        RunFolderError: it cannot be read as a run.

    Attributes:
        info: contents of `run.json`.
        signals: what the run stored, force and spikes included.
        model: the twin, once it has come.
        fetched: set each time samples asked for have arrived.
    """

    running = False

    def __init__(self, path: Path) -> None:
        self._run = Run.load(path)
        self.path = path
        self.info: dict[str, Any] = self._run.info
        self.model: RecordedTwin | None = None
        self.fetched = threading.Event()
        run = self._run
        self._pyramids = {name: Pyramid(run.signal(name)) for name in run.signals}
        self.length = max(run.duration, 1e-3)
        self.reach = self.followed = self.length
        self.spikes = run.spikes["time"].copy()
        self.trials = run.trials
        self.holds = [
            Hold(
                float(t["start"]),
                float(t["end"]),
                _text(t["label"]),
                bool(t["pause"]),
                _held(t),
            )
            for t in self.trials
        ]
        attributes = run.attributes
        self.simulated = run.simulated
        self._gain = float(attributes.get("newtons_per_ampere", 1.0)) or 1.0
        self._slow = _slow(run, self._gain)
        slow = (name for name, (time, _) in self._slow.items() if time.size)
        searched = () if run.detection is None else ("spikes",)
        self.signals: tuple[str, ...] = (*slow, *self._pyramids, *searched)
        self._force = stepped(*self._slow["force"], self.length)
        self._details: dict[str, tuple[Detail, ...]] = {}
        self._wanted: dict[str, tuple[float, float, int]] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._reader: threading.Thread | None = None

    @property
    def loop(self) -> FloatArray:
        """Shape (n, 2): coil current, A, and the field read then, T; on steps only."""
        (at, force), (time, field) = self._slow["force"], self._slow["field"]
        if not (at.size and time.size):
            return np.empty((0, 2))
        inside = settled(time, self.holds)
        time, field = time[inside], field[inside]
        return np.column_stack([np.interp(time, at, force) / self._gain, field])

    def add_twin(
        self, whole: TwinSlice, ask: Callable[[float, float, int], None]
    ) -> None:
        """Put the twin beside the data; `ask` has a part of it sampled closely."""
        self.model = RecordedTwin(whole, ask)
        self.fetched.set()

    def add_twin_part(self, part: TwinSlice) -> None:
        """A part of the twin that was asked for has come."""
        if self.model is not None:
            self.model.add(part)
            self.fetched.set()

    @property
    def twin_spikes(self) -> FloatArray:
        """The twin's."""
        return np.empty(0) if self.model is None else self.model.spikes

    def trace(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The stored signal; where zoomed in, samples as soon as they are read.

        The force holds from each set-point to the next.
        """
        if signal in self._slow and signal not in self._pyramids:
            time, value = self._force if signal == "force" else self._slow[signal]
            return line_between(time, value, start, end, count)
        pyramid = self._pyramids.get(signal)
        if pyramid is None:
            return Drawn.nothing()
        if not pyramid.coarse(start, end, count):
            return pyramid.between(start, end, count)
        inside = max(start, 0.0), min(end, self.length)
        having = [d for d in self._details.get(signal, ()) if d.covers(*inside)]
        best = min(having, key=lambda detail: detail.width, default=None)
        enough = best is not None and (
            best.exact or best.width <= (end - start) / count
        )
        if not enough and count >= PICTURE:
            self._fetch(signal, (start, end, count))
        if best is None:
            return pyramid.between(start, end, count)
        return cut(best.rows, best.width, start, end, count)

    def twin(self, signal: str, start: float, end: float, count: int) -> Drawn:
        """The model's."""
        if self.model is None:
            return Drawn.nothing()
        return self.model.between(signal, start, end, count)

    def planned(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """The run is over: what was applied is shown, not what was planned."""
        return np.empty(0), np.empty(0)

    def take_fetched(self) -> bool:
        """Whether samples have arrived since this was last asked."""
        arrived = self.fetched.is_set()
        self.fetched.clear()
        return arrived

    def close(self) -> None:
        """Let go of the file, as soon as nobody reads in it."""
        with self._lock:
            self._wanted.clear()
            self._closed = True
            reading = self._reader is not None
        if not reading:
            self._run.close()

    def _fetch(self, signal: str, view: tuple[float, float, int]) -> None:
        """Have samples read; the newest wish for each signal wins."""
        with self._lock:
            if self._closed:
                return
            self._wanted[signal] = view
            if self._reader is None:
                # no daemon: one that dies within a read takes HDF5's lock along, and
                # the process never ends
                self._reader = threading.Thread(target=self._read, name="zoom")
                self._reader.start()

    def _read(self) -> None:
        while True:
            with self._lock:
                if not self._wanted:
                    self._reader = None
                    if self._closed:
                        self._run.close()
                    return
                signal, view = self._wanted.popitem()
            detail = self._detail(signal, *view)
            have = self._details.get(signal, ())
            self._details[signal] = (*have, detail)[-DETAILS:]
            self.fetched.set()

    def _detail(self, signal: str, start: float, end: float, count: int) -> Detail:
        """Read around a view, finer than it needs: it may move and zoom a while."""
        margin = MARGIN * (end - start)
        start, end = start - margin, end + margin
        stored = self._run.signal(signal)
        part = stored.between(max(0.0, start), end)
        samples = part.stop - part.start
        cells = max(1, min(samples, round(FINER * (1 + 2 * MARGIN) * count)))
        found = stored.envelope(part.start, part.stop, cells=cells)
        rows = np.array([found.time, found.low, found.high, found.mean])
        exact = rows.shape[1] == samples
        return Detail(rows, typical_step(found.time), start, end, exact)


def _slow(run: Run, gain: float) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Force from the applied current, and the field, as (times, values)."""
    current = run.current
    measured = np.where(
        np.isnan(current["measured"]), current["setpoint"], current["measured"]
    )
    field = run.field
    return {
        "force": (current["time"].copy(), measured * gain),
        "field": (field["time"].copy(), field["field"].copy()),
    }


def _held(trial: Any) -> tuple[float, float] | None:
    start, begin, end = (float(trial[k]) for k in ("start", "hold_start", "hold_end"))
    return None if begin != begin else (start + begin, start + end)


def _text(raw: bytes) -> str:
    return bytes(raw).decode("utf-8", "replace").rstrip("\0")
