"""A run on disk as a source: pyramids in memory, samples fetched when zoomed in."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from gui.lanes.expected import Stretch, settled
from gui.lanes.source import Source, no_counts
from gui.lanes.twin import MARGIN, Look, TwinTraces
from tactile_lab.arrays import FloatArray
from tactile_lab.engine.events import ModelPart
from tactile_lab.errors import RunFolderError, SceneError
from tactile_lab.pyramid import FINE, Pyramid
from tactile_lab.signals import AVERAGED, BENCH_ONLY
from tactile_lab.store.applied_trial import holds, onsets
from tactile_lab.store.layout import BIN
from tactile_lab.store.remarks import read_remarks
from tactile_lab.store.run import Run
from tactile_lab.store.signal import StoredSignal
from tactile_lab.store.spike_shapes import threshold_of
from tactile_lab.store.stored_run import Records
from tactile_lab.store.uncounted import samples_catch_spikes, uncounted
from tactile_lab.trace import Trace

FINER = 2
"""Cells a pixel that are read."""

PICTURE = 100
"""Columns from which on samples are read; for a number, what is in memory does."""


class RunSource(Source):
    """A run on disk. Opening reads the pyramids: do that away from the window's thread.

    Raises:
        RunFolderError: it cannot be read as a run.

    Attributes:
        info: contents of `run.json`.
        signals: what the run stored, force and spikes included.
        model: the twin, once it has come.
        fetched: set each time samples asked for have arrived.
        moves_probes: its protocol put the probes elsewhere for a while, or set the
            circuit's voltages: there is nothing to compare with the model.
    """

    spikes: FloatArray = np.empty(0)
    length = reach = 0.0
    holds: list[Stretch] = []  # noqa: RUF012
    notes: list[tuple[float, str]] = []  # noqa: RUF012

    def __init__(self, path: Path) -> None:
        self._run = run = Run.load(path)
        self.path: Path = path
        self.info: dict[str, Any] = run.info
        self.model: TwinTraces | None = None
        self.fetched = threading.Event()
        self._pyramids = {name: _pyramid(run.signal(name)) for name in run.signals}
        self.length = self.reach = max(run.duration, 1e-3)
        self.spikes = run.spikes["time"].copy()
        self.read_notes()
        self.trials = run.trials
        self.holds = [
            _stretch(*one)
            for one in zip(self.trials, holds(run, self.trials), strict=True)
        ]
        self.onsets = _onsets(run, self.trials)
        self.uncounted = uncounted(run)
        self.counted = samples_catch_spikes(run)
        self._unrated = [*super().unrated, *no_counts(self.holds, self.uncounted)]
        self.simulated = run.simulated
        self.moves_probes, self.sets_voltages = _moves(run)
        self._threshold = threshold_of(run)
        self._beyond = {name: run.overrange(name) for name in run.signals}
        self._gain = float(run.attributes.get("newtons_per_ampere", 1.0)) or 1.0
        self._slow = _slow(run, self._gain)
        slow = (name for name, (time, _) in self._slow.items() if time.size)
        searched = () if run.detection is None else ("spikes",)
        self.signals: tuple[str, ...] = (*slow, *self._pyramids, *searched)
        self._lines = {
            "force": Trace.steps(*self._slow["force"], self.length),
            **{name: Trace.line(*self._slow[name]) for name in AVERAGED},
        }
        self._wanted: dict[str, tuple[float, float, int]] = {}
        self._lock = threading.Lock()
        self._closed = False
        self._reader: threading.Thread | None = None

    @property
    def has_sensor(self) -> bool:
        """Whether it recorded what a model of the sensor can stand beside."""
        return bool(set(self.signals) - BENCH_ONLY - {"force"})

    @property
    def sampled(self) -> bool:
        """Whether samples were to be stored: a run may do without a scope."""
        return bool(self._pyramids)

    @property
    def unrated(self) -> Sequence[tuple[Stretch, str]]:
        """The steps whose spikes are no count."""
        return self._unrated

    @property
    def loop(self) -> FloatArray:
        """Shape (n, 2): coil current, A, and the field read then, T; on steps only."""
        (at, force), (time, field) = self._slow["force"], self._slow["field"]
        if not (at.size and time.size):
            return np.empty((0, 2))
        inside = settled(time, self.holds)
        time, field = time[inside], field[inside]
        return np.column_stack([np.interp(time, at, force) / self._gain, field])

    def read_notes(self) -> None:
        """Read anew what people noted at a time of it."""
        try:
            said = read_remarks(self.path).notes
        except RunFolderError:
            said = ()  # the card about the run says what is wrong with them
        self.notes = [(one.time, one.text) for one in said if one.time is not None]

    # --- the twin

    def add_twin(self, whole: ModelPart, look: Look) -> None:
        """Put the twin beside the data; `look` has a part of it computed closely."""
        self.model = TwinTraces(look)
        self.model.add(whole)
        self.fetched.set()

    def add_twin_part(self, part: ModelPart) -> None:
        """A part of the twin that was asked for has come."""
        if self.model is not None:
            self.model.refine(part)
            self.fetched.set()

    @property
    def has_model(self) -> bool:
        """Once it has come."""
        return self.model is not None

    @property
    def twin_spikes(self) -> FloatArray:
        """The twin's."""
        return np.empty(0) if self.model is None else self.model.spikes

    def modelled(self, signal: str, start: float, end: float, count: int) -> Trace:
        """The twin's."""
        if self.model is None:
            return Trace.nothing()
        return self.model.trace(signal, start, end, count)

    # --- samples

    @property
    def threshold(self) -> float | None:
        """As the record has it."""
        return self._threshold

    def beyond(self, signal: str) -> FloatArray:
        """As the scope told it, block by block."""
        return self._beyond.get(signal, super().beyond(signal))

    def measured(self, signal: str, start: float, end: float, count: int) -> Trace:
        """The stored signal; where zoomed in, samples as soon as they are read.

        The force holds from each set-point to the next.
        """
        pyramid = self._pyramids.get(signal)
        if pyramid is None:
            line = self._lines.get(signal, Trace.nothing())
            return line.around(start, end).corners(count)
        if count >= PICTURE and pyramid.wants(start, end, count):
            self._fetch(signal, (start, end, count))
        return pyramid.between(start, end, count)

    @property
    def sampled_until(self) -> float:
        """Where the first of the signals ends."""
        return min((one.end for one in self._pyramids.values()), default=self.reach)

    def ends(self, key: str) -> float:
        """Time up to which there is data of a lane, s; the last bins reach beyond."""
        end = self.sampled_until
        if key in self._lines and key not in self._pyramids:
            end = self._lines[key].end
        elif self.model and key == "residual":
            end = min(end, self.model.end)
        return min(end, self.reach)

    def take_fetched(self) -> bool:
        """Whether samples have arrived since this was last asked."""
        arrived = self.fetched.is_set()
        self.fetched.clear()
        return arrived

    def read_all(self) -> None:
        """Return when all samples that were asked for have been read."""
        while (reader := self._reader) is not None:
            reader.join()

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
            self._look(signal, *view)
            self.fetched.set()

    def _look(self, signal: str, start: float, end: float, count: int) -> None:
        """Read around a view, finer than it needs: it may move and zoom a while."""
        margin = MARGIN * (end - start)
        start, end = start - margin, end + margin
        stored = self._run.signal(signal)
        part = stored.between(max(0.0, start), end)
        most = round(FINER * (1 + 2 * MARGIN) * count)
        cells = max(1, min(part.stop - part.start, most))
        found = stored.trace(part.start, part.stop, cells=cells)
        self._pyramids[signal].refine(start, end, found)


def _pyramid(signal: StoredSignal) -> Pyramid:
    cells = min(max(1, -(-len(signal) // BIN)), FINE)
    return Pyramid.of(signal.trace(cells=cells))


def _slow(run: Run, gain: float) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Force from the applied current, field, temperature, as (times, values)."""
    time, current = run.read_back.T
    field, warm = run.field, run.temperature
    return {
        "force": (time, current * gain),
        "field": (field["time"].copy(), field["field"].copy()),
        "temperature": (warm["time"].copy(), warm["temperature"].copy()),
    }


def _stretch(trial: Any, hold: tuple[float, float] | None) -> Stretch:
    start, end = float(trial["start"]), float(trial["end"])
    label = bytes(trial["label"]).decode("utf-8", "replace").rstrip("\0")
    held = hold and (start + hold[0], start + hold[1])
    return Stretch(start, end, label, bool(trial["pause"]), held)


def _onsets(run: Run, trials: Records) -> list[float | None]:
    """When the force of each trial begins to change; None where it cannot be told."""
    try:
        return onsets(run, trials)
    except SceneError:
        return [None] * len(trials)


def _moves(run: Run) -> tuple[bool, bool]:
    """Whether its protocol moves probes or voltages; no where it cannot be read."""
    try:
        protocol = run.scene.protocol
    except SceneError:
        return False, False
    return protocol.moves_probes or bool(protocol.sets), bool(protocol.sets)
