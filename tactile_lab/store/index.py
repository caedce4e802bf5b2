"""What is known of all runs in a folder, in SQLite; may be deleted at any time.

The folders are the truth. Each time it is asked, the index looks at every folder's
times and sizes and reads anew what has changed. Where it cannot be written, or is
damaged, everything is read into memory instead.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from tactile_lab.store.facts import Fact
from tactile_lab.store.where import Condition, condition

FILE = ".index.sqlite"
VERSION = 2
"""Of the tables; another one is thrown away."""
PATIENCE = 2.0
"""Longest wait for another program that writes the index, s."""
_TABLES = f"""
CREATE TABLE runs (run TEXT PRIMARY KEY, stamp TEXT, entry TEXT) WITHOUT ROWID;
CREATE TABLE facts (run TEXT, key TEXT, number REAL, text TEXT, folded TEXT, unit TEXT);
CREATE INDEX by_key ON facts (key, number);
CREATE INDEX by_run ON facts (run);
PRAGMA user_version = {VERSION};
"""
Read = Callable[[str], tuple[dict[str, Any], list[Fact]]]
"""Reads a run's entry and its facts, by the name of its folder."""


class Index:
    """Entries and facts of the runs in one folder.

    Args:
        root: the folder; the index stands in it.
        keep: whether a file may be made; where there are no runs none is.
    """

    def __init__(self, root: Path, *, keep: bool) -> None:
        self._base = _opened(root / FILE if keep else None)

    def close(self) -> None:
        """Let go of the file; idempotent."""
        self._base.close()

    def update(self, stamps: Mapping[str, list[int]], read: Read) -> None:
        """Read the runs whose stamp has changed; forget those that are gone."""
        try:
            self._update(stamps, read)
        except sqlite3.Error:  # read-only, locked or damaged
            self._base.close()
            self._base = _opened(None)
            self._update(stamps, read)

    def _update(self, stamps: Mapping[str, list[int]], read: Read) -> None:
        known = dict(self._base.execute("SELECT run, stamp FROM runs"))
        now = {run: json.dumps(stamp) for run, stamp in stamps.items()}
        changed = [run for run, stamp in now.items() if known.get(run) != stamp]
        gone = [run for run in known if run not in now]
        if not (changed or gone):
            return
        with self._base:
            drop = [(run,) for run in (*gone, *changed)]
            self._base.executemany("DELETE FROM runs WHERE run = ?", drop)
            self._base.executemany("DELETE FROM facts WHERE run = ?", drop)
            for run in changed:
                entry, facts = read(run)
                self._base.execute(
                    "INSERT INTO runs VALUES (?, ?, ?)",
                    (run, now[run], json.dumps(entry, default=str)),
                )
                self._base.executemany(
                    "INSERT INTO facts VALUES (?, ?, ?, ?, ?, ?)",
                    ((run, f.key, f.number, f.text, _folded(f), f.unit) for f in facts),
                )

    def keys(self) -> list[str]:
        """Every key that a run has."""
        return [key for (key,) in self._base.execute("SELECT DISTINCT key FROM facts")]

    def units(self, key: str) -> Collection[str]:
        """Units of a key's numbers; empty where it holds texts alone."""
        asked = "SELECT DISTINCT unit FROM facts WHERE key = ? AND number NOT NULL"
        return {unit for (unit,) in self._base.execute(asked, (key,))}

    def entries(self, where: str = "") -> list[tuple[str, dict[str, Any]]]:
        """Name and entry of the runs that fit, in order of their names.

        Raises:
            SceneError: `where` cannot be read.
        """
        fits = Condition("1", ())
        if where:
            fits = condition(where, self.keys(), self.units)
        sql, values = fits
        asked = f"SELECT run, entry FROM runs WHERE {sql} ORDER BY run"
        found = self._base.execute(asked, values)
        return [(run, json.loads(entry)) for run, entry in found]

    def facts(self, runs: Iterable[str]) -> dict[str, list[Fact]]:
        """All that is known of these runs."""
        asked = "SELECT key, number, text, unit FROM facts WHERE run = ?"
        return {
            run: list(map(Fact._make, self._base.execute(asked, (run,))))
            for run in runs
        }


def _folded(fact: Fact) -> str:
    return fact.text.casefold()


def _opened(file: Path | None) -> sqlite3.Connection:
    """The index, made where there is none; one in memory where it cannot be used."""
    for _ in range(2):
        if file is None:
            break
        try:
            base = sqlite3.connect(file, timeout=PATIENCE)
            if base.execute("PRAGMA user_version").fetchone()[0] == VERSION:
                base.execute("SELECT run FROM runs LIMIT 1").fetchone()
                return base
            if not base.execute("SELECT name FROM sqlite_master").fetchone():
                base.executescript(_TABLES)
                return base
            base.close()
        except sqlite3.OperationalError:
            break  # locked, or on a disk that may only be read
        except sqlite3.DatabaseError:
            pass  # damaged
        try:
            file.unlink()  # that, or of another version
        except OSError:
            break
    base = sqlite3.connect(":memory:")
    base.executescript(_TABLES)
    return base
