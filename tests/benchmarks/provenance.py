"""Where a committed table comes from, and where it goes."""

import os
import platform
from datetime import date
from pathlib import Path

from tactile_lab.validation.table import commit


def provenance() -> str:
    """Commit, day, Python and cores: the first words below a table's title."""
    python, cores = platform.python_version(), os.cpu_count()
    return f"Commit {commit()}, {date.today()}, Python {python}, {cores} cores"


def tell(text: str, out: Path | None) -> None:
    """Print a page, and write it into the file `out` where one is named."""
    print(text)
    if out is not None:
        out.write_text(text, encoding="utf-8")
