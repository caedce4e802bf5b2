"""Each fault of the scope in a whole run: coil verified off, data kept, reason told."""

from __future__ import annotations

from pathlib import Path

import pytest

from sim_backend.bench import open_bench
from sim_backend.picoscope.faults import Fault
from tactile_lab.acquisition.ending import Executed
from tactile_lab.acquisition.events import RunState
from tactile_lab.engine.execution import Execution
from tactile_lab.planning.needs import needs
from tactile_lab.scene.load import load
from tactile_lab.store.run import Run

OVERRIDES = (
    'protocol.levels=["200 mN"]',
    "protocol.ramp=0.1 s",
    "protocol.hold=0.3 s",
    "protocol.rest=0.1 s",
    "record.sample_rate=0.5 MS/s",
)
AT = 150_000
"""Sample at which faults strike; the run has more."""


def run(folder: Path, *faults: Fault) -> tuple[Executed, int]:
    """The finished run, and samples of V_K in its folder."""
    scene = load("demo", OVERRIDES)
    bench = open_bench(scene, needs(scene), scope_faults=faults)
    done = Execution(scene, folder, bench=bench).run()
    if not (done.folder / "data.h5").exists():
        return done, 0  # it ended before the first sample
    with Run.load(done.folder) as stored:
        return done, len(stored.signal("V_K"))


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        (
            Fault(kind="unplug", sample=AT),
            "does not answer: unplugged or without power",
        ),
        (Fault(kind="silent", sample=AT), "sent nothing for"),
        (Fault(kind="stream_fails", sample=AT), "streaming stopped by itself"),
        (Fault(kind="hang", sample=AT, duration=5.0), ""),
        (Fault(kind="gap", sample=AT, samples=700), "Samples are missing"),
        (Fault(kind="stall", sample=AT), "would have been overwritten"),
        (Fault(kind="supply_lost", sample=AT), "mains adapter is not connected"),
        (Fault(kind="supply_connected", sample=AT), "mains adapter was plugged in"),
        (Fault(kind="undervoltage", sample=AT), "cannot feed the scope"),
        (Fault(kind="reset", sample=AT), "does not answer"),
        (
            Fault(kind="status", call="GetStreamingLatestValues", nth=15, code=0x4C),
            "power failed",
        ),
        (
            Fault(kind="status", call="GetStreamingLatestValues", nth=15, code=0x999),
            "0x999, unknown",
        ),
    ],
    ids=lambda value: value.kind if isinstance(value, Fault) else "",
)
def test_faults_while_streaming(tmp_path: Path, fault: Fault, reason: str) -> None:
    done, samples = run(tmp_path, fault)
    ending = done
    assert ending.state is RunState.FAULTED
    assert ending.exit_code == 3
    assert ending.off.verified, ending.off.text
    assert reason in (ending.reason or ""), ending.reason
    # all but what the scope had not handed over yet
    assert samples >= 100_000
    assert done.loss["samples"] == 0


@pytest.mark.parametrize(
    "call", ["OpenUnit", "GetUnitInfo", "SetChannel", "RunStreaming"]
)
def test_unplugged_before_the_first_sample(tmp_path: Path, call: str) -> None:
    done, samples = run(tmp_path, Fault(kind="unplug", call=call))
    assert done.state is RunState.FAULTED
    assert done.off.verified
    assert samples == 0


@pytest.mark.parametrize(
    "fault",
    [
        Fault(
            kind="status", call="GetStreamingLatestValues", nth=9, code=0x27, times=5
        ),
        Fault(
            kind="status", call="GetStreamingLatestValues", nth=9, code=0x43, times=2
        ),
        Fault(kind="overrange", sample=AT, duration=0.05, inputs=("C",)),
    ],
    ids=["busy", "overlap", "overrange"],
)
def test_what_a_run_survives(tmp_path: Path, fault: Fault) -> None:
    done, samples = run(tmp_path, fault)
    assert done.state is RunState.COMPLETE, done.reason
    assert done.off.verified
    assert dict(done.loss) == {"samples": 0, "spikes": 0}
    assert samples >= 300_000
