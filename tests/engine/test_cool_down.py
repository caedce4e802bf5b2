"""Runs one after another on a real bench: each begins with a coil that is cold."""

import json
import os
import time
from pathlib import Path

import pytest
from served_source import Source

from tactile_lab.acquisition.events import Event, Message, RunState
from tactile_lab.engine import execution
from tactile_lab.engine.execution import Execution
from tactile_lab.scene.load import load

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")

LIMITS = """
[coil.limits]
continuous = "50 mA"
heat = "0.02 A^2 s"
recovery = "200 ms"
"""
SHORT = {
    "record.signals": ["force"],
    "protocol.levels": ["80 mN"],
    "protocol.ramp": "20 ms",
    "protocol.hold": "50 ms",
    "protocol.rest": "50 ms",
}


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    monkeypatch.setattr(execution, "_COLD_FROM", {})
    made = Source(tmp_path)
    made.bench.write_text(made.bench.read_text() + LIMITS)
    yield made
    made.served.close()


def test_the_next_run_waits_until_the_coil_is_cold(source: Source, tmp_path: Path):
    told: list[Event] = []
    for _ in range(2):
        one = Execution(
            load("demo", SHORT, str(source.bench)), tmp_path / "runs", emit=told.append
        )
        assert one.run().state is RunState.COMPLETE
    wait = one.plan.estimate.cool_down
    assert wait > 0.1
    switched = [
        (entry["monotonic_s"], entry["value"])
        for entry in map(json.loads, source.log.read_text().splitlines())
        if entry["what"] == "output"
    ]
    began = [at for at, on in switched if on]
    assert len(began) == 2
    ended = min(at for at, on in switched if not on and at > began[0])
    assert began[1] - ended >= wait
    warm = [t for t in told if isinstance(t, Message) and "still warm" in t.text]
    assert len(warm) == 1


def test_a_stop_ends_the_waiting(source: Source, tmp_path: Path):
    one = Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs")
    cold = execution._COLD_FROM[one.bench.name] = time.monotonic() + 1e6
    one.stop("not today")
    assert one.run().state is RunState.ABORTED
    assert execution._COLD_FROM[one.bench.name] == cold, "it is warm all the same"
    assert not source.log.exists() or '"value": true' not in source.log.read_text()
