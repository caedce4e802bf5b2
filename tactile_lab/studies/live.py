"""A study as whoever looks sees it: how far it is, and its figures as points come."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from tactile_lab.conclusion import Table
from tactile_lab.errors import RecordingError, RunFolderError
from tactile_lab.plot import Plot
from tactile_lab.quantity import count, show
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.store.folder import lock, write_json
from tactile_lab.studies.addresses import addresses, seeds_of
from tactile_lab.studies.dataset import Gathered, gathered
from tactile_lab.studies.figures import plots
from tactile_lab.studies.points import BY_POINT, RUNS
from tactile_lab.studies.shelf import Shelf
from tactile_lab.studies.study import Study
from tactile_lab.whole_file import failing_as, write_text

LIVE, RESULTS, LOCK = "live.json", "results.json", ".lock"
"""Files in a study's folder: until its page is written, from then on, and the one that
whoever carries it out holds."""
SCENE = "scene.toml"
"""The scene that varies, complete."""
SHOWN, LEFT = "shown", "left"
"""Keys: in either file what the window shows, in the first the points not known yet."""
EVERY = 1.0
"""Shortest time from one look to the next, s."""
SHARE = 20
"""Looking takes at most one part in so many of the time."""


class LiveStudy:
    """Writes what is known of a study that is computed, and at the end all of it.

    However it ends: interrupted, the window would tell of fewer points than are kept.
    The page of a finished study takes its place.
    """

    def __init__(
        self, study: Study, shelf: Shelf, named: NDArray[np.void], folder: Path
    ) -> None:
        self._study, self._shelf, self._named = study, shelf, named
        self._file = folder / LIVE
        _write(folder / SCENE, study.scene)
        self._known, self._next = (0, 0), 0.0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind is None:
            self._write()
        else:  # what ended it is what has to be told
            with suppress(RecordingError):
                self._write()

    def tell(self, done: int, failed: int) -> None:
        """So many points are done; written now and then.

        Raises:
            RecordingError: the folder cannot be written.
        """
        self._known = done, failed
        began = time.monotonic()
        if began >= self._next:
            self._write()
            took = time.monotonic() - began
            self._next = began + max(EVERY, SHARE * took)

    def _write(self) -> None:
        done, failed = self._known
        places = self._shelf.find(self._named)
        found = gathered(self._study, self._shelf, places)
        said = f"{done:,} of {count(self._named.size, 'point')} are known"
        said += f", {failed:,} of these refused or failed." if failed else "."
        told = {
            LEFT: self._named.size - done,
            SHOWN: shown(found, [said], plots(found)),
        }
        write_json(self._file, told)


def shown(
    found: Gathered,
    sentences: Iterable[str],
    drawn: Iterable[Plot],
    tables: Iterable[Table] = (),
) -> dict[str, Any]:
    """What the window shows of a study, as JSON takes it."""
    study, drawn = found.study, list(drawn)
    of = {n for plot in drawn for p in plot.panels for s in p.series for n in s.of}
    numbers = np.array(sorted(of), dtype=np.intp)
    design = study.design
    values, seeds = design.values(numbers), seeds_of(study, design.repeats(numbers))
    named = addresses(study)[numbers] if study.keeps_runs else [b""] * numbers.size
    points = {}
    for i, number in enumerate(numbers.tolist()):
        pairs = zip(design.axes, values[i], strict=True)
        changes = [axis.change(value) for axis, value in pairs]
        if study.on == "simulated":
            changes.append(f"simulated.seed={seeds[i]}")
        points[number] = [changes, found.reasons[number], bytes(named[i]).hex()]
    return {
        "title": study.title,
        "sentences": list(sentences),
        "tables": [asdict(table) for table in tables],
        "plots": [plot.to_dict() for plot in drawn],
        "points": points,
    }


@dataclass(frozen=True)
class SeenPoint:
    """A point that the figures show.

    Attributes:
        changes: of the study's scene, as ``--set`` takes them.
        reason: why it was refused or failed; "" otherwise.
        address: by which its run is found; "" where none is kept.
    """

    changes: tuple[str, ...]
    reason: str
    address: str

    def __str__(self) -> str:
        told = ", ".join(_told(change) for change in self.changes)
        return f"{told}: {self.reason}" if self.reason else told


def _told(change: str) -> str:
    """``key=value`` for a person: "sensor.R_L = 9 MΩ"."""
    key, _, value = change.partition("=")
    number, _, unit = value.strip('["]').partition(" ")
    try:
        value = show(float(number), unit).replace("Ohm", "Ω") if unit else value
    except ValueError:
        pass  # a word
    return f"{key} = {value}"


@dataclass(frozen=True, eq=False)
class SeenStudy:
    """A study's folder, looked at.

    Attributes:
        folder: of the study.
        title: for people.
        sentences: what it says, or how far it is.
        tables: what it says beyond them, such as the share that each axis has.
        plots: its figures so far.
        points: those that the figures show, by their number.
        running: whether somebody carries it out now.
    """

    folder: Path
    title: str
    sentences: tuple[str, ...]
    tables: tuple[Table, ...]
    plots: tuple[Plot, ...]
    points: Mapping[int, SeenPoint]
    running: bool

    def scene_of(self, number: int) -> Path:
        """A file with the scene of a point, complete, with its seed.

        Raises:
            SceneError: the scene refuses the point.
            RecordingError: the folder cannot be written.
        """
        scene = load(self.folder / SCENE, self.points[number].changes)
        file = self.folder / f"point-{number}.toml"
        _write(file, scene)
        return file

    def run_of(self, number: int) -> Path | None:
        """The folder of a point's run, whichever study beside made it; None without."""
        address = self.points[number].address
        for named in self.folder.parent.glob(f"*/{RUNS}/{BY_POINT}/{address or '-'}"):
            run = named.parent.parent / named.read_text(encoding="utf-8")
            if run.is_dir():
                return run
        return None


def _write(file: Path, scene: Scene) -> None:
    advice = "Make room, or make the folder writable."
    with failing_as(f"{file} cannot be written", advice):
        write_text(file, scene.to_toml())


def studies_in(*roots: Path) -> list[Path]:
    """Folders of studies in these folders, the one that changed last first."""
    found = [path.parent for root in roots for path in root.glob(f"*/{LOCK}")]
    told = [path for path in found if _told_in(path) is not None]
    return sorted(told, key=lambda path: path.stat().st_mtime, reverse=True)


def look_at(folder: Path) -> SeenStudy:
    """What a study says by now.

    Raises:
        RunFolderError: the folder holds none, or it cannot be read.
    """
    file = _told_in(folder) or folder / RESULTS
    running = is_running(folder)
    try:
        whole = json.loads(file.read_text(encoding="utf-8"))
        told = whole[SHOWN]
        sentences = tuple(map(str, told["sentences"]))
        if whole.get(LEFT) and not running:
            sentences += ("Nobody computes it now; start it again and it goes on.",)
        tables = tuple(map(_table, told.get("tables", ())))
        drawn = tuple(Plot.from_dict(plot) for plot in told["plots"])
        points = {
            int(number): SeenPoint(tuple(changes), str(reason), str(address))
            for number, (changes, reason, address) in told.get("points", {}).items()
        }
        title = str(told["title"])
        return SeenStudy(folder, title, sentences, tables, drawn, points, running)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise RunFolderError(
            f"{folder} holds no study that can be read ({type(error).__name__}: "
            f"{error}). Carry it out again: what is known is not computed anew."
        ) from error


def _table(told: Mapping[str, Any]) -> Table:
    """A table from what `shown` made of it."""
    rows = tuple(tuple(row) for row in told["rows"])
    heads = tuple(told["headings"])
    return Table(title=told["title"], headings=heads, rows=rows, note=told["note"])


def _told_in(folder: Path) -> Path | None:
    """The file that tells of a study, while it is computed or after."""
    files = (folder / name for name in (LIVE, RESULTS))
    return next((file for file in files if file.is_file()), None)


def is_running(folder: Path) -> bool:
    """Whether somebody carries out the study of this folder now."""
    try:
        with (folder / LOCK).open(encoding="utf-8") as held:
            return not lock(held, shared=True)
    except OSError:
        return False
