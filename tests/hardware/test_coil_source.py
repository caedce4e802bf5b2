"""Facts about a lab's own current source that no document settled.

Run ``TACTILE_LAB_HARDWARE=coil TACTILE_LAB_PORT=/dev/ttyUSB0 pytest -s
tests/hardware/test_coil_source.py``, with TACTILE_LAB_DIALECT naming the row (default
kepco-bop). The coil stays connected and takes at most 0.3 A for a few seconds.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from checklist import PORT, by_hand, fact, needs, row_of

from drivers.coil.source import CoilSource
from drivers.serial_line.conversation import Conversation
from drivers.serial_line.link import SerialLink
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.current_list import CurrentList
from tactile_lab.errors import InstrumentError
from tactile_lab.instruments.dialects import coil_dialect

pytestmark = needs("coil", "a current source")
NAME = os.environ.get("TACTILE_LAB_DIALECT", "kepco-bop")
ROW = row_of(coil_dialect, NAME)
LIMITS = CoilLimits(current=0.3, slew=2.0, compliance=5.0)


@pytest.fixture
def coil(monkeypatch: pytest.MonkeyPatch) -> Iterator[CoilSource]:
    monkeypatch.setattr("drivers.coil.guard.SILENCE", 5.0)
    source = CoilSource(ROW, PORT, LIMITS, RealClock())
    source.open()
    yield source
    source.close()
    assert source.warnings == []


@pytest.fixture
def bare() -> Iterator[SerialLink]:
    """The wire alone: the source is as its front panel has it."""
    one = SerialLink(PORT, ROW.serial, RealClock(), what="coil source")
    one.open()
    yield one
    one.close()


@pytest.fixture
def link(bare: SerialLink) -> SerialLink:
    """The same, remotely controlled: in local a source refuses all alike."""
    Conversation(bare, ROW).offer(ROW.optional)
    return bare


def drive(coil: CoilSource, current: float, seconds: float) -> None:
    """For `seconds`, and until the slew limit has let the set-point arrive."""
    begun, reached = time.monotonic(), False
    while (spent := time.monotonic() - begun) < seconds or not reached:
        assert spent < seconds + 60, "the set-point does not arrive"
        reached = coil.set_current(current) == current
        time.sleep(coil.update_interval)


def wait(coil: CoilSource, seconds: float) -> None:
    """Let time pass without being taken for hung by the guard."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        coil.beat()
        time.sleep(0.1)


def test_name_and_settings(coil: CoilSource) -> None:
    fact("identity", coil.identity)
    fact("settings", coil.settings())


def test_latency(link: SerialLink) -> None:
    times = []
    for _ in range(50):
        begun = time.monotonic()
        answer = link.query(ROW.set_query)
        times.append(time.monotonic() - begun)
    characters = len(ROW.set_query) + len(answer) + 3
    wire = characters * ROW.serial.character_time
    fact("round trip, ms", f"{1e3 * statistics.median(times):.1f}")
    fact("of it latency, ms", f"{1e3 * (statistics.median(times) - wire):.1f}")
    fact("raw answer to the set-point query", repr(answer))


def test_remote(bare: SerialLink) -> None:
    """What it says to the row's optional lines, and to a set-point before and after."""
    for line in (ROW.set_line(0.0), *ROW.optional, ROW.set_line(0.0)):
        *first, last = ROW.verified(line)
        for part in first:
            bare.write(part)
        fact(f"answer to {line}", bare.query(last) if ROW.error else "not asked")


OWNER = """
import sys, time
from drivers.coil.source import CoilSource
from tactile_lab.instruments.dialects import coil_dialect
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
limits = CoilLimits(current=0.3, slew=2.0, compliance=5.0)
row = coil_dialect(sys.argv[2])
wire = row.serial.model_copy(update={"timeout": 0.4})
row = row.model_copy(update={"serial": wire})
coil = CoilSource(row, sys.argv[1], limits, RealClock())
coil.open()
coil.energise()
print("live", flush=True)
while True:
    coil.set_current(0.1)
    time.sleep(coil.update_interval)
"""


@pytest.mark.skipif(os.name != "posix", reason="kills a process the POSIX way")
def test_guard(tmp_path: Path) -> None:
    """Kill a program that has the output on, and see the guard switch it off."""
    with subprocess.Popen(
        [sys.executable, "-c", OWNER, PORT, NAME],
        stdout=subprocess.PIPE,
        env=os.environ | {"XDG_STATE_HOME": str(tmp_path)},
    ) as owner:
        assert owner.stdout is not None
        assert owner.stdout.readline() == b"live\n"
        owner.kill()
    log = tmp_path / "tactile-lab" / "guard.log"
    until = time.monotonic() + 60
    while not (log.exists() and " after " in log.read_text()):
        assert time.monotonic() < until, "the guard did nothing"
        time.sleep(0.05)
    for line in log.read_text().splitlines():
        fact("guard", line)
    assert "NOT verified" not in log.read_text()
    one = SerialLink(PORT, ROW.serial, RealClock(), what="coil source")
    one.open()
    fact("output after it", one.query(ROW.on_query))
    one.close()


def test_update_interval(coil: CoilSource) -> None:
    fact("update interval, ms", f"{1e3 * coil.update_interval:.1f}")
    fact("planned, ms", f"{1e3 * coil.dialect.promised_interval():.1f}")


def test_zero_then_on_then_a_small_current(coil: CoilSource) -> None:
    coil.energise()
    fact("current at 0 A, output on", coil.read_current().value)
    for current in (0.25, -0.25):
        drive(coil, current, 1.0)
        time.sleep(0.3)
        measured, volts = coil.read_current().value, coil._wire.voltage()
        fact(f"at {current} A: measured A, V, Ohm", (measured, volts, volts / measured))
        assert measured == pytest.approx(current, rel=0.02, abs=0.005)
    report = coil.safe_off()
    fact("safe off", report)
    assert report.verified


def test_off_answers(coil: CoilSource) -> None:
    """What the model measures with its output off."""
    coil.energise()
    drive(coil, 0.1, 0.5)
    begun = time.monotonic()
    assert coil.safe_off().verified
    fact(
        "time to verified off from 0.1 A, ms", f"{1e3 * (time.monotonic() - begun):.0f}"
    )
    fact("current read with the output off", coil.read_current())


def test_error_answers(link: SerialLink) -> None:
    if ROW.error is None:
        pytest.skip("the row has no error query")
    link.write("NONSENSE 1")
    fact("answer after an unknown command", link.query(ROW.error))
    link.write(ROW.set.format(i=99.0))
    fact("answer after 99 A", link.query(ROW.error))
    fact("and after that", link.query(ROW.error))


def test_compound_lines(link: SerialLink) -> None:
    """Whether a set-point and the error query go in one line, as the row has it."""
    lines = ROW.verified(ROW.set_line(0.0))
    fact("sent", lines)
    for line in lines[:-1]:
        link.write(line)
    fact("answered", link.query(lines[-1]))


@pytest.mark.parametrize("baud", [9600, 19200, 38400])
def test_baud_rates(baud: int) -> None:
    """Set the source to each rate at its panel; others do not answer."""
    wire = ROW.serial.model_copy(update={"baud": baud})
    one = SerialLink(PORT, wire, RealClock(), what="coil source")
    try:
        one.open()
        fact(f"{baud} baud", one.identity)
    except InstrumentError as reason:
        fact(f"{baud} baud", reason)
    finally:
        one.close()


@by_hand("pull the cable")
def test_pulled_cable(coil: CoilSource) -> None:
    coil.energise()
    print("\nPull the serial cable now.")
    with pytest.raises(InstrumentError) as seen:
        drive(coil, 0.1, 30.0)
    fact("pulled cable", f"{seen.value} (cause {seen.value.__cause__!r})")
    print("\nPlug it in again within 10 s.")
    wait(coil, 10.0)
    assert coil.safe_off().verified


@pytest.mark.skipif(ROW.list is None, reason="the row has no list mode")
def test_list(coil: CoilSource) -> None:
    coil.energise()
    currents = np.array([0.002 * min(k, 100 - k) for k in range(101)])
    points = CurrentList(currents, np.full(101, 0.01))
    begun = time.monotonic()
    coil.load_list(points)
    fact("loading 101 points, s", f"{time.monotonic() - begun:.2f}")
    coil.start_list()
    wait(coil, points.duration / 2)
    fact("current half-way, A", coil.read_current().value)
    wait(coil, points.duration)
    coil.end_list()
    assert coil.safe_off().verified


@by_hand("give a voltage")
def test_analogue_input(coil: CoilSource) -> None:
    """What flows with 0 A set and 0.2 V at the analogue input."""
    coil.energise()
    print("\nWithin 20 s: 0.2 V to the analogue input.")
    wait(coil, 20.0)
    try:
        fact("current at 0 A set, A", coil.read_current().value)
    except InstrumentError as tripped:
        fact("current at 0 A set", tripped)
    assert coil.safe_off().verified
