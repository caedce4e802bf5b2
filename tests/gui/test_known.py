"""What the window claims of instruments and coil while nothing runs."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest
from benches import READ_BY_HAND
from PySide6.QtWidgets import QApplication
from serial import serial_for_url
from served_source import Source

from gui.lanes.live import LiveSource
from gui.session import bench as connected
from gui.session import heard
from gui.session.live_run import LiveRun
from gui.session.log import Log
from gui.session.session import Session
from gui.session.status import Status
from gui.state import (
    CoilKnowledge,
    InstrumentView,
    Lamp,
    Snapshot,
    WindowState,
    clock_text,
    run_problem,
    stop_text,
    truth,
)
from tactile_lab.acquisition.events import FieldRead, TemperatureRead, VoltageRead
from tactile_lab.engine import execution
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request

LONGEST = 90.0

SCOPE = """
[scope]
[[scope.channels]]
signal = "V_C1"
input = "A"
range = "5 V"
[[scope.channels]]
signal = "V_K"
input = "C"
range = "5 V"
"""


@pytest.fixture
def served(app: QApplication, tmp_path: Path, source: Source) -> Iterator[Session]:
    """A window's session, connected to a source at a port of its own."""
    session = Session(tmp_path / "runs", separate=False)
    session.run.reports = False
    session.connect_bench(str(source.bench))
    until(session, lambda: session.state is WindowState.READY)
    yield session
    session.close()


def until(session: Session, done: Callable[[], object]) -> None:
    end = time.monotonic() + LONGEST
    while not done():
        assert time.monotonic() < end, [line.text for line in session.log.lines]
        session.poll()
        time.sleep(0.005)


def coil(session: Session) -> CoilKnowledge:
    return truth(session.state, session.coil_view())


def lamps(session: Session) -> list[Lamp]:
    return [view.lamp for view in session.snapshot().instruments]


def test_a_source_that_is_gone_while_idle_becomes_a_fault(
    served: Session, source: Source
) -> None:
    assert Lamp.GOOD in lamps(served)
    source.served.close()
    served.bench.look()
    until(served, lambda: served.state is WindowState.FAULT)
    assert "tactile-lab devices" in served.status.fault.consequence
    assert "`" not in served.status.fault.consequence, "a window is no terminal"
    assert Lamp.GOOD not in lamps(served), "nothing green that nobody answered for"
    assert run_problem(served.snapshot(), form_problem="")
    served.acknowledge()
    assert served.state is WindowState.DISCONNECTED, "the one way on is to reconnect"
    assert Lamp.GOOD not in lamps(served)


def test_a_source_that_is_there_is_looked_at_and_stays_ready(
    served: Session, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connected, "HOLDS", -1.0)
    assert not served.snapshot().known
    assert Lamp.GOOD not in lamps(served)[:1], "an old answer says nothing of now"
    monkeypatch.undo()
    said = len(served.log.lines)
    before = served.bench.age
    served.bench.look()
    until(served, lambda: served.bench.age < before)
    assert served.state is WindowState.READY and served.snapshot().known
    assert len(served.log.lines) == said, "a look that finds all well says nothing"


def switch_on_by_hand(served: Session, source: Source) -> None:
    """As somebody does at the source's front panel; the next look finds it."""
    with serial_for_url(source.served.addresses["coil"]) as by_hand:
        by_hand.write(b"CURR 0.3\nOUTP 1\n")
        while not source.output:
            time.sleep(0.005)
    served.bench.look()
    until(served, lambda: served.state is WindowState.FAULT)


def test_an_output_that_is_switched_on_by_hand_is_told_and_left_on(
    served: Session, source: Source
) -> None:
    """A look each minute is no reason to take the coil from a person."""
    switch_on_by_hand(served, source)
    fault = served.snapshot().fault
    assert fault is not None and "output is on" in fault.title
    assert source.output, "nothing was touched"
    served.acknowledge()
    served.connect_bench(str(source.bench))
    until(served, lambda: served.state is WindowState.READY)
    assert not source.output, "connecting again makes it safe"


def test_a_source_is_asked_before_anything_is_said_of_its_coil(
    app: QApplication, tmp_path: Path, source: Source
) -> None:
    """STOP said "no coil source" until it answered, though its output may be on."""
    session = Session(tmp_path / "runs", separate=False)
    session.connect_bench(str(source.bench))
    assert session.state is WindowState.CONNECTING
    assert coil(session) is CoilKnowledge.ASKED
    said = stop_text(session.state, session.coil_view())
    assert said.spoken == "STOP: asking the coil source"
    assert not {Lamp.GOOD, Lamp.ABSENT} & set(lamps(session)[:1])
    until(session, lambda: session.state is WindowState.READY)
    assert coil(session) is CoilKnowledge.OFF
    session.close()


def test_a_bench_that_nobody_could_ask_leaves_its_coil_unknown(
    app: QApplication, tmp_path: Path, source: Source
) -> None:
    session = Session(tmp_path / "runs", separate=False)
    session.connect_bench(str(source.bench))
    source.bench.write_text("broken")
    until(session, lambda: session.state is WindowState.FAULT)
    assert coil(session) is CoilKnowledge.UNKNOWN, "somebody else may be using it"
    session.close()


def test_stop_switches_off_what_a_fault_found_on(
    served: Session, source: Source
) -> None:
    """It did nothing at a fault, while 300 mA flowed and the source answered."""
    switch_on_by_hand(served, source)
    served.stop()
    until(served, lambda: coil(served) is CoilKnowledge.OFF)
    assert not source.output
    assert served.state is WindowState.FAULT, "which a person has yet to read"


@pytest.mark.parametrize("state", [WindowState.FAULT, WindowState.DISCONNECTED])
def test_stop_asks_a_source_that_did_not_answer_again(
    served: Session, source: Source, state: WindowState
) -> None:
    source.served.close()
    served.bench.check()
    until(served, lambda: served.state is WindowState.FAULT)
    if state is WindowState.DISCONNECTED:
        served.acknowledge()
    assert coil(served) is CoilKnowledge.UNKNOWN
    said = len(served.log.lines)
    served.stop()
    until(served, lambda: len(served.log.lines) == said + 2)
    asked, told = served.log.lines[said:]
    assert "Sending coil off" in asked.text, "it cannot be, and is not told as sent"
    assert "Not verified off" in told.text
    assert served.state is state and coil(served) is CoilKnowledge.UNKNOWN


def test_a_coil_that_could_not_be_looked_at_is_not_called_off(
    served: Session, source: Source
) -> None:
    """STOP between runs sends the coil off again; here it cannot."""
    source.bench.write_text("broken")
    served.stop()
    until(served, lambda: served.state is WindowState.FAULT)
    assert coil(served) is CoilKnowledge.UNKNOWN


def test_a_run_that_begins_during_a_look_waits_for_its_end(
    served: Session, source: Source
) -> None:
    served.bench.look()
    served.start(source.request, "at once")
    assert served.state is WindowState.RUNNING
    until(served, lambda: truth(served.state, served.coil_view()) is CoilKnowledge.LIVE)
    served.stop()
    until(served, lambda: served.state is WindowState.READY)


def test_what_answered_before_a_fault_is_not_green_after_it(served: Session) -> None:
    served.status.set_fault("Something broke.", "")
    assert Lamp.GOOD not in lamps(served)
    assert Lamp.BAD not in lamps(served), "a source that is verified off did not break"
    served.acknowledge()
    until(served, lambda: served.state is WindowState.READY)
    assert Lamp.GOOD in lamps(served), "it was asked"


def test_by_hand_is_not_called_ready() -> None:
    word, _ = clock_text(Snapshot(state=WindowState.READY, manual=True))
    assert word == "BY HAND"


def scope_of(session: Session) -> InstrumentView:
    chips = session.snapshot().instruments
    return next(one for one in chips if one.name == "Oscilloscope")


def test_a_scope_whose_samples_are_overdue_is_not_called_active(
    lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that hangs was, until the run ended after 6 s."""
    session = lab.session
    long = Request(str(lab.folder / "long.toml"), (), "sim")
    for begin in (
        lambda: session.start(long, "Long", session.plan.expectation),
        lambda: session.show_monitor(True),
    ):
        begin()
        assert scope_of(session).lamp is not Lamp.ACTIVE, "nobody has heard it yet"
        lab.until(lambda: scope_of(session).lamp is Lamp.ACTIVE)
        with monkeypatch.context() as later:
            later.setattr(heard, "monotonic", lambda: time.monotonic() + 100)
            seen = scope_of(session)
            assert seen.lamp is Lamp.WAITING and seen.value == "—"
            assert seen.detail.startswith("silent for 1")
        if session.busy:
            session.stop("enough")
            lab.until(lambda: session.state is WindowState.READY and not session.busy)


def test_a_scope_that_pauses_as_planned_is_not_overdue(
    lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person moved the probes, and the scope was said to be silent meanwhile."""
    session, opened = lab.session, execution.open_bench
    monkeypatch.setattr(
        execution,
        "open_bench",
        lambda *given, **how: replace(opened(*given, **how), place_probes=None),
    )
    quick = ('protocol.hold="0.2 s"', 'record.sample_rate="10 kS/s"')
    wiring = Request("wiring_check", quick, "sim")
    session.start(wiring, "Wiring", session.plan.expectation)
    for _ in range(2):
        lab.until(lambda: session.run.asked is not None)
        with monkeypatch.context() as later:
            later.setattr(heard, "monotonic", lambda: time.monotonic() + 100)
            seen = scope_of(session)
        assert seen.lamp is Lamp.GOOD and "silent" not in seen.detail
        session.run.answer()
    session.stop("enough")
    lab.until(lambda: session.state is WindowState.READY and not session.busy)


def test_a_scope_is_not_overdue_while_simulated_time_stands_still(
    lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A person was to read the field, and a simulated scope was called silent."""
    session, bench = lab.session, lab.folder / "by_hand.toml"
    bench.write_text(READ_BY_HAND + SCOPE)
    session.connect_bench(str(bench))
    lab.until(lambda: session.state is WindowState.READY)
    signals = ('record.signals=["V_C1", "V_K", "field"]',)
    asked = Request(str(lab.folder / "short.toml"), signals, str(bench))
    session.start(asked, "By hand", session.plan.expectation)
    lab.until(lambda: session.run.asked is not None)
    for ahead in (0, 100):
        with monkeypatch.context() as later:
            later.setattr(heard, "monotonic", lambda by=ahead: time.monotonic() + by)
            assert scope_of(session).lamp is Lamp.GOOD
    session.stop("enough")
    lab.until(lambda: session.state is WindowState.READY and not session.busy)
    session.connect_bench("sim")
    lab.until(lambda: session.state is WindowState.READY)


def test_what_goes_on_after_a_pause_is_due_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = [0.0]
    monkeypatch.setattr(heard, "monotonic", lambda: clock[0])
    one = heard.Heard()
    one.pause()
    clock[0] = 50.0
    one.word()  # the last of what was streamed
    assert not one.overdue
    clock[0] = 100.0
    one.go_on()
    clock[0] = 100.9
    assert not one.overdue
    clock[0] = 101.1
    assert one.overdue, "and the pause says nothing of how slow it is"


def test_who_is_slow_is_not_overdue(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(heard, "monotonic", lambda: clock[0])
    one = heard.Heard()
    clock[0] = 0.9
    assert not one.overdue
    clock[0] = 2.5
    assert one.overdue and one.silent == 2.5
    one.word()  # it is slow, and there
    clock[0] = 7.0
    assert not one.overdue
    clock[0] = 7.6
    assert one.overdue


def test_readings_that_are_overdue_are_shown_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    clock = [0.0]
    monkeypatch.setattr(heard, "monotonic", lambda: clock[0])
    run = LiveRun(Link(separate=False), Status(Log()), Log(), Path("runs"))
    run.source = LiveSource(None, 1.0)
    run.hear(TemperatureRead(0.0, 295.0))
    run.hear(VoltageRead("V_GS", SimpleNamespace(voltage=1.4)))
    run.hear(FieldRead(0.0, 0.01))
    clock[0] = 0.5
    assert not any(one.overdue for one in run.answered.values())
    clock[0] = 3.0
    assert all(one.overdue for one in run.answered.values())
    assert set(run.answered) == {"thermometer", "V_GS", "meter"}
