"""The PicoScope driver streams what lies at the simulated scope's inputs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from voltages import Voltages

from drivers.picoscope.scope import PicoScope
from drivers.picoscope.setup import streaming_interval
from sim_backend.picoscope.scope import UnitModel
from sim_backend.picoscope.sdk import FakePs3000a
from sim_backend.plant.scope_source import Acquisition, Codes
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import LimitError
from tactile_lab.scope import Block, Channel

SINE = Voltages(
    {
        "A": lambda t: 2 * np.sin(2 * np.pi * 37 * t),
        "B": lambda t: 0.5 * np.cos(2 * np.pi * 11 * t),
    }
)
PAIR = (
    Channel(signal="V_C1", input="B", range=1.0),
    Channel(signal="V_K", input="A", range=5.0),
)


class Counter:
    """A source whose samples say which sample they are, and on which input."""

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        count = np.arange(first, first + samples)
        rows = [
            (count % 251 - 125 + ord(i.name) - ord("A")) * 256
            for i in acquisition.inputs
        ]
        return np.array(rows, dtype=np.int16), (False,) * len(rows)


def collect(
    scope: PicoScope, clock: SimulatedClock, polls: int, step: float
) -> list[Block]:
    blocks = []
    with clock.taking_part("scope"):
        for _ in range(polls):
            clock.sleep_until(clock.now() + step)
            block = scope.poll()
            if block is not None:
                blocks.append(block)
    return blocks


def joined(blocks: list[Block]) -> np.ndarray:
    expected = 0
    for block in blocks:
        assert block.first == expected
        expected += block.samples
    return np.concatenate([block.codes for block in blocks], axis=1)


def test_codes_mean_the_volts_at_the_inputs() -> None:
    clock = SimulatedClock()
    with PicoScope(clock=clock, library=FakePs3000a(SINE, clock)) as scope:
        stream = scope.start(PAIR, 1e-5)
        codes = joined(collect(scope, clock, 20, 0.01))
    assert codes.dtype == np.int16
    assert codes.shape == (2, 20_000)
    time = stream.started + np.arange(codes.shape[1]) * stream.interval
    for row, channel in enumerate(stream.channels):
        gain, offset = stream.volts_per_code(row)
        truth = (0.5 * np.cos(2 * np.pi * 11 * time), 2 * np.sin(2 * np.pi * 37 * time))
        step = channel.range / 127
        assert (
            np.max(np.abs(gain * codes[row] + offset - truth[row])) <= step / 2 * 1.001
        )


def test_the_interval_the_scope_wrote_back_is_used() -> None:
    clock = SimulatedClock()
    with PicoScope(clock=clock, library=FakePs3000a(SINE, clock)) as scope:
        stream = scope.start(PAIR, 1 / 3e6)
        assert stream.interval == pytest.approx(336e-9)
        codes = joined(collect(scope, clock, 10, 0.01))
    assert codes.shape[1] == int(0.1 / 336e-9)


def test_blocks_are_owned_and_contiguous() -> None:
    clock = SimulatedClock()
    with PicoScope(clock=clock, library=FakePs3000a(Counter(), clock)) as scope:
        scope.start(PAIR, 1e-5)
        first, second = collect(scope, clock, 2, 0.01)
        assert first.codes.flags["C_CONTIGUOUS"] and first.codes.flags["OWNDATA"]
        assert not np.shares_memory(first.codes, second.codes)
        kept = first.codes.copy()
        collect(scope, clock, 50, 0.01)
        assert np.array_equal(first.codes, kept)


@settings(max_examples=40)
@given(
    ring=st.integers(50, 3000),
    longest=st.one_of(st.none(), st.integers(7, 500)),
    parts=st.integers(1, 3),
    empty=st.booleans(),
    pauses=st.lists(st.integers(0, 40), min_size=5, max_size=60),
)
def test_any_chunking_and_ring_length_gives_the_same_samples(
    ring: int, longest: int | None, parts: int, empty: bool, pauses: list[int]
) -> None:
    clock = SimulatedClock()
    make = UnitModel(
        parts=parts, longest_part=longest, empty_callbacks=empty, fifo=100_000
    )
    library = FakePs3000a(Counter(), clock, make)
    with PicoScope(clock=clock, library=library, ring=ring, lag_tolerance=1) as scope:
        scope.start(PAIR, 1e-5)
        blocks = []
        with clock.taking_part("scope"):
            for pause in pauses:
                clock.sleep_until(clock.now() + pause * 1e-5)
                block = scope.poll()
                blocks += [] if block is None else [block]
    library.raise_errors()
    if blocks:
        codes = joined(blocks)
        count = np.arange(codes.shape[1])
        assert np.array_equal(codes[0], (count % 251 - 124) * 256)
        assert np.array_equal(codes[1], (count % 251 - 125) * 256)


def test_a_new_start_begins_at_sample_zero_again() -> None:
    clock = SimulatedClock()
    with PicoScope(clock=clock, library=FakePs3000a(Counter(), clock)) as scope:
        for _ in range(3):
            stream = scope.start(PAIR, 1e-5)
            assert stream.started == clock.now()
            codes = joined(collect(scope, clock, 3, 0.01))
            assert codes[1, 0] == -125 * 256
            scope.stop()
            scope.stop()


def test_overrange_is_flagged_on_the_row_it_happened() -> None:
    clock = SimulatedClock()
    source = Voltages({"A": lambda t: np.where(t > 0.05, 6.0, 0.0)})
    with PicoScope(clock=clock, library=FakePs3000a(source, clock)) as scope:
        stream = scope.start(PAIR, 1e-5)
        blocks = collect(scope, clock, 10, 0.01)
    assert [b.overrange for b in blocks] == [(False, False)] * 5 + [(False, True)] * 5
    assert blocks[-1].codes[1].max() == stream.full_scale


def test_overrange_in_any_part_of_a_wrapped_ring_counts() -> None:
    clock = SimulatedClock()
    source = Voltages({"A": lambda t: np.where(t < 0.005, 6.0, 0.0)})
    library = FakePs3000a(source, clock)
    with PicoScope(clock=clock, library=library, ring=1500) as scope:
        scope.start(PAIR, 1e-5)
        # 800 and 800 samples: the second poll wraps
        blocks = collect(scope, clock, 2, 0.008)
        assert [b.overrange for b in blocks] == [(False, True), (False, False)]
        # over range up to the ring's end at 30 ms, then no longer
        library.device.source = Voltages({"A": lambda t: np.where(t < 0.03, 6.0, 0.0)})
        (block,) = collect(scope, clock, 1, 0.0149)
        assert block.overrange == (False, True)
        assert block.codes[1, -1] == 0


def test_identity_capability_and_settings() -> None:
    clock = SimulatedClock()
    scope = PicoScope(clock=clock, library=FakePs3000a(SINE, clock))
    scope.open()
    assert scope.identity == "Pico Technology PicoScope 3404D SIM04/0001"
    assert scope.capability.gapless
    assert scope.capability.inputs == ("A", "B", "C", "D")
    assert scope.capability.bits == 8
    stream = scope.start(PAIR, 1e-6)
    assert (stream.full_scale, stream.shift) == (32512, 8)
    settings = scope.settings()
    assert settings["usb"] == "3.0"
    assert settings["input_A"] == "V_K: ±5 V, offset 0 V, DC"
    scope.close()
    scope.close()


class Slow(Counter):
    """A source that takes its time, as a busy computer does."""

    def __init__(self, clock: SimulatedClock) -> None:
        self.clock = clock

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        busy = 0.03 if self.clock.now() > 0.4 else 0.0
        self.clock.sleep_until(self.clock.now() + busy)
        return super().render(acquisition, first, samples)


def test_a_slow_delivery_is_no_loss() -> None:
    clock = SimulatedClock()
    library = FakePs3000a(Slow(clock), clock)
    with PicoScope(clock=clock, library=library, ring=1 << 14) as scope:
        scope.start(PAIR, 1e-5)
        blocks = collect(scope, clock, polls=60, step=0.01)
        assert clock.now() > 0.9
    assert joined(blocks).shape[1] == pytest.approx(clock.now() * 1e5, rel=0.1)


@pytest.mark.parametrize("interval", [1e300, 4.3e6, 7e-9, float("inf")])
def test_an_interval_that_no_counter_holds_is_refused(interval: float) -> None:
    with pytest.raises(LimitError, match="sample interval"):
        streaming_interval(interval)
