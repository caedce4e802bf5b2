"""Sobol indices of the parts' spread against central differences, and what scale costs.

python tests/benchmarks/study_answers.py [--pairs 512] [--out FILE]
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from provenance import provenance, tell

from tactile_lab.model.equations import critical_force
from tactile_lab.model.simulate import simulate
from tactile_lab.planning.timeline import timeline
from tactile_lab.studies.addresses import addresses
from tactile_lab.studies.answers import conclude
from tactile_lab.studies.carry_out import carry_out
from tactile_lab.studies.points import Points, PointTask
from tactile_lab.studies.study import Study, load_study

SHIFTS = 41
"""Of one part across its spread, from which a slope of the spike count is taken."""


def shares(study: Study, of: str, variance: float) -> dict[str, float]:
    """Square of each part's linear effect over all variance, by the name of its key.

    The critical force's by a central difference at one deviation; the spike count's, a
    whole number, by a line through many, weighted as the part is spread.
    """
    scene = study.scene
    drive = timeline(scene, through_coil=False)
    effects = {}
    for axis in study.design.drawn:
        assert axis.spread is not None
        name, width = axis.key.partition(".")[2], axis.spread.width
        at = getattr(scene.sensor, name)
        steps = (
            np.array([-1, 1])
            if of == "critical_force"
            else np.linspace(-2.5, 2.5, SHIFTS)
        )
        found = []
        for step in steps:
            changes: dict[str, Any] = {name: at + step * width}
            circuit = replace(scene.sensor, **changes).circuit
            if of == "critical_force":
                found.append(critical_force(circuit))
            else:
                result = simulate(circuit, drive.force, until=drive.duration)
                assert result.spike_times is not None
                found.append(len(result.spike_times))
        weight = np.exp(-0.5 * steps**2)
        values = np.array(found, dtype=float)
        mean = np.average(values, weights=weight)
        slope = (weight * steps * (values - mean)).sum() / (weight * steps**2).sum()
        effects[axis.key] = slope**2
    return {key: float(effect / variance) for key, effect in effects.items()}


def spread(pairs: int) -> str:
    """The table of indices, and how many intervals hold the linear share."""
    from tactile_lab.plugins import study_path

    data = study_path("spread").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / "spread.toml"
        file.write_text(data.replace("points = 512", f"points = {pairs}"))
        study = load_study(file)
        began = time.process_time()
        found = carry_out(study, Path(name), count=1)
        taken = time.process_time() - began
    values = conclude(found).values
    rows, held, size = [], 0, 0
    for what in ("critical_force", "spike_count"):
        independent = found.numbers()[what][: 2 * pairs]
        for key, share in shares(study, what, independent.var()).items():
            first, total = (
                values[f"sobol_{what}_{key}"][order] for order in ("first", "total")
            )
            held += first.low <= share <= first.high
            size += 1
            rows.append(
                f"| {what} | {key} | {first.value:.3f} ({first.low:.3f} to "
                f"{first.high:.3f}) | {share:.3f} | {total.value:.3f} ({total.low:.3f} "
                f"to {total.high:.3f}) |"
            )
    return f"""## Sobol indices of `spread` against central differences

{pairs} pairs, {study.design.size:,} points, {taken:.1f} s of processor time in one
process. "Linear" is the square of each part's effect over the variance of the
independent points: of the critical force by central differences at one standard
deviation; of the spike count, a whole number, by the slope through {SHIFTS} simulations
across the part's spread. It lies in the first-order index's 95 % interval (bootstrap)
in {held} of {size} cases. What is missing from 1 in the sum of the spike count's
first-order indices is that whole numbers round, which takes all parts together.

| of | part | first order | linear | total |
|---|---|---|---|---|
{chr(10).join(rows)}
"""


def scale() -> str:
    """What a point costs, and what 1e9 points on 1,000 cores would."""
    study = load_study(
        {
            "scene": "demo",
            "set": {"protocol.levels": ["160 mN"], "protocol.hold": "1.8 s"},
            "keep": ["spike_count", "first_spike", "mean_rate"],
            "axis": [{"key": "sensor.R1", "normal": "1 %"}],
            "draw": {"points": 100_000, "method": "random"},
        }
    )
    points, design = Points(study), study.design
    few = np.arange(100)

    def task(numbers: np.ndarray, named: np.ndarray) -> PointTask:
        columns = design.columns(numbers)
        return PointTask(named[numbers], columns, design.repeats(numbers))

    began = time.process_time()
    named = addresses(study)
    naming = (time.process_time() - began) / design.size
    points.batch(task(few, named))
    some = np.arange(20_000)
    began = time.process_time()
    batch = points.batch(task(some, named))
    computing = (time.process_time() - began) / some.size
    from tactile_lab.studies.shelf import put

    with tempfile.TemporaryDirectory() as name:
        began, wall = time.process_time(), time.perf_counter()
        for i in range(20):
            mine = replace(batch, addresses=np.roll(batch.addresses, i))
            put(mine, Path(name))
        putting = (time.process_time() - began) / 20
        waiting = (time.perf_counter() - wall) / 20
        size = sum(f.stat().st_size for f in Path(name).iterdir()) / 20 / some.size
    whole, cores, batches = 1e9, 1000, 1e9 / 20_000
    rows = [
        ("computing", f"{computing * 1e6:.1f} µs a point", computing * whole / cores,
         "1,000 cores"),
        ("addresses", f"{naming * 1e6:.2f} µs a point", naming * whole, "the client"),
        ("keeping", f"{putting * 1e3:.1f} ms a batch of 20,000, {waiting * 1e3:.0f} ms "
         "with the disk", waiting * batches, "the client"),
        ("scheduling", "1 ms a task (as Dask's documentation says)", 1e-3 * batches,
         "the scheduler"),
    ]  # fmt: skip
    table = "\n".join(
        f"| {what} | {each} | {seconds / 3600:.2f} h | {who} |"
        for what, each, seconds, who in rows
    )
    feeds = computing / (naming + waiting / 20_000)
    memory = whole * (16 + 8 + 3 * 8) / 1e9
    return f"""## On paper: 1e9 points on 1,000 cores

Measured here, load {os.getloadavg()[0]:.1f}, and multiplied; nothing of this was run.

| what | measured | for 1e9 points | who |
|---|---|---|---|
{table}

A point takes {size:.0f} bytes on disk, {size * whole / 1e9:.0f} GB in all. What breaks
first is the client: one process names and keeps every point, and cannot feed more than
{feeds:.0f} cores at that; with 1,000 the study takes its hours, not theirs. Then its
memory: addresses, places and three columns are {memory:.0f} GB when the data set is
gathered, so a study is refused beyond 50 million points ({memory / 20:.1f} GB), and 1e9
are 20 studies beside each other, on 20 clients if they are to feed 1,000 cores.
"""


def main() -> None:
    """Measure, and print or write the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--pairs", type=int, default=512)
    parser.add_argument("--out", type=Path)
    asked = parser.parse_args()
    text = f"""# What a study says, and what it costs

{provenance()}. Made by `tests/benchmarks/study_answers.py`.

{spread(asked.pairs)}
{scale()}"""
    tell(text, asked.out)


if __name__ == "__main__":
    main()
