"""Writes a run while it happens."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RecordingError
from tactile_lab.scope import Block, Stream
from tactile_lab.store.columns import SampleColumn
from tactile_lab.store.data_file import DataFile
from tactile_lab.store.folder import DATA, RESERVE, RunFolder, Status
from tactile_lab.store.layout import RECORDS, Layout
from tactile_lab.store.sample_counter import SampleCounter
from tactile_lab.store.write_queue import QUEUE_BYTES, WhenFull, Write, WriteQueue
from tactile_lab.trial import Outcome, Trial
from tactile_lab.voltage_source import HeldVoltage
from tactile_lab.whole_file import check_space

CADENCE = 0.5
"""Longest time anything stays in memory only, s of real time."""

ROW_BYTES = 256
"""What a row of a table counts for while it waits for the disk."""


class Recorder:
    """The record of one run; what `acquisition.journal.Journal` asks for.

    The file comes into being with the first `segment`, which knows the scaling;
    rows that come before it wait in memory and in the log.

    Args:
        folder: of the run.
        layout: what to store.
        reserve: bytes that must stay free on the disk.
        sync: push the file to the disk every second (see `DiskSync`); unless given, for
            measured runs, because a simulated one can be computed again.
        when_full: writes in a thread of its own, which the caller waits for where the
            disk does not keep up ("wait") or not ("error"); None: in the caller's.
        capacity: bytes that may wait for that thread.

    Attributes:
        folder: of the run.
        queued: samples per channel taken so far.

    Raises:
        RecordingError: from every method, when something cannot be stored, or too much
            waits.
    """

    def __init__(
        self,
        folder: RunFolder,
        layout: Layout,
        *,
        reserve: int = RESERVE,
        sync: bool | None = None,
        when_full: WhenFull | None = None,
        capacity: int = QUEUE_BYTES,
    ) -> None:
        self.folder = folder
        self.queued = 0
        self._layout = layout
        self._reserve = reserve
        self._sync = not layout.simulated if sync is None else sync
        self._waiting: dict[str, list[tuple[Any, ...]]] = {name: [] for name in RECORDS}
        self._file: DataFile | None = None
        self._spikes = 0
        self._trial_open = False
        self._rows: tuple[int, ...] = ()
        self._counter = SampleCounter()
        self._flushed = time.monotonic()
        self._failed = False
        if not layout.signals and layout.detection is None:
            self._guard(self._open, None)
        self._queue: WriteQueue | None = None
        if when_full is not None:
            self._queue = WriteQueue(
                self._tick, CADENCE, when_full=when_full, capacity=capacity
            )

    def segment(self, stream: Stream, start: float) -> None:
        """A stream starts; its first sample is at `start` s on the run's axis."""
        self._do(partial(self._segment, stream, start))

    def append(self, block: Block) -> None:
        """Store a block; samples missing before it become a gap record."""
        self._do(partial(self._append, block), block.codes.nbytes)
        self.queued += block.samples

    def gap(self, missing: int) -> None:
        """Store that the stream went on for so many samples that never came."""
        self._do(partial(self._gap, missing))

    def align(self, *, offset: float, drift: float, uncertainty: float) -> None:
        """Correct the running segment's place in time.

        Args:
            offset: added to the time of its first sample, s.
            drift: of the scope's clock against the host's, s/s.
            uncertainty: of the aligned times, s.
        """
        self._do(partial(self._align, offset, drift, uncertainty))

    def spikes(self, times: FloatArray, found: NDArray[Any]) -> None:
        """Store spikes detected on line.

        Args:
            times: shape (k,), s on the run's axis.
            found: shape (k,), dtype `spikes.detector.SPIKE`, sample indices
                counted from the start of the stream.
        """
        size = max(found.nbytes, ROW_BYTES)
        self._do(partial(self._add_spikes, times, found), size)

    def current(
        self,
        time: float,
        setpoint: float,
        measured: float | None,
        ratio: float | None = None,
        *,
        listed: int = 0,
        asked: float | None = None,
        acted: float | None = None,
    ) -> None:
        """Store a set-point and its read-back, A, and the resistance over cold.

        `listed`, `asked` and `acted`: as
        `tactile_lab.store.applied.applied_current` takes them.
        """
        known, on_way = (measured, ratio), (asked, acted)
        row = time, setpoint, *map(_number, known), listed, *map(_number, on_way)
        self._add("current", *row)

    def field(self, time: float, field: float) -> None:
        """Store a teslameter reading, T."""
        self._add("field", time, field)

    def temperature(self, time: float, kelvin: float) -> None:
        """Store a reading of the temperature, K."""
        self._add("temperature", time, kelvin)

    def voltage(self, name: str, held: HeldVoltage) -> None:
        """Store what the source of the circuit's voltage `name` holds."""
        row = held.time, _fixed(name, 8), held.setpoint, held.voltage, held.current
        self._add("voltages", *row)

    def event(self, time: float, kind: str, text: str) -> None:
        """Store that something happened; the whole text goes to the log."""
        self._do(partial(self.folder.log, kind, text, time=time))
        self._add("events", time, _fixed(kind, 16), _fixed(text, 160))

    def begun(self, index: int, trial: Trial, start: float) -> None:
        """Store that a trial begins, so that it is known should it be cut short."""
        nothing = (0, 0), (math.nan, math.nan)
        self._do(partial(self._trial, _trial_row(index, trial, start, *nothing), False))

    def outcome(self, outcome: Outcome) -> None:
        """Store that the trial that began ended, and what came of it in numbers."""
        counts = outcome.spike_times.size, outcome.skipped
        rests = _number(outcome.rest.get("V_C1")), _number(outcome.drift)
        row = _trial_row(outcome.index, outcome.trial, outcome.start, counts, rests)
        self._do(partial(self._trial, row, True))

    def pause(self, start: float, end: float) -> None:
        """Store a planned pause, s: nothing was streamed, and that is no gap."""
        self._add("pauses", start, end)

    def close(
        self, status: Status, produced: int | None = None, **entries: Any
    ) -> None:
        """Write all that waits, close the file, patch `run.json` with the counters.

        A run whose recorder failed is closed as faulted, whatever `status` says, and
        the failure is raised.

        Args:
            status: how the run ended.
            produced: samples per channel that the scope delivered.
            entries: more entries for `run.json`.
        """
        failure: BaseException | None = None
        if self._queue is not None:
            failure = self._queue.close()
            entries["queued"] = self.queued
        try:
            self._guard(self._close)
        except Exception as error:
            failure = failure or error
        if failure is not None:
            status = "faulted"
            entries["reason"] = entries.get("reason") or str(failure)
        counters = {
            column.signal: {"produced": produced, "written": column.written}
            for column in self._columns
        }
        self.folder.finish(
            status, samples=counters, spikes_online=self._spikes, **entries
        )
        if failure is not None:
            raise failure
        if self._file is not None:
            self._file.drop_ledger()

    @property
    def _columns(self) -> list[SampleColumn]:
        return [] if self._file is None else self._file.samples

    def _do(self, write: Write, size: int = ROW_BYTES) -> None:
        """Write now, or have the thread do so; `size` bytes wait for it."""
        if self._queue is None:
            write()
        else:
            self._queue.put(write, size)

    def _add(self, table: str, *row: Any) -> None:
        self._do(partial(self._row, table, row))

    # what follows is done by the thread, where there is one

    def _row(self, table: str, row: tuple[Any, ...]) -> None:
        self._waiting[table].append(row)
        self._tick()

    def _trial(self, row: tuple[Any, ...], complete: bool) -> None:
        """A trial begins, or the one that began last ends: one row for both."""
        if self._trial_open:
            self._replace_last("trials", (*row, complete))
            self._tick()
        else:
            self._row("trials", (*row, complete))
        self._trial_open = not complete

    def _replace_last(self, table: str, row: tuple[Any, ...]) -> None:
        if self._waiting[table]:
            self._waiting[table][-1] = row
        elif self._file is not None:
            self._guard(self._file.replace_last, table, row)

    def _segment(self, stream: Stream, start: float) -> None:
        if self._file is None:
            self._guard(self._open, stream)
        self._rows = self._layout.rows(stream)
        self._counter.stream(stream, start)
        self._waiting["segments"].append(self._counter.segment)

    def _append(self, block: Block) -> None:
        gap = self._counter.skip_to(block.first)
        if gap is not None:
            self._waiting["gaps"].append((self._counter.taken, *gap))
            self._waiting["segments"].append(self._counter.segment)
        over = sum(
            1 << bit for bit, row in enumerate(self._rows) if block.overrange[row]
        )
        if over:
            self._waiting["overrange"].append(
                (self._counter.taken, block.samples, over)
            )
        self._counter.take(block.samples)
        self._guard(self._write_samples, block)

    def _gap(self, missing: int) -> None:
        ended = self._counter.reached + missing * self._counter.segment[2]
        self._row("gaps", (self._counter.taken, missing, ended))

    def _align(self, offset: float, drift: float, uncertainty: float) -> None:
        self._counter.align(offset, drift, uncertainty)
        self._replace_last("segments", self._counter.segment)

    def _add_spikes(self, times: FloatArray, found: NDArray[Any]) -> None:
        samples = self._counter.stored(found["sample"])
        columns = (samples, times, found["amplitude"], found["width"])
        self._waiting["spikes"] += zip(*columns, strict=True)
        self._spikes += found.size
        self._tick()

    def _tick(self) -> None:
        """Write what has waited for longer than `CADENCE`."""
        if time.monotonic() - self._flushed > CADENCE:
            self._guard(self._flush)

    def _open(self, stream: Stream | None) -> None:
        self._file = DataFile(self.folder.path, self._layout, stream, sync=self._sync)
        self._flush()

    def _write_samples(self, block: Block) -> None:
        if self._waiting["segments"] and self._file is not None:
            self._write_rows(self._file)  # no kill leaves samples without their time
        wrote = [
            column.append(block.codes[row])
            for column, row in zip(self._columns, self._rows, strict=True)
        ]
        if any(wrote):
            self._flush()
        else:
            self._tick()

    def _flush(self) -> None:
        if self._file is None:
            return
        check_space(self.folder.path, self._reserve, "while a run is written")
        if time.monotonic() - self._flushed > CADENCE:
            for column in self._columns:
                column.write()
        self._write_rows(self._file)
        self._file.flush()
        self._flushed = time.monotonic()

    def _write_rows(self, file: DataFile) -> None:
        for table, rows in self._waiting.items():
            if rows:
                file.append(table, rows)
                self._waiting[table] = []

    def _close(self) -> None:
        if self._file is None and not self._failed:
            self._open(None)
        if self._file is None:
            return
        # after a failure, which has been told, as much as still goes
        failed = (OSError, RuntimeError, ValueError) if self._failed else ()
        try:
            with suppress(*failed):
                for column in self._columns:
                    column.write()
                    column.write_pyramid()
                self._write_rows(self._file)
        finally:
            self._file.close(failed=self._failed)
        self._look_for_it()

    def _look_for_it(self, cause: Exception | None = None) -> None:
        if not (self.folder.path / DATA).exists():
            raise RecordingError(
                f"{self.folder.path / DATA} is gone: it was moved or deleted while the "
                "run was recorded. Put it back if you have it."
            ) from cause

    def _guard(self, write: Callable[..., None], *what: Any) -> None:
        """Turn what a disk can do to us into a message that says what is kept."""
        try:
            write(*what)
        except RecordingError:
            self._failed = True
            raise
        except (OSError, RuntimeError, ValueError) as error:
            self._failed = True
            self._look_for_it(error)
            kept = min((column.written for column in self._columns), default=0)
            number = error.errno if isinstance(error, OSError) else None
            why = os.strerror(number) if number else str(error)
            raise RecordingError(
                f"{self.folder.path / DATA} cannot be written: {why}. The first "
                f"{kept} samples per channel are kept; free space on the disk or "
                "choose another folder with --out, and run `tactile-lab recover` on "
                "this run."
            ) from error


def _trial_row(
    index: int,
    trial: Trial,
    start: float,
    counts: tuple[int, int],
    rests: tuple[float, float],
) -> tuple[Any, ...]:
    """A row of the table of trials but its last column.

    Args:
        index: its number.
        trial: what was asked.
        start: s.
        counts: its spikes, and the coil's set-points that were skipped.
        rests: V_C1 just before it and its drift, V; NaN where not known.
    """
    begin, end = trial.hold or (math.nan, math.nan)
    place = (index, start, start + trial.length, _number(trial.level), begin, end)
    return (
        *place,
        _number(trial.onset),
        *counts,
        trial.pause,
        _fixed(trial.label, 48),
        *rests,
    )


def _number(value: float | None) -> float:
    """As a table holds it: NaN for None."""
    return math.nan if value is None else value


def _fixed(text: str, size: int) -> bytes:
    """UTF-8 of at most `size` bytes, cut between characters."""
    return text.encode()[:size].decode(errors="ignore").encode()
