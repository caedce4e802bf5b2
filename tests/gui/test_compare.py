"""Two or three runs in the same lanes."""

from itertools import product
from typing import ClassVar

import numpy as np
import pytest
from lane_stack import box, settle
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QLabel

from gui.dialogs.saving import LEGEND, TITLE, picture, table
from gui.lanes.card import CARD, LaneCard
from gui.lanes.compare import Comparison, ComparisonRows
from gui.lanes.expected import Stretch
from gui.lanes.floor import AXIS
from gui.lanes.lane import lanes_for
from gui.lanes.readings import Painted, values_at
from gui.lanes.source import Member, Source
from gui.lanes.view import TimeView
from gui.look.theme import Theme
from gui.review.run_card import RunCard
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
    assert comparison.right_edge(view, LANES["V_C1"]) == 9.7
    view.show_span(0.0, 5.0)
    assert comparison.right_edge(view, LANES["V_C1"]) == 5.0
    view.show_span(9.8, 0.2)
    assert comparison.right_edge(view, LANES["V_C1"]) == 10.0, (
        "others are not seen to end"
    )


def test_values_are_read_on_the_common_time(comparison: Comparison) -> None:
    comparison.align("step", 2.0)
    lane = LANES["V_C1"]
    painted = Painted(1.0, 9.0, tuple(comparison.shown(lane, 1.0, 9.0, 500)))
    for shown in (painted, Painted()):
        values = values_at(lane, comparison, 5.0, shown)
        assert np.allclose(values, [3.5, 3.52, 3.5], atol=2e-3)
    assert values_at(LANES["rate"], comparison, 2.55, painted)[:2] == (2.0, 0.0)
    assert values_at(lane, comparison, 9.8, painted)[1] is None, "that run has ended"


def test_a_rate_without_another_is_seen(app, stack) -> None:
    """A run that fired twice has one rate, which makes no line."""
    runs = [Member("", Falling(late, 2.0, 2.5)) for late in (0.0, 0.1)]
    stack.show_lanes(lanes_for(("force", "spikes"), twin=False))
    stack.show_source(Comparison(runs))
    stack.view.show_span(0.0, 10.0)
    settle(app)
    lane = box(stack, "rate").geometry().toAlignedRect()
    image = stack.scene.grab(lane).toImage()
    seen = {
        image.pixelColor(x, y).name().upper()
        for x in range(AXIS + 2, image.width())
        for y in range(image.height())
    }
    assert Theme("light").tokens.runs[1] in seen


def colours(image: QImage, start: int, rows: int) -> set[str]:
    """Those of all pixels from a column on, in the uppermost rows."""
    places = range(start, image.width()), range(rows)
    return {image.pixelColor(x, y).name().upper() for x, y in product(*places)}


def test_the_whole_run_below_the_lanes_shows_each_of_several(
    app, stack, comparison
) -> None:
    """It showed the first alone, in the colour of the force."""
    runs = Theme("light").tokens.runs
    for alone in (False, True):
        stack.show_source(comparison.first if alone else comparison)
        settle(app)
        image = stack.navigator.grab().toImage()
        seen = colours(image, CARD + AXIS, image.height())
        assert (set(runs[1:]) <= seen) is not alone, alone


def test_names_of_runs_stand_below_the_title_of_a_picture(
    app, stack, comparison
) -> None:
    """They were written over it, so that neither could be read."""
    stack.show_source(comparison)
    settle(app)
    image = picture(stack, "3 runs, slow channels less those of the reference", 1)
    runs = set(Theme("light").tokens.runs)
    assert not runs & colours(image, 0, TITLE - 8)
    assert runs <= colours(image, 0, TITLE + LEGEND)


def test_spikes_of_several_runs_are_counted_in_a_low_lane(app) -> None:
    """It said "in view" and of nothing how many."""
    card = LaneCard(LANES["spikes"], Theme("light"))
    card.resize(CARD, 34)
    card.show()
    card.show_runs([12.0, 7.0], None, "in view")
    said = " ".join(one.text() for one in card.findChildren(QLabel) if one.isVisible())
    assert "12" in said and "7" in said
    card.close()


@pytest.mark.parametrize("counts", [(3, 0, 2), (12, 0, 17), (123, 118, 130)])
def test_counts_of_three_runs_are_whole_in_a_low_lane(lab, counts) -> None:
    """The last figure was cut off at the edge of the card."""
    card = LaneCard(LANES["spikes"], Theme("light"))
    card.resize(CARD, 34)
    card.show()
    card.show_runs([float(one) for one in counts], None, "in view")
    lab.app.processEvents()
    labels = [one for one in card.findChildren(QLabel) if one.isVisible()]
    (told,) = (one for one in labels if "▲" in one.text())
    assert told.width() >= told.sizeHint().width(), "all of it is seen"
    assert told.geometry().right() < card.width()
    card.show_value(7.0)
    seen = [c.text() for c in card.findChildren(QLabel) if c.isVisible()]
    assert "Spikes" in seen, "one run has its title again"
    card.close()


def test_two_runs_are_compared_in_the_same_lanes(lab) -> None:
    window, session = lab.window, lab.session
    # the newest two: the list leaves out what other tests have run long before
    older, newer = lab.complete_run(), lab.complete_run()
    two, progress = {older, newer}, window.centre.progress
    window.screen_.list_runs()
    window.screen_.open_run(older)
    lab.until(lambda: older.name in progress.text)

    def of_two() -> list[RunCard]:
        cards = window.review.runs.cards
        return [
            c for c in cards if c.entry.folder in two and c.entry.status == "complete"
        ]

    lab.until(lambda: len(of_two()) == 2)
    for card in of_two():
        card.tick.setChecked(True)
    lab.until(lambda: window.review.runs.compare.isEnabled())
    window.review.runs.compare.click()
    lab.until(lambda: window.centre.compare_bar.isVisible())
    comparison = window.screen_.run
    assert progress.text.startswith(f"Steps of ● {comparison.members[0].name}")
    marked = [c for c in window.review.runs.cards if "on screen" in c.accessibleName()]
    assert {c.entry.folder for c in marked} == two, "not the one opened before"
    keys = [row.lane.key for row in window.centre.stack.visible_rows()]
    assert "residual" not in keys, "the model is not compared"
    results = window.screen_.results
    assert results.steps == [] and results.folder is None, "they are of one run"
    view = window.review.results
    assert view.plot.isVisibleTo(view) and "of one run" in view.plot.nothing
    window.centre.compare_bar.align.group.button(1).click()
    starts = [m.source.holds[0].start + m.shift for m in comparison.members]
    assert abs(starts[0] - starts[1]) < 1e-9
    stack = window.centre.stack
    lab.until(lambda: stack.row("V_C1") in stack.visible_rows())
    lab.until(lambda: stack.row("V_C1").card.text.count("\n") == 2)
    assert stack.row("spikes").card.text.startswith("Spikes in view")
    window.centre.tools.toggle_cursors(True)
    lab.until(lambda: "Δ" in stack.row("V_C1").card.text)
    at_cursor = window.centre.compare_bar.align.group.button(2)
    window.centre.view.place_cursors(starts[0] + 0.02, 1.0)
    at_cursor.click()
    assert window.centre.view.cursors[0] == comparison.members[0].source.holds[0].start
    window.centre.tools.toggle_cursors(False)
    assert not at_cursor.isEnabled(), "there is no cursor to align at"
    window.centre.compare_bar.layout_.group.button(2).click()
    lab.until(lambda: "less ●" in stack.row("V_C1").card.text)
    view = window.centre.view
    view.show_span(0.0, 1.0)
    said = table(stack, "Comparing 2 runs").splitlines()[1]
    assert "run2_less_run1_force_mean_N" in said and ",run1_force" not in said
    window.centre.compare_bar.layout_.group.button(0).click()
    lines = table(stack, "Comparing 2 runs").splitlines()
    assert lines[0].count("run1 ") == lines[0].count("run2 ") == 1
    header = lines[1].split(",")
    for run, member in zip(("run1", "run2"), comparison.members, strict=True):
        time = float(lines[2].split(",")[header.index(f"{run}_force_time_s")])
        known = member.source.trace("force", 0.0, 1.0, 100)
        assert abs(time - known.time[0] - member.shift) < 1e-6
    window.screen_.close_run()
    assert not window.centre.compare_bar.isVisible()
    assert stack.source is session.source, "back to the last run"
    lab.until(lambda: stack.source is window.screen_.run, 30.0)
    assert window.screen_.run.path == session.run.folder, "and then to its record"
    assert newer.name in progress.text, "not how the run ended that was opened"
    lab.until(lambda: "●" not in stack.row("V_C1").card.text)
    assert results.folder == session.run.folder and results.steps
