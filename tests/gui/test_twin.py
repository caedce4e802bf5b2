"""The twin of the window against the model in one piece."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gui.lanes.decimate import Drawn
from gui.lanes.twinned import TwinTracks, joined
from gui.session.twin import LiveTwin, twin_of
from tactile_lab.model.simulate import simulate
from tactile_lab.scene.load import load
from tactile_lab.waveform import Waveform

SCENE = load("demo")
POINTS = [(0.1, 0.0), (0.2, 0.3), (0.3, 0.6), (0.9, 0.2), (1.2, 0.0)]


@settings(max_examples=15, deadline=None)
@given(st.lists(st.floats(0.01, 1.45), max_size=6))
def test_any_slicing_gives_the_spikes_of_one_piece(cuts: list[float]) -> None:
    whole = twin_of(SCENE, np.array(POINTS), 1.5)[0]
    twin, tracks = LiveTwin(SCENE), TwinTracks()
    fed = 0
    for end in [*sorted(cuts), 1.5]:
        while fed < len(POINTS) and POINTS[fed][0] <= end:
            twin.add(*POINTS[fed])
            fed += 1
        part = twin.until(end)
        if part is not None:
            tracks.add(part)
    assert whole.spikes.size > 2
    assert np.allclose(tracks.spikes, whole.spikes, atol=1e-5)


def test_set_points_hold_until_the_next() -> None:
    part = twin_of(SCENE, np.array(POINTS), 1.5)[0]
    time, value = np.array(POINTS).T
    steps, held = np.repeat(time, 2)[1:], np.repeat(value, 2)[:-1]
    force = Waveform(
        np.concatenate([[0.0], steps]),
        np.concatenate([[0.0], held]) * SCENE.bench.magnet.newtons_per_ampere,
    )
    result = simulate(SCENE.circuit, force, keep=("spikes", "V_C1"), until=1.5)
    assert result.spike_times is not None
    assert np.allclose(part.spikes, result.spike_times, atol=1e-5)
    bins = part.bins["V_C1"]
    expected = result.sample("V_C1", bins.time)
    assert np.abs(bins.mean - expected).max() < 1e-4


def test_late_set_point_moves_to_where_the_twin_is() -> None:
    twin = LiveTwin(SCENE)
    assert twin.until(0.5) is not None
    twin.add(0.4, 0.8)
    part = twin.until(1.0)
    assert part is not None and part.end == 1.0
    assert part.bins["V_C1"].mean[-1] < part.bins["V_C1"].mean[0] - 0.1


def test_nothing_joined_to_something_is_that() -> None:
    line = Drawn.line(np.array([0.0, 1.0]), np.array([2.0, 3.0]))
    assert joined(Drawn.nothing(), line) is line
    assert joined(line, Drawn.nothing()) is line
    assert joined(line, line).time.size == 4
