"""T1 that saturates: V_C2 acts back on V_C1, and the circuit falls silent again."""

import csv
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tactile_lab.errors import SolverError
from tactile_lab.model.advance import advance, rest
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import T1_currents, V_C1_slope, rest_point
from tactile_lab.model.simulate import simulate
from tactile_lab.model.state import Start
from tactile_lab.validation.honesty import Case, compare, saturated_case
from tactile_lab.waveform import Waveform

SENSOR = Circuit(saturation=True)
FORCE = Waveform.through([(0, 0), (0.05, 0), (0.05, 0.2), (0.2, 0.15), (0.3, 0.32)])
CIRCUITS = (
    SENSOR,
    Circuit(saturation=True, firing="put"),
    Circuit(saturation=True, t_eps=0.01, V_reset=1.0),
)


def step(level, at=0.02):
    return Waveform.through([(0, 0), (at, 0), (at, level)])


@pytest.mark.parametrize(
    ("circuit", "force", "until", "start"),
    [
        (SENSOR, step(0.2), 0.09, None),
        (SENSOR, step(0.35), 0.03, None),
        (CIRCUITS[1], step(0.17), 0.09, None),
        (SENSOR, step(0.1), 3e-3, Start(V_P=0.0, V_C1=0.0, V_C2=0.4)),
    ],
    ids="saturates collapses put cold".split(),
)
def test_errors_are_below_the_estimate(circuit, force, until, start):
    found = compare(Case(0, circuit, force, until, start, 1e-9), samples=8)
    assert found.honest, found
    assert found.V_C1_estimate < 1e-9
    assert found.spike_time_estimate < 1e-9


def test_a_random_scene_has_errors_below_the_estimate():
    found = compare(saturated_case(4), samples=6)
    assert found.honest, found


def test_a_spike_takes_ten_steps():
    found = simulate(SENSOR, step(0.2, at=0.05), until=0.3)
    assert found.spike_times.size == 7
    assert found.stages["V_C1"] <= 10 * found.spike_times.size


def test_a_stiff_step_grows():
    found = simulate(SENSOR, step(1.0), until=0.2)
    assert found.spike_times.size == 0
    assert found.stages["V_C1"] < 200


def test_a_long_step_under_a_rising_force_misses_rounding_alone():
    rising = Waveform.through([(0, 0), (1, 0.1)])
    found = simulate(SENSOR, rising, until=1.0, tolerance=1e-13)
    assert found.stages["V_C1"] <= 15
    assert found.error.V_C1 < 4e-14


def spice_rows():
    with Path(__file__).with_name("saturation.csv").open() as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("netlist", ["t1", "complete"])
def test_rates_agree_with_transistors_in_ngspice(netlist):
    compared = silenced = 0
    for row in spice_rows():
        if row["netlist"] != netlist:
            continue
        circuit = Circuit(
            saturation=True, firing=row["firing"], C2=float(row["C2_F"]),
            V_GS=float(row["V_GS_V"]), tau=float(row["tau_s"]),
        )  # fmt: skip
        force = Waveform.through([(0, 0), (0.1, 0), (0.11, float(row["force_N"]))])
        spikes = simulate(circuit, force, until=float(row["until_s"])).spike_times
        if float(row["highest_Hz"]) > 0:
            rate = np.max(1 / np.diff(spikes))
            assert rate == pytest.approx(float(row["highest_Hz"]), rel=0.03), row
            compared += 1
        elif float(row["force_N"]) > 0.13:
            assert spikes.size == 0, row
            silenced += 1
    assert compared >= 10
    assert silenced >= 4


PUSH = Waveform.through([(0, 0), (0.02, 0), (0.02, 0.205), (0.15, 0.205), (0.25, 0)])


@pytest.fixture(scope="module")
def highest():
    """The highest V_C2 under PUSH without a spike, V; T1 saturates on the way."""
    found = simulate(
        Circuit(saturation=True, V_th=10.0), PUSH, until=0.4, keep=("V_C2",)
    )
    low, high = 0.02, 0.4
    for _ in range(40):
        times = np.linspace(low, high, 201)
        V = found.sample("V_C2", times)
        k = int(np.argmax(V))
        low, high = times[max(k - 1, 0)], times[min(k + 1, 200)]
    assert 2.0 < V[k] < 4.5 and 0.1 < times[k] < 0.39
    return float(V[k])


@pytest.mark.parametrize("gap", [1e-3, 1e-6, 1e-10, -1e-10, -1e-6])
def test_a_spike_that_only_just_happens_or_not_is_decided(highest, gap):
    circuit = Circuit(saturation=True, V_th=highest * (1 - gap))
    found = simulate(circuit, PUSH, until=0.4)
    assert (found.spike_times.size > 0) == (gap > 0)
    assert np.isfinite(found.end.error_V_C2)


def test_what_cannot_be_decided_is_said(highest):
    found = simulate(Circuit(saturation=True, V_th=highest), PUSH, until=0.4)
    assert any("cannot be decided" in text for text in found.warnings)
    assert np.isfinite(found.error.spike_time)
    assert np.isfinite([found.end.V_C1, found.end.V_C2, found.end.error_V_C2]).all()


def test_rest_is_an_equilibrium_of_both_voltages():
    V_C1, V_C2 = rest_point(SENSOR)
    I_C, I_B = T1_currents(SENSOR, V_C1, V_C2)
    assert I_C == pytest.approx(V_C2 / SENSOR.R_L, rel=1e-12)
    assert V_C1_slope(SENSOR, 0.0, V_C1) == pytest.approx(-I_B / SENSOR.C1, rel=1e-5)


def test_the_rate_peaks_and_the_circuit_falls_silent_under_more_force():
    calm = {"tau": 1e9}
    rates = [
        simulate(Circuit(saturation=True, **calm), step(F), until=0.6).spike_times.size
        for F in (0.09, 0.13, 0.17, 0.2, 0.24, 0.4)
    ]
    assert rates[0] == 0 < rates[1] < rates[2] > rates[3] > rates[4] == rates[5] == 0
    assert simulate(Circuit(**calm), step(0.4), until=0.6).spike_times.size > 40


def test_far_from_saturation_it_is_the_cascade_with_a_base_current():
    force, until = step(0.12), 0.5
    ideal = Circuit(saturation=True, beta_F=1e12)
    with_junction = simulate(ideal, force, until=until)
    without = simulate(Circuit(), force, until=until)
    # what remains is the collector junction's leakage, 2e-7 of the current
    assert with_junction.spike_times == pytest.approx(without.spike_times, rel=1e-6)


@settings(max_examples=20)
@given(
    st.sampled_from(CIRCUITS),
    st.lists(st.floats(0, 0.4), max_size=8),
)
@example(CIRCUITS[2], [0.1171875])
def test_any_slicing_gives_the_same_spikes_and_state(circuit, cuts):
    whole = simulate(circuit, FORCE, until=0.4, tolerance=1e-11)
    state, spikes = rest(circuit), []
    for until in [*sorted(cuts), 0.4]:
        state = pickle.loads(pickle.dumps(state))
        solved = advance(circuit, state, FORCE, until, tolerance=1e-11)
        state = solved.after
        spikes.extend(solved.spike_times)
    assert len(spikes) == whole.spike_times.size == state.spikes > 0
    assert np.max(np.abs(np.array(spikes) - whole.spike_times)) < 1e-12
    assert abs(state.V_C1 - whole.end.V_C1) < 1e-11
    assert abs(state.V_C2 - whole.end.V_C2) < 1e-10


@pytest.mark.parametrize("circuit", CIRCUITS)
def test_waveforms_meet_at_spikes_and_give_the_currents(circuit):
    keep = ("spikes", "V_C1", "V_C2", "I_C")
    found = simulate(circuit, FORCE, until=0.4, keep=keep)
    at = found.spike_times
    assert found.sample("V_C2", at - 1e-9) == pytest.approx(
        circuit.fire_voltage, abs=1e-5
    )
    after = at + circuit.reset_time
    after = after[after < 0.399]
    assert found.sample("V_C2", after + 1e-9) == pytest.approx(
        circuit.reset_voltage, abs=1e-5
    )
    times = np.linspace(0, 0.4, 301)
    V_C1, V_C2 = found.sample("V_C1", times), found.sample("V_C2", times)
    assert found.sample("I_C", times) == pytest.approx(
        T1_currents(circuit, V_C1, V_C2)[0]
    )


def test_v_c1_alone_still_needs_v_c2():
    found = simulate(SENSOR, FORCE, until=0.2, keep=("V_C1",))
    both = simulate(SENSOR, FORCE, until=0.2, keep=("V_C1", "V_C2"))
    times = np.linspace(0, 0.2, 101)
    assert np.array_equal(found.sample("V_C1", times), both.sample("V_C1", times))
    assert "V_C2" not in found.left_out
    assert found.stages["V_C2"] > 0
    only_V_P = simulate(SENSOR, FORCE, until=0.2, keep=("V_P",))
    assert only_V_P.stages["V_C1"] == only_V_P.stages["V_C2"] == 0


def test_it_does_not_warn_of_what_it_shows():
    assert not simulate(SENSOR, step(0.2), until=0.3).warnings
    assert any(
        "saturat" in text for text in simulate(Circuit(), step(0.3), until=0.3).warnings
    )


def test_spikes_too_fast_are_refused():
    with pytest.raises(SolverError, match="Spikes follow"):
        simulate(Circuit(saturation=True, V_reset=3.213 - 1e-12), step(0.15), until=0.4)


def test_the_page_says_where_more_force_silences_the_circuit():
    page = Path(__file__).parents[2] / "docs/saturation.md"
    rows = re.findall(
        r"^\| (T1 a|complete).*?\| (.*) \|$", page.read_text("utf-8"), re.M
    )
    assert len(rows) == 2
    for (_, cells), firing, junctions in zip(
        rows, ("lif", "put"), (5e-12, 11e-12), strict=True
    ):
        forces = [float(cell.removesuffix(" mN")) / 1e3 for cell in cells.split(" | ")]
        for force, (tau, hold) in zip(
            forces[:2], ((1e9, 2.0), (8.69, 1.0)), strict=True
        ):
            circuit = Circuit(
                saturation=True, firing=firing, tau=tau, C2=150e-12 + junctions
            )
            counts = [
                simulate(
                    circuit,
                    Waveform.through([(0, 0), (0.1, 0), (0.11, F)]),
                    until=0.11 + hold,
                ).spike_times.size
                for F in (force - 1e-3, force)
            ]
            assert counts[0] > 0 == counts[1], (firing, force)
