"""Whole runs whose force is played by the source's own list."""

import numpy as np
import pytest

from sim_backend.bench import open_bench
from sim_backend.coil.list_mode import ListFault
from tactile_lab.acquisition.events import CoilCurrent, RunState, TrialStarted
from tactile_lab.analysis.delay import delay
from tactile_lab.lag import Lag
from tactile_lab.planning.needs import needs
from tactile_lab.store.applied import BY_SAMPLES
from tactile_lab.waveform import Waveform

LIST = (
    'protocol.levels=["200 mN", "200 mN"]',
    "protocol.hold=0.5 s",
    "protocol.rest=0.2 s",
    "record.sample_rate=50 kS/s",
    "coil.way=list",
)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    from short_runs import Ran

    from tactile_lab.engine.execution import Execution
    from tactile_lab.scene.load import load

    told = []
    out = tmp_path_factory.mktemp("runs")
    done = Execution(load("demo", LIST), out, emit=told.append).run()
    return Ran(done, told)


def test_the_current_follows_the_ramp_without_stairs(ran):
    assert ran.done.state is RunState.COMPLETE and ran.done.off.verified
    run = ran.stored()
    trace = run.signal("coil_current").trace(cells=10_000)
    for start in run.trials["start"]:
        wave = np.array([[0, 0], [0.25, 0.997], [0.75, 0.997], [1.0, 0], [1.2, 0]])
        inside = (trace.time > start + 0.02) & (trace.time < start + 1.15)
        time, seen = trace.time[inside] - start, trace.mean[inside]
        asked = np.interp(time, wave[:, 0], wave[:, 1])
        # 16 mA is one code; a set-point's stair would be 180 mA
        assert np.abs(seen - asked).max() < 0.06


def test_the_list_is_loaded_once_and_its_loading_is_a_planned_pause(ran):
    run = ran.stored()
    starts = [e.start for e in ran.told if isinstance(e, TrialStarted)]
    assert starts[0] > 3.0  # 401 points at 19200 baud
    assert run.trials["end"][-1] == pytest.approx(run.info["planned_s"], abs=0.1)
    assert starts[1] - starts[0] < 1.6  # played again as it is
    assert ran.done.loss == {"samples": 0, "spikes": 0}
    assert run.current["listed"].sum() > 700


def test_rest_is_seen_when_the_list_is_loaded_and_judged_for_drift(run_scene):
    """It was V_C1 from before the loading, 40 mV off where that takes 14 s."""
    short = 'protocol.levels=["200 mN", "150 mN"]', "protocol.rest=0.6 s"
    with run_scene(*LIST, *short, "simulated.noise.V_C1=20 mV").stored() as run:
        second = run.trials[1]
        loaded = second["start"] - run.trials["end"][0]
        trace = run.signal("V_C1").trace(cells=10**6)
        before = (trace.time > second["start"] - 0.1) & (trace.time < second["start"])
        just = trace.mean[before].mean()
        assert loaded > 3.0
        assert second["rest_V_C1"] == pytest.approx(just, abs=1.5e-3)
        assert abs(second["drift_V_C1"]) < 3e-3


def test_its_points_stand_where_the_samples_show_them(ran):
    """Not where the host began to tell the source to start: up to 40 ms before."""
    assert ran.lateness() == pytest.approx([0.0, 0.0], abs=2e-3)


@pytest.mark.parametrize(
    ("grid", "best", "worst"), [(0.0, 0.0, 4e-5), (0.5e-3, 2e-4, 2e-3)]
)
def test_points_are_dated_as_well_as_the_samples_show_them(
    run_scene, grid, best, worst
):
    """Half a millisecond was told of all lists: of those a source stretches, too."""

    def bench(scene):
        return open_bench(
            scene, needs(scene), coil_faults=[ListFault(dwell_grid=grid)] * 2
        )

    with run_scene(*LIST, "protocol.ramp=20 ms", bench=bench).stored() as run:
        timing, lag = run.applied.timing, run.scene.bench.magnet.coil_lag
        flow, _ = Lag(coil=lag).follow(Waveform.stairs(run.applied.steps, run.duration))
        late = []
        for start in run.trials["start"]:
            for ramp in (start, start + 0.52):
                time, seen = run.shunt(ramp - 0.01, ramp + 0.04)
                width = float(np.median(np.diff(time)))
                late.append(delay(flow, time - width / 2, width, seen).value)
        assert max(best, *np.abs(late)) < timing < worst


@pytest.mark.parametrize(
    "fault", [ListFault(trigger_lost=True), ListFault(cut_after=0.1)]
)
def test_a_list_that_does_not_play_ends_the_run_with_the_coil_off(run_scene, fault):
    def bench(scene):
        return open_bench(scene, needs(scene), coil_faults=[fault])

    ended = run_scene(*LIST, bench=bench).done
    assert ended.state is RunState.FAULTED and ended.off.verified
    assert "did not start or was cut short" in ended.reason


def test_a_list_whose_current_nothing_measures_is_said_to_be_as_asked_for(
    ran, run_scene
):
    """Its report had "levels as the source read them back", where none was."""
    from tactile_lab.report.driven import told

    with run_scene(*LIST, 'record.signals=["V_C1"]').stored() as blind:
        assert "as asked for" in told(blind)[0]
        assert "which nothing measured" in told(blind)[0]
    assert "timed by the shunt" in told(ran.stored())[0]


def test_a_list_that_is_stopped_on_its_way_up_is_dated_by_the_samples(run_scene):
    """By the host it was up to 40 ms off, and its report named a misfit."""

    def watch(execution, event):
        if isinstance(event, CoilCurrent) and event.setpoint > 0.6:
            execution.stop("enough")

    ran = run_scene(*LIST, watch=watch)
    assert ran.done.state is RunState.ABORTED and ran.done.off.verified
    with ran.stored() as run:
        listed = run.current[run.current["listed"] > 0]
        assert set(listed["listed"]) == {BY_SAMPLES}
        assert listed["setpoint"][-1] > 0.6
        assert run.applied.uncertainty() is not None
    assert ran.lateness() == pytest.approx([0.0], abs=2e-3)
