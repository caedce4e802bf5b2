"""Facts about a lab's own source meter that no document settled.

Run ``TACTILE_LAB_HARDWARE=voltage_source TACTILE_LAB_PORT=/dev/ttyUSB0 pytest -s
tests/hardware/test_voltage_source.py``, with TACTILE_LAB_DIALECT naming the row
(default keithley-2400-voltage) and its lead off the gate.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator

import pytest
from checklist import PORT, by_hand, fact, needs, row_of

from drivers.voltage_source import STEP_EVERY, SourceMeter
from tactile_lab.clock import RealClock
from tactile_lab.instruments.dialects import voltage_dialect
from tactile_lab.voltage_source import VoltageLimits

pytestmark = needs("voltage_source", "a source meter")


@pytest.fixture
def source() -> Iterator[SourceMeter]:
    row = row_of(voltage_dialect, "keithley-2400-voltage")
    limits = VoltageLimits(highest=2.0, slew=5.0)
    one = SourceMeter("V_GS", row, PORT, limits, RealClock())
    one.open()
    yield one
    left = one.go_to_rest()
    fact("left", left.text)
    one.close()
    assert left.verified


def go(source: SourceMeter, volts: float) -> None:
    while not source.step_to(volts):
        time.sleep(STEP_EVERY)
    time.sleep(0.3)


def test_ramp_and_read_back(source: SourceMeter) -> None:
    fact("identity", source.identity)
    if query := source.dialect.range_query:
        fact(
            "range read back, V",
            source._wire.number(query) * source.dialect.voltage_unit,
        )
    go(source, 1.0)
    held = source.read()
    fact("set to 1 V, read V and A", (held.voltage, held.current))
    fact("settings", source.settings())
    assert abs(held.voltage - 1.0) < 2e-3


def test_latency(source: SourceMeter) -> None:
    go(source, 0.1)
    times = []
    for _ in range(20):
        begun = time.monotonic()
        source.read()
        times.append(time.monotonic() - begun)
    fact("one reading takes, ms", f"{1e3 * statistics.median(times):.1f}")
    assert max(times) < source.dialect.serial.timeout


@by_hand("read a multimeter")
def test_steps_against_a_multimeter(source: SourceMeter) -> None:
    step = source.capability.resolution
    for volts in (1.4, 1.4 + step, 1.4 + 2 * step):
        go(source, volts)
        told = input(f"\nSet to {volts:.5f} V. Multimeter, V? ")
        fact(f"set {volts:.5f} V", f"read {source.read().voltage}, multimeter {told}")
