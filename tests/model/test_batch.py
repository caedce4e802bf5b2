"""Many circuits at once: each to the last bit what it is alone."""

import numpy as np
import pytest

from tactile_lab import Circuit
from tactile_lab.errors import ParameterError
from tactile_lab.model.batch import certain, critical_forces, records, spike_trains
from tactile_lab.model.equations import critical_force
from tactile_lab.model.simulate import simulate
from tactile_lab.model.state import Start
from tactile_lab.waveform import Waveform


def push(level: float) -> Waveform:
    return Waveform(np.array([0, 0.1, 0.11, 1.0]), np.array([0, 0, level, level]))


PUSH = push(0.2)
COLD = Start(V_P=0.0, V_C1=0.0, V_C2=0.0)


def some(names: tuple[str, ...], count: int, part: float) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(7)
    return {
        name: getattr(Circuit(), name) * (1 + part * rng.standard_normal(count))
        for name in names
    }


@pytest.mark.parametrize(
    ("options", "level", "start"),
    [
        ({}, 0.2, None),
        ({}, 0.2, COLD),
        ({"firing": "put"}, 0.2, None),
        ({"t1": "direct", "I_T1s": 2.9e-20}, 0.03, None),
    ],
)
def test_a_batch_is_what_each_is_alone(
    options: dict, level: float, start: Start | None
) -> None:
    circuit, force = Circuit(**options), push(level)
    names = ("R1", "R_L", "R3", "C1", "C2", "V_GS", "V_th", "V_T", "h", "L", "m", "b")
    changes = some(names, 40, 0.03 if level > 0.1 else 1e-3)
    many = records(circuit, changes)
    assert certain(circuit, many, start).all()
    found, solved = spike_trains(circuit, many, force, until=1.0, start=start)
    counted, _ = spike_trains(
        circuit, many, force, until=1.0, start=start, keep_times=False
    )
    assert solved.all() and found.count.max() > 5
    assert np.array_equal(counted.count, found.count) and counted.times.size == 0
    assert np.array_equal(counted.last, found.last, equal_nan=True)
    forces = critical_forces(circuit, many)
    for i, spikes in enumerate(found.rows()):
        one = Circuit(**options, **{name: float(v[i]) for name, v in changes.items()})
        alone = simulate(one, force, start=start).spike_times
        assert np.array_equal(spikes, alone)
        assert np.array_equal(forces[i], critical_force(one), equal_nan=True)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("R1", -1.0), ("R1", 1e61), ("V_GS", np.nan), ("V_GS", -2e4), ("d", 1.0),
        ("C2", 1e-58), ("V_th", -1.0), ("R_k", -1.0), ("t_eps", -1e-6),
        ("V_fire", 2e4), ("V_reset", 4.0), ("h", 1e40), ("I_S", 0.0), ("C1", np.inf),
    ],
)  # fmt: skip
def test_what_a_circuit_refuses_is_not_certain(name: str, value: float) -> None:
    with pytest.raises(ParameterError):
        Circuit(**{name: value})
    circuit = Circuit()
    many = records(circuit, {name: np.array([value])})
    assert not certain(circuit, many, None).any()


def test_what_cannot_be_solved_is_told_apart_and_the_others_are_solved() -> None:
    circuit = Circuit()
    changes = {"g31": np.array([0.039, 5e9, 0.039]), "R1": np.array([9.58e6] * 3)}
    found, solved = spike_trains(circuit, records(circuit, changes), PUSH, until=1.0)
    assert solved.tolist() == [True, False, True]
    assert found.count[0] == found.count[2] > 0 == found.count[1]
    assert np.array_equal(found.rows()[0], found.rows()[2])
