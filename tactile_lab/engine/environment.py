"""What computed a run: versions, commit, machine."""

from __future__ import annotations

import platform
import subprocess
from importlib import metadata
from pathlib import Path

PACKAGES = (
    "tactile-lab", "numpy", "scipy", "numba", "h5py", "hdf5plugin", "pyserial", "pyusb",
)  # fmt: skip


def environment() -> dict[str, str]:
    """Versions by name, for the record of a run."""
    found = {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
    }
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    commit = _commit()
    if commit is not None:
        found["commit"] = commit
    return found


def _commit() -> str | None:
    """The checkout's commit, with a plus where files were changed; None outside git."""
    root = Path(__file__).parents[2]
    if not (root / ".git").exists():
        return None
    try:
        asked = subprocess.run(
            ["git", "-C", str(root), "describe", "--always", "--dirty=+"],
            capture_output=True,
            text=True,
            timeout=5,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return asked.stdout.strip() or None
