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

from tactile_lab.store.facts import KNOWN, Fact
from tactile_lab.store.where import Condition, condition

FILE = ".index.sqlite"
VERSION = 7
"""Of the tables and of what they hold; another one is thrown away."""
PATIENCE = 2.0
"""Longest wait for another program that writes the index, s."""
_TABLES = f"""
CREATE TABLE runs (run INTEGER PRIMARY KEY, name TEXT UNIQUE, stamp TEXT, entry TEXT);
CREATE TABLE facts (
    run INTEGER, place INTEGER, key TEXT, number REAL, text TEXT, folded TEXT,
    unit TEXT, trial TEXT, PRIMARY KEY (run, place)
) WITHOUT ROWID;
CREATE INDEX by_number ON facts (key, unit, number);
CREATE INDEX by_text ON facts (key, folded);
PRAGMA user_version = {VERSION};
"""
_FACT = ", ".join(Fact._fields)
_RUN = "(SELECT run FROM runs WHERE name = ?)"
_KEYS = """
WITH RECURSIVE found (key) AS (
    SELECT min(key) FROM facts
    UNION ALL SELECT (SELECT min(key) FROM facts WHERE key > found.key)
    FROM found WHERE key NOT NULL
)
SELECT key FROM found WHERE key NOT NULL
"""
"""Jumps from each key to the next: there are a few dozen, in many thousands of rows."""
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
        known = dict(self._base.execute("SELECT name, stamp FROM runs"))
        now = {name: " ".join(map(str, stamp)) for name, stamp in stamps.items()}
        changed = [name for name, stamp in now.items() if known.get(name) != stamp]
        gone = [name for name in known if name not in now]
        if not (changed or gone):
            return
        with self._base:
            drop = [(name,) for name in (*gone, *changed)]
            self._base.executemany(f"DELETE FROM facts WHERE run = {_RUN}", drop)
            self._base.executemany("DELETE FROM runs WHERE name = ?", drop)
            for name in changed:
                entry, facts = read(name)
                run = self._base.execute(
                    "INSERT INTO runs (name, stamp, entry) VALUES (?, ?, ?)",
                    (name, now[name], json.dumps(entry, default=str)),
                ).lastrowid
                self._base.executemany(
                    f"INSERT INTO facts (run, place, folded, {_FACT}) "
                    "VALUES (?, ?, ?, ?, ?, ?, ?, ?)",
                    (
                        (run, place, fact.text.casefold(), *fact)
                        for place, fact in enumerate(facts)
                    ),
                )

    def keys(self) -> list[str]:
        """Every key that a run has."""
        return [key for (key,) in self._base.execute(_KEYS)]

    def units(self, key: str) -> Collection[str]:
        """Units of a key's numbers; empty where it holds texts alone."""
        asked = "SELECT DISTINCT unit FROM facts WHERE key = ? AND number NOT NULL"
        found = {unit for (unit,) in self._base.execute(asked, (key,))}
        return found or {unit for unit in (KNOWN.get(key),) if unit is not None}

    def entries(self, where: str = "") -> list[tuple[str, dict[str, Any]]]:
        """Name and entry of the runs that fit, in order of their names.

        Raises:
            SceneError: `where` cannot be read.
        """
        fits = Condition("1", ())
        if where:
            keys = self.keys()
            fits = condition(where, keys and {*keys, *KNOWN}, self.units)
        sql, values = fits
        asked = f"SELECT name, entry FROM runs WHERE {sql} ORDER BY name"
        found = self._base.execute(asked, values)
        return [(name, json.loads(entry)) for name, entry in found]

    def facts(self, names: Iterable[str], key: str | None) -> dict[str, list[Fact]]:
        """What is known of these runs: all, or under one key."""
        if key is not None:
            found: dict[str, list[Fact]] = {name: [] for name in names}
            asked = (
                f"SELECT name, {_FACT} FROM facts JOIN runs USING (run) "
                "WHERE key = ? ORDER BY run, place"
            )
            for name, *fact in self._base.execute(asked, (key,)):
                found.get(name, []).append(Fact._make(fact))
            return found
        asked = f"SELECT {_FACT} FROM facts WHERE run = {_RUN}"
        return {
            name: list(map(Fact._make, self._base.execute(asked, (name,))))
            for name in names
        }


def _opened(file: Path | None) -> sqlite3.Connection:
    """The index, made where there is none; one in memory where it cannot be used."""
    for _ in range(2):
        if file is None:
            break
        try:
            base = sqlite3.connect(file, timeout=PATIENCE)
            base.execute("PRAGMA cache_size = -65536")
            if base.execute("PRAGMA user_version").fetchone()[0] == VERSION:
                base.execute("SELECT name FROM runs LIMIT 1").fetchone()
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
