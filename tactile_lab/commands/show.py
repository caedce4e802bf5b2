"""``tactile-lab show``: what one run holds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import click

from tactile_lab.commands.options import json_option, run_argument
from tactile_lab.commands.terminal import print_json, reading, say

FIGURES = (".png", ".svg", ".pdf", ".html")


@click.command()
@run_argument
@json_option
def command(run: Path, as_json: bool) -> None:
    """Show what RUN is, what it holds and where its figures are."""
    with reading(run):  # what is damaged may be found as late as it is put into words
        summary = describe(run)
        told = [(name, value) for name, value in rows(summary) if value]
    if as_json:
        print_json(summary)
    else:
        kind = "simulated" if summary["simulated"] else "measured"
        say(f"{summary['run']}: {summary['status']}, {kind}")
        for name, value in told:
            say(f"{name:<13}{value}" if name else str(value))


def describe(path: Path) -> dict[str, Any]:
    """The documented object (docs/run-folder.md); also for runs without samples.

    Raises:
        RunFolderError: not a run folder, or its data cannot be read.
    """
    from tactile_lab.errors import RunFolderError
    from tactile_lab.store.folder import (
        DATA,
        PLANNED,
        has_lost_data,
        read_info,
        told_status,
    )
    from tactile_lab.store.remarks import read_remarks
    from tactile_lab.store.run import Run
    from tactile_lab.store.stored_run import ended
    from tactile_lab.store.uncounted import uncounted

    info = read_info(path)
    planned = info.get(PLANNED) or {}
    status = told_status(path, info["status"])
    summary: dict[str, Any] = {
        "run": str(path),
        "status": "data gone" if has_lost_data(path, info) else status,
        "reason": info.get("reason"),
        "started": info.get("started"),
        "protocol": info.get("protocol"),
        "scene": info.get("scene"),
        "bench": info.get("bench"),
        "simulated": info.get("simulated"),
        "notes": info.get("notes") or {},
        "remarks": asdict(read_remarks(path)),
        "temperature_K": (info.get("temperature") or {}).get("K"),
        "detection": info.get("detection"),
        "instruments": dict.fromkeys(planned)
        | {
            name: found.get("identity")
            for name, found in (info.get("instruments") or {}).items()
        },
        "instruments_planned": planned,
        "instruments_changed": info.get("instruments_changed") or [],
        "inputs": info.get("files") or {},
        "loss": info.get("loss"),
        "duration_s": None,
        "signals": {},
        "spikes": None,
        "trials": [],
        "overrange_blocks": 0,
        "figures": sorted(
            str(file) for file in path.iterdir() if file.suffix in FIGURES
        ),
    }
    try:
        loaded = Run.load(path) if (path / DATA).exists() else None
    except RunFolderError:
        if status != "cut short":
            raise
        loaded = None  # killed before its first sample
    if loaded is not None:
        with loaded as run:
            summary["duration_s"] = run.duration
            summary["signals"] = {
                name: {
                    "unit": signal.unit,
                    "samples": len(signal),
                    "sample_rate_Hz": 1.0 / signal.interval,
                    "resolution": abs(signal.gain),
                }
                for name in run.signals
                for signal in [run.signal(name)]
            }
            searched, trials = run.detection is not None, run.trials
            if searched:
                summary["spikes"] = int(run.spikes.size)
            summary["trials"] = [
                {
                    "label": row["label"].decode(),
                    "level_N": None if row["level"] != row["level"] else row["level"],
                    "start_s": float(row["start"]),
                    "end_s": float(row["end"]),
                    "spikes": int(row["spikes"]) if searched else None,
                    "uncounted": (why_not or None) if searched else None,
                    "skipped": int(row["skipped"]),
                    "complete": bool(whole),
                }
                for row, whole, why_not in zip(
                    trials, ended(trials), uncounted(run), strict=True
                )
            ]
            summary["overrange_blocks"] = int(run.records("overrange").size)
    return summary


def rows(summary: dict[str, Any]) -> Iterator[tuple[str, object]]:
    """Names and what is shown beside them; rows without a value are left out."""
    from tactile_lab.measurement import unlike_asked
    from tactile_lab.quantity import count, show
    from tactile_lab.scene.tables import ZERO_CELSIUS

    for key in ("reason", "started", "protocol", "scene", "bench"):
        yield key, summary[key]
    yield from summary["notes"].items()
    said = summary["remarks"]
    yield "title", said["title"]
    yield "tags", ", ".join(said["tags"])
    for note in said["notes"]:
        at = "" if note["time"] is None else f"{note['time']:.1f} s: "
        yield "note", f"{at}{note['text']}"
    if summary["temperature_K"] is not None:
        yield "temperature", f"{summary['temperature_K'] - ZERO_CELSIUS:.4g} °C"
    planned = summary["instruments_planned"]
    for name, identity in summary["instruments"].items():
        unheard = f"{planned[name]}: not heard from" if name in planned else None
        yield name, identity or unheard
    yield from (("changed", line) for line in summary["instruments_changed"])
    if found := summary["detection"]:
        why = ", from the noise" if found["from"] == "noise" else ""
        threshold = show(found["threshold_V"], "V", 3)
        yield "detection", f"{found['signal']}, {found['kind']} at {threshold}{why}"
    if summary["duration_s"] is not None:
        yield "duration", show(summary["duration_s"], "s")
    elif summary["status"] != "data gone":
        yield "samples", "none recorded"
    for name, signal in summary["signals"].items():
        rate = show(signal["sample_rate_Hz"], "S/s")
        step = show(signal["resolution"], signal["unit"], 3)
        yield name, f"{signal['samples']} samples, {rate}, step {step}"
    if summary["duration_s"] is not None:
        spikes = summary["spikes"]
        yield "spikes", "not looked for" if spikes is None else str(spikes)
        found = [trial["uncounted"] for trial in summary["trials"]]
        yield "", "; ".join(dict.fromkeys(filter(None, found)))
    for trial in summary["trials"]:
        begun = f"{trial['start_s']:.3f}"
        if trial["start_s"] < trial["end_s"]:
            times = f"{begun} to {trial['end_s']:.3f} s"
        else:  # prepared, and the run ended before it
            times = f"would have begun at {begun} s"
        unlike = unlike_asked(complete=trial["complete"], skipped=trial["skipped"])
        spikes = trial["spikes"]
        told = "" if spikes is None else f", {count(spikes, 'spike')}"
        told += " seen, no count" if trial["uncounted"] else ""
        yield "trial", f"{trial['label']:<12} {times}{told}{unlike}"
    if summary["overrange_blocks"]:
        yield "over range", f"in {summary['overrange_blocks']} blocks"
    if summary["loss"]:
        yield "", summary["loss"]["text"]
    for name, digest in summary["inputs"].items():
        yield "kept", f"{name}  sha256 {str(digest)[:16]}"
    yield from (("figure", figure) for figure in summary["figures"])
