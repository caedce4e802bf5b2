"""What the window claims of instruments and coil while nothing runs."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from serial import serial_for_url
from served_source import Source

from gui.session import bench as connected
from gui.session.session import Session
from gui.state import (
    CoilKnowledge,
    Lamp,
    Snapshot,
    WindowState,
    clock_text,
    run_problem,
    truth,
)

LONGEST = 90.0


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
    monkeypatch.setattr(connected, "STALE", -1.0)
    assert not served.snapshot().known
    assert Lamp.GOOD not in lamps(served)[:1], "an old answer says nothing of now"
    monkeypatch.undo()
    said = len(served.log.lines)
    before = served.bench.age
    served.bench.look()
    until(served, lambda: served.bench.age < before)
    assert served.state is WindowState.READY and served.snapshot().known
    assert len(served.log.lines) == said, "a look that finds all well says nothing"


def test_an_output_that_is_switched_on_by_hand_is_told_and_left_on(
    served: Session, source: Source
) -> None:
    """A look each minute is no reason to take the coil from a person."""
    with serial_for_url(source.served.addresses["coil"]) as by_hand:
        by_hand.write(b"CURR 0.3\nOUTP 1\n")
        while not source.output:
            time.sleep(0.005)
    served.bench.look()
    until(served, lambda: served.state is WindowState.FAULT)
    fault = served.snapshot().fault
    assert fault is not None and "output is on" in fault.title
    assert source.output, "nothing was touched"
    served.acknowledge()
    served.connect_bench(str(source.bench))
    until(served, lambda: served.state is WindowState.READY)
    assert not source.output, "connecting again makes it safe"


def test_a_coil_that_could_not_be_looked_at_is_not_called_off(
    served: Session, source: Source
) -> None:
    """STOP between runs sends the coil off again; here it cannot."""
    source.bench.write_text("broken")
    served.stop()
    until(served, lambda: served.state is WindowState.FAULT)
    known = truth(served.state, served.coil_view())
    assert known is CoilKnowledge.UNKNOWN


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
