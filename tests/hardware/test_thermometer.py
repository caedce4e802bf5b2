"""Facts about a lab's own thermometer that no document settled.

Run ``TACTILE_LAB_HARDWARE=thermometer TACTILE_LAB_PORT=/dev/ttyUSB0 pytest -s
tests/hardware/test_thermometer.py``, with TACTILE_LAB_DIALECT naming the row (default
lakeshore-218) and a sensor at its first input.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator

import pytest
from checklist import PORT, by_hand, fact, needs, row_of

from drivers.thermometer import Thermometer
from tactile_lab.clock import RealClock
from tactile_lab.errors import InstrumentError, LimitError
from tactile_lab.instruments.dialects import thermometer_dialect

pytestmark = needs("thermometer", "a thermometer")


def made(**wire: float) -> Thermometer:
    """The thermometer, with changes of how its wire is used."""
    row = row_of(thermometer_dialect, "lakeshore-218", **wire)
    return Thermometer(row.at(None), PORT, RealClock())


@pytest.fixture
def thermometer() -> Iterator[Thermometer]:
    one = made()
    one.open()
    yield one
    one.close()


def test_name_and_settings(thermometer: Thermometer) -> None:
    fact("identity", thermometer.identity)
    fact("settings", thermometer.settings())


def test_latency_and_noise(thermometer: Thermometer) -> None:
    times, readings = [], []
    for _ in range(10):
        begun = time.monotonic()
        readings.append(thermometer.read().value)
        times.append(time.monotonic() - begun)
    fact("one reading takes, ms", f"{1e3 * statistics.median(times):.1f}")
    fact("mean of 10 readings, K", statistics.mean(readings))
    fact("their standard deviation, K", statistics.stdev(readings))


@pytest.mark.parametrize("gap", [0.0, 0.03])
def test_rest_between_messages(gap: float) -> None:
    one, told = made(min_gap=gap), f"with {1e3 * gap:g} ms between messages"
    try:
        one.open()
        fact(told, [one.read().value for _ in range(3)])
    except InstrumentError as reason:
        fact(told, reason)
    finally:
        one.close()


@by_hand("pull the sensor")
def test_status_of_an_open_sensor(thermometer: Thermometer) -> None:
    input("\nPull the sensor's lead, wait 5 s, then press Enter. ")
    try:
        fact("open sensor", thermometer.read().value)
    except LimitError as reason:
        fact("open sensor", reason)
