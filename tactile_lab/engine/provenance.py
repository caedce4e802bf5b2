"""What a run keeps of where it came from, so that its folder needs nothing outside."""

from __future__ import annotations

import inspect
import platform
import subprocess
from collections.abc import Iterator, Mapping
from contextlib import suppress
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from tactile_lab.acquisition.search import SpikeSearch
from tactile_lab.bench import Bench
from tactile_lab.errors import RecordingError
from tactile_lab.planning.needs import Needs
from tactile_lab.planning.plan import Plan
from tactile_lab.plugins import ships
from tactile_lab.scene.bench_file import PortSpec, ScopeSpec
from tactile_lab.scene.scene import Scene
from tactile_lab.scene.tables import ZERO_CELSIUS
from tactile_lab.scope import Stream
from tactile_lab.store.folder import INPUTS, PLANNED, SCENE, RunFolder
from tactile_lab.store.layout import Layout
from tactile_lab.table import dumped
from tactile_lab.trust import code_named, remember

PACKAGES = (
    "tactile-lab", "numpy", "scipy", "numba", "h5py", "hdf5plugin", "pyserial", "pyusb",
)  # fmt: skip

Settings = Mapping[str, Mapping[str, str]]


def origin(plan: Plan, bench: Bench, notes: Mapping[str, str]) -> dict[str, Any]:
    """What `run.json` says of a run before it begins."""
    scene = plan.scene
    return {
        "scene": scene.name,
        "protocol": scene.protocol.name,
        "title": scene.protocol.title,
        "parameters": dumped(scene.protocol),
        "bench": scene.bench.name,
        "simulated": bench.simulated,
        "seed": scene.simulated.seed if bench.simulated else None,
        "sample_rate_Hz": scene.record.sample_rate,
        "planned_s": plan.estimate.duration,
        PLANNED: instruments(scene, plan.needs),
        "warnings": list(plan.warnings),
        "assumptions": list(plan.assumptions),
        "notes": dict(notes),
        "environment": environment(),
    }


def instruments(scene: Scene, needed: Needs) -> dict[str, str]:
    """What a run is to open, by the names under which `run.json` has what it opened."""
    bench = scene.bench
    wanted: dict[str, PortSpec | ScopeSpec | None] = {
        "coil": bench.coil if needed.coil else None,
        "scope": bench.scope if needed.channels else None,
        "field meter": bench.field_meter if needed.field_meter else None,
        "thermometer": bench.thermometer if needed.thermometer else None,
    }
    sources = {f"source of {n}": bench.voltage_sources[n] for n in needed.voltages}
    found = {}
    for name, spec in {**wanted, **sources}.items():
        if spec is not None:
            kind = Path(spec.dialect or spec.driver).name  # may be somebody's own file
            at = f" at {spec.port}" if isinstance(spec, PortSpec) else ""
            found[name] = f"{kind}{at}"
    return found


def layout(
    plan: Plan,
    bench: Bench,
    folder: RunFolder,
    search: SpikeSearch | None,
    stream: Stream | None,
) -> Layout:
    """What the record of a planned run holds; `run.json` says how spikes are found."""
    detection = None
    if search is not None and stream is not None:
        detection = search.detection(stream)
        folder.update(detection=search.describe(stream))
    magnet = plan.scene.bench.magnet
    return Layout(
        signals=plan.needs.stored,
        detection=detection,
        simulated=bench.simulated,
        attributes={"newtons_per_ampere": magnet.newtons_per_ampere},
    )


def keep_scene(folder: RunFolder, scene: Scene) -> None:
    """Put the resolved scene, and every file it was made from, into the run.

    The scene names the copies, so that the run can be read and repeated wherever its
    folder lies. The protocol's source is kept for the record even where it ships.

    Raises:
        RecordingError: a file cannot be read any more, or the folder not be written.
    """
    copies = _names(scene.files)
    folder.write_text(SCENE, scene.to_toml(copies))
    sources = {path: f"{INPUTS}/{path.name}" for path in _shipped(scene)}
    for path, name in {**sources, **copies}.items():
        try:
            text = path.read_text(encoding="utf-8")
        except (OSError, ValueError) as error:
            raise RecordingError(
                f"{path} cannot be copied into the run: "
                f"{getattr(error, 'strerror', None) or error}."
            ) from error
        folder.write_text(name, text)
    with suppress(OSError):  # `tactile-lab trust` says what prevents it
        remember(code_named(scene.to_dict(), folder.path))


def temperature(scene: Scene, read_back: Settings) -> dict[str, object]:
    """Temperature of the run, K, and who says so; both None where nobody does."""
    if scene.conditions.temperature is not None:
        return {"K": scene.conditions.temperature, "from": "entered"}
    for instrument, found in read_back.items():
        try:
            celsius = float(found["temperature"])
        except (KeyError, ValueError):
            continue
        return {"K": celsius + ZERO_CELSIUS, "from": instrument}
    return {"K": None, "from": None}


def _names(files: tuple[Path, ...]) -> dict[Path, str]:
    """A name of its own in the run for each file."""
    found: dict[Path, str] = {}
    for path in dict.fromkeys(files):
        name, number = f"{INPUTS}/{path.name}", 2
        while name in found.values():
            name, number = f"{INPUTS}/{path.stem}_{number}{path.suffix}", number + 1
        found[path] = name
    return found


def _shipped(scene: Scene) -> Iterator[Path]:
    """Source files of a protocol that ships, those it builds on included."""
    for kind in type(scene.protocol).__mro__:
        if ships(kind):
            yield Path(inspect.getfile(kind))


def environment() -> dict[str, str]:
    """Versions by name, for the record of a run."""
    found = {
        "python": platform.python_version(),
        "system": f"{platform.system()} {platform.release()} {platform.machine()}",
        **_versions(),
    }
    commit = commit_of(Path(__file__).parents[2])
    if commit is not None:
        found["commit"] = commit
    return found


@cache
def _versions() -> dict[str, str]:
    """Of `PACKAGES`; a process keeps those it began with."""
    found = {}
    for name in PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
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
