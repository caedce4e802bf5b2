"""How coil current and field answer one set-point: two lags and the core's hysteresis.

The current follows the set-point with the coil's L/R lag; eddy currents in the solid
core let the field follow the current with a second lag. In between acts the core's
hysteresis, a sum of play operators: each stays until the current has moved by its
radius, then follows. Between two such moments all of it is exponentials, given here
as linear pieces that stay within `ACCURACY` of the step.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from sim_backend.plant.pieces import Pieces
from tactile_lab.arrays import FloatArray
from tactile_lab.lag import decay, evening, excess

ACCURACY = 1e-4
"""Largest deviation of the linear pieces from the exponentials, per step."""
OVER = 1e-6
"""Part of a step at which its answer is over. Of short presses, one that was over at
5e-5 put tau off by half of the half-width to which `identify` tells it."""
LONGEST = 0.75
"""Length of a piece at most, in lags, however little of the step is left."""
PLAYS = 8
"""Play operators that share the core's hysteresis."""


@dataclass(frozen=True, eq=False)
class Moment:
    """Coil and core at one instant, and the set-point from then on.

    Attributes:
        time: s.
        target: set-point in force, A.
        current: coil current, A.
        effective: current that would give the field in a core without lag and loop, A.
        plays: state of each play operator, A.
    """

    time: float
    target: float
    current: float
    effective: float
    plays: FloatArray


@dataclass(frozen=True, eq=False)
class StepResponse:
    """What follows a moment if no other command comes.

    Attributes:
        current: coil current, A.
        effective: current that would give the field in a core without lag and loop, A.
    """

    current: Pieces
    effective: Pieces


class Core:
    """The lags and the hysteresis of coil and core.

    Args:
        coil_lag: L/R of the coil, s, from 0.
        eddy_lag: lag of the field behind the current, s, from 0.
        hysteresis: half-width of the loop for large currents, A, from 0.
    """

    def __init__(self, coil_lag: float, eddy_lag: float, hysteresis: float) -> None:
        if coil_lag > 0 and abs(eddy_lag / coil_lag - 1) < 1e-6:
            # equal lags have another closed form; this is within rounding of it
            eddy_lag = coil_lag * (1 + 1e-6)
        self._coil, self._eddy = coil_lag, eddy_lag
        self._field_knots = lag_knots(coil_lag, eddy_lag)
        self._current_knots = lag_knots(coil_lag)
        elements = PLAYS if hysteresis > 0 else 1
        # radii spread evenly from 0 to twice the mean: virgin curve and minor loops
        self._radius = 2 * hysteresis * (np.arange(elements) + 0.5) / elements

    def virgin(self) -> Moment:
        """A core that was never magnetised, at 0 A, at time 0."""
        return Moment(0.0, 0.0, 0.0, 0.0, np.zeros(self._radius.size))

    def moved(self, plays: FloatArray, current: float) -> FloatArray:
        """Play operators after the current went straight to `current` A."""
        return np.clip(plays, current - self._radius, current + self._radius)

    def answer(self, begin: Moment) -> StepResponse:
        """Coil current and effective current from `begin` on."""
        jump = begin.target - begin.current
        current = begin.target - jump * decay(self._current_knots, self._coil)
        current[-1] = begin.target
        current -= jump * _evening(self._current_knots, (1.0, self._coil))
        times, values = [], []
        for moment, end in self._stretches(begin):
            held, fast, slow = self._terms(moment)
            value = self._value(self._field_knots, held, fast, slow)
            value[-1] = held
            parts = (fast, self._coil), (slow, self._eddy)
            value += _evening(self._field_knots, *parts)
            inside = moment.time + self._field_knots < end
            times.append(moment.time + self._field_knots[inside])
            values.append(value[inside])
        return StepResponse(
            Pieces.through(begin.time + self._current_knots, current),
            Pieces.through(np.concatenate(times), np.concatenate(values)),
        )

    def _stretches(self, begin: Moment) -> list[tuple[Moment, float]]:
        """When another play operator begins to move, and the end of each stretch."""
        target, current = begin.target, begin.current
        sign = 1.0 if target >= current else -1.0
        caught = begin.plays + sign * self._radius
        between = ((caught - current) * sign > 0) & ((target - caught) * sign > 0)
        cuts: list[float] = []
        if self._coil > 0:
            share = (target - current) / (target - caught[between])
            cuts = sorted((begin.time + self._coil * np.log(share)).tolist())
        stretches = []
        moment = begin
        for cut in cuts:
            stretches.append((moment, cut))
            left = math.exp(-(cut - begin.time) / self._coil)
            at = target + (current - target) * left
            since = np.array([cut - moment.time])
            effective = float(self._value(since, *self._terms(moment))[0])
            plays = self.moved(moment.plays, at)
            moment = Moment(cut, target, at, effective, plays)
        return [*stretches, (moment, math.inf)]

    def _terms(self, moment: Moment) -> tuple[float, float, float]:
        """End value, and amplitudes of the coil's and the eddy currents' decay, A."""
        sign = 1.0 if moment.target >= moment.current else -1.0
        edge = sign * self._radius
        if self._coil == 0:
            held, fast = float(self.moved(moment.plays, moment.target).mean()), 0.0
        else:
            # rounding must not leave behind the operator that this stretch begins with
            slack = 1e-12 * (1 + abs(moment.current))
            moves = (moment.plays + edge - moment.current) * sign <= slack
            ends = np.where(moves, moment.target - edge, moment.plays)
            begins = np.where(moves, moment.current - edge, moment.plays)
            held = float(ends.mean())
            fast = float((begins - ends).mean())
        if self._eddy == 0:
            return held, fast, 0.0
        fast *= self._coil / (self._coil - self._eddy)
        return held, fast, moment.effective - held - fast

    def _value(
        self, since: FloatArray, held: float, fast: float, slow: float
    ) -> FloatArray:
        return held + fast * decay(since, self._coil) + slow * decay(since, self._eddy)


def lag_knots(coil: float, eddy: float = 0.0) -> FloatArray:
    """Times after a step at which its answer through two lags bends, s.

    A chord of length l deviates by l^2 |f''|/8, so knots are spaced such that each
    chord deviates by `ACCURACY` of the step, also while a quarter of such a step is
    still under way, and no farther apart than `LONGEST` until it is `OVER`.

    Args:
        coil: first lag, s.
        eddy: second lag, s, another one; either may be 0.
    """
    slowest = max(coil, eddy)
    if slowest == 0:
        return np.zeros(1)
    end = -math.log(OVER) * slowest
    time = np.concatenate([np.zeros(1), np.geomspace(slowest * 1e-4, end, 4000)])
    if coil == 0 or eddy == 0:
        bend = 1.25 * np.exp(-time / slowest) / slowest**2
    else:
        fast = decay(time, coil) / (coil * (eddy - coil))
        slow = decay(time, eddy) / (eddy * (eddy - coil))
        bend = np.maximum(np.abs(fast - slow), np.abs(fast - 1.25 * slow))
    density = np.maximum(np.sqrt(bend / (8 * ACCURACY)), 1 / (LONGEST * slowest))
    count = np.concatenate(
        [np.zeros(1), np.cumsum(np.diff(time) * (density[1:] + density[:-1]) / 2)]
    )
    knots = np.linspace(0, count[-1], math.ceil(count[-1]) + 1)
    return np.asarray(np.interp(knots, count, time))


def _evening(knots: FloatArray, *decays: tuple[float, float]) -> FloatArray:
    """What to add at the knots that chords of decays, size and lag, come no later."""
    lasts = np.diff(knots)
    beyond = [excess(knots[:-1], lasts, size, lag) for size, lag in decays]
    return evening(lasts, np.sum(beyond, axis=0))
