"""Against the 40-digit reference: right spikes, and an honest error estimate."""

from decimal import Decimal

import numpy as np
import pytest

from tactile_lab.model.circuit import Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.model.state import Start
from tactile_lab.validation import honesty
from tactile_lab.validation.extremes import grazing
from tactile_lab.validation.honesty import Case, compare, random_case
from tactile_lab.validation.reference import constant_firing, reference
from tactile_lab.waveform import Waveform


@pytest.mark.parametrize("seed", [1, 2, 4, 5, 7, 104, 421])
def test_random_scenes_have_errors_below_the_estimate(seed):
    comparison = compare(random_case(seed), samples=15)
    assert comparison.honest, comparison


@pytest.mark.parametrize("seed", [209, 230])
def test_errors_that_cancel_over_a_train_are_not_summed_up(seed):
    # 80 and 40 spikes; the estimate was 105 and 109 times the true error
    row = compare(random_case(seed), samples=2)
    assert row.spike_time < row.spike_time_estimate < 60 * row.spike_time, row


def test_a_campaign_goes_on_where_it_was_stopped(tmp_path, monkeypatch):
    monkeypatch.setattr(honesty, "KINDS", {"cascade": random_case})
    first = honesty.campaign(2, tmp_path, print)
    monkeypatch.setattr(honesty, "compare", None)  # what is known is not measured again
    again = honesty.campaign(2, tmp_path, print)
    assert again == first
    # while our answer is the same, so is its error; its estimate may be another
    file = tmp_path / "honesty.csv"
    rows = [line.split(",") for line in file.read_text().splitlines()]
    changed = [[*row[:6], "7.0", row[7], "7.0"] for row in rows[1:]]
    file.write_text("\n".join(map(",".join, [rows[0], *changed])) + "\n")
    assert honesty.campaign(1, tmp_path, print)["cascade"] == first["cascade"][:1]
    after = [line.split(",") for line in file.read_text().splitlines()]
    assert after == [rows[0], rows[1], changed[1]], "what was not asked for stays"
    text = honesty.report(2, again | {"saturated": again["cascade"]})
    assert "2 of 2 (100.0%)" in text
    honesty.scatter(again, tmp_path / "honesty.svg")
    assert (tmp_path / "honesty.svg").stat().st_size > 1000
    (tmp_path / "honesty.csv").write_text("cascade,0,another solver,1,1,0,0,0,0\n")
    with pytest.raises(TypeError):
        honesty.campaign(1, tmp_path, print)


def test_a_call_undercuts_its_tolerance_by_less_than_it_did():
    """V_C1 at 1e-9: the estimate was below 1e-12, six digits for nothing."""
    force = Waveform.through([(0, 0), (0.01, 0.15)])
    found = simulate(Circuit(), force, until=2.0)
    assert 1e-12 < found.error.V_C1 < 1e-9
    assert found.solution.evaluations < 700


def error_of(circuit, force, until, start=None):
    times = np.linspace(0, until, 17)
    found = simulate(
        circuit, force, until=until, start=start, keep=("spikes", "V_C1", "V_C2"),
        tolerance=1e-13,
    )  # fmt: skip
    exact = reference(circuit, force, until, start=start, times=times.tolist())
    assert found.spike_times.size == len(exact.spike_times)
    spikes = [
        abs(float(Decimal(a) - b))
        for a, b in zip(found.spike_times.tolist(), exact.spike_times, strict=True)
    ]
    V_C1 = [
        abs(float(Decimal(a) - b))
        for a, b in zip(found.sample("V_C1", times).tolist(), exact.V_C1, strict=True)
    ]
    V_C2 = [
        abs(float(Decimal(a) - b))
        for a, b in zip(found.sample("V_C2", times).tolist(), exact.V_C2, strict=True)
    ]
    return max(spikes, default=0.0), max(V_C1), max(V_C2)


@pytest.mark.parametrize(
    ("circuit", "force", "until", "start"),
    [
        (Circuit(), Waveform.through([(0, 0), (0.1, 0), (0.1, 0.3)]), 0.2, None),
        (Circuit(), Waveform.through([(0.1, 0), (0.1 + 1e-12, 0.2)]), 0.4, None),
        (Circuit(firing="put"), Waveform.through([(0, 0), (0.01, 0.2)]), 0.4, None),
        (
            Circuit(t1="direct", I_T1s=2.873e-20),
            Waveform.through([(0, 0), (0.01, 0.03)]),
            0.02,
            None,
        ),
        (Circuit(), Waveform.constant(0), 0.3, Start(V_P=0.3, V_C1=0, V_C2=0)),
        (Circuit(C2=1.5e-12), Waveform.through([(0, 0), (1e-3, 0.2)]), 8e-3, None),
        (Circuit(tau=0.05), Waveform.through([(0, 0), (0.1, 0.4)]), 0.5, None),
        (Circuit(V_reset=-2.0, t_eps=3e-3), Waveform.through([(0, 0), (0, 0.2)]), 0.3,
         None),
    ],
    ids="jump ramp put direct cold fast decay reset".split(),
)  # fmt: skip
def test_errors_are_near_machine_precision(circuit, force, until, start):
    spike_time, V_C1, V_C2 = error_of(circuit, force, until, start)
    assert spike_time < 2e-14
    assert V_C1 < 1e-12
    assert V_C2 < 1e-10


@pytest.mark.parametrize("V_C1", [0.0, 0.1, 0.3, 0.4])
def test_a_change_over_before_the_first_node_is_in_the_estimate(V_C1):
    # exp(-V_C1/V_T) vanishes within 0.2 ms, a two-hundredth of the first step
    case = Case(
        0, Circuit(C1=4e-9), Waveform.constant(0), 0.03,
        Start(V_P=-0.15, V_C1=V_C1, V_C2=0.3), 1e-9,
    )  # fmt: skip
    comparison = compare(case)
    assert comparison.honest, comparison


@pytest.mark.parametrize(
    ("circuit", "until"),
    [(Circuit(C2=1e-15, V_GS=2.0), 0.01), (Circuit(V_GS=1.6), 1e4)],
)
def test_long_firing_keeps_time_to_the_last_digits(circuit, until):
    exact = constant_firing(circuit)
    found = simulate(circuit, Waveform.constant(0), until=until, keep=("statistics",))
    statistics = found.solution.statistics
    assert found.spike_times is None
    assert statistics.count == int(Decimal(until) / exact) > 1e5
    gap = abs(float(Decimal(statistics.last) - statistics.count * exact))
    assert gap <= found.error.spike_time < 1e-9
    assert statistics.mean_rate == pytest.approx(1 / float(exact), rel=1e-12)


@pytest.mark.parametrize("gap", [1e-6, 1e-12, -1e-12, -1e-6])
def test_a_spike_that_only_just_happens_or_not_is_decided(gap):
    found = simulate(**_grazing(gap))
    assert found.spike_times.size == (gap > 0)


@pytest.mark.parametrize("gap", [1e-9, 1e-12, -1e-12])
def test_the_reference_finds_a_spike_that_only_touches_the_threshold(gap):
    case = _grazing(gap)
    exact = reference(case["circuit"], case["force"], case["until"])
    assert len(exact.spike_times) == (gap > 0)
    found = simulate(**case)
    for ours, true in zip(found.spike_times, exact.spike_times, strict=True):
        assert abs(ours - float(true)) <= found.error.spike_time


def _grazing(gap):
    case = grazing(gap).problem
    return {"circuit": case.circuit, "force": case.force, "until": case.until}


def test_what_cannot_be_decided_is_said():
    found = simulate(**_grazing(1e-17))
    assert any("cannot be decided" in text for text in found.warnings)


def test_a_coarser_tolerance_takes_fewer_steps_and_says_so():
    force = Waveform.through([(0, 0), (0.01, 0.15)])
    fine = simulate(Circuit(), force, until=2.0, tolerance=1e-11)
    coarse = simulate(Circuit(), force, until=2.0, tolerance=1e-3)
    assert coarse.stages["V_C1"] < 0.7 * fine.stages["V_C1"]
    assert coarse.error.V_C1 > 10 * fine.error.V_C1
    gap = np.max(np.abs(coarse.spike_times - fine.spike_times))
    assert gap <= coarse.error.spike_time
