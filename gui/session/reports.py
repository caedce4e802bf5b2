"""Writing a run's report in a process of its own, so that no frame waits for it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tactile_lab.errors import RecordingError

LONGEST = 300.0
"""Seconds a report may take."""


def write_report(folder: Path) -> None:
    """Write figures, results and report into a finished run's folder.

    Raises:
        RecordingError: the report could not be written.
    """
    try:
        asked = subprocess.run(
            [sys.executable, "-m", "gui.session.reports", str(folder.resolve())],
            capture_output=True,
            text=True,
            timeout=LONGEST,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RecordingError(f"The report was not written: {error}") from error
    if asked.returncode:
        last = (asked.stderr.strip().splitlines() or ["no message"])[-1]
        raise RecordingError(f"The report was not written: {last}")


def main(folder: str) -> None:
    """Write the report of the run in `folder`; the window and a next run come first."""
    if hasattr(os, "nice"):
        os.nice(10)
    from tactile_lab.report.from_run import read
    from tactile_lab.report.write import write

    write(Path(folder), read(Path(folder)))


if __name__ == "__main__":
    main(sys.argv[1])
