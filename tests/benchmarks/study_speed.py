"""Points a second of a model study: process pool, Dask, and a plain script beside them.

    python tests/benchmarks/study_speed.py [--points 1000000] [--out FILE]

The study is a two-second push with 20 to 30 spikes of a sensor whose parts vary. The
kernel's own time is measured apart, on the first points of the same draws in one
process; "in the kernel" is that time for all points over the processor time of all
processes together, and over the time of two cores while the study went on. Other work
on the machine makes the latter smaller, not the former.
"""

from __future__ import annotations

import argparse
import os
import resource
import tempfile
import time
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from multiprocessing import Pool
from pathlib import Path
from typing import Any

import numpy as np
from distributed import LocalCluster
from provenance import provenance, tell
from scipy.integrate import solve_ivp

from tactile_lab import Circuit
from tactile_lab.model.equations import I_C, V_C1_slope, rest_point
from tactile_lab.studies.addresses import addresses
from tactile_lab.studies.carry_out import StudyProgress, carry_out
from tactile_lab.studies.points import Points, PointTask
from tactile_lab.studies.study import Study, load_study

WORKERS = 2
SAMPLE = 20_000
"""Points whose kernel time is measured in one process."""
PLAIN = 40
"""Points of the plain script."""
PUSH = {
    "protocol.levels": ["160 mN"],
    "protocol.hold": "1.8 s",
    "protocol.rest": "0.1 s",
}
PARTS = {"R1": 0.5, "R_L": 0.5, "R3": 0.5, "C1": 1.0, "C2": 1.0}
"""Standard deviations, %."""
HEADINGS = (
    "way",
    "points",
    "whole, 1/s",
    "computing, 1/s",
    "processor time a point",
    "in the kernel, of processor time",
    "of two cores",
    "largest process",
    "load",
)
AGREES = "with the same number of spikes at each"


def study_of(points: int, keep: tuple[str, ...]) -> Study:
    """The study, with so many draws."""
    axes = [{"key": f"sensor.{n}", "normal": f"{p} %"} for n, p in PARTS.items()]
    return load_study(
        {
            "scene": "demo",
            "set": PUSH,
            "keep": list(keep),
            "axis": axes,
            "draw": {"points": points, "method": "random"},
        }
    )


@dataclass
class Measured:
    """One way of carrying it out."""

    points: int
    wall: float
    computing: float
    cpu: float
    memory: float


def carried_out(study: Study, cluster: bool) -> Measured:
    """Carry the study out in a child process of its own, and measure it."""
    reader, writer = os.pipe()
    if (child := os.fork()) == 0:
        with tempfile.TemporaryDirectory() as folder:
            context: AbstractContextManager[Any] = (
                LocalCluster(
                    n_workers=WORKERS,
                    threads_per_worker=1,
                    dashboard_address=None,
                    memory_limit=0,
                )
                if cluster
                else nullcontext()
            )
            with context as scheduler:
                address = scheduler and scheduler.scheduler_address
                told: list[tuple[float, StudyProgress]] = []
                began = time.perf_counter()
                carry_out(
                    study,
                    Path(folder),
                    count=WORKERS,
                    scheduler=address,
                    tell=lambda progress: told.append((time.perf_counter(), progress)),
                )
                wall = time.perf_counter() - began
                computing = told[-1][0] - told[0][0]
        used = [
            resource.getrusage(who)
            for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
        ]
        cpu = sum(one.ru_utime + one.ru_stime for one in used)
        memory = max(one.ru_maxrss for one in used) / 1024
        os.write(writer, f"{wall} {computing} {cpu} {memory}".encode())
        os._exit(0)
    os.close(writer)
    found = [float(one) for one in os.read(reader, 1000).split()]
    os.waitpid(child, 0)
    return Measured(study.design.size, *found)


def kernel_time(study: Study) -> float:
    """Processor time of a point in the batch kernel alone, s."""
    points = Points(study)
    design = study.design
    some = np.arange(min(SAMPLE, design.size))
    task = PointTask(addresses(study)[some], design.columns(some), design.repeats(some))
    (group,) = points._axes.groups(task.columns, some.size)
    scene, drive = points._with(group.others)
    from tactile_lab.model.batch import records

    many = records(scene.circuit, group.numbers)
    points._trains(scene, drive, many[:1])
    began = time.process_time()
    points._trains(scene, drive, many)
    return (time.process_time() - began) / some.size


def plainly(
    parts: dict[str, float], times: np.ndarray, values: np.ndarray, until: float
) -> int:
    """The same scene by solve_ivp, as one would write it: spikes are events."""
    named: dict[str, Any] = {**parts}
    circuit = Circuit(**named)
    k, tau = circuit.k_F, circuit.tau
    slopes = np.append(np.diff(values) / np.diff(times), 0)

    def slope(t: float, y: np.ndarray) -> list[float]:
        p = slopes[np.searchsorted(times, t, side="right") - 1]
        return [
            k * p - y[0] / tau,
            float(V_C1_slope(circuit, y[0], y[1])),
            (float(I_C(circuit, y[1])) - y[2] / circuit.R_L) / circuit.C2,
        ]

    def fires(t: float, y: np.ndarray) -> float:
        return float(y[2] - circuit.V_th)

    event: Any = fires
    event.terminal, event.direction = True, 1
    y, t, spikes = np.array([0.0, *rest_point(circuit)]), 0.0, 0
    for end in (*times[(times > 0) & (times < until)], until):
        while t < end:
            found = solve_ivp(
                slope, (t, end), y, "LSODA", events=event, rtol=1e-9, atol=1e-11
            )
            t, y = found.t[-1], found.y[:, -1]
            if found.status == 1:
                spikes, y[2] = spikes + 1, 0.0
    return spikes


def plain_rate(study: Study) -> tuple[float, bool]:
    """Points a second of the plain script on two processes; whether it agrees."""
    design = study.design
    rows = design.values(range(PLAIN))
    points = Points(study)
    drive = points._with(())[1]
    force = drive.force.time, drive.force.value, drive.duration
    parts = [(dict(zip(PARTS, row, strict=True)), *force) for row in rows]
    with Pool(WORKERS) as pool:
        pool.starmap(plainly, parts[:WORKERS])
        began = time.perf_counter()
        counts = pool.starmap(plainly, parts, chunksize=1)
        wall = time.perf_counter() - began
    task = PointTask(
        addresses(study)[:PLAIN],
        design.columns(np.arange(PLAIN)),
        design.repeats(np.arange(PLAIN)),
    )
    ours = points.batch(task).columns["spike_count"]
    assert isinstance(ours, np.ndarray)
    return PLAIN / wall, bool(np.array_equal(ours, counts))


def main() -> None:
    """Measure and print or write the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--points", type=int, default=1_000_000)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    short, long = ("spike_count", "first_spike", "mean_rate"), ("spike_times",)
    each = kernel_time(study_of(SAMPLE, short))
    rows, cost = [], 0.0
    for name, keep, cluster in (
        ("process pool", short, False),
        ("Dask, 2 worker processes", short, True),
        ("process pool, all spike times kept", long, False),
    ):
        load = os.getloadavg()[0]
        one = carried_out(study_of(asked.points, keep), cluster)
        share, cost = each * one.points / one.cpu, cost or one.cpu / one.points
        of_cores = each * one.points / (WORKERS * one.wall)
        rows.append(
            f"| {name} | {one.points:,} | {one.points / one.wall:,.0f} | "
            f"{one.points / one.computing:,.0f} | "
            f"{one.cpu / one.points * 1e6:.1f} µs | "
            f"{share:.0%} | {of_cores:.0%} | {one.memory:.0f} MiB | {load:.1f} |"
        )
        print(rows[-1], flush=True)
    rate, agrees = plain_rate(study_of(SAMPLE, short))
    text = f"""# Points of a model study a second

{provenance()}. {asked.points:,} points of a two-second push to 160 mN (20 to 30 spikes)
of a sensor whose five parts vary, on two worker processes; made by
`tests/benchmarks/study_speed.py`. The kernel alone takes {each * 1e6:.1f} µs of
processor time a point. "Whole" is from the call to the written data set, "computing"
from the first batch to the last; "in the kernel" is the kernel's time for all points
over the processor time of all processes, and over that of two cores for the whole
time. Load is of the machine before each row: work of others lowers every rate, and the
last share but one.

| {" | ".join(HEADINGS)} |
{"|---" * len(HEADINGS)}|
{chr(10).join(rows)}

By processor time alone, two free cores would compute {WORKERS / cost:,.0f} points a
second in the pool: an extrapolation, which the table's own rate replaces where the load
is near 0. Dask's six processes take about 0.08 s of processor time a second even when
idle, which on a loaded machine, where a study lasts long, is most of what its row has
more.

A plain script (`scipy.integrate.solve_ivp`, LSODA at rtol 1e-9, spikes as events,
two processes) computes {rate:.1f} points a second of the same study, from {PLAIN}
points{", " + AGREES if agrees else "; its spike counts differ"}.
"""
    tell(text, asked.out)


if __name__ == "__main__":
    main()
