"""Facts about a lab's own PicoScope that no document settled.

Run ``TACTILE_LAB_HARDWARE=picoscope pytest -s tests/hardware/test_picoscope.py``; see
docs/bench-acceptance-scope.md. Nothing needs to be connected to the inputs. Lines that
begin with FACT are to be copied into the checklist.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest
from checklist import by_hand, fact, needs

from drivers.picoscope.scope import PicoScope
from drivers.picoscope.sdk import RANGES
from tactile_lab.clock import RealClock
from tactile_lab.errors import InstrumentError, LimitError
from tactile_lab.scope import Channel

pytestmark = needs("picoscope", "a PicoScope")

SECONDS = float(os.environ.get("TACTILE_LAB_SECONDS", "100"))
FOUR = tuple(
    Channel(signal=signal, input=name, range=5.0)
    for signal, name in zip(
        ("V_C1", "V_C2", "V_K", "coil_current"), "ABCD", strict=True
    )
)


@pytest.fixture
def scope() -> Iterator[PicoScope]:
    scope = PicoScope(clock=RealClock(), allow_usb2=True, allow_usb_power=True)
    yield scope
    scope.close()


def test_listed_and_identified(scope: PicoScope) -> None:
    scope.open()
    for name, value in scope.settings().items():
        fact(name, value)
    capability = scope.capability
    fact("inputs, bits", (capability.inputs, capability.bits))
    assert capability.bits == 8, "the driver assumes codes in the high byte"


@pytest.mark.parametrize("volts", list(RANGES))
def test_each_range_is_taken(scope: PicoScope, volts: float) -> None:
    scope.open()
    try:
        scope.start([Channel(signal="V_K", input="A", range=volts)], 1e-6)
    except LimitError as error:
        pytest.fail(f"range {volts} V: {error}")
    scope.stop()


def test_noise(scope: PicoScope) -> None:
    """Mean and deviation of each input at 5 V, to be run with the inputs shorted."""
    scope.open()
    scope.start(FOUR, 1e-6)
    block = None
    for _ in range(1500):
        time.sleep(scope.poll_interval)
        block = scope.poll()
        if block is not None and block.samples > 1000:
            break
    assert block is not None
    steps = block.codes / 256
    for channel, row in zip(FOUR, steps, strict=True):
        fact(f"input {channel.input}, codes (mean, deviation)",
             (round(float(row.mean()), 2), round(float(row.std()), 2)))  # fmt: skip


@pytest.mark.parametrize("volts", [0.05, 0.5, 5.0])
def test_offset_limits(scope: PicoScope, volts: float) -> None:
    scope.open()
    beyond = Channel(signal="V_K", input="A", range=volts, offset=1e3)
    with pytest.raises(LimitError) as caught:
        scope.start([beyond], 1e-6)
    fact(f"offset at {volts} V", caught.value)


@pytest.mark.parametrize("wanted", [128e-9, 1 / 7e6, 1 / 3e6, 1e-6, 1e-5, 1e-3])
def test_intervals_are_near_what_was_asked(scope: PicoScope, wanted: float) -> None:
    scope.open()
    stream = scope.start(FOUR, wanted)
    fact(f"interval for {wanted:g} s", f"{stream.interval!r} s")
    fact("started known to", f"{stream.uncertainty:.2g} s")
    assert stream.interval == pytest.approx(wanted, rel=0.07)


@pytest.mark.parametrize("rate", [1e6, 3.90625e6, 7.8125e6])
def test_nothing_is_lost(scope: PicoScope, rate: float) -> None:
    """The qualification of this computer: any loss is raised."""
    clock = RealClock()
    scope.open()
    stream = scope.start(FOUR, 1 / rate)
    total, lags, callbacks = 0, [], 0
    began = clock.now()
    until = began + SECONDS
    while clock.now() < until:
        time.sleep(scope.poll_interval)
        block = scope.poll()
        if block is not None:
            assert block.first == total
            total += block.samples
            callbacks += 1
            elapsed = block.received - stream.started
            lags.append(elapsed - total * stream.interval)
    scope.stop()
    fact(f"samples a channel in {SECONDS:g} s at {rate:g} S/s", total)
    fact("lag behind the clock, s (least, median, largest)",
         [float(np.round(q, 5)) for q in np.quantile(lags, (0, 0.5, 1))])  # fmt: skip
    first, last = lags[: len(lags) // 4], lags[-len(lags) // 4 :]
    drift = (min(last) - min(first)) / (0.75 * SECONDS)
    fact("drift of the scope's clock against this computer's", f"{drift:.2e}")
    if SECONDS >= 50:  # in less time, jitter looks like drift
        assert abs(drift) < 1e-4, "raise the driver's drift allowance"


def test_a_late_poll_is_reported(scope: PicoScope) -> None:
    """Starved for longer than the ring holds: never silent."""
    scope.open()
    stream = scope.start(FOUR, 128e-9)
    ring = int(scope.settings()["ring_samples"]) * stream.interval
    time.sleep(ring * 1.5)
    with pytest.raises(InstrumentError) as caught:
        for _ in range(20):
            scope.poll()
            time.sleep(scope.poll_interval)
    fact("how starvation shows", caught.value)


def test_the_callback_comes_on_the_polling_thread(scope: PicoScope) -> None:
    scope.open()
    scope.start(FOUR, 1e-6)
    ring = scope._ring
    assert ring is not None
    seen: set[int] = set()
    copy = ring._copy

    def spy(samples: int, start: int, overflow: int) -> None:
        seen.add(threading.get_ident())
        copy(samples, start, overflow)

    ring._copy = spy  # type: ignore[method-assign]
    for _ in range(20):
        time.sleep(scope.poll_interval)
        scope.poll()
    fact("callback on the polling thread", seen == {threading.get_ident()})
    assert seen


@by_hand("pull plugs")
@pytest.mark.parametrize(
    "plug", ["USB cable", "mains adapter", "mains adapter back in"]
)
def test_pulled_while_streaming(scope: PicoScope, plug: str) -> None:
    """Which of its forms an unplugging takes on this computer."""
    scope.open()
    scope.start(FOUR, 1e-6)
    print(f"\nWithin 30 s: {plug}.")
    with pytest.raises(InstrumentError) as caught:
        for _ in range(1500):
            time.sleep(scope.poll_interval)
            scope.poll()
    fact(f"{plug}", f"{type(caught.value).__name__}: {caught.value}")
    scope.close()
    print("Put everything back; going on in 15 s.")
    time.sleep(15)


def test_generator(scope: PicoScope) -> None:
    """With the generator's output at input A: its time, ends and voltage."""
    scope.open()
    generator, each = scope.generator, 2**17 / 20e6 / 8
    generator.hold(0.0)
    generator.load(np.interp(np.arange(301), [0, 100, 200, 300], [0, 1, 1, 0]), each)
    stream = scope.start([Channel(signal="V_K", input="A", range=2.0)], 1e-5)
    taken = []
    for k in range(40):
        time.sleep(scope.poll_interval)
        if k == 10:
            begun = time.perf_counter()
            generator.start()
            fact("starting takes, s", f"{time.perf_counter() - begun:.2g}")
        block = scope.poll()
        taken += [] if block is None else [block.codes[0]]
    gain, offset = stream.volts_per_code(0)
    volts = np.concatenate(taken) * gain + offset
    fact("before, V", round(float(volts[: 1 << 12].mean()), 4))
    fact("after, V", round(float(volts[-(1 << 12) :].mean()), 4))
    fact("held, V", round(float(np.median(volts[volts > 0.9])), 4))
    above = np.flatnonzero(volts > 0.5)
    lasts = float(above[-1] - above[0]) * stream.interval
    fact("from half to half, s", f"{lasts:.5f} of {200 * each:.5f}")
    try:
        generator.hold(0.0)
        fact("set while a stream runs", "taken")
    except InstrumentError as refused:
        fact("set while a stream runs", refused)
    assert lasts == pytest.approx(200 * each, rel=1e-3)
