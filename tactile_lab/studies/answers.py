"""What a study says: response, tornado, Sobol indices, spread, yield."""

from __future__ import annotations

import itertools
import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.control_chart import mean_and_error
from tactile_lab.analysis.estimate import Estimate, student_95
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Conclusion, Table
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import count, plus_minus, printed, show
from tactile_lab.studies.axes import Axis
from tactile_lab.studies.dataset import Gathered

CURVES = 8
"""Most curves in one panel."""
ROWS = 60
"""Most rows of a table of values; more are only drawn."""
DOTS = 3000
"""Most dots in one panel."""
CELLS = 100
"""Most cells of a map along either axis."""
FAILED = "refused or failed"
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
            sentences.append(
                f"{name}: median {_told(found, name, np.median(known))}, 95 % of the "
                f"points from {_told(found, name, low)} to {_told(found, name, high)}."
            )
            values[name] = {
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
    text = show(float(value), found.unit(name))
    return f"+{text}" if signed and value > 0 else text


def plots(found: Gathered) -> Iterator[Plot]:
    """Figures of a study: what is kept against what varies."""
    design = found.study.design
    numbers = found.numbers()
    if not numbers:
        return
    grid = [g[0] for g in design.groups if len(g[0].values) > 1]
    if len(grid) == 2 and all(axis.numeric for axis in grid):
        yield _map(found, *grid)
    for number, (key, dimension, axis, values) in enumerate(design.coordinates()):
        if not axis.numeric or dimension != key:
            continue
        yield _response(found, axis, number, np.array(values, dtype=np.float64))
    if design.sampled:
        for number, axis in enumerate(design.drawn):
            yield _scatter(found, axis, number)


def _map(found: Gathered, across: Axis, up: Axis) -> Plot:
    """Every number over two axes of values; what failed is crossed out."""
    dimensions = list(found.study.design.dimensions)
    along = dimensions.index(up.key), dimensions.index(across.key)
    steps = [math.ceil(len(axis.values) / CELLS) for axis in (up, across)]

    def laid(column: NDArray[Any]) -> NDArray[Any]:
        """Shape (cells, all other axes and repeats)."""
        thin = np.moveaxis(column, along, (0, 1))[:: steps[0], :: steps[1]]
        return thin.reshape(thin.shape[0] * thin.shape[1], -1)

    y, x = (
        np.array(axis.values, dtype=np.float64)[::step]
        for axis, step in zip((up, across), steps, strict=True)
    )
    x, y = np.tile(x, y.size), np.repeat(y, x.size)
    of = laid(_points(found))[:, 0]
    failed = (laid(found.reasons.reshape(found.study.design.shape)) != "").any(axis=1)
    crossed = Series(
        x=x[failed], y=y[failed], name=FAILED if failed.any() else "", mark="crosses",
        colour="ink", of=tuple(of[failed].tolist()),
    )  # fmt: skip
    panels = []
    for name, column in found.numbers().items():
        z = _known_mean(laid(column))
        cells = Series(
            x=x, y=y, z=z, z_unit=found.unit(name), name=name, mark="cells",
            of=tuple(of.tolist()),
        )  # fmt: skip
        panels.append(Panel(label=up.key, unit=up.unit, series=(cells, crossed)))
    thinned = "" if max(steps) == 1 else f"; one value in {max(steps)} of a long axis"
    return Plot(
        name="map",
        title=f"map of {across.key} and {up.key}",
        caption="Means over all other axes and repeats. A cell without colour has no "
        f"number, one with a cross was refused or failed{thinned}.",
        x_label=across.key,
        x_unit=across.unit,
        panels=tuple(panels),
    )


def _points(found: Gathered) -> NDArray[np.intp]:
    """Numbers of the points, in the shape of the design."""
    design = found.study.design
    return np.arange(design.size).reshape(design.shape)


def _response(found: Gathered, axis: Axis, number: int, at: FloatArray) -> Plot:
    """Every number against one axis of values; a curve for each of another."""
    design = found.study.design
    dimensions = list(design.dimensions)
    along = dimensions.index(axis.key)
    others = [g[0] for g in design.groups if g[0].key != axis.key]
    by = min(others, key=lambda one: len(one.values)) if others else None
    if by is not None and len(by.values) > CURVES:
        by = None
    sampled = len(others) == (by is not None) and (
        design.sampled if design.drawn else design.repeat > 1
    )
    points = np.moveaxis(_points(found), along, 0)
    failed = np.moveaxis(found.reasons.reshape(design.shape) != "", along, 0)
    panels = []
    for name, column in found.numbers().items():
        if design.drawn and design.repeat > 1:
            column = _known_mean(column)  # one number of each draw
        if by is None:
            moved = np.moveaxis(column, along, 0)
            curves = [_mean(moved, at, points, "", sampled=sampled)]
        else:
            place = dimensions.index(by.key)
            moved = np.moveaxis(column, (along, place), (0, 1))
            each = np.moveaxis(_points(found), (along, place), (0, 1))
            curves = [
                _mean(moved[:, i], at, each[:, i], by.shown(value), i, sampled=sampled)
                for i, value in enumerate(by.values)
            ]
        curves += _crossed(at, column, points, failed)
        panels.append(Panel(label=name, unit=found.unit(name), series=tuple(curves)))
    of = "draws" if design.drawn else "repeats"
    return Plot(
        name=f"response_{number}",
        title=f"response to {axis.key}",
        caption=f"Means over all other axes and repeats against {axis.key}"
        + (f"; bars are 95 % intervals of the mean over {of}" if sampled else "")
        + (
            ". Crosses along the bottom were refused or failed."
            if found.failed
            else "."
        ),
        x_label=axis.key,
        x_unit=axis.unit,
        panels=tuple(panels),
    )


COLOURS = ("V_C1", "V_C2", "V_K", "force", "rate", "model", "ink", "quiet")


def _crossed(
    at: FloatArray,
    column: FloatArray,
    points: NDArray[np.intp],
    failed: NDArray[np.bool_],
) -> Iterator[Series]:
    """Crosses where a point was refused or failed, at the least that is known."""
    known, bad = column[np.isfinite(column)], failed.reshape(at.size, -1)
    where = np.flatnonzero(bad.any(axis=1))
    if where.size:
        first = points.reshape(at.size, -1)[where, bad[where].argmax(axis=1)]
        yield Series(
            x=at[where],
            y=np.full(where.size, np.min(known, initial=np.inf) if known.size else 0.0),
            name=FAILED,
            mark="crosses",
            colour="ink",
            of=tuple(first.tolist()),
        )


def _known_mean(column: FloatArray) -> FloatArray:
    """Mean along the last axis of what is known there; NaN where nothing is."""
    known = np.isfinite(column)
    size = known.sum(axis=-1)
    total = np.where(known, column, 0.0).sum(axis=-1)
    none = np.full(size.shape, np.nan)
    mean: FloatArray = np.divide(total, size, out=none, where=size > 0)
    return mean


def _mean(
    column: FloatArray,
    at: FloatArray,
    points: NDArray[np.intp],
    name: str,
    number: int = 0,
    *,
    sampled: bool,
) -> Series:
    """Mean of everything but the first axis; its 95 % interval where it is a sample."""
    rows = column.reshape(at.size, -1)
    mean, error = _known_mean(rows), None
    known = np.isfinite(rows)
    size = known.sum(axis=1)
    if sampled and np.max(size, initial=0) > 1:
        off = np.where(known, rows - mean[:, None], 0.0)
        variance = (off**2).sum(axis=1) / np.maximum(size - 1, 1)
        wide = np.array([student_95(int(max(n - 1, 1))) for n in size])
        error = wide * np.sqrt(variance / np.maximum(size, 1))
        error[size < 2] = np.nan
    return Series(
        x=at,
        y=mean,
        y_error=error,
        name=name,
        mark="joined",
        colour=COLOURS[number % len(COLOURS)],
        of=tuple(points.reshape(at.size, -1)[:, 0].tolist()),
    )


def _scatter(found: Gathered, axis: Axis, number: int) -> Plot:
    """Every number against one drawn axis."""
    design = found.study.design
    _, _, _, drawn = next(c for c in design.coordinates() if c[2] is axis)
    along = design.dimensions.index("draw")
    panels = []
    for name, column in found.numbers().items():
        moved = np.moveaxis(column, along, -1)
        x = np.broadcast_to(np.array(drawn), moved.shape).ravel()
        step = math.ceil(x.size / DOTS)
        of = np.moveaxis(_points(found), along, -1).ravel()[::step]
        dots = Series(
            x=x[::step], y=moved.ravel()[::step], mark="dots", of=tuple(of.tolist())
        )
        panels.append(Panel(label=name, unit=found.unit(name), series=(dots,)))
    return Plot(
        name=f"draws_{number}",
        title=f"draws of {axis.key}",
        caption=f"{_each(design.size)} against its {axis.key}; all other axes vary as "
        "well.",
        x_label=axis.key,
        x_unit=axis.unit,
        panels=tuple(panels),
    )


def _each(size: int) -> str:
    step = math.ceil(size / DOTS)
    return "Each point" if step == 1 else f"One point in {step}"


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
    """How many points meet every requirement; one that failed does not.

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
        sentences.append(f"{said}: {_share(share)}, Wilson's 95 % interval).")
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
                    abs(high - low),
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
