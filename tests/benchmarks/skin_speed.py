"""An array's kernel beside Brian2 and Dormand-Prince, and how its time grows.

``python tests/benchmarks/skin_speed.py --out docs/skin-figures.md``; Brian2 is taken
from where `make test` installs it.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from day_long import memory
from provenance import provenance, tell

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.neuro.solved import Solved
from tactile_lab.skin import kernel
from tactile_lab.skin.events import Events
from tactile_lab.skin.press import press
from tactile_lab.skin.single import force_of, simulate_taxel
from tactile_lab.skin.skin import Skin, load_skin
from tactile_lab.validation.problem import Problem
from tactile_lab.validation.rivals import DORMAND_PRINCE, stepped

PLATE = {
    "kind": "texture", "pressure": "100 kPa", "start": "0.2 s", "ramp": "20 ms",
    "hold": "0.5 s", "period": "1 s",
}  # fmt: skip
RIVALS = 64
"""Taxels that all methods compute."""
TOLERANCES = (1e-6, 1e-8, 1e-10, 1e-12)
STEPS = (1e-4, 2e-5, 5e-6)
SIMULATORS = Path(sys.prefix) / "simulators"
ACTIVE = ((25, 40), (100, 100), (250, 400))
"""Rows and columns of arrays whose every taxel fires."""
SILENT = ((100, 100), (250, 400), (1000, 1000))
"""Rows and columns of arrays under a ball that makes a few taxels fire."""
LONG, MANY = 10, (100, 100)
"""s, and rows and columns: the figure of the issue."""
SLIDING = ("plate", "grating slides", "texture slides")
"""What presses in it."""
GROWN = (
    "load", "taxels", "solved", "fired", "spikes", "CPU time", "a taxel", "a spike",
    "wall time", "times real time", "most memory", "machine's load",
)  # fmt: skip
HEADS = ("method", "setting", "spikes", "largest error of a time", "CPU time", "ratio")


def plate(rows: int, columns: int, seconds: int, how: str = "plate") -> Skin:
    """An array under a rough plate that is pressed once a second, or one of LOADS."""
    load = {**PLATE, "times": seconds}
    if how == "ball":  # on one spot: most taxels stay silent
        load |= {"kind": "sphere", "force": "2 N", "radius": "5 mm"}
        del load["pressure"]
    if how.endswith("slides"):
        load = {
            "kind": how.split()[0], "pressure": "100 kPa", "speed": "40 mm/s",
            "hold": f"{seconds} s",
        }  # fmt: skip
    return load_skin(
        {
            "duration": f"{seconds} s",
            "sensor": {"preset": "table1" if how == "ball" else "fig5b"},
            "array": {"grid": [rows, columns], "pitch": "1.5 mm"},
            "stimulus": [load],
        }
    )


def pressed(skin: Skin, cores: int | None = None) -> tuple[Events, float, float]:
    """Its events, CPU time and wall time spent, s."""
    folder = Path(tempfile.mkdtemp())
    before, began = time.process_time(), time.perf_counter()
    press(skin, folder, cores=cores)
    took = time.perf_counter() - began
    return Events.read(folder), time.process_time() - before, took


def apart(found: list[np.ndarray], true: list[np.ndarray]) -> float:
    """Largest error of a spike time, s; infinite where a train has another number."""
    return max(
        float(np.max(np.abs(a - b), initial=0.0)) if a.size == b.size else np.inf
        for a, b in zip(found, true, strict=True)
    )


def brian2(skin: Skin, taxels: range, step: float) -> tuple[list[np.ndarray], float]:
    """Trains and the time of the compiled program's run, which has one thread, s."""
    solved = [
        Solved.of(skin.circuit_of(n), force_of(skin, n), skin.duration) for n in taxels
    ]
    columns: dict[str, Any] = {
        name: [one.parameters[name] for one in solved] for name in solved[0].parameters
    } | {name: [one.first[name] for one in solved] for name in ("V_C1", "I_C", "V_C2")}
    columns["tau_L"] = [one.circuit.tau_L for one in solved]
    with tempfile.TemporaryDirectory() as folder:
        given, answer = Path(folder) / "in.npz", Path(folder) / "out.npz"
        np.savez(
            given, duration=skin.duration, **columns,
            points=[one.force.time.size for one in solved],
            time=np.concatenate([one.force.time for one in solved]),
            force=np.concatenate([one.force.value for one in solved]),
        )  # fmt: skip
        script = Path(__file__).with_name("skin_brian2.py")
        words = [sys.executable, str(script), str(given), str(answer), str(step)]
        subprocess.run(
            words, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": str(SIMULATORS)},
        )  # fmt: skip
        got = np.load(answer)
    trains = [np.sort(got["time"][got["taxel"] == k]) for k in range(len(solved))]
    return trains, float(got["spent"])


def rivals(seconds: int) -> tuple[list[str], int]:
    """Rows of the table of methods, and the number of spikes."""
    skin, taxels = plate(8, RIVALS // 8, seconds), range(RIVALS)
    true = []
    for n in taxels:
        train = simulate(
            skin.circuit_of(n), force_of(skin, n), until=skin.duration, tolerance=1e-12
        ).spike_times
        assert train is not None
        true.append(train)
    count = sum(train.size for train in true)
    pressed(skin, cores=1)  # compiles, or loads what was
    events, ours, _ = min(
        (pressed(skin, cores=1) for _ in range(3)), key=lambda r: r[1]
    )

    def row(name: str, setting: str, trains: list[np.ndarray], took: float) -> str:
        error, spikes = apart(trains, true), sum(t.size for t in trains)
        told = f"{error:.1e} s" if np.isfinite(error) else "another number of spikes"
        return (
            f"| {name} | {setting} | {spikes:,} | {told} | {took * 1e3:,.1f} ms | "
            f"{took / ours:,.1f} |"
        )

    rows = [row("Tactile Lab, with forces and file", "1 ns", events.trains(), ours)]
    problems = [
        Problem(str(n), skin.circuit_of(n), force_of(skin, n), skin.duration)
        for n in taxels
    ]
    stepped(problems[0], 60.0, DORMAND_PRINCE, 1e-6)
    for tolerance in TOLERANCES:
        took = np.inf
        for _ in range(3):
            began = time.process_time()
            found = [
                stepped(one, 60.0, DORMAND_PRINCE, tolerance).spike_times
                for one in problems
            ]
            took = min(took, time.process_time() - began)
        rows.append(row("Dormand-Prince 5(4), numba", f"{tolerance:g}", found, took))
        print(rows[-1], flush=True)
    for step in STEPS:
        found, took = brian2(skin, taxels, step)
        rows.append(row("Brian2, C++ standalone, RK4", f"{step:g} s", found, took))
        print(rows[-1], flush=True)
    return rows, count


def in_its_own_process(size: tuple[int, int], seconds: int, how: str) -> str:
    """A row of GROWN, computed by a process whose memory is its own."""
    words = [sys.executable, __file__, "--row", *map(str, size), str(seconds), how]
    row = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout
    print(row, end="", flush=True)
    return row.strip()


def grown(rows: int, columns: int, seconds: int, how: str) -> str:
    """A row of GROWN; what is compiled was, before."""
    pressed(plate(2, 2, 1, how))
    events, cpu, wall = pressed(plate(rows, columns, seconds, how))
    size = rows * columns
    active = int((events.role <= kernel.SILENT).sum())
    fired, spikes = int((events.count > 0).sum()), int(events.count.sum())
    most = memory(os.getpid(), "VmHWM")  # ru_maxrss is the parent's, too
    return (
        f"| {how} | {size:,} | {active:,} | {fired:,} | {spikes:,} | "
        f"{cpu:.2f} s | {cpu / size * 1e6:,.1f} µs | "
        f"{cpu / max(spikes, 1) * 1e6:,.2f} µs | "
        f"{wall:.2f} s | {seconds / wall:.2f} | {most:,.0f} MiB | "
        f"{os.getloadavg()[0]:.1f} |"
    )


def first_time() -> tuple[float, float]:
    """Wall time of a small array in a process with nothing compiled, and again, s."""
    code = (
        "import sys, time; from skin_speed import plate, pressed;"
        "skin = plate(2, 2, 1);"
        "print(pressed(skin)[2], pressed(skin)[2])"
    )
    with tempfile.TemporaryDirectory() as empty:
        told = subprocess.run(
            [sys.executable, "-c", code], check=True, stdout=subprocess.PIPE, text=True,
            cwd=Path(__file__).parent, env={**os.environ, "NUMBA_CACHE_DIR": empty},
        ).stdout  # fmt: skip
    first, warm = map(float, told.split())
    return first, warm


def equal(seconds: int, count: int, seed: int) -> int:
    """How many of `count` random taxels of 10,000 equal their single simulation."""
    skin = plate(100, 100, seconds)
    events, _, _ = pressed(skin)
    trains = events.trains()
    chosen = np.random.default_rng(seed).choice(skin.array.size, count, replace=False)
    alone = (simulate_taxel(skin, int(n)).spike_times for n in chosen)
    return sum(
        own is not None and np.array_equal(trains[n], own)
        for n, own in zip(chosen, alone, strict=True)
    )


def main() -> None:
    """Measure and print or write the tables."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=int, default=4)
    parser.add_argument("--taxels", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--row", nargs=4, help="rows, columns, seconds and a load")
    asked = parser.parse_args()
    if asked.row:
        high, wide, seconds = map(int, asked.row[:3])
        print(grown(high, wide, seconds, asked.row[3]))
        return
    first, warm = first_time()
    simulate(Circuit(), force_of(plate(2, 2, 1), 0), until=1.0)
    rows, count = rivals(asked.seconds)
    of_issue = [in_its_own_process(MANY, LONG, how) for how in SLIDING]
    active = [in_its_own_process(size, asked.seconds, "plate") for size in ACTIVE]
    silent = [in_its_own_process(size, asked.seconds, "ball") for size in SILENT]
    same = equal(asked.seconds, asked.taxels, asked.seed)
    text = f"""# An array's kernel beside others, and how its time grows

{provenance()}. Made by `tests/benchmarks/skin_speed.py`. Sensors of preset fig5b,
each a specimen of its own, under a rough plate pressed once a second for
{asked.seconds} s.

## The same equations by others

{RIVALS} taxels, {count:,} spikes, one thread each. Errors are against our solver at
1e-12 s, which Dormand-Prince, another method, confirms as far as it goes. CPU time of
ours is that of the whole `press` on one core, forces and file included; of the others
that of the solution alone, compiling and the force left out. Dormand-Prince is compiled
as ours is, has V_P in closed form, starts anew at each point of the force and locates
spikes on its dense output. Brian2 (for its runs wall time, one thread) is given a
spike's place inside its step. Ratios of one run on one machine, load
{os.getloadavg()[0]:.0f}.

| {" | ".join(HEADS)} |
{"|---" * len(HEADS)}|
{chr(10).join(rows)}

## 10,000 taxels, 10 s

"Solved" are the taxels that could come to threshold, "fired" those of them that did.
The plate is pressed once a second; grating and texture slide at 40 mm/s all the time.
Each row is a process of its own; times hold forces, events and the file, and no
compiling: the first time ever, 4 taxels take {first:.0f} s, and then {warm:.3f} s.

| {" | ".join(GROWN)} |
{"|---" * len(GROWN)}|
{chr(10).join(of_issue)}

## Growth

Of active taxels, under the plate for {asked.seconds} s:

| {" | ".join(GROWN)} |
{"|---" * len(GROWN)}|
{chr(10).join(active)}

Of silent ones: sensors of preset table1 under a ball on one spot for {asked.seconds} s.

| {" | ".join(GROWN)} |
{"|---" * len(GROWN)}|
{chr(10).join(silent)}

## To the last bit

{same:,} of {asked.taxels:,} random taxels (seed {asked.seed}) of the array of 10,000
have the spike times of their single simulation to the last bit.
"""
    tell(text, asked.out)


if __name__ == "__main__":
    main()
