"""Any slicing gives the same answer, and the state can be put away."""

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tactile_lab.errors import ParameterError
from tactile_lab.model import slices
from tactile_lab.model.advance import advance, rest
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import ErrorEstimate, simulate
from tactile_lab.waveform import Waveform

FORCE = Waveform.through(
    [(0, 0), (0.1, 0), (0.1, 0.2), (0.4, 0.15), (0.4 + 1e-12, 0.3), (0.8, 0)]
)
CIRCUITS = (Circuit(), Circuit(firing="put"), Circuit(t_eps=0.01, V_reset=1.0))


def sliced(circuit, cuts, end, known_until_now=False, through_pickle=False):
    state, spikes = rest(circuit), []
    for until in [*cuts, end]:
        force = FORCE
        if known_until_now:
            inside = FORCE.time <= until
            force = Waveform(
                np.append(FORCE.time[inside], until + 1.0),
                np.append(FORCE.value[inside], FORCE.at(until)),
            ) if until in FORCE.time else FORCE  # fmt: skip
        if through_pickle:
            state = pickle.loads(pickle.dumps(state))
        solved = advance(circuit, state, force, until)
        state = solved.after
        spikes.extend(solved.spike_times)
    return state, np.array(spikes)


@settings(max_examples=40)
@given(
    st.sampled_from(CIRCUITS),
    st.lists(st.floats(0, 1.2), max_size=12),
    st.booleans(),
)
def test_any_slicing_gives_the_same_spikes_and_state(circuit, cuts, through_pickle):
    whole = simulate(circuit, FORCE, until=1.2, keep=("spikes", "V_C1", "V_C2"))
    state, spikes = sliced(circuit, sorted(cuts), 1.2, through_pickle=through_pickle)
    assert spikes.size == whole.spike_times.size == state.spikes
    assert np.max(np.abs(spikes - whole.spike_times), initial=0) < 1e-12
    assert abs(state.V_C1 - whole.end.V_C1) < 1e-11
    assert abs(state.V_C2 - whole.end.V_C2) < 1e-9


@pytest.mark.parametrize("circuit", CIRCUITS)
def test_cuts_at_the_spikes_themselves(circuit):
    whole = simulate(circuit, FORCE, until=1.2).spike_times
    cuts = np.sort(np.concatenate([whole, whole + circuit.reset_time]))
    _, spikes = sliced(circuit, cuts, 1.2)
    assert spikes == pytest.approx(whole, abs=1e-12)


def test_what_is_known_later_does_not_matter_now():
    cuts = [0.1, 0.3, 0.4, 0.8]
    _, spikes = sliced(Circuit(), cuts, 1.2, known_until_now=True)
    assert spikes == pytest.approx(
        simulate(Circuit(), FORCE, until=1.2).spike_times, abs=1e-12
    )


def test_a_jump_counts_once_whatever_slice_it_falls_into():
    force = Waveform.through([(0, 0), (0.5, 0), (0.5, 0.1), (1, 0.1)])
    state = advance(Circuit(), rest(Circuit()), force, 0.5).after
    assert state.V_P == pytest.approx(0.1 * Circuit().k_F)
    again = advance(Circuit(), state, force, 0.5).after
    assert again.V_P == state.V_P


def test_slices_sample_as_the_whole_does():
    times = np.linspace(0.3, 0.9, 501)
    keep = ("V_C1", "V_C2", "V_K", "rate", "I_C", "V_P")
    circuit = Circuit(firing="put")
    whole = simulate(circuit, FORCE, until=1.2, keep=keep)
    before = advance(circuit, rest(circuit), FORCE, 0.3, keep=keep).after
    solved = advance(circuit, before, FORCE, 0.9, keep=keep)
    for signal in keep:
        scale = np.max(np.abs(whole.sample(signal, times)))
        gap = np.abs(solved.sample(signal, times) - whole.sample(signal, times))
        assert np.max(gap) < 1e-8 * scale, signal


def test_a_state_without_v_c2_cannot_go_on_with_it():
    state = advance(Circuit(), rest(Circuit()), FORCE, 0.5, keep=("V_C1",)).after
    with pytest.raises(ParameterError, match="same signals"):
        advance(Circuit(), state, FORCE, 0.6)


def test_time_does_not_run_backwards():
    with pytest.raises(ParameterError, match="until"):
        advance(Circuit(), rest(Circuit(), time=2.0), FORCE, 1.0)


@pytest.mark.parametrize("circuit", [*CIRCUITS, Circuit(saturation=True)])
def test_a_long_force_is_solved_in_slices_as_at_once(circuit, monkeypatch):
    monkeypatch.setattr(slices, "POINTS", 100)
    time = np.linspace(0, 1.2, 400)
    force = Waveform.stairs(np.column_stack([time, FORCE.at(time)]), 1.3)
    keep, at = ("spikes", "V_C1", "V_C2", "V_K"), np.linspace(0, 1.3, 700)[::-1]
    whole = simulate(circuit, force, until=1.3, keep=keep)
    spikes, errors = [], []
    taken = {name: slices.Samples(name, at, 1.3) for name in ("V_C1", "V_C2", "V_K")}
    for part in slices.slices(circuit, force, until=1.3, keep=keep):
        spikes.extend(part.spike_times)
        errors.append(ErrorEstimate.of(part))
        for samples in taken.values():
            samples.take(part)
    assert len(errors) > 5
    assert spikes == pytest.approx(whole.spike_times, abs=1e-14)
    assert ErrorEstimate.largest(errors) == pytest.approx(whole.error, rel=1e-6)
    for name, samples in taken.items():
        assert samples.value == pytest.approx(whole.sample(name, at), abs=1e-12), name


def test_slices_have_nothing_beyond_their_end():
    samples = slices.Samples("V_C1", np.array([0.5, 1.3]), 1.2)
    with pytest.raises(ParameterError, match="within"):
        for part in slices.slices(Circuit(), FORCE, until=1.2, keep=("V_C1",)):
            samples.take(part)
