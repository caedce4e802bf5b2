"""Statistics of stored samples, against numpy on all of them."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tactile_lab.errors import RunFolderError
from tactile_lab.store.statistics import statistics


class Signal(SimpleNamespace):
    """Codes of a stored signal, 1 us apart."""

    name = "V_K"

    def between(self, start: float, end: float) -> slice:
        first, last = (round(t * 1e6) for t in (start, end))
        return slice(min(first, self.codes.size), min(last, self.codes.size))


@given(
    st.integers(0, 2**32 - 1),
    st.integers(1, 3000),
    st.sampled_from([2e-4, -1.5e-4]),
    st.floats(-50.0, 50.0),
)
def test_they_are_those_of_all_samples(seed, count, gain, offset):
    rng = np.random.default_rng(seed)
    codes = rng.normal(20_000, 3, count + 10).astype(np.int16)
    found = statistics(Signal(codes=codes, gain=gain, offset=offset), 0.0, count * 1e-6)
    values = gain * codes[:count].astype(np.float64) + offset
    assert found.samples == count
    assert (found.low, found.high) == pytest.approx((values.min(), values.max()))
    assert found.mean == pytest.approx(values.mean(), rel=1e-9, abs=1e-9)
    assert found.deviation == pytest.approx(values.std(), rel=1e-6, abs=1e-9)
    rms = np.sqrt(np.mean(values**2))
    assert found.rms == pytest.approx(rms, rel=1e-9, abs=1e-9)


def test_a_stretch_without_samples_is_refused():
    empty = Signal(codes=np.zeros(5, np.int16), gain=1.0, offset=0.0)
    with pytest.raises(RunFolderError, match="0 samples of V_K"):
        statistics(empty, 1.0, 2.0)
