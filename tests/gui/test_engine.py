"""The process that drives benches: what happens when one of the two ends dies."""

import json
import os
import signal
import time
from collections.abc import Callable, Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication
from served_source import Source

from gui.look.theme import Theme
from gui.session.session import Session
from gui.state import CoilKnowledge, WindowState, truth
from gui.window import Window
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.commands import begin_manual, begin_run, hold, renew
from tactile_lab.engine.engine import Engine, Reply
from tactile_lab.engine.events import Ended, Samples
from tactile_lab.engine.jobs import read_field
from tactile_lab.engine.request import Request
from tactile_lab.engine.threads import start

LONGEST = 90.0
SCENE = """
[protocol]
name = "pulses"
levels = ["80 mN"]
hold = "10000 s"

[record]
signals = ["V_C1"]
sample_rate = "10 kS/s"
"""


@pytest.fixture
def request_(tmp_path: Path) -> Request:
    (tmp_path / "long.toml").write_text(SCENE)
    return Request(str(tmp_path / "long.toml"), (), "sim")


def ended(out: Path) -> dict[str, object]:
    (file,) = out.glob("*/run.json")
    found: dict[str, object] = json.loads(file.read_text())
    return found


def test_window_that_has_gone_leaves_coil_off_and_record_complete(
    tmp_path: Path, request_: Request
) -> None:
    ours, theirs = Pipe()
    serving = start(Engine(theirs, realtime=False).serve, "engine")
    ours.send((1, Engine.begin, begin_run, (request_, tmp_path / "runs", {}), {}))
    live = False
    while not live:
        assert ours.poll(LONGEST), "the engine tells nothing"
        number, told = ours.recv()
        assert number == 1
        live = isinstance(told, Samples) and told.coil.live and bool(told.bins)
    ours.close()
    serving.join(LONGEST)
    assert not serving.is_alive()
    info = ended(tmp_path / "runs")
    assert info["status"] == "aborted"
    assert info["coil_verified_off"] is True
    assert "window has gone" in str(info["reason"])


@pytest.mark.timeout(400)
def test_engine_that_dies_is_a_fault_with_the_coil_unknown(
    app: QApplication, tmp_path: Path, request_: Request
) -> None:
    session = Session(tmp_path / "runs", realtime=False)
    window = Window(session, Theme("light"))

    def until(done: Callable[[], object]) -> None:
        end = time.monotonic() + LONGEST
        while not done():
            assert time.monotonic() < end, [line.text for line in session.log.lines]
            app.processEvents()
            session.poll()
            time.sleep(0.005)

    def listed() -> list[str]:
        return [card.entry.status for card in window.review.runs.cards]

    def known() -> CoilKnowledge:
        return truth(session.state, session.coil_view())

    session.connect_bench("sim")
    until(lambda: session.state is WindowState.READY)
    engine = session.link.pid
    assert engine is not None and engine != os.getpid()
    session.start(request_, "long")
    until(lambda: known() is CoilKnowledge.LIVE)
    until(lambda: listed() == ["running"])
    os.kill(engine, signal.SIGKILL)
    until(lambda: session.state is WindowState.FAULT)
    assert not session.busy
    until(lambda: listed() == ["cut short"])
    until(lambda: "Cut short" in window.centre.progress.text)
    assert known() is CoilKnowledge.UNKNOWN
    session.acknowledge()
    session.connect_bench("sim")
    until(lambda: session.state is WindowState.READY)
    assert session.link.pid != engine
    assert known() is CoilKnowledge.OFF
    window.close()
    session.close()
    window.deleteLater()
    assert not session.link.alive
    assert ended(tmp_path / "runs")["status"] == "running", "`recover` mends it"


def wait_for(done: Callable[[], object], poll: Callable[[], object]) -> None:
    end = time.monotonic() + LONGEST
    while not done():
        assert time.monotonic() < end
        poll()
        time.sleep(0.005)


def hears(
    pipe: Connection, wanted: Callable[[object], object], *, lives: bool = True
) -> object:
    """What the engine tells, as soon as it is what is wanted; `lives`: the window."""
    while True:
        assert pipe.poll(LONGEST), "the engine tells nothing"
        number, told = pipe.recv()
        if wanted(told):
            return told
        if lives and isinstance(told, Samples):
            pipe.send((number, Engine.say, renew, (), {}))


def flows(told: object) -> bool:
    return isinstance(told, Samples) and abs((told.coil.measured or 0) - 0.1) < 2e-3


@pytest.fixture
def pipe() -> Iterator[Connection]:
    """An engine's window, which says nothing by itself."""
    ours, theirs = Pipe()
    serving = start(Engine(theirs).serve, "engine")
    yield ours
    ours.close()
    serving.join(LONGEST)
    assert not serving.is_alive()


def test_window_that_hangs_loses_the_coil_by_hand(
    pipe: Connection, source: Source
) -> None:
    pipe.send((1, Engine.begin, begin_manual, (source.request,), {}))
    pipe.send((1, Engine.say, hold, (0.1,), {}))
    ended = hears(pipe, lambda told: isinstance(told, Ended), lives=False).ending
    assert ended.state is RunState.FAULTED
    assert ended.off.verified and "sign of life" in ended.reason
    assert not source.output


def test_stop_by_hand_is_verified_and_field_is_read(pipe: Connection) -> None:
    request = Request("demo", ('record.signals=["force", "field"]',), "sim")
    pipe.send((1, Engine.begin, begin_manual, (request,), {}))
    pipe.send((1, Engine.say, hold, (0.1,), {}))
    hears(pipe, flows)
    pipe.send((1, Engine.stop, "enough", (), {}))
    ended = hears(pipe, lambda told: isinstance(told, Ended)).ending
    assert ended.state is RunState.ABORTED and ended.reason == "enough"
    assert ended.off.verified
    pipe.send((2, Engine.ask, read_field, (request, 0), {}))
    read = hears(pipe, lambda told: isinstance(told, Reply)).value
    assert abs(read.mean) < 1e-4


def test_window_that_has_gone_leaves_the_coil_by_hand_off(source: Source) -> None:
    ours, theirs = Pipe()
    serving = start(Engine(theirs).serve, "engine")
    ours.send((1, Engine.begin, begin_manual, (source.request,), {}))
    ours.send((1, Engine.say, hold, (0.1,), {}))
    hears(ours, flows)
    assert source.output
    ours.close()
    serving.join(LONGEST)
    assert not serving.is_alive()
    assert not source.output


@pytest.mark.timeout(400)
def test_engine_that_dies_by_hand_is_switched_off_by_its_guard(
    app: QApplication, tmp_path: Path, source: Source
) -> None:
    session = Session(tmp_path / "runs")
    session.connect_bench(str(source.bench))
    wait_for(lambda: session.state is WindowState.READY, session.poll)
    session.begin_manual()
    session.manual.hold(0.1)
    wait_for(lambda: (session.coil_view().current or 0) > 0.09, session.poll)
    assert (
        source.output
        and truth(session.state, session.coil_view()) is CoilKnowledge.LIVE
    )
    os.kill(session.link.pid, signal.SIGKILL)
    wait_for(lambda: session.state is WindowState.FAULT, session.poll)
    assert not session.manual.alive and not session.busy
    assert truth(session.state, session.coil_view()) is CoilKnowledge.UNKNOWN
    wait_for(lambda: not source.output, session.poll)
    session.close()
