"""The plant: the physics behind all simulated instruments."""

import threading
from dataclasses import replace

import numpy as np
import pytest
from plant_world import (
    CHANNELS,
    FULL,
    IDEAL,
    MAGNET,
    QUIET,
    SHARP,
    SHIFT,
    newtons,
    plant,
    render,
    volts,
)

from sim_backend.plant.options import PlantOptions
from sim_backend.plant.plant import Plant
from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.scope import Channel


def test_at_rest_the_inputs_show_the_circuits_rest_point() -> None:
    codes = render(plant(IDEAL), 0.01)
    assert codes.dtype == np.int16 and codes.flags.c_contiguous
    assert volts(codes[0], CHANNELS[0]) == pytest.approx(4.347, abs=0.009)
    assert volts(codes[1], CHANNELS[1]) == pytest.approx(1.448, abs=0.009)
    assert not codes[2:].any()
    assert not np.any(codes % 256)


def test_the_followers_bias_lifts_the_integrator_by_32_millivolts() -> None:
    fine = Channel(signal="V_C2", input="B", range=2.0, offset=-1.7)
    rest = [
        volts(render(plant(o), 1e-3, channels=(fine,), shift=0)[0], fine).mean()
        for o in (IDEAL, PlantOptions(follower=False, noise=QUIET))
    ]
    assert rest[1] - rest[0] == pytest.approx(32.5e-3, abs=0.2e-3)


def test_force_makes_spikes_that_reset_the_integrator() -> None:
    made = plant(IDEAL)
    made.set_current(0.01, newtons(0.2))
    codes = render(made, 0.3, interval=1e-6)
    spikes = np.flatnonzero(np.diff((codes[2] > FULL // 10).astype(int)) == 1)
    assert spikes.size >= 3
    potential = volts(codes[1], CHANNELS[1])
    assert potential[spikes] == pytest.approx(3.213, abs=0.02)
    assert potential[spikes + 2] == pytest.approx(0.0, abs=0.02)
    height = volts(codes[2], CHANNELS[2])
    ideal = 3.213 * np.exp(-1 / 1.5)
    assert np.all(height[spikes + 1] > ideal - 0.04)
    # 1.5 us decay: the charge of each spike is that of C2
    area = np.mean([height[s : s + 30].sum() * 1e-6 for s in spikes])
    assert area == pytest.approx(3.213 * 1.5e-6, rel=0.3)


def test_output_off_drives_no_current() -> None:
    made = Plant(Circuit(), MAGNET, IDEAL)
    made.set_current(0.0, 1.0)
    assert made.coil_current(0.5) == 0.0
    made.output(1.0, True)
    assert made.coil_current(1.5) == 1.0
    assert made.coil_voltage(1.5) == pytest.approx(4.9, rel=0.01)
    assert made.field(1.5) == pytest.approx(0.011)
    assert made.force(1.5) == pytest.approx(MAGNET.newtons_per_ampere)
    made.output(2.0, False)
    assert made.coil_current(2.5) == 0.0


def test_passive_attraction_is_a_constant_that_drives_nothing() -> None:
    pulled = PlantOptions(follower=False, bias=0, noise=QUIET, attraction=0.011)
    made = plant(pulled)
    assert made.force(0.5) == pytest.approx(0.011)
    free = plant(PlantOptions(follower=False, bias=0, noise=QUIET))
    assert np.array_equal(render(made, 0.05), render(free, 0.05))


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"first_sample": -1}, "count from 0"),
        ({"n": 0}, "Cannot render 0"),
        ({"interval": 0.0}, "count from 0"),
        ({"full_scale": 40000}, "int16"),
        ({"channels": (Channel(signal="V_X", input="A", range=1.0),)}, "V_X"),
    ],
)
def test_impossible_requests_are_refused(change: dict[str, object], named: str) -> None:
    request: dict[str, object] = {
        "first_sample": 0, "n": 10, "interval": 1e-6, "started": 0.0,
        "channels": CHANNELS, "full_scale": FULL, "shift": SHIFT,
    }  # fmt: skip
    with pytest.raises(ParameterError, match=named):
        plant().render(**(request | change))  # type: ignore[arg-type]


def test_a_set_point_must_be_finite() -> None:
    with pytest.raises(ParameterError, match="finite"):
        plant().set_current(0.0, float("inf"))


def test_a_reset_that_takes_time_holds_the_integrator() -> None:
    options = PlantOptions(follower=False, bias=0, noise=QUIET, coil_lag=0, eddy_lag=0)
    made = Plant(Circuit(firing="put"), MAGNET, options)
    made.output(0.0, True)
    made.set_current(0.001, newtons(0.2))
    channels = (CHANNELS[1], CHANNELS[2])
    wide = (replace(channels[0], range=5.0, offset=0.0), channels[1])
    codes = render(made, 1.0, channels=wide, interval=1e-6, shift=0)
    spikes = np.flatnonzero(np.diff((codes[1] > FULL // 10).astype(int)) == 1) + 1
    assert spikes.size > 10
    potential = volts(codes[0], wide[0])
    for spike in spikes:
        assert potential[spike : spike + 7] == pytest.approx(np.full(7, 3.56), abs=2e-3)
        after = potential[spike + 9 : spike + 300]
        assert after == pytest.approx(np.full(after.size, 0.578), abs=0.1)


def test_many_threads_may_ask_at_once() -> None:
    made = plant(SHARP)
    failed: list[BaseException] = []

    def command() -> None:
        try:
            for k in range(200):
                made.set_current(k * 1e-3, 0.1 * (k % 3))
                made.field(k * 1e-3)
                made.coil_voltage(k * 1e-3)
        except BaseException as error:
            failed.append(error)

    threads = [threading.Thread(target=command) for _ in range(3)]
    for thread in threads:
        thread.start()
    for k in range(40):
        made.render(k * 500, 500, 1e-5, 0.0, CHANNELS, FULL, SHIFT)
    for thread in threads:
        thread.join()
    assert not failed
