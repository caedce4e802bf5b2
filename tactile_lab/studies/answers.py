"""What a study says, in sentences and tables: spread, yield, Sobol indices, tornado."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.control_chart import mean_and_error
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Conclusion, Table
from tactile_lab.quantity import count, plus_minus, printed, show
from tactile_lab.studies.dataset import Gathered

ROWS = 60
"""Most rows of a table of values; more are only drawn."""
RESAMPLES = 200
"""Of the bootstrap behind the intervals of Sobol indices."""


def conclude(found: Gathered) -> Conclusion:
    """Sentences, tables and numbers of a study."""
    study, design = found.study, found.study.design
    failed = found.failed
    sentences = [
        f"{count(design.size, 'point')} of {study.scene.name} on {study.on}"
        + (f", {failed} of them refused or failed." if failed else ".")
    ]
    missing = _reasons(found)
    tables: list[Table] = []
    values: dict[str, Any] = {"points": design.size, "failed": failed}
    for name, column in found.numbers().items():
        known = column[np.isfinite(column)]
        if known.size and design.sampled:
            low, high = np.quantile(known, (0.025, 0.975))
            of, whom = "", "the points"
            if known.size < column.size:
                of = f"of the {known.size} of {column.size} that have one, "
                whom = "them"
            sentences.append(
                f"{name}: {of}median {_told(found, name, np.median(known))}, 95 % of "
                f"{whom} from {_told(found, name, low)} to {_told(found, name, high)}."
            )
            values[name] = {
                "points": int(known.size),
                "median": float(np.median(known)),
                "low": float(low),
                "high": float(high),
            }
    if not design.drawn and found.numbers():
        tables += _every(found)
    if study.require:
        tables += _yield(found, sentences, values, missing)
    if design.method == "indices" and design.drawn:
        tables += _indices(found, values, missing)
    if design.method == "tornado" and design.drawn:
        tables += _tornado(found)
    return Conclusion(tuple(sentences), values, tuple(missing), tuple(tables))


def _told(found: Gathered, name: str, value: float, *, signed: bool = False) -> str:
    if not math.isfinite(value):
        return "none"
    return show(float(value), found.unit(name), sign="+" if signed else "-")


def _every(found: Gathered) -> Iterator[Table]:
    """What was found at each combination of values, where they are few."""
    design, columns = found.study.design, found.numbers()
    together = math.prod(len(group[0].values) for group in design.groups)
    if together > ROWS:
        return
    wide = {name: c.reshape(together, design.repeat) for name, c in columns.items()}
    rows = []
    for i, shown in enumerate(_combinations(found)):
        told = (_with_error(found, name, column[i]) for name, column in wide.items())
        rows.append((*shown, *told))
    repeats = f"mean and standard error of {design.repeat} repeats"
    yield Table(
        title="What was found",
        headings=(*(axis.key for g in design.groups for axis in g), *wide),
        rows=tuple(rows),
        note=f"Where it is known of several: {repeats}." if design.repeat > 1 else "",
    )


def _with_error(found: Gathered, name: str, values: FloatArray) -> str:
    """Mean of what is known, with its standard error where it is known of several."""
    known = values[np.isfinite(values)]
    if not known.size:
        return "none"
    mean, error = mean_and_error(known.tolist())
    return plus_minus(mean, error, found.unit(name))


def _combinations(found: Gathered) -> Iterator[tuple[str, ...]]:
    """The values of each combination of the axes that have some, for a person."""
    groups = found.study.design.groups
    for places in itertools.product(*(range(len(g[0].values)) for g in groups)):
        yield tuple(
            axis.shown(axis.values[place])
            for group, place in zip(groups, places, strict=True)
            for axis in group
        )


def _yield(
    found: Gathered,
    sentences: list[str],
    values: dict[str, Any],
    missing: list[str],
) -> Iterator[Table]:
    """How many points meet every requirement; a number that failed meets none.

    Only of independent draws is the share known to an interval; at each combination
    of values by itself.
    """
    numbers, design = found.numbers(), found.study.design
    good = np.ones(design.shape, dtype=bool)
    for name, limit in found.study.require.items():
        if name not in numbers:
            missing.append(f"[require.{name}]: it is a row of numbers, no number.")
            return
        good &= limit.hold(numbers[name])
    told = ", ".join(f"{name} {limit}" for name, limit in found.study.require.items())
    said = f"{int(good.sum())} of {design.size} points are good ({told})"
    shares = None
    if design.sampled and design.repeat == 1:
        shares = [
            Estimate.share(int(row.sum()), row.size)
            for row in good.reshape(-1, design.shape[-1])
        ]
    if shares is not None and len(shares) == 1:
        (share,) = shares
        taken = "" if design.method == "random" else ", as of independent draws"
        sentences.append(f"{said}: {_share(share)}, Wilson's 95 % interval{taken}).")
        values["yield"] = share
        return
    values["yield"] = float(good.mean())
    sentences.append(
        f"{said}. They are no sample of anything: how many depends on the values that "
        "were chosen, and there is no interval."
    )
    if shares is not None and len(shares) <= ROWS:
        yield Table(
            title="Yield",
            headings=(*(axis.key for g in design.groups for axis in g), "good"),
            rows=tuple(
                (*shown, f"{_share(share)})")
                for shown, share in zip(_combinations(found), shares, strict=True)
            ),
            note=f"Of {design.shape[-1]} draws each; in brackets Wilson's 95 % "
            "interval, as of independent draws.",
        )


def _share(one: Estimate) -> str:
    return f"{one.value:.1%} ({one.low:.1%} to {one.high:.1%}"


def _indices(
    found: Gathered, values: dict[str, Any], missing: list[str]
) -> Iterator[Table]:
    """Sobol indices of each number, with bootstrapped 95 % intervals."""
    design = found.study.design
    k, n = len(design.drawn), design.draws
    along = design.dimensions.index("draw")
    for name, column in found.numbers().items():
        flat = np.moveaxis(column, along, -1).reshape(-1, n * (k + 2)).mean(axis=0)
        if not np.all(np.isfinite(flat)):
            missing.append(
                f"Sobol indices of {name}: {np.count_nonzero(~np.isfinite(flat))} "
                "points have no number; narrow the axes, or keep what every point has."
            )
            continue
        if np.ptp(flat) == 0:
            missing.append(f"Sobol indices of {name}: it is the same at every point.")
            continue
        pairs = (flat - flat[: 2 * n].mean()).reshape(k + 2, n)
        rows = []
        orders = _with_intervals(pairs, design.seed)
        for axis, first, total in zip(design.drawn, *orders, strict=True):
            values[f"sobol_{name}_{axis.key}"] = {"first": first, "total": total}
            rows.append((axis.key, _shown(first), _shown(total)))
        yield Table(
            title=f"Sobol indices of {name}",
            headings=("axis", "first order", "total"),
            rows=tuple(rows),
            note=f"Saltelli's estimator on {n} pairs; 95 % intervals by bootstrap "
            f"(BCa) over {RESAMPLES} resamples, its draws fixed by the seed.",
        )


def _with_intervals(pairs: FloatArray, seed: int) -> list[list[Estimate]]:
    """First-order and total index of each axis, with 95 % intervals.

    Args:
        pairs: centred values, shape (axes + 2, n), see `Design`.
        seed: of the resamples.
    """
    from scipy.stats import bootstrap

    def indices(rows: NDArray[np.intp]) -> FloatArray:
        return _saltelli(pairs[:, rows])

    every = np.arange(pairs.shape[1])
    resample: Any = bootstrap  # the stubs know statistics of one number alone
    with warnings.catch_warnings():  # an axis that does nothing has no spread
        warnings.simplefilter("ignore")
        spread = resample(
            [every], indices, vectorized=False, n_resamples=RESAMPLES, rng=seed
        )
    index, interval = indices(every), spread.confidence_interval
    same = np.isnan(interval.low)  # in every resample
    low, high = (np.where(same, index, x) for x in (interval.low, interval.high))
    return [
        [Estimate(*map(float, one)) for one in zip(*order, strict=True)]
        for order in zip(index, spread.standard_error, low, high, strict=True)
    ]


def _saltelli(pairs: FloatArray) -> FloatArray:
    """First-order and total indices, shape (2, axes), of centred values at n pairs.

    Saltelli et al., Comput. Phys. Commun. 181, 2010, Table 2 (b) and (f).
    """
    f_A, f_B, f_AB = pairs[0], pairs[1], pairs[2:]
    first = (f_B * (f_AB - f_A)).mean(axis=-1)
    total = ((f_A - f_AB) ** 2).mean(axis=-1) / 2
    indices: FloatArray = np.array([first, total]) / pairs[:2].var()
    return indices


def _shown(one: Estimate) -> str:
    return printed(f"{one.value:.3f} ({one.low:.3f} to {one.high:.3f})")


def _tornado(found: Gathered) -> Iterator[Table]:
    """How each number changes where one axis alone is moved by one deviation."""
    design = found.study.design
    along = design.dimensions.index("draw")
    for name, column in found.numbers().items():
        flat = np.moveaxis(column, along, -1).reshape(-1, design.shape[along])
        middle = flat.mean(axis=0)
        rows = []
        for i, axis in enumerate(design.drawn):
            low, high = middle[1 + 2 * i], middle[2 + 2 * i]
            half = axis.spread.width if axis.spread is not None else 0.0
            rows.append(
                (
                    float(np.nan_to_num(abs(high - low), nan=-1.0)),  # not known: last
                    (
                        axis.key,
                        f"±{show(half, axis.unit)}",
                        _told(found, name, low - middle[0], signed=True),
                        _told(found, name, high - middle[0], signed=True),
                    ),
                )
            )
        rows.sort(key=lambda row: -row[0])
        yield Table(
            title=f"{name}, {_told(found, name, middle[0])} at the centre",
            headings=("axis", "spread", "low", "high"),
            rows=tuple(row for _, row in rows),
            note="Change of it where one axis alone lies one standard deviation low "
            "or high (of a uniform spread: where a normal one has its deviation).",
        )


def _reasons(found: Gathered) -> list[str]:
    """Each reason once, with how often."""
    reasons, counts = np.unique(found.reasons[found.reasons != ""], return_counts=True)
    return [
        f"{count(int(number), 'point')}: {reason}"
        for reason, number in zip(reasons.tolist(), counts, strict=True)
    ][:20]
