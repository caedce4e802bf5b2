"""How much later a signal is recorded than one that it should follow."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.analysis.delay import delay
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.waveform import Waveform

PULSE = Waveform.pulse(0.5, ramp=0.02, hold=0.1, rest=0.2)
WIDTH = 1e-3
START = np.arange(-0.05, 0.3, WIDTH)


@given(
    late=st.floats(-2e-4, 2e-4), size=st.floats(0.3, 2.0), offset=st.floats(-0.2, 0.2)
)
def test_it_is_told_whatever_the_signal_s_size_and_offset(late, size, offset):
    seen = size * PULSE.mean(START - late, WIDTH) + offset
    assert delay(PULSE, START, WIDTH, seen).value == pytest.approx(late, abs=2e-5)


def test_it_is_known_as_well_as_the_noise_lets_it():
    rng, held = np.random.default_rng(1), 0
    for _ in range(200):
        seen = PULSE.mean(START - 5e-5, WIDTH) + rng.normal(0, 5e-3, START.size)
        found = delay(PULSE, START, WIDTH, seen)
        held += found.low < 5e-5 < found.high
    assert 180 <= held <= 199


@pytest.mark.parametrize("start", [START[:6], START[START < -0.002], START[60:68]])
def test_a_signal_that_stands_or_only_rises_tells_nothing(start):
    with pytest.raises(NotIdentifiableError, match="do not tell when it moved"):
        delay(PULSE, start, WIDTH, PULSE.mean(start, WIDTH))
