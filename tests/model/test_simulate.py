"""The paper's circuit does what the equations say, and refuses nonsense."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numba import float64

from tactile_lab.errors import ParameterError
from tactile_lab.model import kernel
from tactile_lab.model.advance import advance, rest
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import I_C, rest_V_C1, rest_V_C2
from tactile_lab.model.simulate import simulate
from tactile_lab.model.state import Start
from tactile_lab.waveform import Waveform

SANITY = Waveform.through([(0, 0), (1, 0), (1.01, 0.15), (11, 0.15), (11.01, 0)])


def test_rest_point_is_the_one_of_table_1():
    circuit = Circuit()
    V_C1 = rest_V_C1(circuit)
    assert V_C1 == pytest.approx(4.347038, abs=5e-7)
    assert float(I_C(circuit, V_C1)) == pytest.approx(2.896e-9, rel=2e-4)
    assert rest_V_C2(circuit, V_C1) == pytest.approx(1.448, abs=5e-4)


def test_150_millinewton_gives_the_known_spikes():
    result = simulate(Circuit(), SANITY, until=13.0)
    assert result.spike_times.size == 37
    assert result.spike_times[0] == pytest.approx(1.0533804034882868, abs=1e-8)
    assert result.spike_times[-1] == pytest.approx(4.933638227816434, abs=1e-8)


def test_whole_numbers_of_seconds_run_the_code_there_is():
    simulate(Circuit(), SANITY, until=2)
    advance(Circuit(), rest(Circuit(), time=0, force=0), SANITY, np.float32(0.5))
    assert {signature[2] for signature in kernel.run.signatures} == {float64}


def test_slices_give_the_spikes_of_the_whole():
    whole = simulate(Circuit(), SANITY, until=3.0).spike_times
    state, spikes = rest(Circuit()), []
    for until in np.arange(0.25, 3.01, 0.25):
        solved = advance(Circuit(), state, SANITY, until)
        state = solved.after
        spikes.extend(solved.spike_times)
    assert spikes == pytest.approx(whole, abs=1e-8)


def test_spikes_that_are_kept_keep_nothing_else():
    """A view of them kept all rows of the solution, 200 MB in ten minutes."""
    force = Waveform([0.0, 0.1], [0.0, 0.18])
    spikes = simulate(Circuit(), force, keep=("V_C1", "spikes"), until=1.0).spike_times
    assert spikes.size and spikes.base is None


def test_stages_nothing_asks_for_are_left_out():
    result = simulate(Circuit(), SANITY, until=2.0, keep=("V_C1",))
    assert result.spike_times is None
    assert result.error.spike_time is None
    assert result.stages["V_C1"] > 0
    assert result.stages["V_C2"] == result.stages["spikes"] == 0
    assert "V_C2" in result.left_out
    with pytest.raises(ParameterError, match="not kept"):
        result.sample("V_C2", np.array([1.0]))


@pytest.mark.parametrize(
    "wrong",
    [
        {"C1": 0.0}, {"C1": float("nan")}, {"R3": -1.0}, {"V_GS": float("inf")},
        {"V_reset": 4.0}, {"t1": "base"}, {"firing": "x"}, {"saturation": 1},
        {"t_eps": -1.0}, {"R_k": -1.0}, {"d": 1.0}, {"C2": 1e-200}, {"m": True},
    ],
)  # fmt: skip
def test_impossible_parameters_are_named(wrong):
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        Circuit(**wrong)


@pytest.mark.parametrize(
    "options",
    [
        {"tolerance": 1e-30}, {"tolerance": float("nan")}, {"until": -1.0},
        {"until": float("inf")}, {"keep": ("V_X",)},
        {"start": Start(V_P=0, V_C1=0, V_C2=4.0)},
        {"start": Start(V_P=float("nan"), V_C1=0, V_C2=0)},
    ],
)  # fmt: skip
def test_impossible_options_are_refused(options):
    with pytest.raises(ParameterError):
        simulate(Circuit(), SANITY, **options)


def test_a_circuit_hashes_alike_in_every_process():
    """Its hash is kept and pickled with it; that of a text differs from run to run."""
    code = "from tactile_lab.model.circuit import Circuit; print(hash(Circuit()))"
    told = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True,
        env=os.environ | {"PYTHONHASHSEED": "7"},
    ).stdout  # fmt: skip
    assert int(told) == hash(Circuit())
    assert hash(Circuit()) != hash(Circuit(tau=1.0))


def test_v_c2_is_held_at_v_fire_where_a_simulation_ends_within_a_reset():
    held = Circuit(t_eps=0.01)
    wave = Waveform.through([(0, 0), (0.01, 0.2)])
    at = simulate(held, wave, until=0.2).spike_times[0]
    found = simulate(held, wave, until=at + 0.005, keep=("spikes", "V_C2"))
    end = np.array([at + 0.005])
    assert found.sample("V_C2", end) == found.end.V_C2 == held.fire_voltage


@pytest.mark.parametrize("level", [4.0, 5.0, 10.0])
def test_a_force_that_holds_V_C1_down_by_a_huge_current_has_an_answer(level):
    """There its slope is rounding times a huge rate, and says nothing of a rise."""
    push = Waveform.pulse(level, ramp=0.01, hold=0.5, rest=1.0)
    found = simulate(Circuit(), push, keep=("V_C1", "spikes"))
    assert found.error.V_C1 < 1e-9
    assert found.sample("V_C1", np.array([0.3]))[0] < 1e-12
    loose = simulate(Circuit(), push, tolerance=1e-6)
    assert np.abs(found.spike_times - loose.spike_times).max() < 2e-6


def test_a_train_takes_one_search_a_spike():
    """It took 2.1: the next interval was not known from the last ones."""
    force = Waveform.through([(0, 0), (0.5, 0), (0.5, 0.27)])
    found = simulate(Circuit(), force, until=2.5, tolerance=1e-6)
    assert found.spike_times.size == 111
    assert found.stages["spikes"] < 1.7 * 111


def test_a_long_train_is_searched_several_spikes_at_a_time():
    """Each waited for the one before: 1.1 searches a spike."""
    force = Waveform.through([(0, 0), (0.5, 0), (0.5, 0.4)])
    found = simulate(Circuit(), force, until=2.5, tolerance=1e-6)
    assert found.spike_times.size == 175
    assert found.stages["spikes"] < 0.4 * 175
    # with a reset time, through a force that rises and falls, and cut into slices
    circuit = Circuit(firing="put")
    force = Waveform.through([(0, 0), (0.1, 0.2), (2, 0.25), (4, 0.1), (5, 0.3)])
    found = simulate(circuit, force, tolerance=1e-12)
    state, parts = rest(circuit), []
    for until in np.arange(0.03, 5.0, 0.03):  # of a spike or two: one by one
        solved = advance(circuit, state, force, until, tolerance=1e-12)
        state = solved.after
        parts.extend(solved.spike_times)
    whole = found.spike_times[: len(parts)]
    assert whole.size > 80
    assert np.abs(whole - parts).max() < 1e-11


def test_a_search_stops_where_the_estimate_ends():
    """It took 1.9 a spike, for digits that the estimate says are wrong."""
    force = Waveform.through([(0, 0), (5, 0), (5.01, 0.05), (105, 0.05)])
    found = simulate(Circuit(V_GS=1.54141), force, tolerance=1e-6)
    assert found.spike_times.size == 234
    assert found.stages["spikes"] < 1.2 * 234
