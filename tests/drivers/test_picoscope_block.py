"""Block mode: one record, at the timebase the scope says, around a trigger."""

from __future__ import annotations

import gc
import weakref

import numpy as np
import pytest

from drivers.picoscope.block import Trigger, timebase
from drivers.picoscope.scope import PicoScope
from sim_backend.picoscope.faults import Fault
from sim_backend.picoscope.scope import Make
from sim_backend.picoscope.sdk import FakePs3000a
from sim_backend.plant.scope_source import Voltages
from tactile_lab.bench import Channel
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import LimitError, LinkLostError, NoReplyError, ParameterError

TWO = (
    Channel(signal="V_K", input="C", range=5.0, offset=-2.0),
    Channel(signal="V_C1", input="A", range=0.5),
)
SPIKES = Voltages(
    {
        "C": lambda t: 4.0 * np.exp(-(t % 1e-3) / 1.5e-6),
        "A": lambda t: 0.3 * np.cos(2e3 * np.pi * t),
    }
)


def scope_on(
    *faults: Fault, make: Make | None = None
) -> tuple[PicoScope, FakePs3000a, SimulatedClock]:
    clock = SimulatedClock()
    library = FakePs3000a(SPIKES, clock, make, faults)
    return PicoScope(clock=clock, library=library), library, clock


def test_a_spike_is_caught_around_its_trigger() -> None:
    scope, library, clock = scope_on()
    trigger = Trigger(input="C", level=2.0)
    with clock.taking_part("test"), scope:
        clock.sleep_until(0.5e-3)
        stream, block = scope.capture(TWO, 8e-9, 2000, before=500, trigger=trigger)
    library.raise_errors()
    assert stream.interval == pytest.approx(8e-9)
    gain, offset = stream.volts_per_code(0)
    volts = gain * block.codes[0] + offset
    assert volts[499] < 2.0 <= volts[500]
    time = (np.arange(2000) - 500) * 8e-9
    truth = np.where(time < 0, 0.0, 4.0 * np.exp(-time / 1.5e-6))
    assert np.max(np.abs(volts - truth)) < 0.05 + 4.0 * 8e-9 / 1.5e-6


def test_a_falling_edge() -> None:
    scope, library, clock = scope_on()
    trigger = Trigger(input="A", level=0.1, rising=False)
    with clock.taking_part("test"), scope:
        stream, block = scope.capture(TWO, 1e-6, 200, before=100, trigger=trigger)
    library.raise_errors()
    gain, offset = stream.volts_per_code(1)
    volts = gain * block.codes[1] + offset
    assert volts[99] > 0.1 >= volts[100] - gain * 256
    assert volts[0] > volts[199]


def test_memory_the_library_points_to_is_kept() -> None:
    scope, _library, clock = scope_on()
    with clock.taking_part("test"), scope:
        _, block = scope.capture(TWO, 1e-6, 100)
        kept = weakref.ref(
            block.codes.base if block.codes.base is not None else block.codes
        )
        del block
        gc.collect()
        assert kept() is not None
        scope.close()
        gc.collect()
        assert kept() is None


def test_an_untriggered_record_starts_at_once() -> None:
    scope, _library, clock = scope_on()
    with clock.taking_part("test"), scope:
        stream, block = scope.capture(TWO, 1e-6, 3000)
    assert block.samples == 3000
    assert stream.uncertainty < 5e-3
    assert block.codes[0].max() > 0


def test_patience_ends_the_wait_for_a_trigger() -> None:
    scope, _library, clock = scope_on()
    trigger = Trigger(input="A", level=0.45, patience=0.02)
    with clock.taking_part("test"), scope:
        _, block = scope.capture(TWO, 1e-6, 100, before=50, trigger=trigger)
        assert 0.02 <= clock.now() < 0.03
    assert block.samples == 100


def test_streaming_works_after_a_block() -> None:
    scope, library, clock = scope_on()
    with clock.taking_part("test"), scope:
        scope.capture(TWO, 1e-6, 100, trigger=Trigger(input="C", level=2.0))
        scope.start(TWO, 1e-6)
        clock.sleep_until(clock.now() + 0.02)
        block = scope.poll()
    assert block is not None and block.samples == 20_000
    library.raise_errors()


@pytest.mark.parametrize(
    ("interval", "number"),
    [
        (1e-9, 0),
        (2e-9, 1),
        (4e-9, 2),
        (8e-9, 3),
        (16e-9, 4),
        (1e-6, 127),
        (1.0, 125000002),
    ],
)
def test_timebases_of_the_guide(interval: float, number: int) -> None:
    assert timebase(interval) == number


def test_impossible_records_are_refused() -> None:
    scope, _library, clock = scope_on(make=Make(memory=1 << 20))
    with clock.taking_part("test"), scope:
        with pytest.raises(LimitError, match="interval is impossible"):
            scope.capture(TWO, 1e-9, 100)
        with pytest.raises(LimitError, match="memory"):
            scope.capture(TWO, 1e-6, (1 << 19) + 1)
        with pytest.raises(ParameterError, match="0 samples"):
            scope.capture(TWO, 1e-6, 0)
        with pytest.raises(LimitError, match="input B, which is not enabled"):
            scope.capture(TWO, 1e-6, 10, trigger=Trigger(input="B", level=0.0))
        with pytest.raises(LimitError, match="outside the range"):
            scope.capture(TWO, 1e-6, 10, trigger=Trigger(input="A", level=0.6))


def test_a_scope_that_never_gets_ready() -> None:
    scope, library, clock = scope_on()
    with clock.taking_part("test"), scope:
        library.device.memory.ready = lambda: False  # type: ignore[method-assign]
        with pytest.raises(NoReplyError, match="did not finish a block"):
            scope.capture(TWO, 1e-6, 100)


@pytest.mark.parametrize("call", ["RunBlock", "IsReady", "GetValues", "GetTimebase2"])
def test_unplugged_during_a_block(call: str) -> None:
    scope, library, clock = scope_on(Fault(kind="unplug", call=call))
    with clock.taking_part("test"), scope:
        with pytest.raises(LinkLostError):
            scope.capture(TWO, 1e-6, 10_000)
    library.raise_errors()
