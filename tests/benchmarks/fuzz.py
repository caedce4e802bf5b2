"""Damages scenes, benches, waveforms, calibrations and run folders, and looks on.

    python tests/benchmarks/fuzz.py [--cases 10000] [--seed 1] [--out FILE] [--kind K]

Each case goes through the verbs of the command line in a process of its own kind that
is killed after 30 s of its own, or ten minutes on a busy machine. It may be answered or
refused with one of our messages; a traceback, a hang, a crash, or a run called sound
that does not hold what was recorded is counted as wrong. What is done is kept in
`build/fuzz.jsonl`, so that a campaign can be gone on with. The exit code is 1 where
anything was wrong.
"""

from __future__ import annotations

import argparse
import io
import json
import multiprocessing
import os
import random
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from fuzz_inputs import KINDS, Case, make, prepare  # beside it
from provenance import provenance, tell

LONGEST, STUCK = 30.0, 600.0
"""Longest time of the processor, and by the clock, that a case may take, s."""

ANSWERED, REFUSED = "answered", "refused"
TRACEBACK, HANG, CRASH, INTACT = "traceback", "hang", "crash", "wrongly intact"
WRONG = (TRACEBACK, HANG, CRASH, INTACT)


def verb(*arguments: str) -> tuple[int, str]:
    """Exit code of one call of the command line, and all it said."""
    from tactile_lab.cli import main

    said = io.StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        try:
            main(list(arguments))
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 1
            return code, said.getvalue()
    return 0, said.getvalue()


def judged(case: Case) -> tuple[str, str]:
    """What became of a case, and what was said."""
    told, answered = "", False
    for arguments in case.calls:
        try:
            code, told = verb(*arguments)
        except Exception as error:  # that is what is looked for
            return TRACEBACK, f"{arguments[0]}: {type(error).__name__}: {error}"
        if "Traceback" in told or "has a mistake" in told:
            return TRACEBACK, f"{arguments[0]}: {told[-300:]}"
        answered = answered or code == 0
        if arguments[0] == "verify" and code == 0 and _changed(case):
            return INTACT, case.what
    return (ANSWERED if answered else REFUSED), told[-200:]


def _changed(case: Case) -> bool:
    """Whether what was called sound is another; also where it cannot be read."""
    try:
        return case.changed()
    except Exception:  # damage of any kind
        return True


def work(pipe: Connection, seed: int) -> None:
    """Judge the cases that are asked for, one after the other."""
    with tempfile.TemporaryDirectory() as folder:
        while True:
            try:
                kind, number = pipe.recv()
            except EOFError:
                return
            place = Path(folder) / f"{kind}{number}"
            place.mkdir()
            chance = random.Random(f"{seed} {kind} {number}")
            what, told, how = CRASH, "", ""
            try:
                case = make(kind, chance, place)
                how = case.what
                what, told = judged(case)
            finally:
                shutil.rmtree(place, ignore_errors=True)
            pipe.send((what, how, told))


class Worker:
    """A process that judges cases, started anew when it dies or hangs."""

    def __init__(self, seed: int) -> None:
        self._seed = seed
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=work, args=(theirs, self._seed), daemon=True
        )
        self._process.start()
        theirs.close()

    def judge(self, kind: str, number: int) -> tuple[str, str, str]:
        """(outcome, what was damaged, what was said)."""
        self._pipe.send((kind, number))
        ended: tuple[str, str, str] = (HANG, "", f"longer than {LONGEST:g} s")
        spent, began = self._spent(), time.monotonic()
        try:
            while not self._pipe.poll(0.5):
                if self._spent() - spent > LONGEST or time.monotonic() - began > STUCK:
                    break
            else:
                answer: tuple[str, str, str] = self._pipe.recv()
                return answer
        except (EOFError, OSError):
            self._process.join(5)
            ended = (CRASH, "", f"exit code {self._process.exitcode}")
        self._process.kill()
        self._process.join()
        self._start()
        return ended

    def _spent(self) -> float:
        """Time of the processor that the process has had, s; 0 where none is told."""
        try:
            told = Path(f"/proc/{self._process.pid}/stat").read_text(encoding="ascii")
        except OSError:
            return 0.0
        user, system = told.rpartition(")")[2].split()[11:13]
        return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def campaign(
    cases: dict[str, int], seed: int, done: Path, judge: Callable[..., Any]
) -> Iterator[dict[str, Any]]:
    """Every case's entry; those of an earlier campaign are not repeated."""
    known = {}
    if done.exists():
        for line in done.read_text(encoding="utf-8").splitlines():
            entry = json.loads(line)
            known[entry["seed"], entry["kind"], entry["number"]] = entry
    done.parent.mkdir(parents=True, exist_ok=True)
    with done.open("a", encoding="utf-8") as file:
        for kind, count in cases.items():
            for number in range(count):
                entry = known.get((seed, kind, number))
                if entry is None:
                    what, how, told = judge(kind, number)
                    entry = {
                        "seed": seed, "kind": kind, "number": number,
                        "outcome": what, "how": how, "told": told,
                    }  # fmt: skip
                    file.write(json.dumps(entry) + "\n")
                    file.flush()
                yield entry


def main() -> int:
    """Run the campaign, print and write the table."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--cases", type=int, default=10_000)
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--kind", choices=KINDS)
    options.add_argument("--done", type=Path, default=Path("build/fuzz.jsonl"))
    options.add_argument("--out", type=Path)
    chosen = options.parse_args()
    shares = {chosen.kind: 1.0} if chosen.kind else KINDS
    cases = {kind: round(share * chosen.cases) for kind, share in shares.items()}
    found: dict[str, Counter[str]] = {kind: Counter() for kind in cases}
    prepare()
    worker = Worker(chosen.seed)
    for entry in campaign(cases, chosen.seed, chosen.done, worker.judge):
        found[entry["kind"]][entry["outcome"]] += 1
        if entry["outcome"] in WRONG:
            print(json.dumps(entry), flush=True)
    lines = [_line(kind, counts) for kind, counts in found.items()]
    total = sum(found.values(), Counter[str]())
    lines.append(_line("**all**", total))
    text = "\n".join([*_head(chosen.seed), *lines]) + "\n"
    tell(text, chosen.out)
    return 1 if any(total[one] for one in WRONG) else 0


def _line(kind: str, found: Counter[str]) -> str:
    counts = (found.total(), found[ANSWERED], found[REFUSED])
    return f"| {kind} | " + " | ".join(
        str(one) for one in (*counts, *(found[what] for what in WRONG))
    ) + " |"  # fmt: skip


def _head(seed: int) -> list[str]:
    return [
        "# Damaged input",
        "",
        f"{provenance()}. Made by `tests/benchmarks/fuzz.py --seed {seed}`: files "
        "damaged at random (values out of range, wrong types and units, flipped bits, "
        "lost parts) through `plan`; run folders, whole or killed while recorded, "
        "through `recover`, `verify`, `show`, `report` and `export`.",
        "",
        "A run is called intact wrongly if `verify` finds nothing although a sample, a "
        "table, a scale or what `run.json` says of the run is not what was recorded.",
        "",
        "| damaged | cases | answered | refused | traceback | hang | crash | wrongly "
        "intact |",
        "|---|---|---|---|---|---|---|---|",
    ]


if __name__ == "__main__":
    sys.exit(main())
