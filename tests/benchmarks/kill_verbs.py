"""Kills run, report, export and recover at random instants, and looks at what is left.

    python tests/benchmarks/kill_verbs.py [--kills 1000] [--seed 1] [--out FILE]

Each verb runs in a fork of this process, which has everything imported, and is killed
with SIGKILL at an instant drawn evenly over the time it takes; every second run over
the time from its first data on, for much of a run goes by before. Then:

run      the folder opens, is recovered, verifies without a finding, and holds a prefix
         of what the same run gives to its end, no less than could be read right after
         the kill less a block
report   what lies there under its final name is whole (JSON parses, HTML and SVG are
         closed, PNG opens); every fourth time a second one writes the same numbers
export   the file is there whole or not at all, and a second export writes it
recover  a second one gives what an undisturbed one gives, sample for sample

What is done is kept in `build/kills.jsonl`; a campaign goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import random
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from typing import Any

import numpy as np
from provenance import provenance, tell

from tactile_lab.cli import main as command_line
from tactile_lab.errors import RunFolderError
from tactile_lab.store.recover import recover
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

VERBS = {"run": 0.4, "report": 0.2, "export": 0.2, "recover": 0.2}
"""Verbs, and the part of the kills that each gets."""

SHORT = (
    *("--set", 'protocol.levels=["120 mN", "180 mN"]'),
    *("--set", "protocol.ramp=0.2 s"),
    *("--set", "protocol.hold=1 s"),
    *("--set", "protocol.rest=0.2 s"),
    *("--set", "record.sample_rate=50 kS/s"),
    *("--set", 'record.signals=["V_C1", "V_K", "coil_current", "field", "spikes"]'),
)
FORMATS = ("csv", "mat", "ro-crate")
LEAST = 30_000
"""Samples a channel that the run to be recovered holds at least."""


def call(*arguments: str) -> None:
    """One call of the command line in this process, silently, to its end."""
    with Path(os.devnull).open("w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    try:
        command_line(arguments)
    except SystemExit as end:
        os._exit(end.code if isinstance(end.code, int) else 1)


def forked(
    arguments: tuple[str, ...],
    kill_after: float | None = None,
    first: Path | None = None,
) -> float:
    """Carry a call out in a fork; how long it took, s. Killed after that time if given.

    Args:
        arguments: of the command line.
        kill_after: s.
        first: folder in which a run's data is waited for; time counts from there.

    Raises:
        RuntimeError: it was not killed, and failed.
    """
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        try:
            call(*arguments)
        finally:
            os._exit(70)
    if first is not None:
        while not list(first.glob("*/data.h5")):
            time.sleep(0.002)
        began = time.monotonic()
    if kill_after is not None:
        time.sleep(kill_after)
        os.kill(child, signal.SIGKILL)
    _, status = os.waitpid(child, 0)
    if kill_after is None and status != 0:
        raise RuntimeError(f"{arguments} ended with {status >> 8}")
    return time.monotonic() - began


def codes(path: Path) -> dict[str, Any]:
    """Codes of each signal of a run."""
    with Run.load(path) as run:
        return {
            name: run.signal(name).scope_codes(0, run.stored(name))
            for name in run.signals
        }


def is_prefix(part: dict[str, Any], whole: dict[str, Any]) -> bool:
    """Whether all of `part` begins `whole`."""
    return all(
        np.array_equal(found, whole[name][: found.size]) for name, found in part.items()
    )


def only(folder: Path) -> Path | None:
    """The run in a folder, if one was begun."""
    found = [path for path in folder.glob("*") if path.is_dir()]
    return found[0] if found else None


def killed_run(place: Path, known: dict[str, Any], after: float) -> str:
    """What became of a killed run."""
    first = place if known["number"] % 2 else None
    forked(("run", "demo", "--no-report", "--out", str(place), *SHORT), after, first)
    path = only(place)
    if path is None or not (path / "run.json").exists():
        return "nothing begun"
    try:
        with Run.load(path) as run:
            seen, status = run.samples, run.status
    except RunFolderError:
        seen, status = 0, "running"
    if status == "running":
        recover(path)
    found = verify(path)
    if not found.sound:
        return f"UNSOUND: {found.findings[0]}"
    held = codes(path) if (path / "data.h5").exists() else {}
    if not is_prefix(held, known["codes"]):
        return "WRONG SAMPLES"
    kept = min((part.size for part in held.values()), default=0)
    if seen > 0 and kept < seen - known["block"]:
        return f"LOST {seen - kept} samples that had been read"
    if status != "running":
        return "ended before, sound"
    return "recovered, sound" if kept else "no sample yet, recovered"


def killed_report(place: Path, known: dict[str, Any], after: float) -> str:
    """What became of a run whose report was killed."""
    path = Path(shutil.copytree(known["whole"], place / known["whole"].name))
    for file in path.iterdir():
        if file.suffix in (".html", ".png", ".svg") or file.name == "results.json":
            file.unlink()
    forked(("report", str(path)), after)
    for file in path.iterdir():
        if file.name[0] != "." and not is_whole(file):
            return f"HALF {file.name}"
    if not verify(path).sound:
        return "UNSOUND"
    there = (path / "report.html").exists()
    if known["number"] % 4:
        return "report whole" if there else "no report yet"
    forked(("report", str(path)))
    if (path / "results.json").read_bytes() != known["results"]:
        return "OTHER NUMBERS in the second report"
    return "report whole" if there else "no report yet, then whole"


def is_whole(file: Path) -> bool:
    """Whether a file of a report is one that was written to its end."""
    if file.suffix == ".json":
        json.loads(file.read_text(encoding="utf-8"))
    elif file.suffix in (".html", ".svg"):
        end = "</html>" if file.suffix == ".html" else "</svg>"
        return file.read_text(encoding="utf-8").rstrip().endswith(end)
    elif file.suffix == ".png":
        return file.read_bytes().endswith(b"IEND\xaeB`\x82")
    return True


def killed_export(place: Path, known: dict[str, Any], after: float) -> str:
    """What became of a killed export."""
    path = Path(shutil.copytree(known["whole"], place / known["whole"].name))
    form = known["chance"].choice(FORMATS)
    there = {file.name for file in path.iterdir()}
    asked = ("export", str(path), "--to", form)
    forked(asked, after)
    wanted: dict[str, int] = known["exports"][form]
    new = [f for f in path.iterdir() if f.name not in there and f.name[0] != "."]
    for file in new:
        size = sum(one.stat().st_size for one in [file, *file.rglob("*")])
        if file.is_file() and abs(size - wanted.get(file.name, 0)) > 200:
            return f"HALF {file.name}"
    if not verify(path).sound:
        return "UNSOUND"
    forked(asked)
    return "export whole" if new else "no export yet, then whole"


def killed_recover(place: Path, known: dict[str, Any], after: float) -> str:
    """What became of a run whose recovery was killed."""
    path = Path(shutil.copytree(known["cut_short"], place / "run"))
    forked(("recover", str(path)), after)
    with_status = json.loads((path / "run.json").read_text(encoding="utf-8"))["status"]
    if with_status == "running":
        recover(path)
    found = verify(path)
    if not found.sound:
        return f"UNSOUND: {found.findings[0]}"
    held = codes(path)
    if not (is_prefix(held, known["mended"]) and is_prefix(known["mended"], held)):
        return "OTHER SAMPLES"
    original = path / "data.killed.h5"
    if original.read_bytes() != (known["cut_short"] / "data.h5").read_bytes():
        return "ORIGINAL CHANGED"
    return "again, sound" if with_status == "running" else "done before, sound"


JUDGES: dict[str, Callable[[Path, dict[str, Any], float], str]] = {
    "run": killed_run,
    "report": killed_report,
    "export": killed_export,
    "recover": killed_recover,
}


def here(*arguments: str) -> None:
    """One call of the command line in this process, silently.

    Raises:
        RuntimeError: it failed.
    """
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
        try:
            command_line(arguments)
        except SystemExit as end:
            if end.code not in (0, None):
                raise RuntimeError(f"{arguments} ended with {end.code}") from end


def cut_while_recording(place: Path) -> Path:
    """A long run that was killed once it had `LEAST` samples on disk."""
    child = os.fork()
    if child == 0:
        try:
            long = (
                "--set",
                'protocol.levels=["100 mN"]',
                "--set",
                "protocol.hold=300 s",
            )
            call("run", "demo", "--no-report", "--out", str(place), *SHORT, *long)
        finally:
            os._exit(70)
    kept = 0
    while kept < LEAST:
        time.sleep(0.02)
        if os.waitpid(child, os.WNOHANG)[0]:
            raise RuntimeError("the run to be killed ended by itself")
        with suppress(RunFolderError), Run.load(only(place) or place) as run:
            kept = run.samples
    os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)
    path = only(place)
    if path is None:
        raise RuntimeError("there is no run")
    return path


def prepared(place: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """What undisturbed calls give, and how long each takes, s."""
    took = {}
    # what this process has imported and compiled, no fork does again
    here("run", "demo", "--out", str(place / "warm"), *SHORT)
    warm = str(only(place / "warm"))
    for form in FORMATS:
        here("export", warm, "--to", form)
    here("verify", warm)
    run_to = ("run", "demo", "--no-report", *SHORT, "--out")
    took["run"] = forked((*run_to, str(place / "again")))
    took["recording"] = forked((*run_to, str(place / "whole")), first=place / "whole")
    whole = only(place / "whole")
    if whole is None:
        raise RuntimeError("there is no run")
    took["report"] = forked(("report", str(whole)))
    results = (whole / "results.json").read_bytes()
    exports = {}
    times = []
    for form in FORMATS:
        copy = Path(shutil.copytree(whole, place / f"for-{form}" / whole.name))
        there = {file.name for file in copy.iterdir()}
        times.append(forked(("export", str(copy), "--to", form)))
        exports[form] = {
            file.name: file.stat().st_size
            for file in copy.iterdir()
            if file.name not in there
        }
    took["export"] = max(times)
    cut_short = cut_while_recording(place / "cut")
    mended = Path(shutil.copytree(cut_short, place / "mended"))
    took["recover"] = forked(("recover", str(mended)))
    known = {
        "whole": whole, "results": results, "exports": exports,
        "cut_short": cut_short, "codes": codes(whole), "mended": codes(mended),
        "block": 16_384 + 4096,
    }  # fmt: skip
    return known, took


def main() -> int:
    """Kill, judge, and print or write the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--kills", type=int, default=1000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--done", type=Path, default=Path("build/kills.jsonl"))
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    chosen.done.parent.mkdir(parents=True, exist_ok=True)
    entries = []
    if chosen.done.exists():
        lines = chosen.done.read_text(encoding="utf-8").splitlines()
        entries = [one for one in map(json.loads, lines) if one["seed"] == chosen.seed]
    there = {(one["verb"], one["number"]) for one in entries}
    with tempfile.TemporaryDirectory() as folder, chosen.done.open("a") as file:
        known: dict[str, Any] = {}
        counts = {verb: round(part * chosen.kills) for verb, part in VERBS.items()}
        for number in range(max(counts.values())):
            for verb, count in counts.items():
                if number >= count or (verb, number) in there:
                    continue
                if not known:
                    known, took = prepared(Path(folder))
                chance = random.Random(f"{chosen.seed} {verb} {number}")
                place = Path(folder) / f"{verb}{number}"
                place.mkdir()
                recording = verb == "run" and number % 2
                longest = took["recording" if recording else verb]
                after = chance.uniform(0.0, 1.1 * longest)
                told = JUDGES[verb](
                    place, {**known, "chance": chance, "number": number}, after
                )
                shutil.rmtree(place)
                entry = {
                    "seed": chosen.seed, "verb": verb, "number": number,
                    "after_s": round(after, 3), "end": told,
                }  # fmt: skip
                entries.append(entry)
                file.write(json.dumps(entry) + "\n")
                file.flush()
                if told[:2].isupper():
                    print(json.dumps(entry), flush=True)
    text = table(entries, chosen.seed)
    tell(text, chosen.out)
    return 1 if any(one["end"][:2].isupper() for one in entries) else 0


def table(entries: list[dict[str, Any]], seed: int) -> str:
    """The page of the campaign."""
    ends = Counter((one["verb"], one["end"].partition(":")[0]) for one in entries)
    rows = [
        f"| {verb} | {end} | {count} |"
        for (verb, end), count in sorted(ends.items(), key=lambda one: one[0])
    ]
    head = [
        "# Killed while it worked",
        "",
        f"{provenance()}. {len(entries)} calls of `run`, `report`, `export` and "
        "`recover` killed with SIGKILL at instants drawn evenly over the time each "
        "takes, every second `run` over the time from its first data on "
        f"(seed {seed}). Made by `tests/benchmarks/kill_verbs.py`, which says "
        "what is looked at. Words in capitals are failures.",
        "",
        "| killed | end | times |",
        "|---|---|---|",
    ]
    return "\n".join([*head, *rows]) + "\n"


if __name__ == "__main__":
    sys.exit(main())
