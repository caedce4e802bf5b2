"""Each key of each scene that ships far from what it is, through `plan` and `simulate`.

    python tests/benchmarks/key_ends.py [--scene NAME] [--out FILE]

A number is made 10, 1000, ... times larger and smaller. A scene is hopeless whose model
alone, or plan, then takes more than `LONGEST` of the processor: it is to be refused
with the number, or made fast. Keys that all scenes have are tried with one. Each call
has a fork of its own; what is done is kept in `build/key-ends.jsonl`, so that it goes
on where it was stopped. The exit code is 1 where anything was hopeless or a traceback.
"""

from __future__ import annotations

import argparse
import io
import json
import os
import resource
import signal
import sys
import tomllib
from collections import Counter
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

from provenance import provenance, tell

LONGEST = 20
"""Processor time of a call from which on it is hopeless, s."""
MEMORY = 4 << 30
"""Memory that a call may take, bytes."""
FACTORS = (1e1, 1e3, 1e6, 1e12, 1e-1, 1e-3, 1e-6, 1e-12, -1.0, 0.0)
ALL_HAVE = ("record", "detect", "sensor", "coil", "simulated", "conditions", "bench")
"""Tables whose keys are tried with the first scene alone."""
VERBS = ("plan", "simulate")
ANSWERED, REFUSED = "answered", "refused"
HOPELESS, MISTAKE, DIED = "hopeless", "traceback", "died"


def numbers(scene: str, whole: bool) -> Iterator[tuple[str, str]]:
    """Changes of single keys of a scene, as `--set` takes them, by key."""
    from tactile_lab.scene.keys import keys
    from tactile_lab.scene.load import load

    for key in keys(load(scene)):
        # a list of tables is shown as it cannot be written
        shown = not key.value or "{...}" in key.value
        if not shown and (whole or key.name.partition(".")[0] not in ALL_HAVE):
            value = tomllib.loads(f"x = {key.value}")["x"]
            yield from ((key.name, text) for text in far(value))


def far(value: Any) -> Iterator[str]:
    """A key's value, as TOML writes it, far from what it is."""
    listed = isinstance(value, list | tuple)
    held = list(value) if listed else [value]
    for factor in FACTORS:
        try:
            changed = [scaled(one, factor) for one in held]
        except ValueError:
            return
        if changed != held:
            yield json.dumps(changed if listed else changed[0])


def scaled(value: Any, factor: float) -> Any:
    """A number, with its unit if it has one, times a factor.

    Raises:
        ValueError: it is none.
    """
    if isinstance(value, bool) or value is None:
        raise ValueError(value)
    if isinstance(value, int | float):
        return type(value)(value * factor)
    number, _, unit = str(value).replace("\u2212", "-").partition(" ")
    return f"{float(number) * factor!r} {unit}".strip()


def called(verb: str, scene: str, change: str) -> dict[str, Any]:
    """What one call of the command line came to, and what it took."""
    reading, telling = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        resource.setrlimit(resource.RLIMIT_CPU, (LONGEST, LONGEST + 5))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        os.write(telling, json.dumps(answer(verb, scene, change)).encode()[:60_000])
        os._exit(0)
    os.close(telling)
    told = b""
    while part := os.read(reading, 1 << 16):
        told += part
    os.close(reading)
    _, status, used = os.wait4(child, 0)
    found: dict[str, Any] = json.loads(told) if told else {}
    if not told:
        over = os.WIFSIGNALED(status) and os.WTERMSIG(status) == signal.SIGXCPU
        found = {"end": HOPELESS if over else DIED, "said": f"status {status}"}
    return {**found, "cpu_s": round(used.ru_utime + used.ru_stime, 2)}


def answer(verb: str, scene: str, change: str) -> dict[str, Any]:
    """How a call ended, and what it said."""
    from tactile_lab.cli import main

    out, err = io.StringIO(), io.StringIO()
    code = 0
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main([verb, scene, "--json", "--set", change])
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
        except BaseException as error:
            said = f"{type(error).__name__}: {error}"
            return {"end": MISTAKE, "said": said[-300:]}
    if "Traceback" in err.getvalue() or "has a mistake" in err.getvalue():
        return {"end": MISTAKE, "said": err.getvalue()[-300:]}
    if code:
        return {"end": REFUSED, "said": err.getvalue()[-300:]}
    held = json.loads(out.getvalue())
    if verb == "plan":
        return {"end": ANSWERED, "said": json.dumps(held.get("computing"))}
    return {"end": ANSWERED, "said": f"{len(held['spike_times_s'] or ())} spikes"}


def campaign(scenes: list[str], done: Path) -> Iterator[dict[str, Any]]:
    """Every call's entry; those of an earlier campaign are not repeated."""
    known = {}
    if done.exists():
        lines = done.read_text(encoding="utf-8").splitlines()
        known = {
            (e["verb"], e["scene"], e["change"]): e for e in map(json.loads, lines)
        }
    done.parent.mkdir(parents=True, exist_ok=True)
    with done.open("a", encoding="utf-8") as file:
        for number, scene in enumerate(scenes):
            for key, text in numbers(scene, whole=number == 0):
                for verb in VERBS:
                    change = f"{key}={text}"
                    entry = known.get((verb, scene, change))
                    if entry is None:
                        asked = {"verb": verb, "scene": scene, "change": change}
                        entry = {**asked, **called(**asked)}
                        file.write(json.dumps(entry) + "\n")
                        file.flush()
                    yield entry


def main() -> int:
    """Sweep, print what was hopeless, print or write the table."""
    from tactile_lab.plugins import scene_names

    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--scene", action="append", choices=scene_names())
    options.add_argument("--done", type=Path, default=Path("build/key-ends.jsonl"))
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    scenes = chosen.scene or ["demo", *(s for s in scene_names() if s != "demo")]
    for verb in VERBS:  # what this process has imported, no fork does again
        answer(verb, "demo", "protocol.hold=1 s")
    found: dict[str, Counter[str]] = {scene: Counter() for scene in scenes}
    longest = dict.fromkeys(scenes, 0.0)
    for entry in campaign(scenes, chosen.done):
        found[entry["scene"]][entry["end"]] += 1
        longest[entry["scene"]] = max(longest[entry["scene"]], entry["cpu_s"])
        if entry["end"] not in (ANSWERED, REFUSED):
            print(json.dumps(entry), flush=True)
    ends = (ANSWERED, REFUSED, HOPELESS, MISTAKE, DIED)
    total = sum(found.values(), Counter[str]())
    found, longest = {**found, "**all**": total}, {
        **longest, "**all**": max(longest.values()),
    }  # fmt: skip
    rows = (
        f"| {scene} | {counts.total()} | "
        + " | ".join(str(counts[end]) for end in ends)
        + f" | {longest[scene]:.1f} |"
        for scene, counts in found.items()
    )
    text = "\n".join(
        [
            "# Keys at their ends",
            "",
            f"{provenance()}. Made by `tests/benchmarks/key_ends.py`: each number of "
            "each scene that ships 10, 1000, 10⁶ and 10¹² times larger and smaller, "
            "negative and 0, through `plan` and `simulate`. A call is hopeless that "
            f"takes more than {LONGEST} s of the processor.",
            "",
            "| scene | calls | " + " | ".join(ends) + " | longest, s |",
            "|---|" + "---|" * (len(ends) + 2),
            *rows,
        ]
    )
    tell(text + "\n", chosen.out)
    return 1 if any(total[end] for end in (HOPELESS, MISTAKE, DIED)) else 0


if __name__ == "__main__":
    sys.exit(main())
