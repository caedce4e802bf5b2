import numpy as np
import pytest

from tactile_lab.analysis.response import gain
from tactile_lab.errors import NotIdentifiableError

TIME = np.arange(0, 12, 0.01)


def test_it_finds_gain_and_phase_on_a_drift():
    wave = 2 * np.pi * 0.5 * TIME
    cause = 0.05 * np.sin(wave + 0.3)
    rng = np.random.default_rng(0)
    answer = 4.3 + 0.01 * TIME + 0.12 * np.sin(wave + 0.3 - 0.7)
    found = gain(TIME, cause, answer + rng.normal(0, 0.005, TIME.size), 0.5)
    assert found.gain == pytest.approx(2.4, abs=4 * found.error)
    assert found.phase == pytest.approx(-0.7, abs=0.01)
    assert 0 < found.error < 0.01


def test_too_little_is_refused():
    with pytest.raises(NotIdentifiableError, match="less than one cycle"):
        gain(TIME[:50], np.sin(TIME[:50]), np.sin(TIME[:50]), 0.5)
    with pytest.raises(NotIdentifiableError, match="no cause"):
        gain(TIME, np.zeros_like(TIME), np.sin(TIME), 0.5)
