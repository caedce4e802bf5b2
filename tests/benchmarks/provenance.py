"""Where a committed table comes from."""

import os
import platform
import subprocess
from datetime import date


def provenance() -> str:
    """Commit, day, Python and cores: the first words below a table's title."""
    commit = subprocess.run(
        ["git", "rev-parse", "--short", "HEAD"],
        capture_output=True,
        text=True,
        check=False,
    ).stdout.strip()
    python, cores = platform.python_version(), os.cpu_count()
    return f"Commit {commit}, {date.today()}, Python {python}, {cores} cores"
