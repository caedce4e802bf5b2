"""From spike to spike, their shape, and the intervals between them."""

import numpy as np
import pytest
from PySide6.QtTest import QTest

from gui.review.spike_plots import Intervals, interval_plot, shape_plot
from tactile_lab.store.run import Run
from tactile_lab.store.spike_shapes import spike_shapes


def test_intervals_leave_out_silences_and_say_how_many() -> None:
    train = np.array([1.0, 1.1, 1.3, 5.0, 5.2, 5.3])
    found = Intervals.of(train)
    assert np.allclose(found.isi, [0.1, 0.2, 0.2, 0.1])
    assert found.silences == 1
    assert "4 intervals, 1 silence left out" in found.text
    assert "median 150 ms, mean 150 ms, SD 57.7 ms, CV 0.38" in found.text
    late = found.between(5.0, 6.0)
    assert late.at.tolist() == [5.2, 5.3]


def test_a_histogram_counts_every_interval_once() -> None:
    rng = np.random.default_rng(3)
    found = Intervals.of(np.cumsum(rng.uniform(0.1, 0.2, 500)))
    plot = interval_plot(found)
    assert plot is not None
    (series,) = plot.panels[0].series
    assert np.sum(np.asarray(series.y)[1:-1:2]) == found.isi.size == 499


def test_spikes_are_laid_over_each_other_where_they_cross(lab) -> None:
    (folder,) = lab.runs(1)
    with Run.load(folder) as run:
        times = run.spikes["time"]
        shapes = spike_shapes(run, times[[0, 1, 1]] + 1e-4)
        assert np.array_equal(shapes.times, times[:2]), "each once, the nearest"
        own = run.signal("V_K")
        values = own[:]
        for after, seen, time in zip(
            shapes.after, shapes.values, shapes.times, strict=True
        ):
            at = np.searchsorted(own.time(), time)
            last = int(np.flatnonzero(after < 0)[-1])
            assert seen[last] == values[at - 1] < shapes.threshold
            assert seen[last + 1] == values[at] >= shapes.threshold
            line = np.interp(0.0, after[last : last + 2], seen[last : last + 2])
            assert line == pytest.approx(shapes.threshold, abs=1e-3), "crosses at 0"
    plot = shape_plot(shapes, float(times[1]))
    assert np.array_equal(plot.panels[0].series[1].y, shapes.values[1])


def test_keys_go_from_spike_to_spike(lab) -> None:
    (folder,) = lab.runs(1)
    window, view = lab.window, lab.window.centre.view
    window.screen_.open_run(folder)
    lab.until(lambda: window.session.opened == (folder.name,))
    spikes = window.screen_.run.spikes
    window.actions_._tab(3)
    view.show_all()
    QTest.keyClicks(window.page, ".")
    assert view.spike == spikes[0], "not the last, that follows the middle of a run"
    view.show_span(0.0, 0.2)
    assert spikes[0] > 0.2
    QTest.keyClicks(window.page, "..")
    assert view.spike == spikes[1]
    assert view.start < spikes[1] < view.end
    QTest.keyClicks(window.page, ",")
    assert view.spike == spikes[0]
    page = window.review.spikes
    lab.until(lambda: page.shape.plot is not None)
    assert f"Spike 1 of {spikes.size}" in page.facts.text()
    assert "peak" in page.facts.text()
    window.actions_._tab(0)


def test_cards_tell_statistics_between_the_cursors(lab) -> None:
    (folder,) = lab.runs(1)
    window, view = lab.window, lab.window.centre.view
    window.screen_.open_run(folder)
    lab.until(lambda: window.session.opened == (folder.name,))
    row = window.centre.stack.row("V_C1")
    view.place_cursors(0.4, 0.2)
    lab.until(lambda: row.statistics is not None)
    with Run.load(folder) as run:
        signal = run.signal("V_C1")
        values = signal[signal.between(0.2, 0.4)]
    assert row.statistics.samples == values.size
    assert row.statistics.mean == pytest.approx(values.mean())
    assert f"mean {values.mean():.3f}" in row.card.toolTip()
    view.move_cursor(0, 0.3)
    assert row.statistics is None, "what it was of is gone"
    view.clear_cursors()


def test_a_level_of_V_K_becomes_the_threshold_of_the_next_run(lab) -> None:
    (folder,) = lab.runs(1)
    window, form = lab.window, lab.window.setup.tables.form("detect")
    window.screen_.open_run(folder)
    lab.until(lambda: window.session.opened == (folder.name,))
    assert window.screen_.run.threshold == pytest.approx(0.5, abs=0.01)
    before = form.texts()
    window.centre.stack.threshold_asked.emit(0.8)
    assert form.texts()["threshold"] == "800 mV"
    assert form.texts()["hysteresis"] == "160 mV"
    assert form.problem == ""
    form.set_texts(before)
