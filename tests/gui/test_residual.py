"""Measured less model where both are drawn as means of columns."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gui.lanes.decimate import Drawn, columns
from gui.lanes.derive import difference

STEP = 1e-3


def ramps(time: np.ndarray) -> np.ndarray:
    """Up and down by 1 V within 50 ms, every 0.5 s."""
    phase = time % 0.5
    return np.clip(phase / 0.05, 0, 1) - np.clip((phase - 0.25) / 0.05, 0, 1)


def seen(start: float, count: int, offset: float = 0.0) -> Drawn:
    """Ten seconds of it in 1 ms bins from `start`, joined into `count` columns."""
    time = start + STEP * np.arange(10_000)
    value = ramps(time + STEP / 2) + offset
    return columns(np.array([time, value, value, value]), count, STEP)


@given(
    start=st.floats(0, STEP), count=st.integers(100, 2000), offset=st.floats(-0.1, 0.1)
)
def test_columns_that_do_not_fall_together_leave_no_residual(
    start: float, count: int, offset: float
) -> None:
    rest = difference(seen(0.0, count, offset), seen(start, 4 * count))
    assert rest.time.size > 0.9 * count / 2
    assert np.abs(rest.mean[1:-2] - offset).max() < 0.03


def test_nothing_is_left_of_nothing() -> None:
    some = seen(0.0, 100)
    assert difference(Drawn.nothing(), some).empty
    assert difference(some, Drawn.nothing()).empty


def test_what_the_model_does_not_reach_is_left_out() -> None:
    whole, half = seen(0.0, 500), seen(0.0, 500)
    known = half.time < 5
    half = Drawn(
        *(v[known] for v in (half.time, half.low, half.high, half.mean)),
        half.gap[known],
    )
    assert difference(whole, half).time[-1] <= 5.0


def test_what_is_before_the_model_is_left_out() -> None:
    rest = difference(seen(0.0, 500, 3.0), seen(2.0, 500, 3.0))
    assert rest.time[0] >= 2.0 and rest.gap[0]
    assert np.abs(rest.mean[: rest.time.size // 2]).max() < 1.1


def test_columns_cut_short_by_a_gap_leave_no_residual() -> None:
    time = np.concatenate([np.arange(0.0, 1.0, STEP), np.arange(40.0, 41.0, STEP)])
    measured = columns(np.array([time, *[ramps(time + STEP / 2)] * 3]), 30, STEP)
    whole = np.arange(0.0, 50.0, STEP)
    model = columns(np.array([whole, *[ramps(whole + STEP / 2)] * 3]), 20_000, STEP)
    rest = difference(measured, model)
    assert rest.time.size >= measured.time.size - 2
    assert np.count_nonzero(rest.gap) == 2 and rest.gap[0]
    assert np.abs(rest.mean).max() < 0.06
