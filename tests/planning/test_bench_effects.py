"""Followers and lags are the bench's: plan, model and world know the same of them."""

import re

import numpy as np
import pytest

from sim_backend.bench import options, plant_of
from tactile_lab.engine.execution import Execution
from tactile_lab.planning import timeline
from tactile_lab.planning.plan import plan, text
from tactile_lab.report.findings import find
from tactile_lab.report.from_run import read
from tactile_lab.scene.load import load


def test_the_world_is_as_the_bench_says_unless_it_deviates():
    scene = load("demo")
    world = options(scene)
    assert (world.bias, world.coil_lag, world.eddy_lag) == (65e-12, 1.1e-3, 3e-3)
    assert scene.circuit.I_bias == 65e-12
    assert plant_of(scene).circuit == scene.circuit
    off = load(
        "demo",
        {
            "simulated.deviation": {
                "V_GS": 2e-3, "input_bias": 30e-12, "R1": 0.02, "force": -0.03,
                "lag": 4e-3,
            }
        },
    )  # fmt: skip
    true = plant_of(off)
    assert true.circuit.V_GS == pytest.approx(1.402)
    assert true.circuit.I_bias == pytest.approx(95e-12)
    assert true.circuit.R1 == pytest.approx(9.58e6 * 1.02)
    assert true.options.eddy_lag == pytest.approx(7e-3)
    assert true.options.force == pytest.approx(0.97)
    assert off.circuit == scene.circuit  # nobody told the model


def test_the_force_of_a_plan_lags_behind_its_current():
    quick = load("demo", {"bench.magnet.eddy_lag": 0.0, "bench.magnet.coil_lag": 0.0})
    late = plan(load("demo"), preview=False).timeline.force
    ideal = plan(quick, preview=False).timeline.force
    # whatever the steps of the first ramp, the hold after it comes as much later
    behind = (ideal.integral(1.2) - late.integral(1.2)) / 0.08
    assert behind == pytest.approx(4.1e-3, rel=1e-3)


def test_stairs_without_end_are_planned_as_their_ramp(monkeypatch):
    """The plan of a ramp of three hours took 1.1 GB."""
    monkeypatch.setattr(timeline, "MOST_BENDS", 2000)
    force = plan(load("demo"), preview=False).timeline.force
    early, late = force.at(np.array([0.1, 13.6])) / (0.32 * 0.1, 0.8 * 0.1)
    assert early < 0.7  # an interval and a half behind
    assert late == pytest.approx(1 - 4.1e-3 / 0.1, rel=0.01)


def test_a_scene_of_before_still_says_what_it_said():
    old = load("demo", ["simulated.input_bias=10 pA", "simulated.eddy_lag=5 ms"])
    assert old.bench.followers.input_bias == pytest.approx(10e-12)
    assert old.bench.magnet.eddy_lag == 5e-3
    assert options(old).bias == pytest.approx(10e-12)
    ideal = load(
        "demo", {"simulated.follower": False, "simulated.follower_offset": 1e-3}
    )
    assert options(ideal).follower is False
    assert options(ideal).offset == 1e-3


def test_a_sensor_alone_has_no_follower():
    assert load("demo").sensor_alone.circuit.I_bias == 0.0


def test_the_model_beside_a_run_is_planned_and_can_be_left_out(tmp_path):
    with_it = plan(load("demo"), preview=False)
    assert "model beside the run" in dict(with_it.uses)
    scene = load(
        "v_c1_only",
        {"record.compare": False, "protocol.levels": (0.1,), "protocol.hold": 0.3,
         "protocol.rest": 0.1, "record.sample_rate": 20e3},
    )  # fmt: skip
    without = plan(scene, preview=False)
    assert dict(without.leaves_out)["model beside the run"] == "record.compare = false"
    data = read(Execution(scene, tmp_path).run().folder)
    assert find(data).beside is None


def test_a_plan_tells_its_numerical_error_and_what_a_signal_costs():
    told = text(plan(load("demo")))
    assert re.search(r"numerics +spike times within .* by the solver's own", told)
    assert re.search(r'no V_C2 +3.94 MB of disk and .* without "V_C2" in record', told)
    assert re.search(r"no model beside the run .* record.compare = false", told)


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({}, None),
        ({"simulated.hum": "5 mV"}, "by its noise and hum, and 5 are needed"),
        ({"simulated.hum": "2 mV"}, "noise and hum of the shunt date"),
        ({"protocol.levels": ["20 mN"]}, "shows 0 of the source's steps, which are"),
        ({"coil.way": "list", "simulated.hum": "20 mV"}, None),
    ],
)
def test_a_plan_foresees_where_the_shunt_dates_no_steps(changes, told):
    """Edges that hum hides, or that are smaller than two codes, left ±45 ms unsaid."""
    scene = {"protocol.levels": ["120 mN"], "protocol.hold": "0.2 s", **changes}
    said = [line for line in plan(load("demo", scene)).assumptions if "clocks" in line]
    assert [told in line for line in said] == ([] if told is None else [True])
