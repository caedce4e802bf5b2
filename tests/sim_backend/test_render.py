"""The kernels equal a plain numpy reference, sample for sample."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_backend.plant.render import (
    NOISE_UNIT,
    TABLE_BITS,
    TILE_BITS,
    add_pulses,
    digitise,
    noise_table,
)

NOISE = noise_table(7)
LIMIT, SHIFT = 127, 8


def place(key: int, tile: int, which: int) -> int:
    """splitmix64 in Python's integers."""
    mask = (1 << 64) - 1
    z = (key + (2 * tile + which + 1) * 0x9E3779B97F4A7C15) & mask
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & mask
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
    return (z ^ (z >> 31)) & ((1 << TABLE_BITS) - 1)


def noise_of(index: np.ndarray, key: int) -> np.ndarray:
    tiles, at = index >> TILE_BITS, index & ((1 << TILE_BITS) - 1)
    begin = {
        tile: (place(key, tile, 0), place(key, tile, 1)) for tile in set(tiles.tolist())
    }
    one = np.array([begin[tile][0] for tile in tiles.tolist()]) + at
    two = np.array([begin[tile][1] for tile in tiles.tolist()]) + at
    return NOISE[one].astype(np.float64) + NOISE[two]


def reference(
    first: int,
    n: int,
    started: float,
    interval: float,
    pieces: tuple[np.ndarray, np.ndarray, np.ndarray],
    key: int,
    scale: float,
    pulses: tuple[np.ndarray, np.ndarray, float] | None = None,
) -> np.ndarray:
    index = first + np.arange(n)
    time = started + index * interval
    start, value, slope = pieces
    j = np.searchsorted(start, time, side="right") - 1
    x = value[j] + (time - start[j]) * slope[j]
    if pulses is not None:
        times, pulse, step = pulses
        extra = np.zeros(n)
        for begin in times:
            since = (time - begin) / step
            inside = (since >= 0) & (since < pulse.size - 1)
            extra[inside] += np.interp(since[inside], np.arange(pulse.size), pulse)
        x = extra + x
    x = x + scale * noise_of(index, key)
    return (np.clip(np.rint(x), -LIMIT, LIMIT) * (1 << SHIFT)).astype(np.int16)


@settings(max_examples=60)
@given(
    knots=st.lists(
        st.tuples(st.floats(0, 1e-2), st.floats(-150, 150)), min_size=1, max_size=12
    ),
    first=st.integers(0, 10**7),
    n=st.integers(1, 3000),
    interval=st.sampled_from([1e-8, 1.28e-7, 1e-6, 3.3e-6]),
    key=st.integers(0, 2**63 - 1),
    seed=st.integers(0, 99),
)
def test_a_block_equals_the_reference(
    knots: list[tuple[float, float]],
    first: int,
    n: int,
    interval: float,
    key: int,
    seed: int,
) -> None:
    started = 0.25
    begin = started + first * interval
    knots = sorted(dict(knots).items())
    start = np.unique([begin - 1e-3, *(begin + t for t, _ in knots)])
    rng = np.random.default_rng(seed)
    value = rng.uniform(-150, 150, start.size)
    slope = rng.uniform(-1e4, 1e4, start.size)
    pieces = (start, value, slope)
    scale = 0.7 / NOISE_UNIT
    expected = reference(first, n, started, interval, pieces, key, scale)
    codes = np.empty(n, dtype=np.int16)
    common = (first, started, interval, *pieces, NOISE, key, scale, 0.0, 50.0)
    highest = digitise(codes, *common, LIMIT, SHIFT)
    assert np.array_equal(codes, expected)
    if highest <= LIMIT:
        assert highest == np.abs(codes).max() >> SHIFT
    count = 1 + seed % 5
    times = np.sort(begin + rng.uniform(-0.3, 1.1, count) * n * interval)
    pulse = np.linspace(90, 0, 40)
    step = interval * 0.37
    assert add_pulses(codes, *common, LIMIT, SHIFT, times, pulse, step) >= 0
    expected = reference(
        first, n, started, interval, pieces, key, scale, (times, pulse, step)
    )
    # the sum of overlapping pulses may round differently, never by more than a step
    different = codes != expected
    assert np.count_nonzero(different) <= 1
    assert np.all(np.abs(codes.astype(int) - expected) <= 1 << SHIFT)


def test_overlapping_pulses_add() -> None:
    codes = np.empty(100, dtype=np.int16)
    flat = (np.zeros(1), np.zeros(1), np.zeros(1))
    common = (0, 0.0, 1.0, *flat, NOISE, 1, 0.0, 0.0, 50.0, LIMIT, SHIFT)
    digitise(codes, *common)
    begins = np.array([10.0, 15.0])
    add_pulses(codes, *common, begins, np.full(11, 40.0), 1.0)
    steps = codes >> SHIFT
    assert steps[9] == 0 and steps[10] == 40 and steps[15] == 80 and steps[19] == 80
    assert steps[20] == 40 and steps[24] == 40 and steps[25] == 0


def test_the_largest_step_is_reported_where_it_clips() -> None:
    codes = np.empty(10, dtype=np.int16)
    rising = (np.zeros(1), np.array([120.0]), np.array([2.0]))
    common = (0, 0.0, 1.0, *rising, NOISE, 1, 0.0, 0.0, 50.0, LIMIT, SHIFT)
    assert digitise(codes, *common) == 138
    assert codes.max() == LIMIT << SHIFT


@pytest.mark.parametrize("volts", [1e30, -1e30])
def test_absurd_voltages_clip(volts: float) -> None:
    codes = np.empty(10, dtype=np.int16)
    flat = (np.zeros(1), np.array([volts]), np.zeros(1))
    digitise(codes, 0, 0.0, 1.0, *flat, NOISE, 1, 0.0, 0.0, 50.0, LIMIT, SHIFT)
    assert np.all(codes == np.sign(volts) * (LIMIT << SHIFT))


def test_noise_does_not_repeat_from_tile_to_tile() -> None:
    n = 1 << 20
    codes = np.empty(n, dtype=np.int16)
    flat = (np.zeros(1), np.zeros(1), np.zeros(1))
    common = (0, 0.0, 1.0, *flat, NOISE, 1, 4.0 / NOISE_UNIT, 0.0, 50.0, LIMIT, SHIFT)
    digitise(codes, *common)
    tiles = (codes >> SHIFT).reshape(-1, 1 << TILE_BITS).astype(float)
    likeness = np.corrcoef(tiles) - np.eye(tiles.shape[0])
    assert np.abs(likeness).max() < 0.06
