"""What guard processes wrote down: how a source was left whose program died.

A guard (`drivers.coil.guard_process`) appends one line when it has done its work; who
has outlived its owner reads there whether the output is off.
"""

from __future__ import annotations

import re
import time
from datetime import datetime
from pathlib import Path

from tactile_lab.bench import OffReport
from tactile_lab.lab import state_folder

WAIT = 1.0
"""How long a guard's word is waited for, s; it takes some 20 ms."""

LOOK = 0.02
"""Pause between two looks into the log, s."""


def default_log() -> Path:
    """Where guards write what they did."""
    return state_folder() / "guard.log"


def left_by_guard(owner: int, log: Path | None = None) -> OffReport | None:
    """How a guard left the source of process `owner`, which has ended.

    Waits up to `WAIT` s for it; None where no guard of it has said anything.
    """
    file = log or default_log()
    until = time.monotonic() + WAIT
    while (said := _last_word(owner, file)) is None:
        if time.monotonic() > until:
            return None
        time.sleep(LOOK)
    when, off = said
    how = "verified off" if off else "NOT verified off"
    return OffReport(
        off, None, f"The guard left the output {how} ({when}; see {file})."
    )


def switched_off(owner: int, since: float) -> float | None:
    """When a guard verified the source of process `owner` off.

    Args:
        owner: its number, which another may have had before.
        since: look at what was done from then on, s since the epoch.

    Returns:
        Seconds since the epoch; None where no guard of it has done so.
    """
    said = _last_word(owner, default_log())
    if said is None or not said[1]:
        return None
    # it writes whole seconds
    when = datetime.strptime(said[0], "%Y-%m-%dT%H:%M:%S%z").timestamp() + 1.0
    return when if when > since else None


def _last_word(owner: int, file: Path) -> tuple[str, bool] | None:
    """When a guard of `owner` had done its work last, and whether that was verified."""
    word = re.compile(
        rf"(\S+) guard \d+: .*; owner {owner}, port .*, (off|NOT verified off) after "
    )
    try:
        lines = file.read_text("utf-8", "replace").splitlines()
    except OSError:
        return None
    for line in reversed(lines):
        if (found := word.match(line)) is not None:
            return found[1], found[2] == "off"
    return None
