"""Rate against force: measured points beside Eq. (15), and the force of onset."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tactile_lab.analysis.estimate import Estimate, Line
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.magnetics import ForceUncertainty
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import I_C, rest_V_C1


@dataclass(frozen=True)
class Onset:
    """The critical force lies between these two, N."""

    silent: float
    fires: float

    @property
    def middle(self) -> float:
        """Middle of the bracket, N."""
        return (self.silent + self.fires) / 2

    @property
    def half_width(self) -> float:
        """Half the bracket, N."""
        return (self.fires - self.silent) / 2


def eq15_rate(circuit: Circuit, force: float, ramp: float = 0.0) -> float:
    """Rate that a constant current gives, Eq. (15), at the end of a ramp, Hz.

    I_C is taken at the equilibrium of node A for the V_P that a linear ramp of `ramp` s
    to `force` N leaves; Eq. (15) knows no adaptation, so a measured rate lies below.
    0 where the current never charges C2 to the threshold.
    """
    V_P = circuit.k_F * force
    if ramp > 0:
        V_P *= -math.expm1(-ramp / circuit.tau) * circuit.tau / ramp
    current = float(I_C(circuit, rest_V_C1(circuit, V_P))) + circuit.I_bias
    target = circuit.R_L * current
    if target <= circuit.fire_voltage:
        return 0.0
    charge = math.log(
        (target - circuit.reset_voltage) / (target - circuit.fire_voltage)
    )
    return 1.0 / (circuit.reset_time + circuit.tau_L * charge)


def mean_slope(
    forces: Sequence[float],
    rates: Sequence[float],
    uncertainty: ForceUncertainty | None = None,
) -> Estimate:
    """Slope of the straight line through rates above onset, Hz/N.

    Its interval holds the scatter about the line, which is the curve's own bend where
    there is no noise, and the force's uncertainty if given: the absolute part strikes
    each force on its own, the relative part all alike.

    Args:
        forces: N, of trials that fired.
        rates: Hz.
        uncertainty: of the forces.

    Raises:
        NotIdentifiableError: fewer than 3 different forces.
    """
    force, rate = np.asarray(forces, float), np.asarray(rates, float)
    fired = np.unique(force).size
    if fired < 3:
        raise NotIdentifiableError(
            f"{fired or 'no'} force{'s' * (fired > 1)} made it fire, 3 are needed for "
            "a slope"
        )
    line = Line.through(force, rate)
    if uncertainty is None:
        return line.slope
    steep = abs(line.slope.value)
    single = steep * uncertainty.absolute / math.sqrt(line.spread)
    return line.slope.widened(single, steep * uncertainty.relative)


def onset(forces: Sequence[float], spikes: Sequence[int]) -> Onset:
    """Bracket of the critical force from trials that each started from rest.

    Args:
        forces: N.
        spikes: number of spikes at each force.

    Raises:
        NotIdentifiableError: all fire, none fires, or a larger force was silent.
    """
    fired = np.array(spikes) > 0
    levels = np.array(forces, dtype=np.float64)
    if not fired.any():
        raise NotIdentifiableError("no force made the sensor fire")
    if fired.all():
        raise NotIdentifiableError("every force made the sensor fire")
    lowest = float(levels[fired].min())
    below = levels[~fired]
    if below.max() >= lowest:
        raise NotIdentifiableError(
            f"{below.max() * 1e3:g} mN silent though {lowest * 1e3:g} mN fired: not at "
            "rest, or a drift"
        )
    return Onset(float(below.max()), lowest)
