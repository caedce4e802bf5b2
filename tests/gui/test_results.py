"""The results: any column of the steps against any other."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtWidgets import QApplication, QFrame, QScrollArea

from gui.lanes.expected import Stretch
from gui.look.theme import Theme
from gui.plots.numbers import unbroken
from gui.record.progress import ProgressStrip
from gui.review.live_plots import COLUMNS, column_plot, rate_plot, train_plot
from gui.review.results import ResultsView
from gui.session.fit import FitInput, fit
from gui.state import Snapshot, WindowState
from tactile_lab.conclusion import Table
from tactile_lab.measurement import BETWEEN_SAMPLES, MeasuredTrial

SILENT, SLOW, FAST = (
    MeasuredTrial(
        label=f"{level * 1e3:.0f} mN", level=level, start=100 * level, duration=3.0,
        spike_times=np.array(times), hold=(0.0, 2.0),
    )
    for level, times in ((0.04, []), (0.08, [0.3, 0.5, 0.8]), (0.16, [0.1, 0.15, 0.2]))
)  # fmt: skip


@pytest.fixture
def results(app) -> ResultsView:
    view = ResultsView(Theme("light"))
    view.show_steps([SILENT, SLOW, FAST], total=3, running=False, whole=True)
    return view


def drawn(view: ResultsView) -> tuple[list[float], list[float], str]:
    QApplication.processEvents()
    (series,) = view.plot.plot.panels[0].series
    return list(series.x), list(series.y), series.name


def test_steps_without_a_level_are_said_to_be_none(app) -> None:
    """24 vibrations were "No steps yet", and five of them all named 100 Hz."""
    steps = [replace(s, level=None, label="100 Hz") for s in (SLOW, FAST)]
    view = ResultsView(Theme("light"))
    view.show_steps(steps, total=2, running=False, whole=True)
    assert "No steps yet" not in view.plot.nothing
    for _ in range(2):
        QApplication.processEvents()
    names = [one.name for one in view.trains.plot.panels[0].series]
    assert names == ["100 Hz, no. 2", "100 Hz, no. 1"]


def test_steps_whose_spikes_are_not_all_counted_have_no_rate(app) -> None:
    steps = [replace(s, uncounted=BETWEEN_SAMPLES) for s in (SILENT, SLOW, FAST)]
    view = ResultsView(Theme("light"))
    view.show_steps(steps, total=3, running=False, whole=True)
    shown = [[view.table.item(r, c).text() for c in range(6)] for r in range(3)]
    assert shown[1] == ["80 mN", "3†", "—", "—", "—", "—"]
    assert BETWEEN_SAMPLES in view.table.item(1, 1).toolTip()
    assert rate_plot(steps) is None
    assert train_plot(steps) is None
    assert column_plot(steps, "spikes", "force") is None
    for _ in range(2):
        QApplication.processEvents()
    assert "missed" in view.plot.nothing
    spikes = np.concatenate([s.start + s.spike_times for s in steps])
    found = fit(steps, FitInput(spikes, spikes, {}))
    assert {card.value for card in found.cards} == {"—"}
    assert all("missed" in card.detail for card in found.cards)
    assert not found.bars and not found.rates


def test_a_run_longer_than_planned_is_not_beyond_its_end(app) -> None:
    """Looks at rest that were not over made it "15 of 14 steps"."""
    view = ResultsView(Theme("light"))
    strip = ProgressStrip(Theme("light"))
    holds = [Stretch(0.0, 1.0, "a"), Stretch(1.0, 2.0, "b")]
    for total, results, steps in (
        (3, "preliminary · 3 of 3 steps", "Step 2 of 2 · b"),
        (2, "preliminary · 3 steps", "Step 3 · b"),
    ):
        view.show_steps([SILENT, SLOW, FAST], total=total, running=True, whole=False)
        assert view.mark.text() == results
        running = Snapshot(WindowState.RUNNING)
        strip.show_run(running, holds, 2.0, 1.0, (4 - total, "b"), "")
        assert strip.text.startswith(steps)


def test_a_force_that_comes_again_is_joined_by_no_line_of_the_model() -> None:
    rates = [(0.08, 2.0), (0.16, 5.0), (0.08, 0.0)]
    for model, mark in ((rates[:2], "line"), (rates, "crosses")):
        assert rate_plot([SLOW, FAST], model).panels[0].series[-1].mark == mark


def test_a_step_of_one_spike_has_no_rate_and_is_not_drawn_as_silent() -> None:
    """It stood at 0 Hz, as the one that did not fire; the slope said it had not."""
    once = replace(SLOW, level=0.06, spike_times=np.array([0.5]))
    peak, final = rate_plot([SILENT, once, FAST]).panels[0].series
    for series in (peak, final):
        assert series.y[0] == 0.0 and np.isnan(series.y[1]) and series.y[2] > 0
    assert rate_plot([SILENT, once]) is None


def test_a_step_that_stop_cut_short_has_no_final_rate() -> None:
    """The plot had one beside "No step that ended has fired"."""
    cut = replace(FAST, level=0.2, complete=False)
    for series in rate_plot([SILENT, SLOW, cut]).panels[0].series:
        assert series.x == pytest.approx([0.04, 0.08])
    assert rate_plot([SILENT, cut]) is None
    for what in ("final rate", "fall"):
        (series,) = column_plot([SLOW, FAST, cut], what, "force").panels[0].series
        assert series.name == "2 of 3 steps"


def test_a_page_of_results_asks_for_no_more_height_than_it_needs(results) -> None:
    """Plots asked for a picture's, and the room became a gap above the last lines."""
    results.show_statements(["The rate rises."])
    assert results.plot.sizeHint().height() == results.plot.minimumHeight()
    results.resize(360, 2000)
    results.show()
    QApplication.processEvents()
    below = results.bars.y() - results.statements.geometry().bottom()
    assert below < 40, "plots take the room that is left"


def test_a_column_is_drawn_against_another(results: ResultsView) -> None:
    results.drawn.setCurrentText("first spike")
    results.against.setCurrentText("peak rate")
    x, y, name = drawn(results)
    assert x == pytest.approx([5.0, 20.0]) and y == pytest.approx([0.3, 0.1])
    assert name == "2 of 3 steps", "one has no spike"
    assert results._title.text() == "First spike against peak rate"


def test_the_table_is_of_the_run_that_is_on_screen(results: ResultsView) -> None:
    """Rows of the run before stayed where the next had as many steps, or more."""
    results.show_steps([FAST, SILENT, SLOW], total=3, running=False, whole=True)
    names = [results.table.item(at, 0).text() for at in range(3)]
    assert names == ["160 mN", "40 mN", "80 mN"]


def test_the_table_is_as_high_as_its_steps(results: ResultsView) -> None:
    """Below the one step of a hold was a gap of three rows."""

    def high(count: int, *, running: bool) -> int:
        steps = [SILENT, SLOW, FAST][:count]
        results.show_steps(steps, total=3, running=running, whole=not running)
        return results.table.height()

    one, two = (high(count, running=False) for count in (1, 2))
    assert two - one == results.table.rowHeight(0)
    assert high(1, running=True) == high(3, running=True), "nothing below it moves"
    # of "120 mN, 1 set-point skipped" it told "120 mN, …-point …"
    assert not results.table.wordWrap(), "a long name is one line without its middle"


def test_a_wide_table_of_the_report_pushes_nothing_out_of_the_page(
    results: ResultsView, app
) -> None:
    """Five columns of a sine sweep cut bars and the button off at the right."""
    row = ("0.0299 Hz", "2.04662 ± 0.00077", "−148.576 ± 0.021", "2.04798", "−148.581")
    headings = ("Frequency", "Gain, V/N", "Phase, °", "Model", "Model, °")
    results.resize(332, 900)
    results.show()
    results.show_statements(["Told."], [Table(headings=headings, rows=(row,))])
    app.processEvents()
    (area,) = results.findChildren(QScrollArea)
    assert area.widget().width() <= area.viewport().width()
    assert "± " not in results.tables.text(), "no line ends between it and its number"


def test_the_rates_go_with_the_force_alone(results: ResultsView) -> None:
    results.against.setCurrentText("start")
    assert results.drawn.currentText() == "peak rate"
    assert drawn(results)[0] == pytest.approx([8.0, 16.0])
    results.drawn.setCurrentText("rates")
    assert results.against.currentText() == "force"
    QApplication.processEvents()
    assert [one.name for one in results.plot.plot.panels[0].series] == ["peak", "final"]


@pytest.mark.parametrize("x", COLUMNS)
@pytest.mark.parametrize("y", COLUMNS)
def test_each_column_can_be_drawn_also_where_nothing_fired(y: str, x: str) -> None:
    found = column_plot([SLOW, FAST], y, x)
    assert found is not None and found.panels[0].series[0].x.size == 2
    needs = {"force", "start", "spikes"}
    assert (column_plot([SILENT], y, x) is None) is not ({x, y} <= needs)


def test_cards_without_the_newest_step_are_pale(results: ResultsView) -> None:
    def fitted(steps: list[MeasuredTrial]) -> None:
        results.show_fit(fit(steps, FitInput(np.empty(0), np.empty(0), {})))

    def steps(count: int) -> list[MeasuredTrial]:
        shown = [SILENT, SLOW, FAST][:count]
        results.show_steps(shown, total=3, running=True, whole=False)
        return shown

    fitted(steps(2))
    tips = [card.toolTip() for card, *_ in results.cards._labels]
    assert "neighbouring" in tips[1] and "95 %" in tips[2], "how they were obtained"
    assert not results.cards.old
    three = steps(3)
    assert results.cards.old, "they say that one step fired, beside a plot of two"
    assert "newest" in results.cards.toolTip()
    results.show_steps(three, total=3, running=False, whole=True)
    assert results.cards.old, "the run has ended, and the fit is still on its way"
    fitted(three)
    assert not results.cards.old and not results.cards.toolTip()


def test_a_step_of_a_run_draws_the_rates_once(results: ResultsView) -> None:
    """Its plots were made at its end, and again five frames later by the fit.

    To make both took 36 ms of one frame: each has a turn of its own.
    """
    plots = results.plot, results.trains

    def made() -> list[int]:
        return [id(panel) for plot in plots for panel in plot.panels]

    QApplication.processEvents()
    results.show_steps([], total=3, running=True, whole=False)
    for count in (1, 2, 3):
        steps = [SLOW, FAST, SILENT][:count]
        QApplication.processEvents()
        before = made()
        results.show_steps(steps, total=3, running=True, whole=False)
        QApplication.processEvents()
        assert made() == before, "the fit of the step is on its way"
        results.show_fit(fit(steps, FitInput(np.empty(0), np.empty(0), {})))
        assert made() == before, "in a turn of its own"
        for _ in range(2):
            QApplication.processEvents()
        assert made() != before
        assert not results.trains.isHidden(), "the first step fired"


def test_pale_cards_lay_out_nothing_else(results: ResultsView, app) -> None:
    """Each step's end took 36 ms, in which Qt laid out all that was hidden."""

    class Hidden(QFrame):
        resized = 0

        def event(self, event: QEvent) -> bool:
            self.resized += event.type() is QEvent.Type.Resize
            return super().event(event)

    hidden = Hidden(results)
    hidden.hide()
    results.show()
    results.show_fit(fit([SLOW, FAST], FitInput(np.empty(0), np.empty(0), {})))
    app.processEvents()
    sharp = results.cards.grab().toImage()
    hidden.resized = 0
    hidden.resize(7, 7)
    results.cards.mark_old(True)
    app.processEvents()
    assert hidden.resized == 0
    assert results.cards.grab().toImage() != sharp
    results.cards.mark_old(False)
    assert results.cards.grab().toImage() == sharp


def test_a_step_that_was_cut_short_says_so_in_full(results: ResultsView, app) -> None:
    cut = replace(FAST, label="200 mN", complete=False)
    results.resize(332, 700)  # as wide as the panel
    results.show()
    results.show_steps([cut], total=3, running=False, whole=False)
    app.processEvents()
    table = results.table
    words = table.fontMetrics().horizontalAdvance(table.item(0, 0).text())
    assert table.item(0, 0).text() == "200 mN, cut short"
    assert words < table.columnWidth(0)
    heads = table.horizontalHeader()
    assert all(heads.sectionSize(k) >= heads.sectionSizeHint(k) for k in range(1, 6))


def test_what_a_report_cannot_tell_is_told_with_what_it_can(lab, tmp_path) -> None:
    """Six of 24 frequencies of a sweep were not in its plot, and nothing said why."""
    why = "No gain at 0.1 Hz: V_C1 left its channel's range."
    told = {"protocol": "sine_sweep", "conclusion": None, "missing": [why]}
    (tmp_path / "results.json").write_text(json.dumps(told | {"statements": ["Fair."]}))
    lab.window.screen_.results._conclude(tmp_path)
    shown = lab.window.review.results.statements.text()
    assert shown.splitlines() == ["Fair.", unbroken(why)]
    lab.window.screen_.results.clear()
