import numpy as np
import pytest

from tactile_lab.planning.plan import plan
from tactile_lab.planning.timeline import timeline
from tactile_lab.plugins import protocol_names, scene_names
from tactile_lab.scene.load import load

SHIPPED = (
    "hold_10s", "fig5b", "rate_force", "staircase", "repeat", "bipolar", "sine_sweep",
    "threshold_search", "calibrate_field", "force_check", "wiring_check", "monitor",
    "waveform", "vibration", "texture", "touch", "threshold_trim",
    "threshold_drift",
)  # fmt: skip


@pytest.mark.parametrize("name", SHIPPED)
def test_each_shipped_scene_plays_through_the_coil_without_a_warning(name):
    planned = timeline(load(name), through_coil=True)
    assert planned.warnings == ()
    assert planned.duration > 5
    for step in planned.steps:
        if step.trial.hold is not None:
            start, end = step.trial.hold
            assert 0 <= start < end <= step.trial.length + 1e-9


@pytest.mark.parametrize("name", SHIPPED)
def test_each_shipped_scene_is_simulated_only(name):
    scene = load(name)
    assert scene.bench.simulated
    assert scene.bench.path is None


@pytest.mark.parametrize("name", SHIPPED)
def test_each_scene_survives_being_written_and_read(name, tmp_path):
    copy = tmp_path / f"{name}.toml"
    copy.write_text(load(name).to_toml(), encoding="utf-8")
    assert load(copy).protocol == load(name).protocol


@pytest.mark.parametrize("name", SHIPPED)
def test_the_force_ends_at_zero(name):
    planned = timeline(load(name), through_coil=True)
    last = planned.steps[-1].trial
    assert (last.current or last.force).value[-1] == pytest.approx(0.0, abs=1e-15)
    assert np.all(np.isfinite(planned.force.value))


def test_no_scene_that_ships_is_sampled_too_slowly_for_its_spikes():
    plans = [plan(load(name), preview=False) for name in scene_names()]
    told = [line for planned in plans for line in planned.warnings]
    assert not [line for line in told if "misses about" in line]


def test_every_protocol_that_ships_has_a_scene():
    played = {load(name).protocol.name for name in scene_names()}
    assert played == set(protocol_names())


def test_recovery_lasts_as_long_as_the_scene_s_own_film_needs():
    slow = load("rate_force", ["sensor.tau=20 s"]).protocol
    usual = load("rate_force").protocol
    assert slow.recovery_time(0.2) / usual.recovery_time(0.2) == pytest.approx(
        20 / 8.69
    )
    told = load("rate_force", ["sensor.tau=20 s", "protocol.tau=5 s"]).protocol
    assert told.recovery_time(0.2) / usual.recovery_time(0.2) == pytest.approx(5 / 8.69)
