"""Kills clients, workers and schedulers of a study at random moments.

    python tests/benchmarks/study_kills.py [--kills 100] [--state FILE] [--out FILE]

After each SIGKILL every batch that was on disk before must be there unchanged, and the
study, started again until it ends, must give the very data set that one process gives.
Interrupted itself, it goes on from its state file.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from provenance import provenance, tell

from tactile_lab.errors import LinkLostError, NotFoundError
from tactile_lab.studies.carry_out import carry_out
from tactile_lab.studies.study import load_study

STUDY = load_study(
    {
        "scene": "demo",
        "set": {"protocol.levels": ["160 mN"], "protocol.hold": "1.8 s"},
        "keep": ["spike_count", "spike_times", "critical_force"],
        "axis": [
            {"key": "sensor.R1", "normal": "1 %"},
            {"key": "sensor.C2", "normal": "2 %"},
        ],
        "draw": {"points": 6000},
    }
)
SHARES = {
    "client of a pool": 40,
    "worker of a pool": 30,
    "worker of Dask": 12,
    "scheduler of Dask": 8,
    "client of Dask": 10,
}
"""Of a hundred kills, what is killed."""
HALF = 2.0
"""Mean time from the start to a kill, s."""
STANDS = 600.0
"""One that has not ended after so long stands still, even at the lowest priority, s."""


def carried_out(folder: Path, scheduler: str | None) -> None:
    """What the client does, in a process of its own; exits 3 where workers are gone."""
    try:
        carry_out(STUDY, folder, count=2, scheduler=scheduler)
    except (LinkLostError, NotFoundError):
        os._exit(3)


def on_disk(folder: Path) -> dict[str, str]:
    """Finished batches, each with its hash."""
    return {
        path.name: hashlib.blake2b(path.read_bytes()).hexdigest()
        for path in (folder / "points").glob("*.npz")
    }


def answer(folder: Path) -> str:
    """Hash of everything in the data set."""
    found = carry_out(STUDY, folder, count=1).to_xarray()
    whole = hashlib.blake2b()
    for name in sorted(map(str, found.variables)):
        whole.update(name.encode() + found[name].values.tobytes())
    return whole.hexdigest()


def children(of: int) -> list[int]:
    """Python processes that another's threads began."""
    found = []
    for listed in Path("/proc").glob(f"{of}/task/*/children"):
        found += [int(one) for one in listed.read_text().split()]
    return [one for one in found if b"resource_tracker" not in _command(one)]


def _command(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def lives(pid: int) -> bool:
    """Whether a process is there and has not ended."""
    try:
        return (
            Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
        )
    except OSError:
        return False


@contextmanager
def dask(folder: Path) -> Iterator[tuple[str, int, list[int]]]:
    """A scheduler and two workers: address, the scheduler's process, the workers'."""
    file = folder / "scheduler.json"
    file.unlink(missing_ok=True)
    command = [sys.executable, "-m"]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = subprocess.Popen(
        [*command, "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard",
         "--host", "127.0.0.1", "--scheduler-file", str(file)], **quiet,
    )  # fmt: skip
    workers = subprocess.Popen(
        [*command, "distributed.cli.dask_worker", "--scheduler-file", str(file),
         "--nworkers", "2", "--nthreads", "1", "--no-dashboard",
         "--death-timeout", "60"], **quiet, start_new_session=True,
    )  # fmt: skip
    try:
        while len(found := children(workers.pid)) < 2 or not file.exists():
            time.sleep(0.1)
        address = json.loads(file.read_text())["address"]
        from distributed import Client

        with Client(address, set_as_default=False) as client:
            client.wait_for_workers(2, timeout=120)
        yield address, scheduler.pid, found
    finally:
        scheduler.kill()
        os.killpg(workers.pid, signal.SIGKILL)
        scheduler.wait()
        workers.wait()


def killed(what: str, folder: Path, draw: random.Random) -> str:
    """Start the study, kill something, look; start it again until it ends."""
    if not what.endswith("Dask"):
        return _killed(what, folder, draw, None, [])
    with dask(folder) as (address, scheduler, workers):
        targets = {"scheduler of Dask": [scheduler], "worker of Dask": workers}
        return _killed(what, folder, draw, address, targets.get(what, []))


def _killed(
    what: str,
    folder: Path,
    draw: random.Random,
    address: str | None,
    targets: list[int],
) -> str:
    client = get_context("fork").Process(target=carried_out, args=(folder, address))
    client.start()
    client.join(draw.expovariate(1 / HALF))
    pid = client.pid or 0
    if what == "worker of a pool":
        targets = children(pid)
    elif what.startswith("client"):
        targets = [pid]
    if not client.is_alive() or not targets:
        client.join()
        return "ended before"
    before = on_disk(folder)
    own = children(pid)
    try:
        os.kill(draw.choice(targets), signal.SIGKILL)
    except ProcessLookupError:  # as the finished batches were hashed
        client.join()
        return "ended before"
    client.join(STANDS)
    if client.is_alive():
        client.kill()
        return "hangs"
    if what == "client of a pool":
        time.sleep(1.0)
        if any(map(lives, own)):
            return "leaves workers behind"
    after = on_disk(folder)
    if any(after.get(name) != hashed for name, hashed in before.items()):
        return "a batch lost"
    how = {0: "went on by itself", 3: "told, and went on when started again"}
    return how.get(client.exitcode or 0, "went on when started again")


def main() -> None:
    """Kill, count, print or write the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--state", type=Path)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    state = asked.state
    told = json.loads(state.read_text()) if state and state.exists() else []
    order = [what for what, n in SHARES.items() for _ in range(n)]
    random.Random(asked.seed).shuffle(order)
    with tempfile.TemporaryDirectory() as whole:
        right = answer(Path(whole))
        number = tries = 0
        while number < asked.kills:
            what = order[number % len(order)]
            number += 1
            if number <= len(told) and told[number - 1]:
                continue
            with tempfile.TemporaryDirectory() as name:
                folder = Path(name)
                draw = random.Random(f"{asked.seed} {number} {tries}")
                end = killed(what, folder, draw)
                if end == "ended before":
                    number, tries = number - 1, tries + 1
                    continue
                same = answer(folder) == right
            told[number - 1 : number] = [[what, end, same]]
            print(number, *told[number - 1], flush=True)
            if state:
                state.write_text(json.dumps(told))
    counted = Counter((what, end, same) for what, end, same in told)
    rows = [
        f"| {what} | {end} | {'the same' if same else 'ANOTHER'} | {n} |"
        for (what, end, same), n in sorted(counted.items())
    ]
    text = f"""# Killed while a study is computed

{provenance()}. {len(told)} SIGKILLs at random moments (seed {asked.seed}) of a study of
{STUDY.design.size:,} points on two workers, made by `tests/benchmarks/study_kills.py`.
Before each kill the finished batches on disk were hashed, after it compared; then the
study was started again to its end, and its data set compared with that of one process
that nobody disturbed. The page cache survives a kill: this says nothing about a power
cut.

| killed | what happened | data set | times |
|---|---|---|---|
{chr(10).join(rows)}
"""
    tell(text, asked.out)


if __name__ == "__main__":
    main()
