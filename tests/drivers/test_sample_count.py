"""Loss is found from counts, whatever the latency; health is not called loss."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.picoscope.sample_count import SampleCount
from tactile_lab.errors import SamplesLostError
from tactile_lab.scope import Stream

RATE = 1e6


def counter() -> SampleCount:
    return SampleCount(
        started=1.0, interval=1 / RATE, depth=10**6, tolerance=0.01, drift=1e-4
    )


@settings(max_examples=50)
@given(
    latencies=st.lists(st.floats(0, 0.03), min_size=20, max_size=200),
    drift=st.floats(-8e-5, 8e-5),
)
def test_latency_and_drift_are_no_loss(latencies: list[float], drift: float) -> None:
    count = counter()
    for k, latency in enumerate(latencies, start=1):
        # each eighth poll sees little latency, as a real one does
        latency = 0.001 if k % 8 == 0 else latency
        now = 0.02 * k
        arrived = max(0, int((now * (1 + drift) - latency) * RATE))
        count.poll(1.0 + now, max(0, arrived - count.received))
    assert count.received > 0


@settings(max_examples=50)
@given(lost=st.integers(20_000, 10**6), at=st.integers(10, 50))
def test_loss_is_found_within_a_few_polls(lost: int, at: int) -> None:
    count = counter()
    for k in range(1, at):
        count.poll(1.0 + 0.02 * k, 20_000)
    total = 20_000 * (at - 1)
    with pytest.raises(SamplesLostError, match="samples"):
        for k in range(at, at + 80):
            produced = 20_000 * k - lost
            count.poll(1.0 + 0.02 * k, max(0, produced - total))
            total = max(total, produced)


@pytest.mark.parametrize("drift", [-5e-5, 5e-5])
def test_a_few_samples_are_missed_where_there_is_no_latency(drift: float) -> None:
    count = SampleCount(
        started=0.0,
        interval=1 / RATE,
        depth=10**6,
        tolerance=3e-6,
        drift=1e-4,
        window=0.0,
        polls=1,
    )
    lost = 0
    with pytest.raises(SamplesLostError, match=r"about [678] too few"):
        for k in range(1, 10_000):
            lost = 7 if k > 8_000 else 0
            arrived = int(0.02 * k * (1 - drift) * RATE) - lost
            count.poll(0.02 * k, arrived - count.received)
    assert k == 8_001


def test_many_small_gaps_add_up() -> None:
    count = counter()
    with pytest.raises(SamplesLostError, match="Samples are missing"):
        for k in range(1, 2_000):
            count.poll(1.0 + 0.02 * k, 20_000 - (k % 2) * 50)


def test_a_poll_that_left_something_unread_is_not_judged() -> None:
    count = SampleCount(
        started=0.0, interval=1 / RATE, depth=10**6, tolerance=3e-6, window=0.0, polls=1
    )
    count.poll(0.02, 20_000)
    count.poll(0.04, 5_000, drained=False)
    count.poll(0.06, 35_000)
    count.finish()
    with pytest.raises(SamplesLostError):
        count.poll(0.08, 15_000)


def test_the_end_is_looked_at_more_sharply() -> None:
    count = counter()
    for k in range(1, 50):
        count.poll(1.0 + 0.02 * k, 20_000)
    count.poll(2.00, 5_000)
    count.poll(2.02, 20_000)
    with pytest.raises(SamplesLostError, match="about 15000 too few"):
        count.finish()


def test_a_computer_that_halts_while_it_asks_has_lost_nothing() -> None:
    """Samples that came while a poll was held up are more, and none is missing."""
    count = counter()
    total = 0
    for k in range(1, 60):
        halted = 0.3 if k == 10 else 0.0
        produced = int((0.02 * k + halted) * RATE)
        if produced > total:
            had = 1.0 + 0.02 * k + halted
            count.poll(1.0 + 0.02 * k, produced - total, had=had)
            total = produced
    assert count.received == int(0.02 * 59 * RATE)


@pytest.mark.parametrize("rate", [10.0, 20.0, 50.0])
def test_a_slow_stream_is_judged_by_its_samples(rate: float) -> None:
    """A poll sees an interval more or less; that is more than 10 ms here."""
    stream = Stream(
        channels=(),
        interval=1 / rate,
        full_scale=32512,
        shift=8,
        started=0.0,
        uncertainty=0.0,
    )
    count = SampleCount.of(stream, 1 << 16, None, simulated=False)
    for k in range(1, 2_000):
        now = 0.02 * k
        late = 0.9 / rate if 500 <= k < 520 else 0.0
        arrived = max(0, int((now - late) * rate))
        count.poll(now, arrived - count.received)
    count.finish()
