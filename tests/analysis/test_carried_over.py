"""Trials that do not begin from rest are told, and what is left in the film."""

import re

import numpy as np
import pytest

from tactile_lab.analysis.carried_over import Begun, carried_over
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

PULSE = {"ramp": 0.25, "hold": 2.0}


def newtons(said: str) -> list[float]:
    """The forces of a sentence, N."""
    units = {"mN": 1e-3, "N": 1.0}
    found = re.findall(r"([−\d.]+) (mN|N)\b", said)
    return [float(value.replace("−", "-")) * units[unit] for value, unit in found]


@pytest.mark.parametrize("ramp", [0.25, 0.0])
def test_what_is_left_is_what_the_model_has_in_its_film(ramp):
    circuit, first = Circuit(), Waveform.pulse(0.15, **PULSE, rest=2.0)
    start = first.end
    force = first.then(Waveform.pulse(0.2, ramp=ramp, hold=2.0))
    said = carried_over(
        circuit, force, [Begun("a", 0.0, 0.15), Begun("second", start, 0.2)]
    )
    assert said is not None and said.startswith("1 of 2 trials") and "second" in said
    film = simulate(circuit, first, keep=("V_P",)).sample("V_P", [start])[0]
    left, acts = newtons(said)
    assert left == pytest.approx(film / circuit.k_F, rel=0.05)
    assert acts == pytest.approx(0.2 + film / circuit.k_F, rel=0.005)
    more = float(re.search(r"([\d.]+) s more", said)[1])
    rested = simulate(
        circuit, Waveform.pulse(0.15, **PULSE, rest=2.0 + more), keep=("V_P",)
    )
    (then,) = rested.sample("V_P", [first.end + more])
    assert abs(then / circuit.k_F) == pytest.approx(0.01 * 0.2, rel=0.06)


@pytest.mark.parametrize(
    ("force", "second"),
    [
        (Waveform.pulse(0.15, ramp=0.25, hold=2.0, rest=60.0), 62.5),
        (Waveform.stairs(np.array([[0.0, 0.1], [5.0, 0.2]]), 10.0), 5.0),
    ],
)
def test_nothing_is_told_of_a_trial_from_rest_nor_of_a_stair(force, second):
    trials = [Begun("a", 0.0, 0.1), Begun("b", second, 0.2)]
    assert carried_over(Circuit(), force, trials) is None


def test_a_film_that_no_force_charges_remembers_none():
    force = Waveform.pulse(0.15, **PULSE, rest=2.0).then(Waveform.pulse(0.2, **PULSE))
    trials = [Begun("a", 0.0, 0.15), Begun("b", 4.5, 0.2)]
    assert carried_over(Circuit(g31=0.0), force, trials) is None
