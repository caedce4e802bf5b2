"""The next spikes of a train, several at a time.

One by one each search waits for the one before: a series at a time that only it tells.
Here all times are foretold from the last intervals, what V_C2 misses V_fire by is
computed for all at once, and one correction goes through the train, for what shifts a
spike shifts those after it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

from numba import types
from numba.extending import intrinsic

from tactile_lab.arrays import FloatArray
from tactile_lab.model import elementary
from tactile_lab.model.compiled import inner
from tactile_lab.model.integrator import T_EPS, TAU_L, V_FIRE, V_RESET
from tactile_lab.model.matrix import (
    ALL_FIRST,
    DOUBLE,
    FOUR,
    INDEX,
    NOTHING,
    WIDTH,
)
from tactile_lab.model.tableau import ORDER

LANES = 8
"""Spikes at a time."""
MOST_ROUNDS = 4
"""Corrections, after which spikes that are not settled are searched one by one."""
TIME, CHARGE, WAY, DECAY, PER, MISSED, PASSED, LEFT, REST, AT_Q, AT_P = range(
    0, 11 * LANES, LANES
)
"""Rows, a number for each spike: when it is, s after the piece's start; how long C2
charges before it, s; x of the series; exp(-charge/tau_L) - 1; one over Q - V_fire; by
how much it comes later than foretold, in tau_L: by itself, and where the spike before
comes later by one; what higher orders add to that; what is still wrong, s; the series
there."""
FROM_Q, FROM_P, SHIFT, BEND = range(11 * LANES, 15 * LANES + 4, LANES + 1)
"""The series where C2 begins to charge; how much later it comes, from the spike before
the first on; tau_L Q' along its charge, V, from the charge before on."""
BEFORE = 15 * LANES + 4
"""The last charge and its backward differences, to the third."""
DIFFERENCES = 4
ROOM = BEFORE + DIFFERENCES


def _series_each() -> Callable[..., None]:
    """A function for compiled code: (q, P, x, Q there, P there), LANES of each.

    The series are of degree ORDER; Clenshaw's recurrence as in `integrator.both_at`.
    """

    @intrinsic
    def each(_: Any, q: Any, P: Any, x: Any, of_q: Any, of_P: Any) -> Any:
        def build(context: Any, code: Any, signature: Any, arrays: Any) -> Any:
            series_q, series_P, ways, *into = (
                context.make_array(kind)(context, code, array).data
                for kind, array in zip(signature.args, arrays, strict=True)
            )

            def wide(value: Any) -> Any:
                one = code.insert_element(NOTHING, value, INDEX(0))
                return code.shuffle_vector(one, NOTHING, ALL_FIRST)

            def term(series: Any, n: int) -> Any:
                return wide(code.load(code.gep(series, [INDEX(n)])))

            def four(start: Any, at: int) -> Any:
                return code.bitcast(code.gep(start, [INDEX(at)]), FOUR.as_pointer())

            def plus(a: Any, b: Any) -> Any:
                return code.fadd(a, b)

            for lane in range(0, LANES, WIDTH):
                at = code.load(four(ways, lane), align=8)
                y = code.fmul(wide(DOUBLE(4.0)), code.fmul(at, at))
                y = code.fsub(y, wide(DOUBLE(2.0)))
                for series, result in zip((series_q, series_P), into, strict=True):
                    sums = []
                    for first in (ORDER - ORDER % 2, ORDER - 1 + ORDER % 2):
                        one, two = term(series, first), wide(DOUBLE(0.0))
                        for n in range(first - 2, first % 2, -2):
                            kept = code.fsub(term(series, n), two)
                            one, two = plus(kept, code.fmul(y, one)), one
                        sums.append((one, two))
                    (even, even_2), (odd, odd_2) = sums
                    half = code.fmul(wide(DOUBLE(0.5)), y)
                    found = code.fsub(code.fmul(half, even), even_2)
                    less = code.fsub(y, wide(DOUBLE(1.0)))
                    inner_ = plus(
                        code.fsub(term(series, 1), odd_2), code.fmul(less, odd)
                    )
                    found = plus(found, code.fmul(at, inner_))
                    found = plus(term(series, 0), found)
                    code.store(found, four(result, lane), align=8)
            return context.get_dummy_value()

        return types.void(q, P, x, of_q, of_P), build

    return cast(Callable[..., None], each)


series_each = _series_each()


@inner
def remember(charge: float, known: int, c: FloatArray) -> None:
    """Let one more charge follow the `known` ones before it."""
    change = charge
    for n in range(DIFFERENCES):
        before = c[BEFORE + n]
        c[BEFORE + n] = change if n <= known else 0.0
        change -= before


@inner
def foretell(c: FloatArray) -> None:
    """Fill the charges to come: as the last ones and their differences go on."""
    d_0, d_1, d_2, d_3 = c[BEFORE], c[BEFORE + 1], c[BEFORE + 2], c[BEFORE + 3]
    for i in range(LANES):
        n = i + 1.0
        d = 0.5 * d_2 + (n + 2.0) * (1.0 / 6.0) * d_3
        c[CHARGE + i] = d_0 + n * (d_1 + (n + 1.0) * d)


@inner
def together(
    ref: float,
    to_x: float,
    end: float,
    worth: float,
    drift: float,
    q: FloatArray,
    P: FloatArray,
    par: FloatArray,
    c: FloatArray,
) -> tuple[int, int]:
    """Find the spikes after `ref`, where C2 begins to charge, from foretold charges.

    The series at `ref` are in the first places of their rows; `drift` is tau_L Q' of
    the charge before, V. What is left to correct is below a thousandth of what an
    error of `worth` V makes. Returns how many were found before `end`, maybe none,
    and in how many rounds.
    """
    tau = par[TAU_L]
    per_tau = 1.0 / tau
    V_f, V_r, eps = par[V_FIRE], par[V_RESET], par[T_EPS]
    span = V_f - V_r
    c[BEND], c[SHIFT] = drift, 0.0
    found = settled = rounds = 0
    while rounds == 0 or settled < found:
        rounds += 1
        at = ref
        for i in range(LANES):
            at += c[CHARGE + i]
            c[TIME + i] = at
            at += eps
        for i in range(LANES):
            c[WAY + i] = min(c[TIME + i] * to_x - 1.0, 1.0)
        series_each(q, P, c[WAY:], c[AT_Q:], c[AT_P:])
        if eps > 0.0:
            for i in range(LANES):
                c[WAY + i] = min((c[TIME + i] + eps) * to_x - 1.0, 1.0)
            series_each(q, P, c[WAY:], c[FROM_Q + 1 :], c[FROM_P + 1 :])
        else:
            for i in range(LANES):
                c[FROM_Q + 1 + i] = c[AT_Q + i]
                c[FROM_P + 1 + i] = c[AT_P + i]
        for i in range(LANES):
            e = elementary.expm1(-c[CHARGE + i] * per_tau)
            V = (V_r - c[FROM_P + i]) * e + (c[AT_P + i] - c[FROM_P + i]) - span
            per = 1.0 / (c[AT_Q + i] - V_f)
            c[DECAY + i], c[PER + i], c[MISSED + i] = e, per, -V * per
            c[BEND + 1 + i] = (c[AT_Q + i] - c[FROM_Q + i]) / c[CHARGE + i] * tau
            # a spike that comes later lets this one come so much later
            c[PASSED + i] = (1.0 + e) * (c[FROM_Q + i] - V_r) * per
        shift = 0.0
        for i in range(LANES):
            shift = c[MISSED + i] + c[PASSED + i] * shift
            c[SHIFT + 1 + i] = shift
        for i in range(LANES):
            # to the third order, with Q on a straight line
            before, per = c[SHIFT + i], c[PER + i]
            g, k = c[BEND + 1 + i] * per, c[PASSED + i]
            bend = (1.0 + c[DECAY + i]) * g
            more = 0.5 * (k + bend) + before * (k / 6.0 + bend / 3.0)
            w = c[MISSED + i] + before * (k + before * more)
            bend = 1.0 / 3.0 + g * (2.0 / 3.0 + 0.5 * g)
            c[LEFT + i] = w * (1.0 + w * (w * bend - 0.5 - 0.5 * g)) - c[SHIFT + 1 + i]
        more = 0.0
        for i in range(LANES):
            more = c[LEFT + i] + c[PASSED + i] * more
            c[LEFT + i] = more
        for i in range(LANES):
            per = c[PER + i]
            g = c[BEND + 1 + i] * per
            m = max(abs(c[SHIFT + 1 + i]), abs(c[SHIFT + i]))
            rest = m * abs(g - (c[AT_Q + i] - c[AT_P + i]) * per)
            rest += abs(c[BEND + 1 + i] - c[BEND + i]) * per
            g = 1.0 + abs(g)
            rest = m * m * (rest + m * m * g * g * g) + 2.0 * m * abs(c[LEFT + i])
            c[REST + i] = tau * rest
        before = 0.0
        found = settled = 0
        for i in range(LANES):
            shift = c[SHIFT + 1 + i] + c[LEFT + i]
            charge = c[CHARGE + i] + tau * (shift - before)
            c[CHARGE + i], c[SHIFT + 1 + i] = charge, shift
            before = shift
            enough = max(1e-16 * charge, 1e-3 * worth * tau * c[PER + i])
            inside = c[TIME + i] + tau * shift < end and abs(shift) < 0.1
            inside &= charge > 0.0 and c[PER + i] > 0.0
            found += 1 if inside and found == i else 0
            settled += 1 if inside and settled == i and c[REST + i] <= enough else 0
        if found == 0 or rounds == MOST_ROUNDS:
            break
    return settled, rounds
