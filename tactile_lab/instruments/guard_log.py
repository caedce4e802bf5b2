"""What guard processes wrote down: how a source was left whose program died.

A guard (`drivers.coil.guard_process`) appends one line when it has done its work; who
has outlived its owner reads there whether the output is off.
"""

from __future__ import annotations

import re
import time
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
    word = re.compile(
        rf"(\S+) guard \d+: .*; owner {owner}, port .*, (off|NOT verified off) after "
    )
    until = time.monotonic() + WAIT
    while True:
        try:
            lines = file.read_text("utf-8", "replace").splitlines()
        except OSError:
            lines = []
        for line in reversed(lines):
            if (found := word.match(line)) is not None:
                off = found[2] == "off"
                how = "verified off" if off else "NOT verified off"
                text = f"The guard left the output {how} ({found[1]}; see {file})."
                return OffReport(off, None, text)
        if time.monotonic() > until:
            return None
        time.sleep(LOOK)
