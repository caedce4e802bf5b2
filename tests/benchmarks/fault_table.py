"""How many faults were injected into whole runs, and what became of each run.

    python tests/benchmarks/fault_table.py [--times N] [--out docs/fault-figures.md]

Each cause of each row is injected at N seeded random places of a run on the simulated
bench. A run survives if it goes on to its end, or ends with one of our messages and the
source really off, or says that the source's state is unknown; and if every sample taken
is stored. The exit code is 1 where one did not.
"""

from __future__ import annotations

import argparse
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any

from fault_rows import (  # beside it
    PLAYED,
    SCOPE,
    SERIAL,
    Cause,
    Injection,
    Row,
    coil_end,
)
from provenance import provenance
from usb_fault_rows import ROWS as USB  # beside it
from usb_fault_rows import session

from sim_backend.bench import open_bench
from sim_backend.coil.list_mode import ListFault
from tactile_lab.acquisition.ending import Executed
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.execution import Execution
from tactile_lab.errors import TactileLabError
from tactile_lab.planning.needs import needs
from tactile_lab.scene.load import load
from tactile_lab.scene.scene import Scene
from tactile_lab.store.run import Run

OVERRIDES = (
    'protocol.levels=["120 mN"]',
    "protocol.ramp=0.2 s",
    "protocol.hold=0.3 s",
    "protocol.rest=0.1 s",
    "record.sample_rate=0.2 MS/s",
    'record.signals=["force", "V_C1", "V_K", "coil_current", "field", "spikes"]',
)
WENT_ON, ENDED, UNKNOWN, WRONG = "went on", "ended", "unknown", "wrong"
MISSED = "did not strike"
OFF_CURRENT = 5e-3
"""Current that counts as none, A."""
TRIES = 8
"""Places tried for one injection until it strikes."""


def outcome(scene: Scene, injection: Injection, folder: Path) -> tuple[str, str]:
    """What became of one run, and what it said."""
    bench = open_bench(
        scene,
        needs(scene),
        coil_faults=injection.coil,
        scope_faults=injection.scope,
        meter_faults=injection.meter,
        make=injection.make,
    )
    end = coil_end(bench)
    source: Any = end.instrument
    if injection.prepare is not None:
        bench = injection.prepare(bench)
    made = injection.make is not None or injection.prepare is not None
    made = made or any(isinstance(one, ListFault) for one in injection.coil)
    done = Execution(scene, folder, bench=bench).run()
    struck = made or _struck(bench, end)
    really_off = not source.output_on and abs(source.measured_current()) < OFF_CURRENT
    told = done.reason or ""
    if not struck:
        return MISSED, told
    if injection.bug and (done.folder / "traceback.txt").exists():
        return (ENDED if done.off.verified and really_off else WRONG), told
    return _judged(done, really_off), told


def _struck(bench: Any, end: Any) -> bool:
    meter = bench.field_meter._wire.link.port.far_end
    schedule = bench.scope._unit._library.device.schedule
    return bool(end.faults.struck or meter.faults.struck or schedule.struck)


def _judged(done: Executed, really_off: bool) -> str:
    ending = done
    if (
        ending.off.verified
        and not really_off
        and "never reached" not in ending.off.text
    ):
        return WRONG
    if done.loss["samples"] not in (0, None) or not _kept(done):
        return WRONG
    if ending.failure is not None and not isinstance(ending.failure, TactileLabError):
        return WRONG
    if not ending.off.verified:
        return UNKNOWN if "unknown" in ending.off.text.lower() else WRONG
    if ending.state is RunState.COMPLETE:
        return WENT_ON
    return ENDED if ending.reason else WRONG


def _kept(done: Executed) -> bool:
    """Whether what the run took can be read back; nothing where it took nothing."""
    if not (done.folder / "data.h5").exists():
        return True
    with Run.load(done.folder) as run:
        return len(run.signal("V_K")) == run.samples


def played_by(way: str) -> Scene:
    """What is run: a pulse, its force by `way` on a bench where that can be."""
    with tempfile.TemporaryDirectory() as folder:
        bench = None
        if way == "generator":
            built_in = resources.files("tactile_lab.scene") / "simulated_bench.toml"
            bench = Path(folder) / "generator.toml"
            bench.write_text(built_in.read_text("utf-8") + "\n[coil.generator]\n")
        scene = load("demo", (*OVERRIDES, f"coil.way={way}"), bench)
        # the run keeps a copy of its scene, not of a bench file that is gone
        return replace(scene, bench=replace(scene.bench, file=None))


def runs(row: Row, times: int) -> tuple[Counter[str], list[str]]:
    """Outcomes of a row's causes, each `times` times, and what the wrong ones said."""
    scene = played_by(row.way)
    found: Counter[str] = Counter()
    wrong = []
    for number, cause in enumerate(row.causes):
        for k in range(times):
            seed = f"{row.title} {number} {k}"
            what, told = _strike(cause, seed, scene)
            found[what] += 1
            if what in (WRONG, MISSED):
                wrong.append(f"{seed}: {what}: {told}")
    return found, wrong


def _strike(cause: Cause, seed: str, scene: Scene) -> tuple[str, str]:
    """The outcome of a cause at a place where it strikes."""
    chance, what, told = random.Random(seed), MISSED, ""
    for _ in range(TRIES):
        with tempfile.TemporaryDirectory() as folder:
            what, told = outcome(scene, cause(chance), Path(folder))
        if what != MISSED:
            break
    return what, told


def usb_runs(row: Row, times: int) -> tuple[Counter[str], list[str]]:
    """Outcomes of sessions with a USBTMC scope, which drives no coil."""
    found: Counter[str] = Counter()
    wrong = []
    for number, cause in enumerate(row.causes):
        for k in range(times):
            seed = f"{row.title} {number} {k}"
            what, told = session(cause, seed)
            found[what] += 1
            if what in (WRONG, MISSED):
                wrong.append(f"{seed}: {what}: {told}")
    return found, wrong


def main() -> int:
    """Inject everything, print and write the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--times", type=int, default=10)
    options.add_argument("--row", default="", help="only rows with this in their title")
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    lines: list[str] = []
    total, bad = Counter[str](), list[str]()
    groups: list[tuple[list[Row], Callable[..., tuple[Counter[str], list[str]]]]] = [
        (SERIAL, runs), (PLAYED, runs), (SCOPE, runs), (USB, usb_runs)
    ]  # fmt: skip
    for rows, judge in groups:
        for row in rows:
            if chosen.row not in row.title:
                continue
            found, wrong = judge(row, chosen.times)
            total, bad = total + found, bad + wrong
            lines.append(_line(row.title, found))
            print(lines[-1], *wrong, sep="\n", flush=True)
    text = "\n".join([*_head(chosen.times), *lines, _line("**all**", total)]) + "\n"
    print(_line("**all**", total))
    if chosen.out is not None:
        chosen.out.write_text(text, encoding="utf-8")
    return 1 if bad else 0


def _line(title: str, found: Counter[str]) -> str:
    injected = found.total() - found[MISSED]
    survived = injected - found[WRONG]
    return (
        f"| {title} | {injected} | {survived} | {found[WENT_ON]} | {found[ENDED]} | "
        f"{found[UNKNOWN]} |"
    )


def _head(times: int) -> list[str]:
    return [
        "# Faults injected and survived",
        "",
        f"{provenance()}. Made by `tests/benchmarks/fault_table.py --times "
        f"{times}`: every cause of every row, at seeded random places of a whole run "
        "of the real drivers on the simulated bench (USB: of a session with the "
        "scope).",
        "",
        "A run survives if every sample taken is stored, and it either goes on, or "
        "ends with a message of ours and the simulated source really off, or says "
        "that the source's state is unknown and to switch it off by hand.",
        "",
        "| what is seen at the bench | injected | survived | went on | "
        "ended, verified off | said to be unknown |",
        "|---|---|---|---|---|---|",
    ]


if __name__ == "__main__":
    sys.exit(main())
