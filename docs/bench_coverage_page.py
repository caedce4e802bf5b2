"""The text of docs/bench-coverage.md; make_bench_coverage.py measures its rows."""

from __future__ import annotations

import datetime
from collections import defaultdict
from typing import Any

import numpy as np
from bench_coverage_cases import CASES
from scipy.special import betaincinv

from tactile_lab.analysis.estimate import Z95

HONEST = (0.93, 0.97)
"""Where the share of intervals that hold the truth should lie."""
SAME = 5e-3
"""Errors that differ by less, in half-widths, are one number told again and again."""
BOUNDS = {
    ("wiring_check", "offset of a channel"),
    ("wiring_check", "gain of a channel"),
    ("wiring_check", "V_GS"),
    ("demo", "latency"),
    ("threshold_drift", "drift"),
}
"""Told as bounds where they stand, which hold the truth more often."""


def ends(commits: list[str]) -> str:
    """The first and the last of commits in order, or the one."""
    return " to ".join(dict.fromkeys([commits[0], commits[-1]]))


def bounds(share: float, runs: int) -> tuple[float, float]:
    """Where the true share of hits lies (95 %, Clopper and Pearson), seen over `runs`.

    Numbers of one run share its errors, so the runs are the draws: `share` may be of
    several numbers from each.
    """
    hits, misses = share * runs, (1 - share) * runs
    low = betaincinv(hits, misses + 1, 0.025) if hits > 0 else 0.0
    high = betaincinv(hits + 1, misses, 0.975) if misses > 0 else 1.0
    return float(low), float(high)


def judged(low: float, high: float, bound: bool) -> str:
    """What such bounds say of an honest interval's 93 to 97 %, or of a `bound`."""
    if bound and high > HONEST[1]:
        return "told as a bound"
    if low >= HONEST[0] and high <= HONEST[1]:
        return "yes"
    if high < HONEST[0] or low > HONEST[1]:
        return "no"
    return "cannot tell"


def stood(page: str, case: str) -> list[str]:
    """The lines of a case on the page as it was."""
    return [line for line in page.splitlines() if line.startswith(f"| {case} |")]


def stands(page: str, case: str, commit: str) -> str:
    """The page on which the lines of a case hold to this commit, too."""
    for line in stood(page, case):
        head, _, commits = line.removesuffix(" |").rpartition(" | ")
        told = ends([*commits.split(" to "), commit])
        page = page.replace(line, f"{head} | {told} |")
    return page


def table(rows: list[dict[str, Any]], page: str = "") -> str:
    """The page; cases without rows as they stand on the one that was."""
    counts: dict[tuple[str, str], list[tuple[int, bool, float]]] = defaultdict(list)
    runs: dict[str, int] = defaultdict(int)
    refused: dict[str, int] = defaultdict(int)
    commits: dict[str, list[str]] = defaultdict(list)
    seconds: dict[str, list[float]] = defaultdict(list)
    for row in rows:
        if row["commit"] not in commits[row["case"]][-1:]:
            commits[row["case"]].append(row["commit"])
        seconds[row["case"]].append(row["cpu"])
        runs[row["case"]] += 1
        refused[row["case"]] += not row["told"]
        for name, value, low, high, truth in row["told"]:
            half = (high - low) / 2
            error = (value - truth) / half if half else float("nan")
            hair = 1e-9 * abs(half)
            hit = low - hair <= truth <= high + hair
            counts[row["case"], name].append((row["seed"], hit, error))
    lines = []
    for case in CASES:
        if case not in runs:
            lines += stood(page, case)
        for (of_case, name), seen in counts.items():
            if of_case != case:
                continue
            errors = np.array([error for _, _, error in seen])
            share = float(np.mean([hit for _, hit, _ in seen]))
            draws = len({seed for seed, _, _ in seen})
            low, high = bounds(share, draws)
            inside = f"{100 * share:.1f} % | {100 * low:.1f} to {100 * high:.1f} %"
            inside += f" | {judged(low, high, (case, name) in BOUNDS)}"
            if len(seen) > 1 and np.ptp(errors) < SAME:
                inside = "one number repeated | – | cannot tell"
            lines.append(
                f"| {case} | {name} | {len(seen)} in {draws} | {inside} "
                f"| {np.mean(errors):+.2f} | {Z95 * np.std(errors):.2f} "
                f"| {refused[case]} of {runs[case]} "
                f"| {np.median(seconds[case]):.1f} s | {ends(commits[case])} |"
            )
    today = datetime.date.today().isoformat()
    body = "\n".join(lines)
    return f"""# How often a 95 % interval holds the truth, as a bench measures it

Written by `docs/make_bench_coverage.py` (part of `make reports`), {today}. Each repeat
is a whole run on the simulated bench: drivers, serial timing, 8 bit converter, noise,
clocks and lags. For each seed the truth is drawn: input bias (±20 pA), offset of the
channels (±1 code of V_C1), lag (±1 ms), force (±4 %, stated in the bench file), each
95 % normal, V_GS (3 mV standard deviation), the scope's clock (20 ppm; for `identify`
51 ppm, to 100 ppm at most), for `calibrate_field` the core's loop (0 to 50 mA,
evenly), and for `bipolar` R1 (±1 %, 95 % normal).

An honest interval holds the truth in 93 to 97 % of the numbers. How often it truly does
is known from so many runs only within the bounds given (95 %, Clopper and Pearson, by
runs: numbers of one run share its errors). "Yes" and "no" are said where those bounds
lie within 93 to 97 % or wholly outside; "yes" takes about a thousand runs.

| run | number | numbers in runs | holds the truth | known to | 93 to 97 %? \
| mean error | spread | refused | CPU | commit |
|---|---|---|---|---|---|---|---|---|---|---|
{body}

Mean error and spread (1.96 standard deviations) are in units of the interval's
half-width: 0 and 1 where the interval is neither biased nor too wide. "Refused" counts
runs that told none of theirs. "CPU" is of one run with all that it tells, the median.

Intervals that hold the truth more often than in 97 % hold a bound rather than a
scatter, and the bound is seldom reached: half a code of a converter whose steps no
noise smooths (V_GS of `wiring_check`, which says that its numbers are bounds), how
well the clocks of coil and scope are aligned at the worst (the latency of a first
spike, which the table of each report tells with it), or one step of the presses over
all of the time (the drift of `threshold_drift`). A field's band is of those that
came from saturation, as both fields told here do: these lie at the edge of the core's
loop.

What the intervals hold beyond noise: a spike that is seen late makes one interval
longer and the next one shorter, and neighbours tell how much of the scatter is of this
kind (`identify`); edges of the current are dated by how well they agree, about 30 us,
or where the shunt does not show them by the steps next to them; the tau of `bipolar` is
taken at both ends of the channel's offset, with 1 % of R1 and R2, of which R1 alone is
drawn here.

Of each row that names two commits, the first 30 seeds were run again at the later one
(`docs/make_bench_coverage.py --again`, from what `docs/bench-coverage.csv` keeps). They
told the same numbers and intervals, within 0.2 % of a half-width.

Others are of both commits that they name: `threshold_trim` with every second seed up to
122 of the earlier one, the demo and `rate_force` with the shunt with the first 577.

`identify` lets each bin of V_C1 count by its own scatter since 8ebd8682 (White, 1980):
bins scatter more where V_C1 moves or one of its codes ends, and tell more there. When
all counted alike, the intervals of both runs with the shunt were 2 to 5 % narrower, and
tau of `rate_force` held in 93.6 % of 1000 (d68f4dac). What neighbouring bins have in
common counts by the weights of Newey and West (1987) since b34ffb37; twelve seeds of
the demo with the shunt moved by 0.002 of a half-width by that, and their intervals by
0.2 %.

Over a minute with the shunt V_C1 is taken in codes of 39 mV. What they leave of its
means is alike over some 20 bins and swings back over the next 100. The likeness is in
the intervals, what of it cancels is not: they are a quarter too wide. The scope's clock
is drawn within its band, which is a bound: of tau, which it decides, intervals hold a
little more often, on the demo too.

Since 45078fc6 a hold ends as the current leaves it, some 46 ms later than asked, and
since a5279dd1 a step's answer, the simulated coil's and the one that is believed, ends
nearer to rest; rows of earlier commits are of before. Ten seeds of each of these cases,
run again at 497671c4, told the numbers of `sine_sweep`, `touch`, `calibrate_field`,
`force_check`, `threshold_search`, `threshold_trim` and `wiring_check`, and the latency
of the demo, within 0.06 of a half-width of what they had told; `monitor` was not run
again. Since then a `touch` waits longer for node A before its law is fitted.

The circuit's law for a hold and for the slopes of a `rate_force` computes T1's current
at nearer points since fc76cc1b, which made the interval of the slope at the largest
force a quarter as wide; `hold` and three forces of `rate_force` are counted after it.

Since 2026-11-29 the ± of the critical force and of V_GS hold what the film still held
of the presses before, up to 0.09 mN, in `threshold_search`, `threshold_trim` and
`rate_force`. The 4 % of force hide it in these rows: with a force known to 0.01 % the
critical force held in 16 of 20 searches and 9 of 12 trims before, in all of them since.
Since then, too, the phase of a `sine_sweep` holds what a converter's codes do to an
answer in stairs. Over a bias of 100 mN, where they are 39 mV, that of 1 Hz held in 12
of 20 runs before and in 20 since; of the rows here, first 20 seeds, no interval moved
by more than 7 %. With a source of 4800 baud, one step in 0.14 s, phases of 0.05 and
0.3 Hz came some 1 ms late (13 and 17 of 20 held); that is in no interval yet.

"One number repeated" is no evidence of coverage, however many runs gave it. Offset and
gain of `wiring_check` are such: the probes on 0 V and V_S pass by all that is drawn,
the stored samples carry no noise there, and 0 V lies on the edge of a code. So all runs
tell the same offset, half a code off, and the same gain; the truth lies exactly on the
bound of either, which held, but was tried once.

The bands of `force_check` and of the critical force (`threshold_search`, `_trim` and
`_drift`) are what the bench file states of the force, and that alone decides: of the
first thousand seeds 945 drew a force within its band, so they hold in 94.5 % and in
what the resolution of a search adds to that. Over the latencies of `touch` the lag
decides alike. Numbers of one run hold or miss together.

What `vibration` and `texture` tell has no row. Vector strengths and phases were those
of the true sensor under the same presentations to 0.01 and 0.3 of their half-widths in
4 runs; these hold the scatter over presentations, behind which no one truth stands. A
grating's period is told with the resolution of a scan.

On this bench the source answers as steadily as its wire. Where answers scatter, a step
that no shunt dates may have come earlier by what its round trip took longer than the
quickest, which is in `identify`'s intervals: without the shunt, answers late by 0 to
8 ms, evenly, each by itself, V_GS, tau and I_bias held in 22 of 24 runs (8e058e9).
"""
