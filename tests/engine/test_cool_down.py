"""Runs one after another on a real bench: each begins with a coil that is cold."""

import json
import math
import os
import re
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
import serial
from served_source import Source

from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.events import (
    CoilCurrent,
    Event,
    Message,
    RunState,
    StateChanged,
)
from tactile_lab.engine.coil_heat import CoilHeat
from tactile_lab.engine.execution import Execution
from tactile_lab.engine.manual import ManualControl
from tactile_lab.errors import LimitError
from tactile_lab.instruments import port
from tactile_lab.instruments.guard_log import default_log, left_by_guard
from tactile_lab.scene.load import load

pytestmark = pytest.mark.skipif(os.name != "posix", reason="needs a pseudo-terminal")

LIMITS = """
[coil.limits]
continuous = "50 mA"
heat = "0.02 A^2 s"
recovery = "1 s"
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
    made = Source(tmp_path)
    made.bench.write_text(made.bench.read_text() + LIMITS)
    yield made
    made.served.close()


def test_the_next_run_waits_until_the_coil_is_cold(source: Source, tmp_path: Path):
    for _ in range(2):
        one = Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs")
        assert one.run().state is RunState.COMPLETE
    wait = one.plan.estimate.cool_down
    assert wait > 0.1
    began = switched_on(source)
    assert len(began) == 2
    ended = min(at for at in switched_on(source, to=False) if at > began[0])
    assert began[1] - ended >= wait


def test_a_stop_ends_the_waiting(source: Source, tmp_path: Path):
    told: list[Event] = []
    one = Execution(
        load("demo", SHORT, str(source.bench)), tmp_path / "runs", emit=told.append
    )
    heat = heat_of(source)
    heat.keep(1000.0)
    one.stop("not today")
    kept = heat.path.read_text()
    assert one.run().state is RunState.ABORTED
    warm = [t for t in told if isinstance(t, Message) and "still warm" in t.text]
    assert len(warm) == 1
    assert heat.path.read_text() == kept, "it is warm all the same"
    assert not source.log.exists() or '"value": true' not in source.log.read_text()


def switched_on(source: Source, to: bool = True) -> list[float]:
    """When its output was switched on, or off, monotonic s."""
    return [
        entry["monotonic_s"]
        for entry in map(json.loads, source.log.read_text().splitlines())
        if entry["what"] == "output" and bool(entry["value"]) is to
    ]


BY_HAND = """
import json, sys
from tactile_lab.acquisition.events import CoilCurrent
from tactile_lab.engine.manual import ManualControl
from tactile_lab.errors import LimitError
from tactile_lab.instruments.guard_log import default_log, left_by_guard
from tactile_lab.scene.load import load

def heard(event):
    if isinstance(event, CoilCurrent):
        hand.renew()
        if event.setpoint > 0.2:
            hand.stop("hot enough")
    elif event.text == "source opened":
        try:
            hand.hold(0.3)
        except LimitError as reason:
            print(reason)
            hand.stop("warm")

scene = load("demo", json.loads(sys.argv[2]), sys.argv[1])
hand = ManualControl(scene, emit=heard)
print(hand.run().off.verified)
"""


def test_what_was_heated_by_hand_is_hot_for_the_next_program(source: Source):
    """Its heat was forgotten, and counted from nothing by whoever came next."""
    bench = source.bench.read_text().replace("0.02 A^2 s", "0.1 A^2 s")
    source.bench.write_text(bench.replace('"1 s"', '"600 s"'))
    said = []
    for _ in range(2):
        asked = [sys.executable, "-c", BY_HAND, str(source.bench), json.dumps(SHORT)]
        said.append(subprocess.run(asked, stdout=-1, text=True))
    assert said[0].stdout == "True\n"
    assert heat_of(source).left() > 100.0
    first, second = said[1].stdout.splitlines()
    assert "still warm: 300 mA may flow in" in first and "50 mA at most" in first
    assert second == "True"
    assert len(switched_on(source)) == 1


def test_a_coil_is_the_same_by_each_name_of_its_port(source, tmp_path, monkeypatch):
    """One that /dev/ttyUSB0 had heated was cold for a bench file that names its id."""
    by_id = tmp_path / "by-id"
    by_id.mkdir()
    named = by_id / "usb-FTDI_AB12-if00"
    named.symlink_to(load("demo", SHORT, str(source.bench)).bench.coil.port)
    monkeypatch.setattr(port, "BY_ID", by_id)
    heat = heat_of(source)
    heat.keep(300.0)
    limits = replace(load("demo").bench.coil.limits, recovery=600.0)
    assert CoilHeat(str(named), limits).left() > 290.0


LONGEST = 600.0 * math.log(100)


def heat_of(source: Source) -> CoilHeat:
    """What is kept of its coil, had that a recovery of 600 s."""
    coil = load("demo", SHORT, str(source.bench)).bench.coil
    return CoilHeat(coil.port, replace(coil.limits, recovery=600.0))


def begun(
    source: Source, tmp_path: Path, changed: dict[str, str] | None = None
) -> "subprocess.Popen[str]":
    """A run in a program of its own."""
    keys = {**SHORT, **(changed or {})}
    changes = [f"--set={key}={json.dumps(value)}" for key, value in keys.items()]
    return subprocess.Popen(
        [sys.executable, "-m", "tactile_lab", "run", "demo", "--no-report",
         "--bench", str(source.bench), "--out", str(tmp_path / "runs"), *changes],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip


def wait_until_on(source: Source, program: "subprocess.Popen[str]") -> None:
    """Until its output is on; not where the program ends before."""
    while not (source.log.exists() and switched_on(source)):
        assert program.poll() is None
        time.sleep(0.001)


def test_another_program_waits_too_until_it_is_stopped(source: Source, tmp_path: Path):
    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    left = 1000.0
    heat_of(source).keep(left)
    other = begun(source, tmp_path)
    assert other.stdout is not None
    with other.stdout as lines:
        said = next((line for line in lines if "still warm" in line), "")
        seconds = re.search(r"begins in (\d+) s", said)
        assert seconds and left - 500.0 < int(seconds[1]) <= left
        other.send_signal(signal.SIGINT)
        lines.read()
    assert other.wait() == 130
    assert not source.log.exists() or not switched_on(source)


def test_a_run_that_was_stopped_hot_leaves_it_hot(source: Source, tmp_path: Path):
    """What the plan expects of its end, where it cools already, does not hold."""
    bench = source.bench.read_text().replace("0.02 A^2 s", "20 A^2 s")
    source.bench.write_text(bench.replace('"1 s"', '"100 s"'))
    long = {**SHORT, "protocol.hold": "60 s", "protocol.rest": "1000 s"}

    def heard(event: Event) -> None:
        if isinstance(event, CoilCurrent) and event.setpoint > 0.1:
            one.stop("hot enough")

    one = Execution(
        load("demo", long, str(source.bench)), tmp_path / "runs", emit=heard
    )
    assert one.plan.estimate.cool_down == 0.0
    assert one.run().state is not RunState.COMPLETE
    driven = one.coil_state.setpoint is not None  # unless a busy machine prevented it
    assert (heat_of(source).left() > 100.0) == driven


def test_a_program_that_was_killed_counts_as_having_spent_the_budget(source: Source):
    heat, other = heat_of(source), heat_of(source)

    def driven() -> Ending:
        heat.begin()
        assert other.left() == 0.0, "whoever drives it has its port"
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        heat.kept_while(driven, lambda _: 0.0, print)
    assert other.left() == pytest.approx(LONGEST)
    other.seen_off()
    assert 0.0 < other.left() <= LONGEST, "counted once, from then on"


def test_after_a_restart_or_a_clock_set_back_it_waits_no_longer_than_it_takes(
    source: Source,
):
    heat = heat_of(source)
    heat.keep(0.0)
    kept = json.loads(heat.path.read_text())
    for boot, wall, least, most in (
        ("another", time.time() + 1e6, LONGEST, LONGEST),
        ("another", time.time() - 1.0, 0.0, 0.0),
        (kept["boot"], time.time() + 1e6, 0.0, 0.0 if kept["boot"] else LONGEST),
    ):
        changed = {**kept, "boot": boot, "cold_wall_s": wall}
        heat.path.write_text(json.dumps(changed))
        assert least <= heat.left() <= most


@pytest.mark.parametrize("text", ["", "{", "[]", "null", '{"heating": false}', "\0"])
def test_a_broken_file_is_refused_before_a_run_is_made(
    source: Source, tmp_path: Path, text: str
):
    heat = heat_of(source)
    heat.keep(0.0)
    heat.path.write_text(text)
    with pytest.raises(LimitError, match=r"delete the file"):
        Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs")
    assert not (tmp_path / "runs").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="needs a folder nobody can write")
def test_a_state_folder_that_cannot_be_written_is_refused_before_a_run_is_made(
    source: Source, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """It was a coil left unknown, exit code 4, and a run that counted as killed."""
    monkeypatch.setenv("XDG_STATE_HOME", "/proc/nobody")
    with pytest.raises(LimitError, match="Let XDG_STATE_HOME name a folder"):
        Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs")
    assert not (tmp_path / "runs").exists()
    with pytest.raises(LimitError, match="Let XDG_STATE_HOME name a folder"):
        ManualControl(load("demo", SHORT, str(source.bench)))


def test_a_run_that_never_reached_its_coil_leaves_it_cold(
    source: Source, tmp_path: Path
):
    one = Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs")
    source.served.close()
    assert one.run().state is RunState.FAULTED
    assert heat_of(source).left() == 0.0


def test_simulated_coils_are_new_with_each_run(source: Source, tmp_path: Path):
    scene = load("demo", SHORT)
    heat = CoilHeat(scene.bench.coil.port, scene.bench.coil.limits)
    heat.keep(1000.0)
    heat.path.write_text("broken")
    Execution(scene, tmp_path / "runs").folder.finish("aborted")


def test_a_coil_that_may_be_on_is_switched_off_before_it_is_waited_for(
    source: Source, tmp_path: Path
):
    """It waited for minutes, with the current on that it took the coil to be rid of."""
    told: list[bool] = []

    def heard(event: Event) -> None:
        if isinstance(event, Message) and "still warm" in event.text:
            told.append(source.output)
            one.stop("seen")

    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    killed(source, b"CURR 0.3\nOUTP 1\n")
    one = Execution(
        load("demo", SHORT, str(source.bench)), tmp_path / "runs", emit=heard
    )
    assert one.run().off.verified
    assert told == [False]
    assert heat_of(source).left() > LONGEST - 60.0, "counted from when it was off"


def test_a_coil_that_may_be_on_and_is_not_reached_is_not_waited_for(
    source: Source, tmp_path: Path
):
    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    killed(source, b"")
    one = Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs")
    source.served.close()
    done = one.run()
    assert done.exit_code == 4
    assert "cannot be opened" in done.told and "switch the coil source off" in done.told
    assert heat_of(source).lost


def killed(source: Source, said: bytes) -> None:
    """A program was killed that had the coil, and had said that to its source."""
    heat = heat_of(source)
    heat.keep(LONGEST, heating=True)
    set_by_hand(source, said)


SETTLED = 0.1
"""Many times L/R of the coil, s: a quick program read 299.9 mA of 300 mA."""


def set_by_hand(source: Source, said: bytes) -> None:
    """Have the source do what is said, its output on and its current there."""
    with serial.Serial(source.served.addresses["coil"]) as port:
        port.write(said)
        port.flush()
        while said and not any(d["what"] == "output" for d in source.told()):
            time.sleep(0.001)
        time.sleep(SETTLED)


def test_a_kill_counts_only_from_when_the_output_is_switched_on(
    source: Source, tmp_path: Path
):
    """A program killed while it connected kept the next from its coil for minutes."""
    known: dict[str, bool] = {}

    def heard(event: Event) -> None:
        if isinstance(event, StateChanged):
            path = heat_of(source).path
            known[event.state] = path.exists() and '"heating": true' in path.read_text()

    one = Execution(
        load("demo", SHORT, str(source.bench)), tmp_path / "runs", emit=heard
    )
    assert one.run().state is RunState.COMPLETE
    assert not known[RunState.CONNECTING]
    assert known[RunState.RUNNING] and known[RunState.STOPPING]


def test_a_coil_that_could_not_be_switched_off_is_hot_until_it_is_seen_off(
    source: Source, tmp_path: Path
):
    """It counted as cold soon after the run, though its current still flowed."""
    long = {**SHORT, "protocol.hold": "60 s"}

    def heard(event: Event) -> None:
        if isinstance(event, CoilCurrent) and event.setpoint > 0.1:
            source.served.close()

    bench = source.bench.read_text().replace("0.02 A^2 s", "20 A^2 s")
    source.bench.write_text(bench)
    one = Execution(
        load("demo", long, str(source.bench)), tmp_path / "runs", emit=heard
    )
    assert not one.run().off.verified
    assert heat_of(source).left() == pytest.approx(LONGEST)
    assert heat_of(source).lost


def test_a_coil_that_was_seen_off_by_hand_is_lost_no_more(source: Source):
    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    killed(source, b"CURR 0.3\nOUTP 1\n")
    hand = ManualControl(load("demo", SHORT, str(source.bench)))
    hand.stop("only looked")
    assert hand.run().off.verified
    assert not source.output and not heat_of(source).lost
    assert heat_of(source).left() > LONGEST - 60.0


def test_what_a_guard_switched_off_cools_since_then(source: Source, tmp_path: Path):
    """The morning after a kill, the first run waited for a coil that had cooled."""
    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    killed = begun(source, tmp_path)
    wait_until_on(source, killed)
    killed.kill()
    killed.communicate()
    told = left_by_guard(killed.pid)
    while told is None:  # a guard that is starved says it late
        told = left_by_guard(killed.pid)
    assert told.verified
    heat = heat_of(source)
    assert not heat.lost
    kept = json.loads(heat.path.read_text())
    for key in ("cold_steady_s", "cold_wall_s"):
        kept[key] -= 2000.0
    heat.path.write_text(json.dumps(kept))
    log = default_log()
    said = log.read_text()
    for ago, left in ((1500.0, LONGEST - 1500.0), (3000.0, LONGEST)):
        moment = time.strftime("%Y-%m-%dT%H:%M:%S%z", time.localtime(time.time() - ago))
        log.write_text(re.sub(r"^\S+", moment, said, flags=re.MULTILINE))
        assert heat.left() == pytest.approx(left, abs=60.0)
        assert heat.lost == (ago > 2000.0), "another process had its number before"


def test_a_coil_that_another_program_drives_is_refused(source: Source, tmp_path: Path):
    """Two that reach it over a network each switched off what the other drove."""
    bench = source.bench.read_text().replace("0.02 A^2 s", "20 A^2 s")
    source.bench.write_text(bench)
    other = begun(source, tmp_path, {"protocol.hold": "60 s"})
    try:
        wait_until_on(source, other)
        runs = len(list((tmp_path / "runs").iterdir()))
        for start in (lambda scene: Execution(scene, tmp_path / "runs"), ManualControl):
            with pytest.raises(LimitError, match=r"Another program .* drives the coil"):
                start(load("demo", SHORT, str(source.bench)))
        assert len(list((tmp_path / "runs").iterdir())) == runs
    finally:
        other.send_signal(signal.SIGINT)
        other.communicate()
    ManualControl(load("demo", SHORT, str(source.bench)))


def test_a_coil_found_on_beyond_its_continuous_current_cools_first(
    source: Source, tmp_path: Path
):
    """It was switched off and pressed with at once, whatever had made it hot."""
    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    set_by_hand(source, b"CURR 0.3\nOUTP 1\n")
    done = Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs").run()
    assert done.state is RunState.FAULTED and done.off.verified
    assert "300 mA flowed through the coil when its source was opened" in done.told
    assert len(switched_on(source)) == 1, "by hand"
    assert heat_of(source).left() > LONGEST - 60.0


def test_a_coil_found_hot_cools_though_its_run_was_stopped_at_once(
    source: Source, tmp_path: Path
):
    """What flowed was forgotten with the run, and the next pressed at once."""

    def heard(event: Event) -> None:
        if isinstance(event, StateChanged) and event.state is RunState.CONNECTING:
            one.stop("another scene was meant")

    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    set_by_hand(source, b"CURR 0.3\nOUTP 1\n")
    one = Execution(
        load("demo", SHORT, str(source.bench)), tmp_path / "runs", emit=heard
    )
    done = one.run()
    assert done.state is RunState.ABORTED and done.off.verified
    assert heat_of(source).left() > LONGEST - 60.0


def test_a_coil_found_hot_is_not_driven_by_hand(source: Source):
    """A warning was told, and as much could be set at once."""
    source.bench.write_text(source.bench.read_text().replace('"1 s"', '"600 s"'))
    set_by_hand(source, b"CURR 0.3\nOUTP 1\n")
    hand = ManualControl(load("demo", SHORT, str(source.bench)))
    hand.hold(0.2)
    done = hand.run()
    assert done.state is RunState.FAULTED and done.off.verified
    assert "300 mA flowed through the coil" in done.told
    assert len(switched_on(source)) == 1, "by hand"
    assert heat_of(source).left() > LONGEST - 60.0


def test_a_coil_found_on_within_its_continuous_current_is_used(
    source: Source, tmp_path: Path
):
    set_by_hand(source, b"CURR 0.04\nOUTP 1\n")
    done = Execution(load("demo", SHORT, str(source.bench)), tmp_path / "runs").run()
    assert done.state is RunState.COMPLETE
