"""Facts about a lab's own USBTMC oscilloscope that no document settled.

Run ``TACTILE_LAB_HARDWARE=usbtmc pytest -s tests/hardware/test_usbtmc_scope.py``, with
TACTILE_LAB_DIALECT naming the row (default rigol-ds1000z). Connect the probe
compensation output (1 kHz) to the first input.
"""

from __future__ import annotations

import os
import time
from collections.abc import Iterator

import numpy as np
import pytest
from checklist import fact, needs

from drivers.usb_presence import present
from drivers.usbtmc.scope import UsbtmcScope
from tactile_lab.clock import RealClock
from tactile_lab.instruments.dialects import scope_dialect
from tactile_lab.scope import Block, Channel

pytestmark = needs("usbtmc", "a USBTMC oscilloscope")


@pytest.fixture
def scope() -> Iterator[UsbtmcScope]:
    row = scope_dialect(os.environ.get("TACTILE_LAB_DIALECT", "rigol-ds1000z"))
    scope = UsbtmcScope(row, clock=RealClock(), timeout=5.0)
    yield scope
    scope.close()


def channels(scope: UsbtmcScope, count: int, offset: float = 0.0) -> list[Channel]:
    ranges = scope.capability.ranges
    wide = min(ranges, key=lambda volts: abs(volts - 4.0))
    return [
        Channel(signal=f"input {name}", input=name, range=wide, offset=offset)
        for name in scope.capability.inputs[:count]
    ]


def one_record(scope: UsbtmcScope) -> Block:
    for _ in range(2000):
        time.sleep(scope.poll_interval)
        block = scope.poll()
        if block is not None:
            return block
    raise AssertionError("no record in 40 s")


def test_seen_and_identified(scope: UsbtmcScope) -> None:
    fact("USB", [one for one in present() if one.usbtmc])
    scope.open()
    fact("identity", scope.identity)


@pytest.mark.parametrize("count", [1, 2, 4])
@pytest.mark.parametrize("interval", [1e-7, 1e-6, 1e-5])
def test_records_have_the_length_and_interval_asked(
    scope: UsbtmcScope, count: int, interval: float
) -> None:
    scope.open()
    stream = scope.start(channels(scope, count), interval)
    fact(f"interval for {interval:g} s, {count} inputs", f"{stream.interval!r} s")
    began = time.monotonic()
    block = one_record(scope)
    fact("samples, time for a record", (block.samples, time.monotonic() - began))
    assert stream.interval <= interval * 1.001


@pytest.mark.parametrize("offset", [0.0, -1.0, 1.0])
def test_offset_has_the_sign_we_think(scope: UsbtmcScope, offset: float) -> None:
    """The compensation output's levels must not depend on the offset."""
    scope.open()
    stream = scope.start(channels(scope, 1, offset), 1e-6)
    block = one_record(scope)
    gain, shift = stream.volts_per_code(0)
    low, high = gain * np.quantile(block.codes[0], (0.1, 0.9)) + shift
    fact(f"levels at offset {offset:g} V", f"{low:.3f} V, {high:.3f} V")
    fact("over range", block.overrange)
