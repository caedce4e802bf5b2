"""What a plan says of a run's size and codes, beside what the run then has stored."""

from importlib import resources

import h5py
import numpy as np
import pytest
from benches import WITH_GAPS

from tactile_lab.planning.plan import plan
from tactile_lab.scene.load import load

QUIET = [f"simulated.noise.{name}=0 V" for name in ("V_C1", "V_C2", "V_K")]
QUIET = [*QUIET, "simulated.noise.coil_current=0 V"]
LOUD = [f"simulated.noise.{name}=100 mV" for name in ("V_C1", "V_C2")]
LOUD = [*LOUD, "simulated.noise.coil_current=10 mV"]


@pytest.mark.parametrize("noise", [QUIET, [], LOUD], ids=["none", "usual", "much"])
def test_bytes_of_samples_are_those_that_a_run_then_stores(noise, run_scene, short):
    keys = (*short, "record.sample_rate=4 MS/s", *noise)
    told = plan(load("demo", keys), preview=False).estimate
    with h5py.File(run_scene(*keys).folder / "data.h5") as file:
        stored = [samples for samples in file["samples"].values()]
        wide = sum(one.size * one.dtype.itemsize for one in stored)
        packed = sum(one.id.get_storage_size() for one in stored)
    assert told.disk_raw == pytest.approx(wide, rel=0.02)
    assert 1 / 1.5 < told.disk / packed < 1.5


def test_samples_beyond_a_range_are_planned_as_they_compress(run_scene, tmp_path):
    """The codes of its end are all alike: 4.4 MB were planned, 0.7 MB stored."""
    own = resources.files("tactile_lab.scene") / "simulated_bench.toml"
    bench = tmp_path / "low.toml"
    # V_C1 from 0 V to 2 V, which it rests far above
    text = own.read_text().replace("auto_range = true", "")
    text = text.replace('range = "2 V"', 'range = "1 V"', 1)
    bench.write_text(text.replace('offset = "-2.5 V"', 'offset = "-1 V"', 1))
    keys = (
        "protocol.levels=['280 mN']",
        "record.signals=['V_C1']",
        f"bench.file='{bench}'",
    )
    told = plan(load("demo", keys), preview=False).estimate
    with h5py.File(run_scene(*keys).folder / "data.h5") as file:
        packed = file["samples/V_C1"].id.get_storage_size()
    assert 1 / 1.5 < told.disk / packed < 1.5


@pytest.mark.parametrize("rate", ["5.1 kS/s", "20 MS/s"])
def test_samples_of_a_scope_with_gaps_are_those_of_its_records(
    rate, run_scene, tmp_path
):
    """It samples in steps of 1, 2, 5, is blind for longer than a short record lasts,
    and what is over within a long one ends with it."""
    (tmp_path / "gaps.toml").write_text(WITH_GAPS, encoding="utf-8")
    keys = (
        'record.signals=["V_C1", "coil_current"]',
        f"bench.file={tmp_path / 'gaps.toml'}",
        "protocol.duration=10 s",
        f"record.sample_rate={rate}",
    )
    told = plan(load("monitor", keys), preview=False).estimate
    run = run_scene(*keys, scene="monitor").stored()
    assert 1 / 1.5 < told.samples_per_channel / run.samples < 1.5
    assert told.duration == pytest.approx(run.duration, rel=0.1)


def test_one_code_is_that_of_the_scope_that_the_bench_has(run_scene, tmp_path):
    """A screen's edge is 100 codes from its middle, a PicoScope's range 127."""
    (tmp_path / "gaps.toml").write_text(WITH_GAPS, encoding="utf-8")
    keys = (
        'record.signals=["V_C1", "coil_current"]',
        "record.compare=false",
        f"bench.file={tmp_path / 'gaps.toml'}",
        "protocol.duration=0.5 s",
    )
    told = plan(load("monitor", keys), preview=False).estimate.resolution
    run = run_scene(*keys, scene="monitor").stored()
    assert told["V_C1"] == pytest.approx(run.signal("V_C1").gain)


def test_a_run_lasts_as_long_as_planned_and_has_one_duration(run_scene):
    """Making the coil safe takes as long again as a short push, and is none of it."""
    keys = (
        'protocol.levels=["100 mN"]',
        "protocol.ramp=0.1 s",
        "protocol.hold=0.1 s",
        "protocol.rest=0.1 s",
    )
    told = plan(load("demo", keys), preview=False).estimate
    ran = run_scene(*keys)
    run = ran.stored()
    assert ran.done.duration == pytest.approx(told.duration, rel=0.02)
    assert ran.done.duration == run.info["duration_s"] == pytest.approx(run.duration)


def test_the_plan_has_the_stairs_that_the_coil_plays(run_scene):
    """A ramp of 60 ms is two set-points: 15 spikes were planned, 50 ms too early."""
    scene = (
        "protocol.levels=['200 mN', '250 mN', '150 mN']",
        "protocol.ramp=60 ms",
        "protocol.hold=0.2 s",
    )
    planned = plan(load("demo", scene))
    ran = run_scene(*scene).stored()
    seen = ran.spikes["time"] - ran.trials["start"][0]
    times = planned.preview.spike_times
    assert planned.spikes == times.size == seen.size == 14
    assert times[0] == pytest.approx(seen[0], abs=0.01)
    # it acts on a set-point sooner than it promises, by less than an exchange
    assert planned.timeline.force.at([0.1, 0.2]) == pytest.approx(
        ran.force.at(ran.trials["start"][0] + np.array([0.1, 0.2])), rel=0.01
    )


def test_spikes_that_the_follower_hides_are_planned_as_hidden(run_scene):
    """They were told to stay above 0.5 V for 37 ns, and a faster scope to see them."""
    keys = (
        "sensor.C2=2 pF",
        "protocol.levels=['150 mN']",
        "protocol.hold=0.2 s",
        'simulated.noise={V_K="2 mV"}',
    )
    told = "\n".join(plan(load("demo", keys)).warnings)
    assert "no spike is high enough: V_K rises to 401 mV" in told
    lower = (*keys, "detect.threshold=0.2 V", "detect.refractory=1 us")
    lower = (*lower, "record.sample_rate=7 MS/s", "record.signals=['V_K', 'spikes']")
    planned = plan(load("demo", lower))
    assert "misses about 41 % of the spikes" in "\n".join(planned.warnings)
    assert run_scene(*keys).stored().spikes.size == 0
    seen = run_scene(*lower).stored().spikes.size
    assert seen / planned.spikes == pytest.approx(0.59, abs=0.06)
