"""Runs in a folder as their run.json describes them. No Qt here."""

from __future__ import annotations

import json
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

from tactile_lab.store.folder import is_live

SHOWN = 60
"""Most runs listed at once."""


@dataclass(frozen=True)
class Entry:
    """A run folder as its `run.json` describes it."""

    folder: Path
    title: str
    scene: str
    status: str
    started: str
    duration: float
    simulated: bool

    @property
    def text(self) -> str:
        """What the search looks at."""
        return f"{self.folder.name} {self.title} {self.scene} {self.status}".lower()

    def shown_under(self, choice: int) -> bool:
        """Whether the filter shows it: 0 all, 1 complete, 2 simulated, 3 faults."""
        return (
            True,
            self.status == "complete",
            self.simulated,
            self.status not in ("complete", "running"),
        )[choice]


def entries(out: Path) -> list[Entry]:
    """The runs in `out`, newest first; folders that are no runs are passed over."""
    found = []
    if not out.is_dir():
        return []
    for file in sorted(out.glob("*/run.json"), reverse=True)[: 4 * SHOWN]:
        try:
            info = json.loads(file.read_text(encoding="utf-8"))
            found.append(
                Entry(
                    file.parent,
                    str(info.get("title") or info.get("protocol") or "run"),
                    str(info.get("scene") or ""),
                    _status(file.parent, str(info["status"])),
                    _when(str(info.get("started") or "")),
                    float(info.get("duration_s") or info.get("planned_s") or 0.0),
                    bool(info.get("simulated")),
                )
            )
        except (OSError, ValueError, KeyError, TypeError):
            continue
    return found


def _status(folder: Path, said: str) -> str:
    """As in `run.json`; "cut short" where a running run has no writer."""
    return "cut short" if said == "running" and not is_live(folder) else said


def _when(text: str) -> str:
    try:
        at = datetime.fromisoformat(text)
    except ValueError:
        return ""
    today = datetime.now(at.tzinfo).date()
    days = (today - at.date()).days
    day = {0: "today", 1: "yesterday"}.get(days, f"{at:%d %b}")
    return f"{day} {at:%H:%M}"
