"""Two or three runs in the same lanes."""

from typing import ClassVar

import numpy as np
import pytest

from gui.lanes.compare import Comparison, ComparisonRows
from gui.lanes.expected import Stretch
from gui.lanes.lane import lanes_for
from gui.lanes.readings import Painted, values_at
from gui.lanes.source import Member, Source
from gui.lanes.view import TimeView
from tactile_lab.trace import Trace

LANES = {lane.key: lane for lane in lanes_for({"force", "V_C1", "V_C2", "spikes"})}


class Falling(Source):
    """A run of 10 s with steps at 1 and 5 s, all `late`; V_C1 falls evenly."""

    reach = 10.0
    spikes = np.empty(0)
    holds: ClassVar[list[Stretch]] = []

    def __init__(self, late: float, *spikes: float, more: float = 0.0) -> None:
        time = np.linspace(0.0, 10.0, 1001)
        self.line = Trace.line(time, 4.0 - 0.1 * (time - late) + more)
        self.spikes = np.array(spikes)
        self.holds = [
            Stretch(1.0 + late, 5.0 + late, "a"),
            Stretch(5.0 + late, 10.0, "b"),
        ]

    def measured(self, signal: str, start: float, end: float, count: int) -> Trace:
        return self.line


@pytest.fixture
def comparison() -> Comparison:
    runs = (
        Falling(0.0, 2.0, 2.5, 3.0),
        Falling(0.3, 2.2, 2.9, 3.4, more=0.02),
        Falling(0.1),
    )
    return Comparison([Member(str(k), one) for k, one in enumerate(runs)])


def shifts(comparison: Comparison) -> list[float]:
    return [round(member.shift, 9) for member in comparison.members]


def test_step_aligns_the_same_step_of_each_run(comparison: Comparison) -> None:
    assert comparison.align("step", 6.0) == 5.0
    assert shifts(comparison) == [0.0, -0.3, -0.1]
    comparison.align("start")
    assert shifts(comparison) == [0.0, 0.0, 0.0]


def test_cursor_aligns_the_nearest_spikes(comparison: Comparison) -> None:
    assert comparison.align("cursor", 2.6) == 2.5, "the cursor snaps to the reference"
    assert shifts(comparison) == [0.0, -0.4, 0.0], "a run without spikes stays"
    assert comparison.align("cursor", 2.5) == 2.5
    assert shifts(comparison) == [0.0, -0.4, 0.0], "what is aligned stays aligned"


def test_cursor_aligns_the_nearest_steps_where_no_spike_is_nearer(comparison) -> None:
    assert comparison.align("cursor", 5.1) == 5.0
    assert shifts(comparison) == [0.0, -0.3, -0.1]


def test_difference_takes_the_reference_from_slow_channels(comparison) -> None:
    comparison.layout = ComparisonRows.DIFFERENCE
    assert comparison.subtracts(LANES["V_C1"]) and comparison.subtracts(LANES["force"])
    for key in ("V_C2", "spikes", "rate"):
        assert not comparison.subtracts(LANES[key])
    comparison.align("step", 2.0)
    none, other, late = comparison.shown(LANES["V_C1"], 1.0, 9.0, 500)
    assert np.allclose(none.mean, 0.0, atol=1e-9)
    inside = (other.time > 1.0) & (other.time < 9.0)
    assert np.allclose(other.mean[inside], 0.02, atol=1e-6), "each where it is shown"
    inside = (late.time > 1.0) & (late.time < 9.0)
    assert np.allclose(late.mean[inside], 0.0, atol=1e-6)


def test_difference_ends_where_one_run_does_and_leaves_gaps() -> None:
    time = np.array([0.0, 1.0, 4.0, 5.0])
    gap = np.array([True, False, True, False])
    one = Trace(time, time, time, time, gap)
    grid = np.arange(-1.0, 7.0, 0.25)
    found = one.minus(Trace.line(np.array([0.5, 9.0]), np.array([0.5, 9.0])), grid)
    assert np.allclose(found.mean, 0.0)
    assert found.time[found.gap].tolist() == [0.5, 4.0]
    assert found.time[0] == 0.5 and found.time[-1] == 5.0
    assert not np.any((found.time > 1.0) & (found.time < 4.0))
    steps = Trace.steps(np.array([0.0, 1.0, 2.0]), np.array([0.0, 3.0, 1.0]), 9)
    assert np.all(steps.minus(steps, grid).mean == 0.0), "nothing differs from itself"


def test_runs_are_read_where_the_first_of_them_ends(comparison: Comparison) -> None:
    comparison.align("step", 6.0)
    view = TimeView()
    view.set_now(comparison.reach, comparison.length)
    view.show_span(0.0, 10.0)
    assert comparison.right_edge(view) == 9.7
    view.show_span(0.0, 5.0)
    assert comparison.right_edge(view) == 5.0
    view.show_span(9.8, 0.2)
    assert comparison.right_edge(view) == 10.0, "others are not seen to end"


def test_values_are_read_on_the_common_time(comparison: Comparison) -> None:
    comparison.align("step", 2.0)
    lane = LANES["V_C1"]
    painted = Painted(1.0, 9.0, tuple(comparison.shown(lane, 1.0, 9.0, 500)))
    for shown in (painted, Painted()):
        values = values_at(lane, comparison, 5.0, shown)
        assert np.allclose(values, [3.5, 3.52, 3.5], atol=2e-3)
    assert values_at(LANES["rate"], comparison, 2.55, painted)[:2] == (2.0, 0.0)
    assert values_at(lane, comparison, 9.8, painted)[1] is None, "that run has ended"
