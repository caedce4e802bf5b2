"""Each fault of the scope in a whole run: coil verified off, data kept, reason told."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivers.picoscope.scope import PicoScope
from sim_backend.bench import open_bench
from sim_backend.picoscope.faults import ScopeFault
from sim_backend.picoscope.scope import UnitModel
from sim_backend.picoscope.sdk import FakePs3000a
from tactile_lab.acquisition.ending import Executed
from tactile_lab.acquisition.events import Event, Message, Progress, RunState
from tactile_lab.engine.execution import Execution
from tactile_lab.planning.needs import needs
from tactile_lab.scene.load import load
from tactile_lab.scope import Block
from tactile_lab.store.run import Run
from tactile_lab.store.verify import verify

OVERRIDES = (
    'protocol.levels=["200 mN"]',
    "protocol.ramp=0.1 s",
    "protocol.hold=0.3 s",
    "protocol.rest=0.1 s",
    "record.sample_rate=0.5 MS/s",
)
AT = 150_000
"""Sample at which faults strike; the run has more."""


def run(folder: Path, *faults: ScopeFault) -> tuple[Executed, int]:
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
            ScopeFault(kind="unplug", sample=AT),
            "does not answer: unplugged or without power",
        ),
        (ScopeFault(kind="silent", sample=AT), "sent nothing for"),
        (ScopeFault(kind="stream_fails", sample=AT), "streaming stopped by itself"),
        (ScopeFault(kind="hang", sample=AT, duration=5.0), ""),
        (ScopeFault(kind="gap", sample=AT, samples=700), "Samples are missing"),
        (ScopeFault(kind="stall", sample=AT), "would have been overwritten"),
        (ScopeFault(kind="supply_lost", sample=AT), "mains adapter is not connected"),
        (
            ScopeFault(kind="supply_connected", sample=AT),
            "mains adapter was plugged in",
        ),
        (ScopeFault(kind="undervoltage", sample=AT), "cannot feed the scope"),
        (ScopeFault(kind="reset", sample=AT), "does not answer"),
        (
            ScopeFault(
                kind="status", call="GetStreamingLatestValues", nth=15, code=0x4C
            ),
            "power failed",
        ),
        (
            ScopeFault(
                kind="status", call="GetStreamingLatestValues", nth=15, code=0x999
            ),
            "0x999, unknown",
        ),
    ],
    ids=lambda value: value.kind if isinstance(value, ScopeFault) else "",
)
def test_faults_while_streaming(tmp_path: Path, fault: ScopeFault, reason: str) -> None:
    done, samples = run(tmp_path, fault)
    ending = done
    assert ending.state is RunState.FAULTED
    assert ending.exit_code == 3
    assert ending.off.verified, ending.off.text
    assert reason in (ending.reason or ""), ending.reason
    # all but what the scope had not handed over yet
    assert samples >= 100_000
    # where samples are missing, nobody knows how many, and nobody says none
    lost = fault.kind in ("gap", "stall", "stream_fails")
    assert done.loss["samples"] == (None if lost else 0)
    verdict = verify(done.folder)
    assert verdict.sound and verdict.certificate.clean is not lost
    assert ("samples are missing" in str(verdict.certificate)) is lost


def test_a_driver_that_hangs_ends_a_long_hold_too(tmp_path: Path) -> None:
    """The current flowed on to the end of the hold, and the sample rate was blamed."""
    long = [*OVERRIDES, "protocol.hold=60 s", 'protocol.levels=["100 mN"]']
    scene = load("demo", long)
    hang = ScopeFault(kind="hang", sample=AT, duration=100.0)
    bench = open_bench(scene, needs(scene), scope_faults=(hang,))
    done = Execution(scene, tmp_path, bench=bench).run()
    assert done.state is RunState.FAULTED and done.off.verified
    assert "driver has not come back" in (done.reason or "")
    with Run.load(done.folder) as stored:
        assert stored.current["time"][-1] < 5.0


def test_a_loss_that_only_the_last_poll_finds_is_told(tmp_path: Path) -> None:
    sound, library = run_slowly(tmp_path / "sound")
    assert sound.exit_code == 0
    polls = library.device.schedule.calls["GetStreamingLatestValues"]
    last = ScopeFault(
        kind="gap", call="GetStreamingLatestValues", nth=polls, samples=700
    )
    done, _ = run_slowly(tmp_path / "lossy", last)
    assert done.off.verified
    assert done.state is RunState.FAULTED
    assert "Samples are missing" in (done.reason or "")
    assert done.loss["samples"] is None
    verdict = verify(done.folder)
    assert "Samples are missing" in verdict.notes[0]
    assert "not known how many" in str(verdict.certificate)


@pytest.mark.parametrize("invents", [False, True], ids=["fast", "invents"])
def test_more_samples_than_time_went_by_for_are_not_called_sound(
    tmp_path: Path, invents: bool
) -> None:
    """The run was complete and sound, with times that were wrong by half a percent."""
    scene = load("demo", OVERRIDES)
    make = UnitModel(clock_error=0.0 if invents else -5e-3)
    bench = open_bench(scene, needs(scene), make=make)
    assert bench.scope is not None
    poll, added = bench.scope.poll, 0

    def poll_twice() -> Block | None:
        nonlocal added
        block = poll()
        if block is None:
            return None
        # a driver that hands a tenth of each block over once more
        more = block.codes[:, : block.samples // 10]
        codes = np.concatenate([block.codes, more], axis=1)
        first, added = block.first + added, added + more.shape[1]
        return replace(block, first=first, codes=codes)

    if invents:
        bench.scope.poll = poll_twice  # type: ignore[method-assign]
    done = Execution(scene, tmp_path, bench=bench).run()
    assert done.state is RunState.FAULTED and done.off.verified
    assert "Too many samples: the scope delivered" in (done.reason or "")
    assert done.loss["samples"] is None
    verdict = verify(done.folder)
    assert verdict.sound and verdict.certificate is not None
    assert "too many" in verdict.notes[0] and not verdict.certificate.clean
    assert "their times are not known" in str(verdict.certificate)


def test_samples_that_come_late_as_the_run_is_stopped_are_kept(tmp_path: Path) -> None:
    scene = load("demo", OVERRIDES)
    late = ScopeFault(kind="late", sample=530_000, samples=100_000, duration=0.12)
    bench = open_bench(scene, needs(scene), scope_faults=(late,))

    def stop(event: Event) -> None:
        if isinstance(event, Progress) and event.elapsed > 0.4:
            execution.stop("a person pressed STOP")

    execution = Execution(scene, tmp_path, bench=bench, emit=stop)
    done = execution.run()
    assert done.state is RunState.ABORTED and done.off.verified
    with Run.load(done.folder) as stored:
        verified_off = stored.current["time"][-1]
        assert stored.axis.time_of(float(stored.samples)) > verified_off
    assert verify(done.folder).certificate.clean


def run_slowly(folder: Path, *faults: ScopeFault) -> tuple[Executed, FakePs3000a]:
    """A run whose polls take 5 ms, so that the last, too, brings samples."""
    scene = load("demo", OVERRIDES)
    bench = open_bench(scene, needs(scene), scope_faults=faults)
    assert isinstance(bench.scope, PicoScope)
    poll, library = bench.scope.poll, bench.scope._unit._library
    assert isinstance(library, FakePs3000a)

    def slow_poll() -> Block | None:
        bench.clock.sleep_until(bench.clock.now() + 0.005)
        return poll()

    bench.scope.poll = slow_poll  # type: ignore[method-assign]
    return Execution(scene, folder, bench=bench).run(), library


@pytest.mark.parametrize(
    "call", ["OpenUnit", "GetUnitInfo", "SetChannel", "RunStreaming"]
)
def test_unplugged_before_the_first_sample(tmp_path: Path, call: str) -> None:
    done, samples = run(tmp_path, ScopeFault(kind="unplug", call=call))
    assert done.state is RunState.FAULTED
    assert done.off.verified
    assert samples == 0


@pytest.mark.parametrize(
    "fault",
    [
        ScopeFault(
            kind="status", call="GetStreamingLatestValues", nth=9, code=0x27, times=5
        ),
        ScopeFault(
            kind="status", call="GetStreamingLatestValues", nth=9, code=0x43, times=2
        ),
        ScopeFault(kind="overrange", sample=AT, duration=0.05, inputs=("C",)),
    ],
    ids=["busy", "overlap", "overrange"],
)
def test_what_a_run_survives(tmp_path: Path, fault: ScopeFault) -> None:
    done, samples = run(tmp_path, fault)
    assert done.state is RunState.COMPLETE, done.reason
    assert done.off.verified
    assert dict(done.loss) == {"samples": 0, "spikes": 0}
    assert samples >= 300_000


@pytest.mark.parametrize(
    ("serial", "told"), [("", True), ("bench.scope.serial=SIM04/0001", False)]
)
def test_a_scope_that_was_chosen_among_several_is_told(
    tmp_path: Path, serial: str, told: bool
) -> None:
    scene = load("demo", (*OVERRIDES, *filter(None, [serial])))
    make = UnitModel(others=("SIM04/0002",))
    seen: list[Event] = []
    bench = open_bench(scene, needs(scene), make=make)
    done = Execution(scene, tmp_path, bench=bench, emit=seen.append).run()
    assert done.state is RunState.COMPLETE, done.reason
    said = [one.text for one in seen if isinstance(one, Message)]
    assert any("SIM04/0001 was taken, not SIM04/0002" in one for one in said) is told
