"""What the reports of this room share: where a number comes from, and tables."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Iterable, Sequence
from datetime import date
from pathlib import Path


def provenance() -> str:
    """Commit, date, machine and how busy it is, for the head of a report."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True,
        check=False, cwd=Path(__file__).parent,
    ).stdout.strip()  # fmt: skip
    busy = f", load average {os.getloadavg()[0]:.0f}" if os.name == "posix" else ""
    return (
        f"Commit {commit or 'unknown'}, {date.today().isoformat()}, "
        f"{platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, one thread{busy}."
    )


def markdown(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)
