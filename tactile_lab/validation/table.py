"""What the reports of this room share: provenance, tables, how a figure is kept."""

from __future__ import annotations

import os
import platform
import subprocess
from collections.abc import Iterable, Sequence
from datetime import date
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_lab.whole_file import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def commit() -> str:
    """Of the checkout; "unknown" outside of one."""
    said = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"], capture_output=True, text=True,
        check=False, cwd=Path(__file__).parent,
    ).stdout.strip()  # fmt: skip
    return said or "unknown"


def provenance() -> str:
    """Commit, date, machine and how busy it is, for the head of a report."""
    busy = f", load average {os.getloadavg()[0]:.0f}" if os.name == "posix" else ""
    return (
        f"Commit {commit()}, {date.today().isoformat()}, "
        f"{platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, one thread{busy}."
    )


def markdown(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    lines = [headings, ["---"] * len(headings), *rows]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def save(plot: Figure, path: Path) -> None:
    """Write a figure as SVG, without the date, and let go of it."""
    import matplotlib.pyplot as plt

    with replacing(path) as part:
        plot.savefig(part, metadata={"Date": None})
    plt.close(plot)
