"""What many circuits do under a push: what a specification can ask for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model.batch import (
    certain,
    critical_forces,
    records,
    rests,
    spike_trains,
)
from tactile_lab.model.circuit import SATURATION_HEADROOM, Circuit
from tactile_lab.spikes.trains import Trains
from tactile_lab.studies.specification import Silence, Specification
from tactile_lab.waveform import Waveform

RAMP = 0.01
"""Of a push, s."""
FIRST = 1.0
"""Of a push: the time over which its rate is taken, s."""
THRESHOLD_HOLD = 3.0
"""Of a push that only just makes it spike, s: far beyond the integrator's time."""
HALVINGS = 10
"""Of the bracket of a threshold, one to four times the force of a tight film."""


def push(hold: float, force: float = 1.0) -> Waveform:
    """From nothing to `force` N within `RAMP`, and held, s."""
    return Waveform(np.array([0.0, RAMP, RAMP + hold]), np.array([0.0, force, force]))


@dataclass(frozen=True, eq=False)
class Behaviour:
    """Of n circuits; each attribute shape (n,).

    Attributes:
        threshold: the least force that makes it spike, N; NaN where none does.
        rate: mean rate of the first second, Hz; NaN below two spikes.
        silence: time from the push to the last spike, s; NaN without spikes.
        headroom: V_C1 above V_fire - 0.5 V at the strongest force, V.
        critical: force that would just keep it firing if the film did not leak, N.
    """

    threshold: FloatArray
    rate: FloatArray
    silence: FloatArray
    headroom: FloatArray
    critical: FloatArray


def behaviour(asked: Specification, changes: Mapping[str, FloatArray]) -> Behaviour:
    """What a specification asks about, of circuits with these parts; NaN for the rest.

    Raises:
        ParameterError: a circuit cannot be solved with such parts.
    """
    circuit, wants = asked.circuit, asked.wants
    size = next(iter(changes.values())).size
    none = np.full(size, np.nan)
    threshold = rate = silence = headroom = none
    if wants.threshold is not None:
        threshold = thresholds(circuit, changes)
    if wants.rate is not None:
        trains = _pushed(circuit, changes, wants.rate.force, FIRST)
        rate = trains.mean_rate
    if wants.silence is not None:
        hold = silence_hold(circuit, wants.silence)
        silence = _pushed(circuit, changes, wants.silence.force, hold).last
    if wants.unsaturated is not None:
        gate = changes.get("V_GS", np.full(size, circuit.V_GS))
        held = gate + wants.unsaturated.force * circuit.k_F
        many = records(circuit, {**changes, "V_GS": held})
        floor = many["fire_voltage"] - SATURATION_HEADROOM
        headroom = rests(circuit, many) - floor  # a leaking film pulls less than that
    critical = critical_forces(circuit, records(circuit, changes))
    return Behaviour(threshold, rate, silence, headroom, critical)


def silence_hold(circuit: Circuit, want: Silence) -> float:
    """How long a push is looked at for its last spike, s.

    Until the film has lost all but a 400th of it: what has no threshold below that
    stays silent from then on.
    """
    return 2 * want.value * (1 + want.within) + 6 * circuit.tau


def thresholds(circuit: Circuit, changes: Mapping[str, FloatArray]) -> FloatArray:
    """The least force that makes each spike, N, within 0.4 % above; NaN for none.

    Between the critical force of a film that does not leak, below which there is no
    spike, and four times that; by halving, all at once.
    """
    low = critical_forces(circuit, records(circuit, changes))
    usable = np.isfinite(low) & (low > 0)
    low = np.where(usable, low, 1e-3)
    high = 4 * low
    usable &= _fires(circuit, changes, high)
    for _ in range(HALVINGS):
        middle = np.sqrt(low * high)
        fires = _fires(circuit, changes, middle)
        low, high = np.where(fires, low, middle), np.where(fires, middle, high)
    return np.where(usable, high, np.nan)


def _fires(
    circuit: Circuit, changes: Mapping[str, FloatArray], force: FloatArray
) -> NDArray[np.bool_]:
    found: NDArray[np.bool_] = (
        _pushed(circuit, changes, force, THRESHOLD_HOLD).count > 0
    )
    return found


def _pushed(
    circuit: Circuit,
    changes: Mapping[str, FloatArray],
    force: FloatArray | float,
    hold: float,
) -> Trains:
    """Each under its own force, N: one waveform of 1 N, and films that much stronger.

    V_P is proportional to the force and to g31 alike.
    """
    g31 = changes.get("g31", circuit.g31)
    size = next(iter(changes.values())).size
    many = records(circuit, {**changes, "g31": np.full(size, g31 * force)})
    if not certain(circuit, many, None).all():
        raise ParameterError(
            "The parts that may be chosen reach beyond what a circuit can have; "
            "narrow least and most."
        )
    trains, _ = spike_trains(
        circuit, many, push(hold), until=RAMP + hold, keep_times=False, tolerance=1e-7
    )
    return trains
