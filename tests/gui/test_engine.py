"""The process that drives benches: what happens when one of the two ends dies."""

import json
import os
import signal
import time
from collections.abc import Callable
from multiprocessing import Pipe
from pathlib import Path

import pytest
from PySide6.QtWidgets import QApplication

from gui.session.commands import StartRun
from gui.session.engine import Engine
from gui.session.messages import Samples
from gui.session.request import Request
from gui.session.session import Session
from gui.session.threads import start
from gui.state import State, Truth, truth

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
    ours.send(StartRun(1, request_, tmp_path / "runs", report=False))
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

    def until(done: Callable[[], object]) -> None:
        end = time.monotonic() + LONGEST
        while not done():
            assert time.monotonic() < end, [line.text for line in session.lines]
            session.poll()
            time.sleep(0.005)

    def known() -> Truth:
        return truth(session.state, session.coil_view())

    session.connect_bench("sim")
    until(lambda: session.state is State.READY)
    engine = session.link.pid
    assert engine is not None and engine != os.getpid()
    session.start(request_, "long")
    until(lambda: known() is Truth.LIVE)
    os.kill(engine, signal.SIGKILL)
    until(lambda: session.state is State.FAULT)
    assert not session.busy
    assert known() is Truth.UNKNOWN
    session.acknowledge()
    session.connect_bench("sim")
    until(lambda: session.state is State.READY)
    assert session.link.pid != engine
    assert known() is Truth.OFF
    session.close()
    assert not session.link.alive
    assert ended(tmp_path / "runs")["status"] == "running", "`recover` mends it"
