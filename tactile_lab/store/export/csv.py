"""CSV files in SI, units in the header: one for the signals, one per table."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.store.export import packed
from tactile_lab.store.export.content import (
    TABLES,
    ExportTable,
    about,
    tables,
    unit,
)
from tactile_lab.store.export.lines import CodeText, Text, fixed, lines, steps, written
from tactile_lab.store.progress import Progress, nothing
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.whole_file import replacing, write_rows

ToText = Callable[[FloatArray], Text]

AT_ONCE = 1 << 15
"""Rows turned into text at once, on every core: more do not fit its cache."""


def size(run: Run, selection: Selection) -> int:
    """Bytes the file of signals will take, rather fewer, as stretches of it tell."""
    names = selection.names(run)
    texts = [_text(run, name, selection) for name in names]

    def pack(part: Selection) -> int:
        return sum(
            len(_told(texts, time, columns, first))
            for time, columns in part.pieces(run)
            for first in range(0, time.size, AT_ONCE)
        )

    return len(_head(names)) + packed.signals(run, selection, pack)


def export(
    run: Run,
    folder: Path,
    selection: Selection,
    progress: Progress = nothing,
    room: int | None = None,
) -> list[Path]:
    """Write `signals.csv`, `spikes.csv`, `trials.csv`, `about.csv`, ... into `folder`.

    Files of these names that an earlier export left there are replaced or removed.

    `room` bytes must be free for it, as `size` tells unless given.

    Raises:
        RunFolderError: a signal, rate or time the run does not have.
        RecordingError: there is no room.
        OSError: the folder cannot be written.
    """
    selection.check(run)
    room = size(run, selection) if room is None else room
    made = []
    if selection.rows(run):
        made.append(_signals(run, folder / "signals.csv", selection, progress, room))
    for name, table in tables(run, selection).items():
        made.append(_table(folder / f"{name}.csv", table))
    told = about(run, selection)
    keys = np.array(list(told)), np.array([str(value) for value in told.values()])
    pairs = ExportTable({"key": keys[0], "value": keys[1]}, {"key": "", "value": ""})
    made.append(_table(folder / "about.csv", pairs))
    for name in {"signals", *TABLES} - {file.stem for file in made}:
        (folder / f"{name}.csv").unlink(missing_ok=True)
    return made


def _signals(
    run: Run, path: Path, selection: Selection, progress: Progress, room: int
) -> Path:
    names, rows = selection.names(run), selection.rows(run)
    texts = [_text(run, name, selection) for name in names]
    done = 0
    with (
        replacing(path, room) as part,
        part.open("wb") as file,
        ThreadPoolExecutor() as threads,
    ):
        file.write(_head(names))
        for time, columns in selection.pieces(run):
            told = partial(_told, texts, time, columns)
            for text in threads.map(told, range(0, time.size, AT_ONCE)):
                file.write(text)
            done += time.size
            progress(done / rows)
    return path


def _head(names: Sequence[str]) -> bytes:
    heads = ["time_s", *(f"{name}_{unit(name)}" for name in names)]
    return (",".join(heads) + "\n").encode()


def _told(
    texts: list[ToText], time: FloatArray, columns: list[FloatArray], first: int
) -> bytes:
    """Lines of the rows from `first` on, as many as are turned into text at once."""
    few = slice(first, first + AT_ONCE)
    cells = (text(column[few]) for text, column in zip(texts, columns, strict=True))
    return lines([fixed(time[few]), *cells])


def _text(run: Run, name: str, selection: Selection) -> ToText:
    """How values of that signal become text."""
    if name not in run.signals:
        return fixed if name == "force" else steps  # nN; the others in twelve digits
    signal = run.signal(name)
    return CodeText(signal) if selection.average(signal.interval) == 1 else written


def _table(path: Path, table: ExportTable) -> Path:
    columns = (_cells(column.tolist()) for column in table.columns.values())
    write_rows(path, table.heads, zip(*columns, strict=True))
    return path


def _cells(values: list[object]) -> list[object]:
    """Numbers in 12 digits; what is not known stays empty."""
    return [
        ("" if v != v else f"{v:.12g}") if isinstance(v, float) else v for v in values
    ]
