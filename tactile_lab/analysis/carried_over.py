"""What forces before leave in the film: trials that do not begin from rest.

V_P is a high-pass of force, Eq. (7): a force held for long leaves, once it is gone, a
V_P of the other sign that decays with τ. A trial that begins meanwhile gives other
spikes than the same trial from rest.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.film import Film
from tactile_lab.quantity import count, show
from tactile_lab.waveform import Waveform

LITTLE = 0.01
"""Part of a trial's own force below which it begins from rest."""


class Begun(NamedTuple):
    """A trial as it begins: its name, when, s, and the force it is about, N."""

    label: str
    start: float
    level: float


def carried_over(
    circuit: Circuit, force: Waveform, trials: Iterable[Begun]
) -> str | None:
    """A sentence on the trials that do not begin from rest; None where all do.

    Args:
        circuit: the sensor as it is believed to be.
        force: of the whole run, N against s.
        trials: in order; those that begin under a force are passed over.
    """
    late: list[tuple[float, float, Begun]] = []
    from_none = 0
    for trial, left in remembered(circuit, force, trials):
        share, from_none = abs(left / trial.level), from_none + 1
        if share > LITTLE:
            late.append((share, left, trial))
    if not late:
        return None
    share, left, worst = max(late, key=lambda one: one[0])
    return (
        f"{len(late)} of {count(from_none, 'trial')} do not begin from rest: as "
        f"{worst.label} begins at {show(worst.start, 's', 3)}, {show(left, 'N', 2)} of "
        f"the forces before are still in the film (Eq. (7), τ = "
        f"{show(circuit.tau, 's')}): at first it acts as "
        f"{show(worst.level + left, 'N', 3)} would from rest. "
        f"{show(circuit.tau * math.log(share / LITTLE), 's', 2)} more of rest would "
        f"leave {100 * LITTLE:g} % of its force."
    )


def remembered(
    circuit: Circuit, force: Waveform, trials: Iterable[Begun]
) -> Iterator[tuple[Begun, float]]:
    """Each trial that begins under no force, and what the film holds then, as N.

    At first it acts as its own force and that would from rest. Arguments as of
    `carried_over`.
    """
    if not circuit.k_F:
        return  # a film that no force charges remembers none
    film, at = Film(circuit), 0
    for trial in trials:
        until = int(np.searchsorted(force.time, trial.start))
        until += bool(trial.start in force.time[until : until + 1])  # before a jump
        if until > at + 1:
            begin = float(force.time[at])
            piece = Waveform(force.time[at:until] - begin, force.value[at:until])
            film.feels(piece, begin)
            at = until - 1  # the next piece goes on from this point
        if abs(film.force) <= LITTLE * abs(trial.level):  # no stair of the one before
            yield trial, film.V_P(trial.start) / circuit.k_F
