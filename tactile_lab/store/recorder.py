"""Writes a run while it happens, in the calling thread."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.bench import Block, Stream
from tactile_lab.errors import RecordingError
from tactile_lab.store.columns import SampleColumn
from tactile_lab.store.data_file import DataFile
from tactile_lab.store.folder import DATA, RESERVE, RunFolder, Status, check_space
from tactile_lab.store.layout import RECORDS, Layout
from tactile_lab.store.pieces import Pieces
from tactile_lab.trial import Outcome

CADENCE = 0.5
"""Longest time anything stays in memory only, s of real time."""


class Recorder:
    """The record of one run; what `acquisition.journal.Journal` asks for.

    The file comes into being with the first `segment`, which knows the scaling;
    records that come before it wait in memory and in the log.

    Args:
        folder: of the run.
        layout: what to store.
        reserve: bytes that must stay free on the disk.
        sync: push the file to the disk every second (see `Durable`); unless given, for
            measured runs, because a simulated one can be computed again.

    Raises:
        RecordingError: from every method, when something cannot be stored.
    """

    def __init__(
        self,
        folder: RunFolder,
        layout: Layout,
        *,
        reserve: int = RESERVE,
        sync: bool | None = None,
    ) -> None:
        self.folder = folder
        self.layout = layout
        self._reserve = reserve
        self._sync = not layout.simulated if sync is None else sync
        self._waiting: dict[str, list[tuple[Any, ...]]] = {name: [] for name in RECORDS}
        self._file: DataFile | None = None
        self._spikes = 0
        self._rows: tuple[int, ...] = ()
        self._pieces = Pieces()
        self._flushed = time.monotonic()
        self._failed = False
        if not layout.signals and layout.detection is None:
            self._guard(lambda: self._open(None))

    def segment(self, stream: Stream, start: float) -> None:
        """A stream starts; its first sample is at `start` s on the run's axis."""
        if self._file is None:
            self._guard(lambda: self._open(stream))
        self._rows = self.layout.rows(stream)
        self._pieces.stream(stream, start)
        self._waiting["segments"].append(self._pieces.segment)

    def append(self, block: Block) -> None:
        """Store a block; samples missing before it become a gap record."""
        gap = self._pieces.skip_to(block.first)
        if gap is not None:
            self._waiting["gaps"].append((self._pieces.taken, *gap))
            self._waiting["segments"].append(self._pieces.segment)
        self._guard(lambda: self._append(block))

    def gap(self, missing: int) -> None:
        """Store that the stream went on for so many samples that never came."""
        pieces = self._pieces
        ended = pieces.reached + missing * pieces.segment[2]
        self._row("gaps", pieces.taken, missing, ended)

    def align(self, *, offset: float, drift: float, uncertainty: float) -> None:
        """Correct the running segment's place in time.

        Args:
            offset: added to the time of its first sample, s.
            drift: of the scope's clock against the host's, s/s.
            uncertainty: of the aligned times, s.
        """
        self._pieces.align(offset, drift, uncertainty)
        self._guard(self._replace_segment)

    def spikes(self, times: NDArray[np.float64], found: NDArray[Any]) -> None:
        """Store spikes detected on line.

        Args:
            times: shape (k,), s on the run's axis.
            found: shape (k,), dtype `spikes.detector.SPIKE`, sample indices
                counted from the start of the stream.
        """
        samples = self._pieces.stored(found["sample"])
        columns = (samples, times, found["amplitude"], found["width"])
        self._waiting["spikes"] += zip(*columns, strict=True)
        self._spikes += found.size
        self.tick()

    def current(
        self,
        time: float,
        setpoint: float,
        measured: float | None,
        ratio: float | None = None,
    ) -> None:
        """Store a set-point and its read-back, A, and the resistance over cold."""
        read = math.nan if measured is None else measured
        warm = math.nan if ratio is None else ratio
        self._row("current", time, setpoint, read, warm)

    def field(self, time: float, field: float) -> None:
        """Store a teslameter reading, T."""
        self._row("field", time, field)

    def event(self, time: float, kind: str, text: str) -> None:
        """Store that something happened; the whole text goes to the log."""
        self.folder.log(kind, text, time=time)
        self._row("events", time, _fixed(kind, 16), _fixed(text, 160))

    def trial(
        self,
        index: int,
        start: float,
        end: float,
        *,
        label: str = "",
        level: float | None = None,
        hold: tuple[float, float] | None = None,
        spikes: int = 0,
        skipped: int = 0,
        pause: bool = False,
        rest: float = math.nan,
        drift: float | None = None,
    ) -> None:
        """Store a trial's place in the run, s, and level, N; see `trial.Trial`.

        `rest` is V_C1 just before it, V; for `drift` see `trial.Outcome`.
        """
        held = hold or (math.nan, math.nan)
        force = math.nan if level is None else level
        self._row(
            "trials", index, start, end, force, *held, spikes, skipped, pause,
            _fixed(label, 48), rest, math.nan if drift is None else drift,
        )  # fmt: skip

    def outcome(self, outcome: Outcome) -> None:
        """Store that a trial ended, and what came of it in numbers."""
        trial = outcome.trial
        self.trial(
            outcome.index,
            outcome.start,
            outcome.start + trial.length,
            label=trial.label,
            level=trial.level,
            hold=trial.hold,
            spikes=outcome.spike_times.size,
            skipped=outcome.skipped,
            pause=trial.pause,
            rest=outcome.rest.get("V_C1", math.nan),
            drift=outcome.drift,
        )

    def pause(self, start: float, end: float) -> None:
        """Store a planned pause, s: nothing was streamed, and that is no gap."""
        self._row("pauses", start, end)

    def tick(self) -> None:
        """Write what has waited for longer than `CADENCE`."""
        if time.monotonic() - self._flushed > CADENCE:
            self._guard(self._flush)

    def close(
        self,
        status: Status,
        produced: Mapping[str, int] | int | None = None,
        **entries: Any,
    ) -> None:
        """Write the rest, close the file and patch `run.json` with the counters.

        Args:
            status: how the run ended.
            produced: samples the scope delivered, per signal or for each of them.
            entries: more entries for `run.json`.
        """
        try:
            self._guard(self._close)
        except RecordingError as failure:
            status = "faulted"
            entries["reason"] = entries.get("reason") or str(failure)
            raise
        finally:
            counters = {
                column.signal: {
                    "produced": produced.get(column.signal)
                    if isinstance(produced, Mapping)
                    else produced,
                    "written": column.written,
                }
                for column in self._columns
            }
            self.folder.finish(
                status, samples=counters, spikes_online=self._spikes, **entries
            )

    @property
    def _columns(self) -> list[SampleColumn]:
        return [] if self._file is None else self._file.samples

    def _row(self, table: str, *values: Any) -> None:
        self._waiting[table].append(values)
        self.tick()

    def _open(self, stream: Stream | None) -> None:
        self._file = DataFile(self.folder.path, self.layout, stream, sync=self._sync)
        self._flush()

    def _replace_segment(self) -> None:
        row = self._pieces.segment
        if self._waiting["segments"]:
            self._waiting["segments"][-1] = row
        elif self._file is not None:
            self._file.replace_last("segments", row)

    def _append(self, block: Block) -> None:
        over = sum(
            1 << bit for bit, row in enumerate(self._rows) if block.overrange[row]
        )
        if over:
            row = (self._pieces.taken, block.samples, over)
            self._waiting["overrange"].append(row)
        self._pieces.take(block.samples)
        wrote = [
            column.append(block.codes[row])
            for column, row in zip(self._columns, self._rows, strict=True)
        ]
        if any(wrote):
            self._flush()
        else:
            self.tick()

    def _flush(self) -> None:
        if self._file is None:
            return
        check_space(self.folder.path, self._reserve)
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

    def _guard(self, write: Callable[[], None]) -> None:
        """Turn what a disk can do to us into a message that says what is kept."""
        try:
            write()
        except RecordingError:
            self._failed = True
            raise
        except (OSError, RuntimeError, ValueError) as error:
            self._failed = True
            kept = min((column.written for column in self._columns), default=0)
            raise RecordingError(
                f"{self.folder.path / DATA} cannot be written: {error}. The first "
                f"{kept} samples per channel are kept; free space on the disk or "
                "choose another --out, and run `tactile-lab recover` on this run."
            ) from error


def _fixed(text: str, size: int) -> bytes:
    """UTF-8 of at most `size` bytes, cut between characters."""
    return text.encode()[:size].decode(errors="ignore").encode()
