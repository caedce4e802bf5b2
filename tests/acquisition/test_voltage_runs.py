"""Runs on a bench whose V_GS a source meter holds."""

import csv
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from benches import WITH_A_SOURCE_METER

from sim_backend.bench import open_bench
from sim_backend.serial_line import wires
from sim_backend.serial_line.faults import SerialFault
from sim_backend.voltage_source import LoadFault
from tactile_lab.acquisition.events import RunState, StateChanged, VoltageRead
from tactile_lab.acquisition.stop import StopRequest
from tactile_lab.acquisition.voltage_thread import VoltageThread
from tactile_lab.engine.execution import Execution
from tactile_lab.engine.jobs import InstrumentAnswer, check
from tactile_lab.engine.request import bench_request
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.model.equations import rest_V_C1
from tactile_lab.planning.needs import needs
from tactile_lab.planning.plan import plan
from tactile_lab.scene.load import load, load_bench
from tactile_lab.store.export import csv as to_csv
from tactile_lab.store.run import Run
from tactile_lab.store.selection import Selection

SHORT = (
    'protocol.levels=["120 mN"]',
    "protocol.ramp=0.1 s",
    "protocol.hold=0.5 s",
    "protocol.rest=0.2 s",
    'record.signals=["force", "V_C1", "V_K", "spikes"]',
    "record.sample_rate=50 kS/s",
)
HELD = (*SHORT, 'sensor.sourced=["V_GS"]')


@pytest.fixture
def scene(tmp_path):
    """A scene on that bench, with overrides."""
    file = tmp_path / "bench.toml"
    file.write_text(WITH_A_SOURCE_METER)
    return lambda *overrides: load("demo", overrides, file)


@pytest.fixture
def execute(tmp_path):
    """Run a scene to its end, with faults of the source meter."""

    def run(scene, *faults, emit=lambda event: None):
        bench = open_bench(scene, needs(scene), voltage_faults=faults)
        return Execution(scene, tmp_path / "runs", bench=bench, emit=emit).run()

    return run


def test_a_voltage_on_its_way_goes_no_further_once_a_stop_is_accepted(scene, tmp_path):
    """It rose for another 0.3 s, until the coil was off. STOP is on the wire here."""
    held = scene(*HELD, "sensor.V_GS=1.405 V")
    bench = open_bench(held, needs(held))
    execution = Execution(held, tmp_path / "runs", bench=bench)
    far = [far for name, far in wires._far_ends.items() if "V_GS" in name][-1]
    act, sent = far.instrument.line, []

    def heard(line: bytes) -> bytes | None:
        if step := re.match(rb":SOUR:VOLT ([\d.]+)", line):
            sent.append(float(step[1]))
        if sent and sent[-1] > 0.3:
            execution.stop("enough")
        return act(line)

    far.instrument.line = heard
    done = execution.run()
    assert done.state is RunState.ABORTED and done.off.verified
    (beyond,) = (one for one in sent if one > 0.3)  # then it went down at once
    assert beyond == max(sent) and sent[-1] == 0.0


def test_V_GS_is_set_held_logged_and_left_at_rest(scene, execute):
    seen = []
    held = scene(*HELD, "sensor.V_GS=1.405 V")
    done = execute(held, emit=seen.append)
    assert done.state is RunState.COMPLETE and done.off.verified
    with Run.load(done.folder) as run:
        rows = run.voltages
        assert len(rows) >= 5 and set(rows["name"]) == {b"V_GS"}
        assert rows["setpoint"] == pytest.approx(1.405)
        assert rows["measured"] == pytest.approx(1.405, abs=1e-4)
        assert rows["time"].min() >= 0 and rows["time"].max() <= run.duration + 1
        # the sensor feels it: V_C1 rests where the model has it at 1.405 V
        before = run.signal("V_C1")[:4000].mean()
        assert before == pytest.approx(rest_V_C1(held.circuit), abs=5e-3)
        assert "output off" in run.info["voltages_left"]["V_GS"]
        settings = run.info["instruments"]["source of V_GS"]
        assert settings["compliance_A"] == "0.0001"
        assert run.info["instruments_planned"].keys() == run.info["instruments"].keys()
        assert run.info["instruments_changed"] == []
        assert len(run.to_pandas("voltages")) == len(rows)
    read = [one for one in seen if isinstance(one, VoltageRead)]
    assert len(read) == len(rows)


def test_the_source_decides_whether_the_sensor_fires(scene, execute):
    counts = []
    for volts in (1.3, 1.46, 1.5):
        done = execute(scene(*HELD, f"sensor.V_GS={volts} V"))
        counts.append(done.spikes)
    assert counts[0] == 0 < counts[1] < counts[2]


def test_a_run_that_does_not_name_it_does_not_open_it(scene, execute):
    quiet = scene(*SHORT)
    assert needs(quiet).voltages == {}
    told = dict(plan(quiet).leaves_out)
    assert "sourced" in told["source of V_GS"]
    done = execute(quiet)
    with Run.load(done.folder) as run:
        assert len(run.voltages) == 0 and "voltages_left" in run.info


def test_the_plan_says_what_it_holds_how_finely_and_where_it_is_left(scene):
    told = dict(plan(scene(*HELD)).uses)["source of V_GS"]
    assert "holds it, 1.4 V" in told and "steps of 50 µV" in told
    assert "goes to 0 V, off" in told


def test_what_cannot_be_held_is_refused_before_anything_is_opened(scene):
    with pytest.raises(LimitError, match=r"V_GS = 2.5 V lies beyond the 1 V to 2 V"):
        needs(scene(*HELD, "sensor.V_GS=2.5 V"))
    with pytest.raises(SceneError, match=r"has no \[voltage_source.V_S\]"):
        needs(scene(*SHORT, 'sensor.sourced=["V_S"]'))
    with pytest.raises(SceneError, match="sourced"):
        scene(*SHORT, 'sensor.sourced=["V_C1"]')
    with pytest.raises(SceneError, match="beyond the 21 V"):
        needs(scene(*HELD, "bench.voltage_source.V_GS.limits.highest=30 V"))


def test_two_voltages_are_held_side_by_side(scene, execute):
    done = execute(scene(*SHORT, 'sensor.sourced=["V_GS", "V_th"]'))
    assert done.state is RunState.COMPLETE
    with Run.load(done.folder) as run:
        assert set(run.voltages["name"]) == {b"V_GS", b"V_th"}
        assert set(run.info["voltages_left"]) == {"V_GS", "V_th"}
        of_threshold = run.voltages[run.voltages["name"] == b"V_th"]
        assert of_threshold["measured"] == pytest.approx(3.213, abs=1e-3)


def test_who_is_there_is_asked_of_every_source_and_none_is_switched_on(tmp_path):
    file = tmp_path / "bench.toml"
    text = WITH_A_SOURCE_METER.replace('lowest = "1 V"', 'lowest = "1.5 V"')
    file.write_text(text)  # Table 1's V_GS is below that
    asked = bench_request(str(file), load_bench(file)).load()
    bench = open_bench(asked, needs(asked))
    found = check(bench)
    assert found.sound
    told = {one.role: one.identity for one in found.found}
    assert told["V_GS"].startswith("KEITHLEY") and "V_th" in told
    source = bench.voltage_sources["V_GS"]
    assert source.go_to_rest().text == (
        "This program did not switch the source of V_GS on."
    )


def test_the_chip_of_a_source_tells_what_it_is_to_hold_and_what_it_holds(scene):
    from gui.session.chips import Chips
    from gui.session.expectation import expect
    from gui.session.heard import Heard
    from gui.session.log import Log
    from gui.session.status import Status
    from gui.state import Lamp, WindowState

    status = Status(Log())
    status.state = WindowState.READY
    answers = (InstrumentAnswer("V_GS", "KEITHLEY", ""),)
    bench = SimpleNamespace(answers=answers, age=0.0, known=True, field=None)
    answered = {"V_GS": Heard()}
    run = SimpleNamespace(voltages={}, agreement=None, answered=answered)
    chips = Chips(status, bench, run, SimpleNamespace(alive=False))
    plan = expect(scene(*HELD))

    def chip():
        found = {view.name: view for view in chips.views(plan, None)}
        return found["Source of V_GS"]

    assert (chip().detail, chip().value) == ("to hold 1.4 V", "—")
    status.state, run.voltages = WindowState.RUNNING, {"V_GS": 1.40012}
    assert (chip().lamp, chip().value) == (Lamp.ACTIVE, "1.4001 V")
    assert chip().short == "V_GS"


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (LoadFault(resistance=0.0, after=6.0), "A load or a short holds it down"),
        (LoadFault(resistance=5e3, after=6.0), "A load or a short holds it down"),
        (SerialFault(kind="unplug", after=6.0, times=None), "was lost"),
        (SerialFault(kind="missing", after=6.0, times=None), "answered nothing"),
        (SerialFault(kind="garbled", after=6.0, times=None), "source of V_GS"),
    ],
    ids=["short", "compliance", "unplugged", "silent", "garbled"],
)
def test_a_fault_of_the_source_ends_the_run_with_the_coil_off(
    scene, execute, fault, reason
):
    done = execute(scene(*HELD, "protocol.hold=4 s"), fault)
    assert done.state is RunState.FAULTED and done.exit_code == 3
    assert done.off.verified
    assert reason in done.reason
    with Run.load(done.folder) as run:  # and what was measured is kept
        assert len(run.voltages) >= 1 and len(run.signal("V_K")) > 0
        left = run.info["voltages_left"]["V_GS"]
    if isinstance(fault, SerialFault):
        assert "unknown" in left
        assert "unknown" in (done.folder / "log.jsonl").read_text()


def test_one_lost_answer_does_not_cost_the_run(scene, execute):
    fault = SerialFault(kind="missing", line="READ", skip=2)
    done = execute(scene(*HELD), fault)
    assert done.state is RunState.COMPLETE, done.reason


def test_a_source_that_answers_slowly_gets_to_its_voltage(scene):
    """With 50 ms to an answer each step was 0 V, and a run waited for it for ever."""
    held = scene(*HELD)
    slow = SerialFault(kind="late", line="SOUR:VOLT ", amount=0.05, times=None)
    bench = open_bench(held, needs(held), voltage_faults=(slow,))
    clock, ((name, source),) = bench.clock, bench.voltage_sources.items()
    thread = VoltageThread(name, source, clock, StopRequest(clock))
    with clock.taking_part("test"):
        thread.start()
        thread.hold(1.4)
        clock.wait_for(lambda: thread.stands, clock.now() + 10.0)
        assert thread.stands
        thread.leave()
        clock.wait_for(lambda: thread.ended)
    assert thread.left is not None and thread.left.verified


def test_a_stop_while_it_ramps_takes_it_to_rest(scene, tmp_path):
    slow = scene(*HELD, "bench.voltage_source.V_GS.limits.slew=0.05 V/s")
    bench = open_bench(slow, needs(slow))

    def emit(event):
        connecting = isinstance(event, StateChanged) and event.state == "connecting"
        if connecting:
            bench.clock.notify()

    execution = Execution(slow, tmp_path / "runs", bench=bench, emit=emit)
    source = bench.voltage_sources["V_GS"]
    step = source.step_to

    def stopping(volts):
        there = step(volts)
        if source.read().setpoint > 0.3:
            execution.stop("test")
        return there

    source.step_to = stopping
    done = execution.run()
    assert done.state is RunState.ABORTED and done.off.verified
    told = json.loads((done.folder / "run.json").read_text())["voltages_left"]
    assert "output off" in told["V_GS"]


def test_a_run_of_before_has_no_table_of_voltages(scene, execute):
    done = execute(scene(*SHORT))
    with Run.load(done.folder) as run:
        run._file = _Without(run._file)
        assert run.voltages.size == 0
        assert run.voltages.dtype.names[0] == "time"


class _Without:
    """A data file as versions before this one wrote it."""

    def __init__(self, file):
        self._file = file

    def __contains__(self, name):
        return name != "voltages" and name in self._file

    def __getattr__(self, name):
        return getattr(self._file, name)


def test_readings_are_exported(scene, execute, tmp_path):
    done = execute(scene(*HELD))
    with Run.load(done.folder) as run:
        to_csv.export(run, tmp_path / "csv", Selection())
        told = (tmp_path / "csv" / "voltages.csv").read_text(encoding="utf-8")
        rows = list(csv.DictReader(told.splitlines()))
        measured = [float(row["measured_V"]) for row in rows]
        assert measured == pytest.approx(list(run.voltages["measured"]))
        assert {row["name"] for row in rows} == {"V_GS"}


def test_a_pause_lasts_as_planned_where_the_voltage_takes_longer(execute, tmp_path):
    """Three of 0.7 s were planned; with a source at 20 mV/s they took 11.3 s."""
    file = tmp_path / "bench.toml"
    file.write_text(WITH_A_SOURCE_METER)
    trimmed = load(
        "threshold_trim",
        (
            *("protocol.wanted=130 mN", "protocol.low=1.38 V", "protocol.high=1.45 V"),
            *("protocol.resolution=20 mV", "protocol.margin=0 N"),
            *("protocol.residual=20 mV", "sensor.tau=0.3 s"),
            *("protocol.ramp=0.05 s", "protocol.hold=0.5 s"),
            'record.signals=["V_K", "spikes"]',
            "bench.voltage_source.V_GS.limits.slew=20 mV/s",
            "bench.voltage_source.V_GS.limits.lowest=1.3 V",
        ),
        file,
    )
    planned = plan(trimmed).estimate
    done = execute(trimmed)
    with Run.load(done.folder) as run:
        pauses = run.records("pauses")
        paused = np.sum(pauses["end"] - pauses["start"])
    expected = planned.duration - planned.streamed
    assert paused == pytest.approx(expected, abs=0.2 * len(pauses))
    assert expected > 5.0
