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
    commit = commit_of(Path(__file__).parents[2])
    if commit is not None:
        found["commit"] = commit
    return found


def commit_of(root: Path) -> str | None:
    """The checkout's commit, with a plus where files were changed; None outside git."""
    if not (root / ".git").exists():
        return None
    try:
        # `describe --dirty` would take the lock of the user's index
        commit = _git(root, "describe", "--always")
        changed = _git(root, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.TimeoutExpired):
        return None
    return commit and commit + ("+" if changed else "")


def _git(root: Path, *arguments: str) -> str | None:
    done = subprocess.run(
        ["git", "--no-optional-locks", "-C", str(root), *arguments],
        capture_output=True,
        text=True,
        timeout=5,
        check=False,
    )
    return done.stdout.strip() or None
