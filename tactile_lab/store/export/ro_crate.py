"""The run folder as an RO-Crate: what each file is, who made it, when, and with what.

RO-Crate 1.1 is a `ro-crate-metadata.json` in JSON-LD beside the files it describes:
https://www.researchobject.org/ro-crate/specification/1.1
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from tactile_lab.errors import RunFolderError
from tactile_lab.quantity import looked_for
from tactile_lab.signals import SIGNALS
from tactile_lab.store.folder import told_status
from tactile_lab.store.progress import Progress, nothing
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection
from tactile_lab.whole_file import replacing, write_text

METADATA = "ro-crate-metadata.json"
CONTEXT = "https://w3id.org/ro/crate/1.1/context"
PROFILE = "https://w3id.org/ro/crate/1.1"
FORMATS = {
    ".h5": "application/x-hdf5",
    ".json": "application/json",
    ".jsonl": "application/jsonl",
    ".toml": "application/toml",
    ".py": "text/x-python",
    ".csv": "text/csv",
    ".txt": "text/plain",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".pdf": "application/pdf",
    ".html": "text/html",
}
"""Media types of what a run folder holds; a protocol's inputs may be anything."""
OTHER = "application/octet-stream"

EXPORTS = (
    ".mat", ".nc", ".nwb", ".zip", ".nix", ".npy", ".npz", ".aedat4", ".brian2.py",
    ".nest.py", ".snntorch.py",
)  # fmt: skip
"""Endings of what other formats leave beside the run's data."""
EXPORT_FOLDERS = ("csv", "parquet")

MEANINGS = {
    "data.h5": "samples, spikes, current, field, trials and events",
    "run.json": "what was run, when, with which instruments, and how it ended",
    "scene.toml": "the resolved scene: all that the run used; it can be run again",
    "log.jsonl": "log of the run, a line per entry",
    "remarks.json": "name, tags, star and notes: what people say of the run",
    "ledger.bin": "what was written of data.h5, for `tactile-lab recover`",
    "data.killed.h5": "data.h5 as a crash left it",
    "report.html": "report: figures, numbers, settings, loss certificate",
    "results.json": "numbers of the report",
}

Entity = dict[str, Any]


def size(run: Run, selection: Selection) -> int:
    """Bytes of the whole folder."""
    return sum(file.stat().st_size for file in _files(run.path))


def export(
    run: Run,
    file: Path,
    selection: Selection,
    progress: Progress = nothing,
    room: int | None = None,
) -> list[Path]:
    """Describe the folder in `ro-crate-metadata.json`; as .zip: with all its files.

    Args:
        run: ended.
        file: the metadata file in the run's folder, or a .zip elsewhere.
        selection: must be the whole run.
        progress: told what part is packed.
        room: bytes that it takes, as `size` tells where that is not known.

    Raises:
        RunFolderError: a part of the run was asked for, or another kind of file.
        RecordingError: there is no room.
        OSError: the file cannot be written.
    """
    if selection != Selection():
        raise RunFolderError(
            "an RO-Crate is the whole run folder; leave out --signal, --from, --until "
            "and --rate."
        )
    if told_status(run.path, run.status) == "running":
        raise RunFolderError(
            f"{run.path} is still recorded; an RO-Crate names each file with its size. "
            "Export it when the run has ended."
        )
    beside = run.path / METADATA
    if file.suffix != ".zip" and file.resolve() != beside.resolve():
        raise RunFolderError(
            f"an RO-Crate is {METADATA} in the run's folder, or a .zip with all its "
            f"files; leave out --out, or let {file.name} end in .zip."
        )
    text = json.dumps(crate(run), indent=2, ensure_ascii=False) + "\n"
    if file.suffix != ".zip":
        write_text(file, text)
        return [file]
    files, done = list(_files(run.path)), 0
    whole = size(run, selection) if room is None else room
    with replacing(file, whole) as part, zipfile.ZipFile(part, "w") as packed:
        packed.writestr(METADATA, text, zipfile.ZIP_DEFLATED)
        for one in files:
            packed.write(one, one.relative_to(run.path))  # samples are compressed
            done += one.stat().st_size
            progress(done / whole)
    return [file]


def crate(run: Run) -> dict[str, Any]:
    """The metadata: what the folder holds, and the measurement that made it."""
    info, notes = run.info, run.info.get("notes") or {}
    kind = "simulated" if run.simulated else "measured"
    title = info.get("title") or info.get("protocol") or "run"
    files = [_file(run, file) for file in _files(run.path)]
    people = [_person(notes["operator"])] if notes.get("operator") else []
    instruments = [
        {
            "@id": f"#{quote(name)}",
            "@type": "IndividualProduct",
            "name": found.get("identity") or name,
            "description": ", ".join(f"{key} {text}" for key, text in found.items()),
        }
        for name, found in (info.get("instruments") or {}).items()
    ]
    variables = [_variable(run, name) for name in run.signals]
    software = {
        "@id": "#tactile-lab",
        "@type": "SoftwareApplication",
        "name": "Tactile Lab",
        "version": str((info.get("environment") or {}).get("tactile-lab", "")),
    }
    found = None if run.detection is None else len(run.table("spikes"))
    spikes = looked_for(found, "spike")
    dataset: Entity = {
        "@id": "./",
        "@type": "Dataset",
        "name": f"{title}: {run.name}",
        "description": f"{title} on a spiking piezoelectric tactile sensor, {kind} "
        f"({info.get('bench')}), {told_status(run.path, run.status)}; "
        f"{run.duration:.4g} s, {spikes}",
        "datePublished": info.get("started"),
        "keywords": ["tactile sensor", "spikes", kind],
        "hasPart": [{"@id": one["@id"]} for one in files],
        "variableMeasured": [{"@id": one["@id"]} for one in variables],
        "mentions": {"@id": "#measurement"},
    }
    if notes.get("license"):
        dataset["license"] = notes["license"]
    if people:
        dataset["author"] = [{"@id": one["@id"]} for one in people]
    action: Entity = {
        "@id": "#measurement",
        "@type": "CreateAction",
        "name": title,
        "startTime": info.get("started"),
        "endTime": info.get("ended"),
        "actionStatus": "CompletedActionStatus"
        if run.status == "complete"
        else "FailedActionStatus",
        "object": [{"@id": "scene.toml"}],
        "result": [{"@id": "data.h5"}],
        "instrument": [{"@id": one["@id"]} for one in (software, *instruments)],
        "agent": [{"@id": one["@id"]} for one in people],
        "description": "; ".join(f"{key}: {text}" for key, text in notes.items()),
    }
    about = {
        "@id": METADATA,
        "@type": "CreativeWork",
        "conformsTo": {"@id": PROFILE},
        "about": {"@id": "./"},
    }
    action = {key: value for key, value in action.items() if value}
    others = (software, *instruments, *people, *variables, *files)
    graph = [about, dataset, action, *others]
    return {"@context": CONTEXT, "@graph": graph}


def _files(folder: Path) -> Iterator[Path]:
    """What belongs to the run; nothing hidden, and no exports of another format."""
    for file in sorted(folder.rglob("*")):
        inside = file.relative_to(folder)
        hidden = any(part.startswith(".") for part in inside.parts)
        exported = inside.parts[0] in EXPORT_FOLDERS or (
            len(inside.parts) == 1 and file.name.endswith((METADATA, *EXPORTS))
        )
        if file.is_file() and not hidden and not exported:
            yield file


def _file(run: Run, file: Path) -> Entity:
    name = file.relative_to(run.path).as_posix()
    found: Entity = {
        "@id": quote(name),
        "@type": "File",
        "name": MEANINGS.get(name, file.name),
        "encodingFormat": FORMATS.get(file.suffix, OTHER),
        "contentSize": str(file.stat().st_size),
    }
    if digest := (run.info.get("files") or {}).get(name):
        found["sha256"] = digest
    return found


def _person(name: str) -> Entity:
    return {"@id": "#operator", "@type": "Person", "name": name}


def _variable(run: Run, name: str) -> Entity:
    signal = run.signal(name)
    return {
        "@id": f"#{name}",
        "@type": "PropertyValue",
        "name": name,
        "description": SIGNALS[name].title if name in SIGNALS else name,
        "unitText": signal.unit,
    }
