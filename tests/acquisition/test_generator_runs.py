"""Runs whose force the scope's generator plays into the source's analogue input."""

from __future__ import annotations

import numpy as np
import pytest
from benches import generator_bench

from sim_backend.bench import open_bench
from sim_backend.picoscope.faults import ScopeFault
from sim_backend.plant.plant import Plant
from tactile_lab.acquisition.events import CoilCurrent, Message, RunState, TrialStarted
from tactile_lab.errors import SceneError
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.planning.ways import ways_used
from tactile_lab.scene.load import load
from tactile_lab.store.applied import BY_SAMPLES

WAVE = (
    'protocol.levels=["190 mN", "190 mN"]',
    "protocol.ramp=250 ms",
    "protocol.hold=0.5 s",
    "protocol.rest=0.2 s",
    "record.sample_rate=50 kS/s",
    "coil.way=generator",
)


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    return generator_bench(tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def ran(tmp_path_factory, bench):
    from short_runs import Ran

    from tactile_lab.engine.execution import Execution

    told = []
    out = tmp_path_factory.mktemp("runs")
    scene = load("demo", WAVE, bench=bench)
    return Ran(Execution(scene, out, emit=told.append).run(), told)


def test_the_current_follows_the_force_without_stairs(ran):
    assert ran.done.state is RunState.COMPLETE and ran.done.off.verified
    run = ran.stored()
    trace = run.signal("coil_current").trace(cells=10_000)
    for start in run.trials["start"]:
        wave = np.array([[0, 0], [0.25, 0.947], [0.75, 0.947], [1.0, 0], [1.2, 0]])
        inside = (trace.time > start + 0.02) & (trace.time < start + 1.15)
        time, seen = trace.time[inside] - start, trace.mean[inside]
        # 16 mA is one code; a set-point's stair would be 170 mA
        assert np.abs(seen - np.interp(time, wave[:, 0], wave[:, 1])).max() < 0.06


def test_it_is_loaded_once_and_at_once(ran):
    starts = [e.start for e in ran.told if isinstance(e, TrialStarted)]
    assert starts[0] < 1.0  # a list takes seconds
    assert starts[1] - starts[0] < 1.4  # played again as it is
    assert ran.done.loss == {"samples": 0, "spikes": 0}


def test_its_points_stand_where_the_samples_show_them(ran):
    assert ran.lateness() == pytest.approx([0.0, 0.0], abs=2e-3)


@pytest.fixture
def voltages(monkeypatch):
    """Voltages that came to the source's analogue input, and when: s, V."""
    told = []
    usual = Plant.analogue_input

    def heard(self, coming):
        coming = list(coming)
        told[:] = [one for one in told if one[0] < coming[0][0]] + coming
        usual(self, coming)

    monkeypatch.setattr(Plant, "analogue_input", heard)
    return told


def in_the_hold(execution, event):
    if isinstance(event, CoilCurrent) and event.setpoint > 0.9:
        execution.stop("enough")


def test_stop_takes_the_current_back_at_the_slew_limit(run_scene, bench, voltages):
    scene = load("demo", bench=bench)
    ran = run_scene(*WAVE, scene=scene, watch=in_the_hold)
    assert ran.done.state is RunState.ABORTED and ran.done.off.verified
    with ran.stored() as run:  # the samples date what was played until then
        assert set(run.current["listed"]) == {0, BY_SAMPLES}
    assert ran.lateness() == pytest.approx([0.0], abs=2e-3)
    time, volts = np.array(voltages).T
    assert volts.max() > 1.8 and volts[-1] == 0
    falls = (time > time[np.argmax(volts)]) & (volts < 1.75)
    # 5 A/s by 0.5 A/V, in steps of some 2 ms
    assert (np.diff(volts[falls]) > -10 * 6e-3).all()
    assert time[falls][-1] - time[falls][0] == pytest.approx(0.175, rel=0.1)


def test_a_stop_before_the_generator_begins_leaves_it_at_0_V(
    run_scene, bench, voltages
):
    """It was started, and taken back from there."""
    running = []

    def made(scene):
        made = open_bench(scene, needs(scene))
        follow = made.coil.follow

        def followed(*asked):
            follow(*asked)
            running[0].stop("as it is to begin")

        made.coil.follow = followed
        return made

    ended = run_scene(
        *WAVE,
        scene=load("demo", bench=bench),
        bench=made,
        watch=lambda execution, event: running.append(execution),
    ).done
    assert ended.state is RunState.ABORTED and ended.off.verified
    assert {volts for _, volts in voltages} <= {0.0}


def test_a_scope_that_is_lost_while_it_plays_ends_with_the_output_off(run_scene, bench):
    def lost(scene):
        fault = ScopeFault(kind="unplug", time=0.9)
        return open_bench(scene, needs(scene), scope_faults=[fault])

    ended = run_scene(*WAVE, scene=load("demo", bench=bench), bench=lost).done
    assert ended.state is RunState.FAULTED and ended.off.verified


def test_a_gain_that_is_not_the_true_one_ends_the_run(run_scene, tmp_path):
    file = generator_bench(tmp_path, 'gain = "0.48 A/V"')
    ended = run_scene(*WAVE, scene=load("demo", bench=file)).done
    assert ended.state is RunState.FAULTED and ended.off.verified
    assert "[coil.generator]" in ended.reason


def test_where_it_is_wired_it_is_taken_for_a_smooth_force(bench):
    scene = load("touch", ('protocol.onsets=["100 ms"]',), bench=bench)
    (used,) = ways_used(plan(scene, preview=False).timeline.steps)
    assert used.way == "generator" and used.part < 0.01
    assert "A/V" in used.why


def test_a_gain_that_a_short_touch_hides_is_told_by_the_samples(run_scene, tmp_path):
    file = generator_bench(tmp_path, 'gain = "0.6 A/V"')
    keys = {"level": "100 mN", "repeats": 1, "rest": "0.2 s", "hold": "0.1 s"}
    short = [f"protocol.{key}={value}" for key, value in keys.items()]
    touch = *short, 'protocol.onsets=["20 ms"]', "record.sample_rate=100 kS/s"
    ran = run_scene(*touch, scene=load("touch", bench=file))
    assert ran.done.state is RunState.COMPLETE
    told = [e.text for e in ran.told if isinstance(e, Message)]
    (warned,) = [text for text in told if "Multiply gain in [coil.generator]" in text]
    seen = float(warned.split(" ± ")[0].split()[-1])
    assert seen == pytest.approx(0.5 / 0.6, abs=0.03)


@pytest.mark.parametrize(
    ("lines", "why"),
    [
        (('[coil]\ndialect = "scpi-generic"', "[coil.generator]"), "no \\[analogue"),
        (("[coil]", '[coil.generator]\ngain = "5 A"'), "A/V"),
    ],
)
def test_wiring_that_cannot_be_is_refused(tmp_path, lines, why):
    file = tmp_path / "bench.toml"
    head = 'simulated = true\n[magnet]\nr = "6 mm"\n'
    file.write_text(head + "\n".join(lines) + "\n")
    with pytest.raises(SceneError, match=why):
        plan(load("demo", ('record.signals=["force"]',), bench=file))
