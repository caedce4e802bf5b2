"""Facts about a lab's own teslameter that no document settled.

Run ``TACTILE_LAB_HARDWARE=teslameter TACTILE_LAB_PORT=/dev/ttyUSB0 pytest -s
tests/hardware/test_teslameter.py``, with TACTILE_LAB_DIALECT naming the row (default
lakeshore-425) and the probe in its zero chamber.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator

import pytest
from checklist import PORT, by_hand, fact, needs, row_of

from drivers.teslameter import Teslameter
from tactile_lab.clock import RealClock
from tactile_lab.instruments.dialects import teslameter_dialect

pytestmark = needs("teslameter", "a teslameter")


@pytest.fixture
def meter() -> Iterator[Teslameter]:
    row = row_of(teslameter_dialect, "lakeshore-425")
    one = Teslameter(row, PORT, RealClock())
    one.open()
    yield one
    one.close()


def test_name_and_settings(meter: Teslameter) -> None:
    fact("identity", meter.identity)
    fact("settings", meter.settings())


def test_zero_and_noise(meter: Teslameter) -> None:
    readings = []
    for _ in range(30):
        readings.append(meter.read().value)
        time.sleep(meter.interval)
    fact("mean of 30 readings, T", statistics.mean(readings))
    fact("their standard deviation, T", statistics.stdev(readings))
    fact("different readings among them", len(set(readings)))


def test_latency(meter: Teslameter) -> None:
    times = []
    for _ in range(30):
        begun = time.monotonic()
        meter.read()
        times.append(time.monotonic() - begun)
    fact("one reading takes, ms", f"{1e3 * statistics.median(times):.1f}")
    assert max(times) < meter.dialect.serial.timeout


@by_hand("move a magnet")
def test_sign_unit_and_overload(meter: Teslameter) -> None:
    for what in ("a magnet's north pole", "its south pole", "a field beyond the range"):
        input(f"\nHold {what} at the probe, then press Enter. ")
        try:
            fact(what, meter.read().value)
        except ValueError as reason:
            fact(what, reason)
