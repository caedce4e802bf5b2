"""Where a committed table comes from."""

import os
import platform
from datetime import date

from tactile_lab.validation.table import commit


def provenance() -> str:
    """Commit, day, Python and cores: the first words below a table's title."""
    python, cores = platform.python_version(), os.cpu_count()
    return f"Commit {commit()}, {date.today()}, Python {python}, {cores} cores"
