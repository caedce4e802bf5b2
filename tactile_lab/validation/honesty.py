"""Random scenes against the reference: is the error estimate honest?"""

from __future__ import annotations

import csv
import hashlib
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from decimal import Decimal
from pathlib import Path

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import Result, simulate
from tactile_lab.model.state import Start
from tactile_lab.validation.reference import reference
from tactile_lab.validation.table import provenance, save
from tactile_lab.waveform import Waveform
from tactile_lab.whole_file import write_rows

SAMPLES = 40
"""Times at which V_C1 is compared."""


@dataclass(frozen=True)
class Case:
    """One random scene.

    Attributes:
        seed: from which it was drawn; the same seed gives the same case.
        circuit: parameters around Table 1, options at random.
        force: ramps and jumps, N.
        until: duration, s.
        start: voltages at time 0, or None for the equilibrium.
        tolerance: asked for, s.
    """

    seed: int
    circuit: Circuit
    force: Waveform
    until: float
    start: Start | None
    tolerance: float


@dataclass(frozen=True)
class HonestyRow:
    """Estimated and true error of one case, s and V; None where there is no spike."""

    case: Case
    spikes: int
    spikes_reference: int
    spike_time: float
    spike_time_estimate: float
    V_C1: float
    V_C1_estimate: float

    @property
    def honest(self) -> bool:
        """Whether the count is right and both true errors are below the estimates."""
        return (
            self.spikes == self.spikes_reference
            and self.spike_time <= self.spike_time_estimate
            and self.V_C1 <= self.V_C1_estimate
        )


def random_case(seed: int) -> Case:
    """A scene drawn from `seed`, short enough for the reference."""
    draw = np.random.default_rng(seed)
    table = Circuit()
    changed = {
        name: getattr(table, name) * float(np.exp(draw.uniform(-0.5, 0.5)))
        for name in "I_S tau R1 R2 R3 R_L C1 C2 I_T1s".split()
    }
    changed["tau"] *= float(10 ** draw.uniform(-2, 1))
    changed["C1"] *= float(10 ** draw.uniform(-1, 1))
    circuit = replace(
        table, **changed, V_GS=1.4 + float(draw.uniform(-0.1, 0.15)),
        firing="put" if draw.random() < 0.3 else "lif",
    )  # fmt: skip
    direct = bool(draw.random() < 0.2)
    if direct:
        # 6.5 kHz at 50 mN: short, or the reference takes for ever
        circuit = replace(table, t1="direct", I_T1s=2.873e-20, tau=changed["tau"])
    points = int(draw.integers(2, 7))
    until = float(draw.uniform(0.02, 0.05) if direct else draw.uniform(0.3, 2.5))
    time = np.sort(np.round(draw.uniform(0, until, points), 4))
    top = 0.02 if direct else 0.35
    value = draw.uniform(-0.01 if direct else -0.1, top, points)
    for i in range(1, points - 1):
        if draw.random() < 0.3 and (i < 2 or time[i - 1] != time[i - 2]):
            time[i] = time[i - 1]
        elif draw.random() < 0.3:
            value[i] = value[i - 1]
    while np.any(time[2:] == time[:-2]):
        time = np.sort(np.round(draw.uniform(0, until, points), 4))
    start = None
    if draw.random() < 0.2 and not direct:
        start = Start(
            V_P=float(draw.uniform(-0.3, 0.3)), V_C1=float(draw.uniform(0, 4.5)),
            V_C2=float(draw.uniform(0, 3.0)),
        )  # fmt: skip
    tolerance = float(10 ** draw.uniform(-12, -3)) if draw.random() < 0.5 else 1e-9
    return Case(seed, circuit, Waveform(time, value), until, start, tolerance)


def saturated_case(seed: int) -> Case:
    """The scene of `seed` with a T1 that saturates, short: each spike costs seconds."""
    case = random_case(seed)
    until = min(case.until, 0.25)
    stretch = until / case.until
    force = Waveform(case.force.time * stretch, case.force.value)
    circuit = replace(case.circuit, saturation=True)
    return replace(case, circuit=circuit, force=force, until=until)


def _solved(case: Case, samples: int = SAMPLES) -> tuple[Result, FloatArray]:
    """What our solver makes of a case, and `samples` random times, shape (n,), s."""
    found = simulate(
        case.circuit, case.force, keep=("spikes", "V_C1"), until=case.until,
        start=case.start, tolerance=case.tolerance,
    )  # fmt: skip
    draw = np.random.default_rng(case.seed)
    return found, np.sort(draw.uniform(0, case.until, samples))


def _answer(found: Result, times: FloatArray) -> str:
    """A stamp of spike times and V_C1, to the last bit, and of the reference's sources.

    While it stays the same so do the true errors, whatever became of the estimates.
    """
    stamp = hashlib.sha1(usedforsecurity=False)
    stamp.update(np.asarray(found.spike_times).tobytes())
    stamp.update(found.sample("V_C1", times).tobytes())
    for path in sorted(Path(__file__).parent.glob("decimal_*.py")):
        stamp.update(path.read_bytes())
    return stamp.hexdigest()[:16]


def compare(case: Case, samples: int = SAMPLES) -> HonestyRow:
    """Solve one case both ways; V_C1 is compared at `samples` random times."""
    found, times = _solved(case, samples)
    exact = reference(
        case.circuit, case.force, case.until, start=case.start, times=times.tolist()
    )
    spikes = [] if found.spike_times is None else found.spike_times.tolist()
    return _row(
        case,
        found,
        len(exact.spike_times),
        _largest_gap(spikes, exact.spike_times),
        _largest_gap(found.sample("V_C1", times).tolist(), exact.V_C1),
    )


def _row(
    case: Case, found: Result, spikes_reference: int, spike_time: float, V_C1: float
) -> HonestyRow:
    """True errors, s and V, beside what `found` estimates them at."""
    error, spikes = found.error, found.solution.spike_times
    assert error.spike_time is not None and error.V_C1 is not None
    return HonestyRow(
        case, spikes.size, spikes_reference, spike_time, error.spike_time, V_C1,
        error.V_C1,
    )  # fmt: skip


def _largest_gap(found: list[float], exact: tuple[Decimal, ...]) -> float:
    pairs = zip(found, exact, strict=False)
    return max((abs(float(Decimal(a) - b)) for a, b in pairs), default=0.0)


Measured = dict[str, list[HonestyRow]]
KINDS = {"cascade": random_case, "saturated": saturated_case}
NUMBERS = (
    "spikes", "spikes_reference", "spike_time", "spike_time_estimate", "V_C1",
    "V_C1_estimate",
)  # fmt: skip


def campaign(count: int, out: Path | None, say: Callable[[str], None]) -> Measured:
    """`count` random scenes, and a fifth as many where T1 saturates.

    With `out`, each is written to honesty.csv as it is measured, with a stamp of our
    answer. Where that is still the same, to the last bit, the true errors are read from
    there, and only the estimates are taken anew.
    """
    file = None if out is None else out / "honesty.csv"
    kept = _kept(file)
    found: Measured = {}
    with ExitStack() as stack:
        writer = None
        if file is not None:
            file.parent.mkdir(parents=True, exist_ok=True)
            opened = stack.enter_context(file.open("a", newline="", encoding="utf-8"))
            writer = csv.writer(opened, lineterminator="\n")
        for kind, draw in KINDS.items():
            found[kind] = []
            for seed in range(count if kind == "cascade" else -(-count // 5)):
                case = draw(seed)
                solved, times = _solved(case)
                answer, old = _answer(solved, times), kept.get((kind, seed), [""])
                if old[0] == answer:
                    row = _row(case, solved, int(old[2]), float(old[3]), float(old[5]))
                else:
                    row = compare(case)
                numbers = [str(getattr(row, name)) for name in NUMBERS]
                if writer is not None and old[0] != answer:
                    writer.writerow((kind, seed, answer, *numbers))
                kept[kind, seed] = [answer, *numbers]
                found[kind].append(row)
                if (seed + 1) % 50 == 0:
                    say(f"{kind}: {seed + 1} random scenes")
    if file is not None:
        heads = ("scenes", "seed", "answer", *NUMBERS)
        write_rows(file, heads, ((*key, *kept[key]) for key in sorted(kept)))
    return found


def _kept(file: Path | None) -> dict[tuple[str, int], list[str]]:
    """Of each scene and seed the newest row of honesty.csv: answer and numbers."""
    if file is None or not file.exists():
        return {}
    with file.open(encoding="utf-8") as lines:
        rows = list(csv.reader(lines))
    return {(row[0], int(row[1])): row[2:] for row in rows if row[1].isdecimal()}


def report(count: int, rows: Measured) -> str:
    """honesty.md."""
    return "\n".join(
        [
            "# Is the error estimate honest?\n",
            f"Written by `tactile-lab validate honesty --scenes {count} --out docs`. "
            "Random scenes and parameters (`tactile_lab/validation/honesty.py`), half "
            "at random tolerances, against the 40-digit reference. A scene is measured "
            "again when a bit of our answer or the reference's code has changed; until "
            "then only its estimates are taken anew.\n",
            f"{provenance()}\n",
            "![estimate against true error](honesty.svg)\n",
            "## The cascade, Eqs. (16) to (18)\n",
            *_section(rows["cascade"]),
            "\n## T1 saturates\n",
            *_section(rows["saturated"]),
            "",
        ]
    )


def scatter(rows: Measured, path: Path) -> None:
    """Estimate against true error, with the 1:1 line: below it an estimate lies."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    plot, axes = plt.subplots(1, 2, figsize=(9, 4.4), layout="constrained")
    for axis, name, unit in zip(axes, ("spike_time", "V_C1"), "sV", strict=True):
        for kind, some in rows.items():
            pairs = [
                (max(getattr(row, name), 1e-18), getattr(row, f"{name}_estimate"))
                for row in some
                if row.spikes or name == "V_C1"
            ]
            if pairs:
                axis.plot(
                    *zip(*pairs, strict=True), "o" if kind == "cascade" else "s",
                    markersize=3, alpha=0.6,
                    label={"saturated": "T1 saturates"}.get(kind, kind),
                )  # fmt: skip
        axis.set(xscale="log", yscale="log", aspect="equal")
        low = min(axis.get_xlim()[0], axis.get_ylim()[0])
        high = max(axis.get_xlim()[1], axis.get_ylim()[1])
        axis.plot([low, high], [low, high], color="black", linewidth=1, label="1:1")
        axis.plot(
            [low, high], [30 * low, 30 * high], ":", color="0.5", label="30 times"
        )
        what = "a spike time" if name == "spike_time" else "V_C1"
        axis.set(
            xlim=(low, high), ylim=(low, high),
            xlabel=f"true error of {what} ({unit})",
            ylabel=f"estimated error of {what} ({unit})",
        )  # fmt: skip
        axis.grid(visible=True, color="0.92")
    axes[0].legend(frameon=False, loc="lower right")
    save(plot, path)


def _section(found: Sequence[HonestyRow]) -> list[str]:
    count = len(found)
    honest = sum(c.honest for c in found)
    spiking = [c for c in found if c.spikes]
    ratios = (
        [c.spike_time_estimate / c.spike_time for c in spiking if c.spike_time > 0],
        [c.V_C1_estimate / c.V_C1 for c in found if c.V_C1 > 0],
    )
    time_ratio, V_ratio = (f"{np.median(r):.0f}" if r else "unknown" for r in ratios)
    default = [c for c in found if c.case.tolerance == 1e-9]
    lines = [
        f"- {count} scenes, {len(spiking)} of them with spikes",
        f"- count right and true errors below the estimates: {honest} of {count} "
        f"({honest / count:.1%})",
        f"- estimate over true error, median: {time_ratio} for spike times, {V_ratio} "
        "for V_C1",
        "- largest true error at the default tolerance: "
        f"{max((c.spike_time for c in default), default=0.0):.1e} s, "
        f"{max((c.V_C1 for c in default), default=0.0):.1e} V",
    ]
    for c in found:
        if not c.honest:
            lines.append(
                f"- not honest: seed {c.case.seed}, {c.spikes} of "
                f"{c.spikes_reference} spikes, error {c.spike_time:.1e} s (estimate "
                f"{c.spike_time_estimate:.1e} s), {c.V_C1:.1e} V (estimate "
                f"{c.V_C1_estimate:.1e} V)"
            )
    return lines
