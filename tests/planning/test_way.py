"""By which way the coil plays a force, why, and how far the force errs."""

from dataclasses import replace

import numpy as np
import pytest
from benches import generator_bench

from tactile_lab.errors import LimitError, SceneError
from tactile_lab.lag import Lag
from tactile_lab.planning.plan import plan, text
from tactile_lab.planning.way import drive_for
from tactile_lab.planning.ways import ways_used
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform

SHORT = ('protocol.levels=["200 mN"]', "protocol.hold=0.8 s", "protocol.rest=0.3 s")


def ways(*overrides, scene="demo"):
    return ways_used(
        plan(load(scene, (*SHORT, *overrides)), preview=False).timeline.steps
    )


def test_set_points_where_the_protocol_bears_their_stairs():
    (used,) = ways()
    assert used.way == "set-points"
    # 0.8 N/s for one interval of 45 ms, 30 ms until the source acts, 4 ms of lags
    assert used.error == pytest.approx(0.8 * 80e-3, rel=0.1)
    assert used.part == pytest.approx(used.error / 0.2)


def test_a_list_where_the_force_must_be_nearer():
    (used,) = ways("coil.accuracy=0.02")
    assert used.way == "list" and used.part < 0.006
    assert used.load > 1.0
    assert ways("coil.accuracy=0.4")[0].way == "set-points"


def test_the_plan_says_so_and_counts_the_time_to_load():
    planned = plan(load("demo", (*SHORT, "coil.way=list")), preview=False)
    told = text(planned)
    assert "by lists" in told and "the force errs by up to" in told
    assert "set-points  " not in told
    (way,) = planned.to_dict()["ways"]
    assert (way["way"], way["trials"]) == ("list", 1)
    # the built-in bench knows its lags to 1 ms, and the force rises by 0.8 N/s
    assert way["lags_N"] == pytest.approx(0.8e-3)
    assert "and by 800 µN as lags are not known better" in told
    assert planned.timeline.loading == pytest.approx(way["load_s"])
    assert planned.timeline.duration == pytest.approx(1.6 + way["load_s"])


def test_a_way_that_cannot_be_gone_is_refused_with_its_reason(tmp_path):
    with pytest.raises(SceneError, match="begins and ends at 0 A"):
        plan(load("sine_sweep", ("protocol.bias=0.1 N", "coil.way=list")))
    scene = tmp_path / "s.toml"
    scene.write_text(
        '[bench]\nsimulated = true\n[bench.coil]\ndialect = "scpi-generic"\n'
        '[bench.magnet]\nr = "6 mm"\n[protocol]\nname = "pulses"\n'
        '[coil]\nway = "list"\n[record]\nsignals = ["force"]\n'
    )
    with pytest.raises(SceneError, match="plays none"):
        plan(load(str(scene)))


def test_a_run_on_a_link_faster_than_promised_takes_what_its_plan_allowed():
    """At a set-point each 0.4 ms a sine of 250 s ended the run: too many of them."""
    asked = "protocol.lowest=0.02 Hz", "protocol.count=1", "protocol.cycles=5"
    scene = load("sine_sweep", (*asked, "protocol.highest=0.02 Hz"))
    trial = next(
        step.trial
        for step in plan(scene, preview=False).timeline.steps
        if step.trial.length > 200
    )
    drive = drive_for(trial, scene, 0.0, update_interval=4e-4)
    assert drive.way == "set-points" and drive.error < 3e-3
    with pytest.raises(LimitError, match="changes its force for"):
        drive_for(replace(trial, force=Waveform.pulse(0.1, ramp=3e4, hold=1)), scene, 0)


def test_near_enough_is_a_share_of_all_force_from_zero_up():
    """A small step about a bias was told why no list could play it."""
    scene = load("demo", ("coil.accuracy=0.2",))
    trial = plan(scene, preview=False).timeline.steps[0].trial
    step = Waveform.through([(0, 0.1), (0.3, 0.1), (0.5, 0.105), (1, 0.105)])
    before = float(scene.bench.magnet.current_for(step).value[0])
    drive = drive_for(replace(trial, force=step, duration=1.0), scene, before)
    assert drive.way == "set-points" and "No list" not in drive.why
    assert 0.2 * 0.005 < drive.error < 0.2 * 0.1


def test_where_no_way_is_near_enough_the_nearest_is_taken_and_said():
    phases = "protocol.highest=200 Hz", "protocol.lowest=200 Hz", "protocol.count=1"
    scene = load("sine_sweep", (*phases, "coil.accuracy=1e-3", "protocol.cycles=9"))
    planned = plan(scene, preview=False)
    (used, *_) = ways_used(planned.timeline.steps)
    assert used.part > 1e-3
    assert any("nearer than" in line for line in planned.warnings)


def test_a_generator_leads_by_coil_and_core_alone(tmp_path):
    """The source's bandwidth delays: led as a lag it gave 0.4 % too much at 100 Hz."""
    keys = "lowest=100 Hz", "highest=100 Hz", "count=1", "base=100 mN", "lasts=0.2 s"
    told = [f"protocol.{key}" for key in (*keys, "amplitude=20 mN")]
    scene = load("vibration", told, bench=generator_bench(tmp_path))
    steps = plan(scene, preview=False).timeline.steps
    drive = next(step.drive for step in steps if step.trial.force.peak > 0)
    asked = next(step.trial.force for step in steps if step.trial.force.peak > 0)
    assert drive is not None and drive.points is not None
    magnet, points = scene.bench.magnet, drive.points
    stairs = Waveform.stairs(np.column_stack([points.starts, points.currents]), 1.0)
    field, _ = Lag(1.1e-3, 3e-3).follow(stairs, (0.0, 0.0))
    time = np.linspace(0, asked.end, 4001)
    error = np.abs(magnet.force(field.at(time)) - asked.at(time)).max()
    assert drive.way == "generator"
    assert error <= drive.error < 2e-3 * 0.12


def test_the_plan_says_what_the_other_ways_would_leave(tmp_path):
    planned = plan(load("demo", SHORT), preview=False)
    generator, points = planned.ways_instead
    assert (generator.way, points.way) == ("generator", "list")
    assert "[coil.generator]" in generator.why_not
    assert points.part is not None and points.part < 0.006 and points.load > 1
    told = text(planned)
    assert "by lists instead" in told and '[coil] way = "list"' in told
    assert planned.to_dict()["ways_instead"][1]["load_s"] == points.load
    # who wired the generator wants it used: it costs no time
    wired = plan(load("demo", SHORT, generator_bench(tmp_path)), preview=False)
    assert [used.way for used in wired.ways] == ["generator"]
    assert wired.ways_instead == () and wired.timeline.loading < 0.1
    assert plan(load("demo", (*SHORT, "coil.way=list"))).ways_instead == ()


def test_an_error_of_the_whole_range_is_written_out(tmp_path):
    """Not as "1e+02 %"."""
    file = tmp_path / "jump.csv"
    file.write_text("time_s,force_N\n0,-0.15\n0.5,-0.15\n0.5,0.18\n2,0.18\n")
    told = text(plan(load("waveform", [f"protocol.file={file}"])))
    assert "100 % of its range" in told
    assert "e+0" not in told
