import numpy as np
import pytest

from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.drain_current import drain_current


def integrate(i_ds, step=1e-5, duration=1.0, parts=None):
    """V_C1 that Eq. (16) gives for I_DS(t)."""
    parts = parts or Circuit()
    v, out = (5.0 / parts.R1 - i_ds(0.0)) / (1 / parts.R1 + 1 / parts.R2), []
    time = np.arange(0, duration, step)
    for t in time:
        out.append(v)
        current = (parts.V_S - v) / parts.R1 - v / parts.R2 - i_ds(t)
        v += step * current / parts.C1
    return time[::100], np.array(out)[::100]


def test_it_gives_back_the_current_that_made_v_c1():
    def i_ds(t):
        return 60e-9 + 30e-9 * np.sin(2 * np.pi * 2 * t)

    time, v_c1 = integrate(i_ds)
    found = drain_current(time, v_c1, window=0.01)
    assert found.current[20:-20] == pytest.approx(i_ds(time[20:-20]), abs=0.4e-9)


def test_without_the_capacitor_it_would_be_wrong():
    def i_ds(t):
        return 60e-9 + 30e-9 * np.sin(2 * np.pi * 2 * t)

    time, v_c1 = integrate(i_ds)
    without = drain_current(time, v_c1, Circuit(C1=1e-15), window=0.01)
    assert np.max(np.abs(without.current - i_ds(time))) > 1.5e-9


def test_the_bandwidth_is_where_a_sine_falls_by_3_db():
    found = drain_current(np.arange(0, 2, 1e-3), np.full(2000, 4.0), window=0.05)
    f = found.bandwidth
    time = np.arange(0, 2, 1e-3)
    parts = Circuit(C1=1e-18)
    wave = drain_current(time, 4 + np.sin(2 * np.pi * f * time), parts, window=0.05)
    inner = wave.current[200:-200]
    conductance = 1 / parts.R1 + 1 / parts.R2
    amplitude = (inner.max() - inner.min()) / 2 / conductance
    assert amplitude == pytest.approx(1 / np.sqrt(2), abs=0.02)


def test_a_resting_divider_reads_its_resting_current():
    found = drain_current([0.0, 0.1, 0.2, 0.3], [4.347038] * 4)
    assert found.current == pytest.approx([24.69e-9] * 4, abs=0.01e-9)


@pytest.mark.parametrize(
    ("time", "values"),
    [
        ([0, 1], [4, 4]),
        ([0, 1, 2], [4, 4]),
        ([0, 1, 5, 6], [4] * 4),
        ([0] * 3, [4] * 3),
    ],
)
def test_unusable_traces_are_refused(time, values):
    with pytest.raises(ParameterError, match="I_DS from V_C1 needs"):
        drain_current(time, values)
