"""Noise of V_fire and of the sources, hum, temperature and spread between specimens."""

from dataclasses import replace

import numpy as np
import pytest

from sim_backend.bench import plant_of
from sim_backend.plant.noise import NoiseSource, SensorNoise
from sim_backend.plant.options import PlantOptions
from sim_backend.plant.plant import Plant
from tactile_lab.magnetics import Magnet
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.specimen import specimen
from tactile_lab.model.temperature import at_temperature, temperature
from tactile_lab.planning.plan import plan
from tactile_lab.scene.load import load
from tactile_lab.scope import Channel
from tactile_lab.waveform import Waveform

V_K = Channel(signal="V_K", input="C", range=5.0)
MAGNET = Magnet(r=6e-3)


def spikes(noise, *, pieces=30, seed=3, seconds=3.0):
    """Times of the spikes of a plant pushed with 150 mN, looked at in pieces."""
    made = Plant(Circuit(), MAGNET, PlantOptions(sensor_noise=noise), seed)
    made.output(0.0, True)
    made.set_current(0.1, 0.15 / MAGNET.newtons_per_ampere)
    found, count = [], round(seconds * 1e4)
    for first in range(0, count, count // pieces):
        made.render(first, count // pieces, 1e-4, 0.0, [V_K], 32512, 8)
        end = (first + count // pieces) * 1e-4
        found.append(made._sensor.spikes(first * 1e-4, end))
    return np.unique(np.concatenate(found))


def irregularity(times):
    """Scatter of the intervals about their smooth course, as a part of each."""
    intervals = np.diff(times)
    bends = intervals[2:] - 2 * intervals[1:-1] + intervals[:-2]
    return np.std(bends) / np.sqrt(6) / intervals.mean()


def test_trains_are_regular_unless_something_is_noisy():
    assert irregularity(spikes(SensorNoise())) < 1e-3
    for noise in (SensorNoise(V_fire=0.05), SensorNoise(V_GS=5e-3),
                  SensorNoise(current=20e-3)):  # fmt: skip
        assert irregularity(spikes(noise)) > 3e-3


@pytest.mark.parametrize("noise", [SensorNoise(V_fire=0.05), SensorNoise(V_GS=5e-3)])
def test_noise_does_not_depend_on_how_the_scope_slices_time(noise):
    whole = spikes(noise)
    assert whole.size > 15
    assert spikes(noise, pieces=200) == pytest.approx(whole, abs=2e-5)
    assert spikes(noise, seed=4)[5] != pytest.approx(whole[5], abs=1e-4)


def test_each_spike_has_a_v_fire_of_its_own_of_the_size_asked_for():
    source = NoiseSource(SensorNoise(V_fire=0.02), 1, 1.5, 0.2, 50.0)
    volts = np.array([source.V_fire(n, 3.2, 0.0) for n in range(4000)])
    assert volts.mean() == pytest.approx(3.2, abs=2e-3)
    assert volts.std() == pytest.approx(0.02, rel=0.05)


def test_hum_and_noise_act_like_a_force_of_their_size():
    quiet = Waveform.through([(0.0, 0.1), (4.0, 0.1)])
    hum = NoiseSource(SensorNoise(hum=1.5e-3), 1, 1.5, 0.2, 50.0).on(quiet)
    assert hum.value.max() - 0.1 == pytest.approx(1e-3, rel=0.05)
    white = NoiseSource(SensorNoise(current=5e-3), 1, 1.5, 0.2, 50.0).on(quiet)
    assert np.std(white.value - 0.1) == pytest.approx(1e-3, rel=0.1)


def test_temperature_moves_what_it_moves():
    warm = at_temperature(Circuit(), temperature(Circuit()) + 1)
    assert warm.V_T == pytest.approx(0.025 * 291.11 / 290.11, rel=1e-5)
    # a junction's saturation current at 290 K rises by 3/T + 1.11 V/(V_T T)
    assert warm.I_T1s / Circuit().I_T1s == pytest.approx(1.177, abs=2e-3)
    # what T1 needs between emitter and base for one current falls by 2.8 mV
    volts = [c.V_T * np.log(6.4e-9 / c.I_T1s) for c in (Circuit(), warm)]
    assert volts[1] - volts[0] == pytest.approx(-2.8e-3, abs=0.1e-3)
    back = at_temperature(warm, temperature(Circuit()))
    assert back.I_S == pytest.approx(Circuit().I_S, rel=1e-9)
    scene = load("demo", {"sensor.temperature": "30 °C"})
    assert scene.circuit.V_T == pytest.approx(0.02612, abs=1e-5)


def test_a_specimen_is_always_the_same_and_spreads_as_its_parts_do():
    assert specimen(Circuit(), 0) is not None and specimen(Circuit(), 0) == Circuit()
    assert specimen(Circuit(), 7) == specimen(Circuit(), 7) != specimen(Circuit(), 8)
    many = [specimen(Circuit(), n) for n in range(1, 400)]
    for name, part in (("R1", 0.005), ("C2", 0.025)):
        values = np.array([getattr(c, name) for c in many]) / getattr(Circuit(), name)
        assert values.std() == pytest.approx(part, rel=0.15)
    assert np.std([c.V_GS for c in many]) == pytest.approx(1e-3, rel=0.15)
    made = plant_of(load("demo", {"simulated.specimen": 7}))
    assert made.circuit == replace(specimen(Circuit(), 7), I_bias=65e-12)


def test_a_plan_tells_what_is_off_and_what_is_on():
    off = dict(plan(load("demo"), preview=False).leaves_out)
    assert off["noise of V_fire"] == "off in [simulated]: not computed"
    assert "spread between specimens" in off
    on = plan(load("demo", {"simulated.V_fire_noise": 0.02}), preview=False)
    assert "noise of V_fire" not in dict(on.leaves_out)
    assert any("noise of the sensor: V_fire 20 mV" in line for line in on.assumptions)
    also = {
        "simulated.specimen": 4,
        "simulated.warming": 3.0,
        "simulated.warming_time": 5.0,
        "simulated.hum": 0.03,
    }
    said = "\n".join(plan(load("demo", also), preview=False).assumptions)
    assert "becomes 3 K warmer than at the begin, with a time constant of 5 s" in said
    assert "and 30 mV of mains hum on every channel" in said
    assert "is of this specimen alone" in said, "no interval holds the spread"
