"""What a run warned of while it went on."""

from __future__ import annotations

import json
from collections.abc import Iterator

from tactile_lab.store.folder import LOG
from tactile_lab.store.stored_run import StoredRun

MOST = 20
"""So many are told; one that comes with every trial says no more by its 200th."""


def told(run: StoredRun) -> tuple[str, ...]:
    """Each once, in order, as its log has them; a recorded event holds 160 bytes."""
    found = list(dict.fromkeys(_logged(run)))
    more = len(found) - MOST
    if more > 0:
        found[MOST:] = [f"{more} more warnings while it went on stand in {LOG}."]
    return tuple(found)


def _logged(run: StoredRun) -> Iterator[str]:
    try:
        lines = (run.path / LOG).read_text(encoding="utf-8", errors="replace")
    except OSError:  # it was moved; the record has the beginnings
        for event in run.events[run.events["kind"] == b"warning"]:
            yield bytes(event["text"]).decode("utf-8", errors="replace")
        return
    for line in lines.splitlines():
        try:
            entry = json.loads(line)
        except ValueError:
            continue  # a crash tore it
        if isinstance(entry, dict) and entry.get("kind") == "warning":
            yield str(entry.get("text", ""))
