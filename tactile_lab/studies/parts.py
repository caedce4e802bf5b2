"""Parts for a wanted behaviour: searched for, and rounded to what is sold."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.optimize import differential_evolution

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.arrays import FloatArray
from tactile_lab.studies.behaviour import Behaviour, behaviour
from tactile_lab.studies.chosen import Chosen, checks_of
from tactile_lab.studies.specification import STEP, Specification

ENOUGH = 0.3
"""Where every miss is below this part of its tolerance, the search ends."""
POPULATION, GENERATIONS = 10, 60
"""Of the search: candidates for each part, and how often they are renewed."""
WORST = 100.0
"""What a miss is counted as at most, in tolerances."""
TUNING = 25
"""Millivolts by which a voltage is tuned either way after the parts are rounded."""
DRAWS = 2000
"""Of the parts within their tolerances, for the yield."""


def choose(asked: Specification) -> Chosen:
    """The parts that come closest to what is wanted.

    Raises:
        ParameterError: the parts may be chosen beyond what a circuit can have.
        SolverError: the circuit that was found cannot be solved.
    """
    wants = asked.wants.names
    best, met = _searched(asked, wants)
    values = _rounded(asked, best)
    changes: dict[str, Any] = dict(values)
    circuit = replace(asked.circuit, **changes)
    checks = tuple(checks_of(asked.wants, circuit))
    conflict: tuple[str, ...] = ()
    if not all(check.met for check in checks):
        conflict = () if met else _conflict(asked)
    return Chosen(
        asked=asked,
        values=values,
        circuit=circuit,
        checks=checks,
        conflict=conflict,
        good=_yield(asked, values),
    )


def misses(
    asked: Specification, found: Behaviour, wants: tuple[str, ...]
) -> FloatArray:
    """How far each want is missed, in tolerances, shape (wants, n); met to 1."""
    rows = []
    for name in wants:
        if name == "unsaturated":
            rows.append(np.maximum(-found.headroom / 0.01, 0.0))
            continue
        want = getattr(asked.wants, name)
        miss = (getattr(found, name) / want.value - 1) / want.within
        rows.append(np.where(np.isnan(miss), WORST / 2 + _far(asked, found), miss))
    clipped: FloatArray = np.clip(np.array(rows), -WORST, WORST)
    return clipped


def _far(asked: Specification, found: Behaviour) -> FloatArray:
    """How far a circuit is from firing as it should, where there is nothing to tell."""
    wants = asked.wants
    forces = [w.force for w in (wants.rate, wants.silence) if w is not None]
    if wants.threshold is not None:
        forces.append(wants.threshold.value)
    far: FloatArray = np.abs(found.critical / min(forces) - 0.5)
    return np.where(np.isfinite(far), np.minimum(far, WORST / 2), WORST / 2)


def _searched(asked: Specification, wants: tuple[str, ...]) -> tuple[FloatArray, bool]:
    """The best values of the parts between their limits, and whether they meet all."""
    parts, low, high = asked.parts, *_bounds(asked)
    now = np.array([_scaled(p.by_hand, getattr(asked.circuit, p.name)) for p in parts])
    best = {"x": np.clip(now, low, high), "cost": math.inf, "worst": math.inf}

    def cost(x: FloatArray) -> FloatArray:
        at = x.reshape(len(parts), -1)
        missed = misses(asked, behaviour(asked, _changes(asked, at)), wants)
        worst = np.abs(missed).max(axis=0)
        costs: FloatArray = (missed**2).sum(axis=0)
        first = int(np.argmin(costs))
        if costs[first] < best["cost"]:
            best.update(x=at[:, first], cost=costs[first], worst=worst[first])
        return costs

    search: Any = differential_evolution  # the stubs know no vectorized one
    search(
        cost,
        list(zip(low, high, strict=True)),
        x0=best["x"],
        maxiter=GENERATIONS,
        popsize=POPULATION,
        rng=asked.seed,
        polish=False,
        vectorized=True,
        updating="deferred",
        callback=lambda intermediate_result: bool(best["worst"] < ENOUGH),
    )
    return np.asarray(best["x"]), bool(best["worst"] <= 1.0)


def _scaled(by_hand: bool, value: float) -> float:
    return value if by_hand else math.log10(value)


def _bounds(asked: Specification) -> tuple[FloatArray, FloatArray]:
    low = [_scaled(part.by_hand, part.least) for part in asked.parts]
    high = [_scaled(part.by_hand, part.most) for part in asked.parts]
    return np.array(low), np.array(high)


def _changes(asked: Specification, at: FloatArray) -> dict[str, FloatArray]:
    """Values of the parts, SI, from what the search varies, shape (parts, n)."""
    return {
        part.name: row if part.by_hand else 10**row
        for part, row in zip(asked.parts, at, strict=True)
    }


def _conflict(asked: Specification) -> tuple[str, ...]:
    """The fewest wants that cannot be had together."""
    wants = asked.wants.names
    for size in range(1, len(wants)):
        for some in itertools.combinations(wants, size):
            if not _searched(asked, some)[1]:
                return some
    return wants


def _rounded(asked: Specification, best: FloatArray) -> dict[str, float]:
    """Parts as sold next to the best ones, the voltages tuned to a millivolt again."""
    choices = []
    for part, x in zip(asked.parts, best, strict=True):
        if part.by_hand:
            nearest = round(float(x) / STEP)
            steps = range(nearest - TUNING, nearest + TUNING + 1)
            some = [round(step * STEP, 3) for step in steps]
            choices.append([v for v in some if part.least <= v <= part.most] or [x])
        else:
            sold = np.array(part.values)
            near = np.argsort(np.abs(np.log10(sold) - x), kind="stable")[:2]
            choices.append(sold[near].tolist())
    # one voltage is tuned; another is rounded to the millivolt
    tuned = [i for i, part in enumerate(asked.parts) if part.by_hand]
    for i in tuned[1:]:
        choices[i] = [choices[i][len(choices[i]) // 2]]
    table = np.array(list(itertools.product(*choices)))
    changes = {p.name: table[:, i] for i, p in enumerate(asked.parts)}
    missed = misses(asked, behaviour(asked, changes), asked.wants.names)
    first = int(np.argmin((missed**2).sum(axis=0)))
    return {name: float(column[first]) for name, column in changes.items()}


def _yield(asked: Specification, values: Mapping[str, float]) -> Estimate:
    """Share of circuits within the tolerances that meet all wants."""
    rng = np.random.default_rng(asked.seed)
    changes = {
        part.name: values[part.name]
        + part.spread(values[part.name]) * rng.standard_normal(DRAWS)
        for part in asked.parts
    }
    missed = misses(asked, behaviour(asked, changes), asked.wants.names)
    return Estimate.share(int((np.abs(missed).max(axis=0) <= 1).sum()), DRAWS)
