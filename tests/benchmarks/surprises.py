"""How often the report names the one thing that is other than believed.

Each seed draws a bench: what its file states a band for lies anywhere in it, and one of
the suspects (none, or two at once) lies beyond. The run is made and reported as
`tactile-lab run surprise` does. Rows are kept as they come: a campaign that was stopped
goes on where it was, at the same commit.
"""

import argparse
import csv
import tempfile
from datetime import date
from pathlib import Path

import numpy as np

from tactile_lab.engine.execution import Execution
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.scene.load import load
from tactile_lab.validation.table import commit

SPANS = {
    "input_bias": (25e-12, 100e-12, "A"),
    "V_GS": (0.5e-3, 8e-3, "V"),
    "force": (0.005, 0.06, ""),
    "lag": (1.5e-3, 6e-3, "s"),
    "temperature": (0.5, 5.0, "K"),
    "R1": (0.005, 0.05, ""),
}
"""Least and largest deviation that is drawn, either sign, and unit."""
PULSES = {
    "protocol.levels": (0.12, 0.16, 0.19),
    "protocol.hold": 1.0,
    "protocol.rest": 0.7,
}
SINGLE, NONE, TWO = 100, 20, 20
COLUMNS = ("seed", "true", "size", "named", "value", "low", "high", "misfit")


def drawn(seed: int) -> tuple[dict[str, float], dict[str, float]]:
    """What lies beyond its band, and the whole deviation of this seed's world."""
    rng = np.random.default_rng(seed)
    bench = load("surprise").bench
    followers, lag = bench.followers, bench.magnet.lag_uncertainty
    assert followers is not None and lag is not None
    bands = {
        "input_bias": followers.input_bias_uncertainty,
        "offset": followers.offset_uncertainty,
        "lag": lag,
    }
    world = {
        name: float(np.clip(rng.normal(0, band / 1.96), -band, band))
        for name, band in bands.items()
    }
    many = 1 if seed < SINGLE else 0 if seed < SINGLE + NONE else 2
    beyond = {}
    for name in rng.permutation(list(SPANS))[:many]:
        least, most, _ = SPANS[name]
        size = least * (most / least) ** rng.uniform()
        # a lag that does not become negative
        sign = 1 if name == "lag" else rng.choice([-1, 1])
        beyond[str(name)] = float(sign * size)
    return beyond, {**dict.fromkeys(SPANS, 0.0), **world, **beyond}


def row(seed: int) -> dict[str, object]:
    """One world, run and reported."""
    beyond, world = drawn(seed)
    keys = {f"simulated.deviation.{name}": size for name, size in world.items()}
    scene = load("surprise", {**PULSES, **keys, "simulated.seed": seed + 1})
    with tempfile.TemporaryDirectory() as scratch:
        beside = find(read(Execution(scene, Path(scratch)).run().folder)).beside
    assert beside is not None
    explanation = beside.explanation
    cause = None if explanation is None else explanation.cause
    size = None if cause is None else cause.size
    said = "not noticed" if explanation is None else "cannot tell"
    return {
        "seed": seed,
        "true": " and ".join(beyond) or "none",
        "size": " and ".join(f"{value:.4g}" for value in beyond.values()),
        "named": said if cause is None else cause.name,
        "value": "" if size is None else f"{size.value:.4g}",
        "low": "" if size is None else f"{size.low:.4g}",
        "high": "" if size is None else f"{size.high:.4g}",
        "misfit": "" if explanation is None else f"{explanation.misfit:.3g}",
    }


def page(rows: list[dict[str, str]], commit: str) -> str:
    """The table in docs/, of runs made at `commit`."""
    single = [r for r in rows if int(r["seed"]) < SINGLE]
    lines = [
        "# What is other than believed, found out from a run",
        "",
        f"Commit {commit}, {date.today()}. Written by `tests/benchmarks/surprises.py`",
        "(part of `make reports`); every seed's row stands in `surprises.csv`.",
        "",
        "Each seed's simulated bench differs from its file: what the file states a",
        "band for (input bias, offset, lag) lies anywhere in it, and one of the",
        "suspects lies beyond, by a size drawn evenly in its logarithm. Three pulses",
        "of 120, 160 and 190 mN, 1 s each.",
        "",
        "| what differs | size drawn | seeds | named | cannot tell | not noticed | "
        "another named | size within its 95 % interval |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name in (*SPANS, None):
        mine = [r for r in single if name in (None, r["true"])]
        right = [r for r in mine if r["named"] == r["true"]]
        said = [r["named"] for r in mine]
        held = sum(
            float(r["low"]) <= float(r["size"]) <= float(r["high"]) for r in right
        )
        other = len(mine) - len(right) - sum(map(said.count, SILENT))
        span = "" if name is None else _span(*SPANS[name])
        lines.append(
            f"| {name or '**all**'} | {span} | {len(mine)} | {len(right)} | "
            f"{said.count(SILENT[0])} | {said.count(SILENT[1])} | {other} | "
            f"{held} of {len(right)} |"
        )
    none = [r["named"] for r in rows if r["true"] == "none"]
    two = [r["named"] for r in rows if " and " in r["true"]]
    named_none = len(none) - sum(map(none.count, SILENT))
    named_two = len(two) - sum(map(two.count, SILENT))
    lines += [
        "",
        f"Where nothing lies beyond its band ({len(none)} seeds) a cause was named",
        f"{named_none} times. Where two do at once ({len(two)} seeds) a single one was "
        f"named {named_two} times;",
        f"{two.count('cannot tell')} times the report said that it cannot tell.",
        "",
        "At 617fc9c the size of a lag lay 36 us below the truth and held in 5 of 16:",
        "edges of the current were dated 28 us late, the mean of what a line between",
        "bins of 0.5 ms misses of a rise by L/R, which was told as a scatter. That is",
        "put right since, and all sizes in the table hold.",
        "",
    ]
    return "\n".join(lines)


SILENT = ("cannot tell", "not noticed")


def _span(least: float, most: float, unit: str) -> str:
    scale, symbol = {
        "A": (1e12, "pA"), "V": (1e3, "mV"), "s": (1e3, "ms"), "K": (1, "K"),
        "": (100, "%"),
    }[unit]  # fmt: skip
    return f"{least * scale:g} to {most * scale:g} {symbol}"


def main() -> None:
    """Go on with the campaign, then write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/surprise-figures.md"))
    parser.add_argument("--seeds", type=int, default=SINGLE + NONE + TWO)
    asked = parser.parse_args()
    table = asked.out.with_name("surprises.csv")
    version, rows = commit(), []
    if table.exists():
        with table.open(newline="", encoding="utf-8") as file:
            rows = [r for r in csv.DictReader(file) if r["commit"] == version]
    done = {int(r["seed"]) for r in rows}
    with table.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, (*COLUMNS, "commit"))
        writer.writeheader()
        writer.writerows(rows)
        for seed in sorted(set(range(asked.seeds)) - done):
            rows.append({k: str(v) for k, v in row(seed).items()} | {"commit": version})
            writer.writerow(rows[-1])
            file.flush()
            print(*(rows[-1][name] for name in COLUMNS), flush=True)
    asked.out.write_text(page(rows, version), encoding="utf-8")


if __name__ == "__main__":
    main()
