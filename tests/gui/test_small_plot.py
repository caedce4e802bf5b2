"""The plots in the window, as painted."""

import gc
import re
import weakref
from dataclasses import replace
from typing import get_args

import numpy as np
import pyqtgraph as pg
import pytest
from PySide6.QtCore import QPoint, QPointF, QRect, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetrics, QImage, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from gui.look.theme import Theme
from gui.plots.axis import RoundAxis, guarded
from gui.plots.panel_item import LEFT
from gui.plots.small_plot import SmallPlot
from tactile_lab.measurement import BETWEEN_SAMPLES
from tactile_lab.plot import Guide, Mark, Panel, Plot, Series


def painted(app, names: list[str], part: QRect) -> QImage:
    series = [Series(x=[0, 1], y=[i, 1 + i]) for i in range(len(names))]
    named = tuple(replace(s, name=name) for s, name in zip(series, names, strict=True))
    panel = Panel(label="Highest rate", unit="Hz", series=named)
    plot = Plot(name="one", caption="", x_label="Force", x_unit="N", panels=(panel,))
    view = SmallPlot(Theme("light"))
    view.resize(340, 260)
    view.show_plot(plot)
    return view.grab(part).toImage()


@pytest.mark.parametrize("names", [["Eq. (15)", "simulated bench", "silent"], ["one"]])
def test_a_legend_is_not_painted_over_the_heading(app, names):
    label, legend = QRect(0, 0, 100, 20), QRect(100, 0, 240, 40)
    bare = [""] * len(names)
    assert painted(app, names, label) == painted(app, bare, label)
    assert painted(app, names, legend) != painted(app, bare, legend)


def test_the_words_where_there_is_no_plot_are_whole(app):
    """Of a long reason in one line both ends lay outside a narrow panel."""
    view = SmallPlot(Theme("light"), f"No rates: {BETWEEN_SAMPLES}.")
    view.resize(260, 200)
    image = view.grab().toImage()
    inked = [
        x
        for x in range(260)
        for y in range(200)
        if image.pixel(x, y) != image.pixel(1, 1)
    ]
    assert max(inked) < 255 and min(inked) > 4
    view.show_plot(rates(1.0))
    drawn = view.grab().toImage()
    view.nothing = "Something else."
    view.draw()
    assert view.grab().toImage() == drawn, "words lie over no plot"


def rates(top: float) -> Plot:
    series = (Series(x=[0.0, 0.1], y=[0.0, top]),)
    panel = Panel(label="rate", unit="Hz", series=series)
    return Plot(name="rates", caption="", x_label="force", x_unit="N", panels=(panel,))


def test_a_note_of_a_panel_is_told(app):
    """Two panels of scans at two speeds, of which nothing said which was which."""
    panel = rates(1.0).panels[0]
    notes = ("8 mm/s", "18 mm/s")
    panels = tuple(replace(panel, note=note) for note in notes)
    view = SmallPlot(Theme("dark"))
    counted = tuple(replace(panel, whole=True) for panel in panels)
    view.show_plot(replace(rates(1.0), panels=counted))
    (left,) = (
        i for i in view.panels[0].items if getattr(i, "orientation", "") == "left"
    )
    assert left.tickValues(0.5, 5.5, 150) == [(1.0, [1, 2, 3, 4, 5])]
    told = [
        [item.text for item in one.items if isinstance(item, pg.LabelItem)]
        for one in view.panels
    ]
    assert all(note in "".join(texts) for note, texts in zip(notes, told, strict=True))


def test_intervals_of_points_are_not_joined_to_a_band(app):
    """Three vector strengths stood in a band, as if those between were known."""
    series = Series(x=[1, 2, 3], y=[5, 5, 5], low=[1, 2, 3], high=[9, 8, 7])
    for mark, filled in (("points", 0), ("dots", 0), ("line", 1)):
        panel = Panel(label="rate", unit="Hz", series=(replace(series, mark=mark),))
        view = SmallPlot(Theme("light"))
        view.show_plot(replace(rates(1.0), panels=(panel,)))
        drawn = view.panels[0].box.addedItems
        bands = [i for i in drawn if isinstance(i, pg.FillBetweenItem)]
        bars = [
            i for i in drawn
            if isinstance(i, pg.PlotCurveItem) and i.opts["connect"] == "pairs"
        ]  # fmt: skip
        assert (len(bands), len(bars)) == (filled, 1 - filled)
        if bars:
            assert bars[0].getData()[1].tolist() == [1, 9, 2, 8, 3, 7]


def test_one_value_but_for_rounding_has_an_axis_that_can_be_read(app) -> None:
    """Twelve touches of 160 mN stood at 159.99995, 160.00000 and 160.00005."""
    force = (0.16, 0.16 * (1 + 1e-9), 0.16)
    panel = Panel(label="rate", unit="Hz", series=(Series(x=force, y=[9, 8, 7]),))
    plot = Plot(name="one", caption="", x_label="F", x_unit="N", panels=(panel,))
    view = SmallPlot(Theme("light"))
    view.show_plot(plot)
    left, right = view.panels[0].box.whole[0]
    assert 10 < right - left < 30 and left < 160 < right


def near(*y: float) -> Plot:
    """A time constant of each run, all nearly the same."""
    series = Series(x=[1, 2], y=y, mark="joined", of=(7, 8))
    panel = Panel(label="tau", unit="s", series=(series,))
    return Plot(name="near", caption="", x_label="Run", whole=True, panels=(panel,))


def test_numbers_that_differ_in_late_digits_are_told_as_in_the_report(app) -> None:
    """They were one point on an axis from 4.1 to 4.65 s."""
    view = SmallPlot(Theme("light"))
    view.resize(340, 260)
    view.show_plot(near(4.36877012, 4.36877031))
    (one,) = view.panels
    (heading,) = (i for i in one.items if isinstance(i, pg.LabelItem))
    assert "tau less 4.36877 s (ns)" in heading.text
    (left,) = (i for i in one.items if getattr(i, "orientation", "") == "left")
    low, high = one.box.whole[1]
    assert 80 < low < 120 and 310 < high < 350
    step, values = left.tickValues(low, high, 150)[0]
    texts = left.tickStrings(values, 1.0, step)
    metrics = QFontMetrics(left.style["tickFont"])
    assert max(map(metrics.horizontalAdvance, texts)) < LEFT
    assert len(texts) > 2 and "200" in texts
    assert one.at(QPointF(2, 310)) == 8, "its points are where they are drawn"


def test_a_zoom_does_not_stay_where_other_numbers_are_on_the_axis(app) -> None:
    view = SmallPlot(Theme("light"))
    for y, kept in ((4.36877035, True), (4.5, False)):
        view.show_plot(near(4.36877012, 4.36877031))
        box = view.panels[0].box
        box.setRange(yRange=(150, 200), padding=0)
        view.show_plot(near(4.36877012, y))
        shown = view.panels[0].box.viewRange()[1]
        assert (shown == pytest.approx([150, 200])) is kept, shown


def test_the_ends_of_intervals_are_in_view(app) -> None:
    """Of a phase of −100° ± 40° the bar ended at −120°, where its panel did."""
    view, low = SmallPlot(Theme("light")), Series(x=[1.0, 9.0], y=[-100.0, -90.0])
    phase = replace(low, y_error=[40.0, 1.0], x_error=[0.5, 6.0], mark="points")
    gain = replace(phase, y=[2.0, 3.0], y_error=[2.5, 1.0], x_error=None)
    panels = (
        Panel(label="phase", series=(phase,)),
        Panel(label="gain", series=(gain,), log=True),
    )
    view.show_plot(Plot(name="one", caption="", x_label="f", panels=panels))
    (left, right), (bottom, top) = view.panels[0].box.whole
    assert left < 0.5 and right > 15 and bottom < -140 and top > -60
    (bars,) = (
        i for i in view.panels[1].box.addedItems if isinstance(i, pg.ErrorBarItem)
    )
    ends = np.log10([2.0, 3.0]) - bars.opts["bottom"]
    assert ends[0] < view.panels[1].box.whole[1][0] - 1, "it reaches 0, and is drawn so"
    assert ends[1] == pytest.approx(np.log10(2.0))


def test_no_number_of_an_axis_lies_over_another(app) -> None:
    """Of 24 frequencies each had its number, and none could be read."""
    at = np.geomspace(0.01, 0.8, 24)
    panel = Panel(label="gain", series=(Series(x=at, y=at, mark="points"),))
    plot = Plot(name="one", caption="", x_label="f", x_log=True, panels=(panel,))
    few, many = (replace(plot, x_ticks=tuple(x)) for x in (at[::6], at))
    view = SmallPlot(Theme("light"))
    for plot in (few, many):
        view.show_plot(plot)
        (axis,) = (
            i for i in view.panels[0].items if getattr(i, "orientation", "") == "bottom"
        )
        ((step, values),) = axis.tickValues(-2.1, 0.0, 250)
        texts = axis.tickStrings(values, 1.0, step)
        assert texts[0] == "0.01" and len(texts) >= 4
        assert np.diff(values).min() * 250 / 2.1 > 44
    assert len(texts) < 7


def test_values_that_are_all_zero_have_an_axis_that_can_be_read(app) -> None:
    """No spike at any point of a study: its range was a nanohertz, without a number."""
    view = SmallPlot(Theme("light"))
    view.show_plot(rates(0.0))
    low, high = view.panels[0].box.whole[1]
    assert high - low >= 1 and low < 0 < high


def test_what_is_near_its_other_limit_has_air_about_it(app) -> None:
    """Three rates about 15 Hz above 0: their dots stood half cut at the upper edge."""
    line = Series(x=(1.0, 2.0, 3.0), y=[15.2, 15.4, 15.2])
    panel = Panel(label="rate", unit="Hz", series=(line,), limits=(0.0, None))
    plot = Plot(name="near", caption="", x_label="t", x_unit="s", panels=(panel,))
    view = SmallPlot(Theme("light"))
    view.show_plot(plot)
    low, high = view.panels[0].box.whole[1]
    assert low == 0 and high > 1.05 * 15.4


def test_a_text_of_many_lines_stands_below_its_plot(app) -> None:
    """Five fitted values stood over the data they are of."""
    lines = "\n".join(f"line {k}" for k in range(5))
    curve = (Series(x=[0, 1], y=[1, 0]),)
    heights = []
    for text in ("", lines):
        panel = Panel(label="r", unit="Hz", series=curve, text=text)
        plot = Plot(name="one", caption="", x_label="t", x_unit="s", panels=(panel,))
        view = SmallPlot(Theme("light"))
        view.show_plot(plot)
        view.resize(340, view.minimumHeight())
        view.show()
        app.processEvents()
        item = view.panels[0]
        heights.append(item.box.height())
    words = item.layout.itemAt(3, 0)
    assert words.geometry().top() >= item.box.geometry().bottom() + 30, "and the axis"
    assert words.geometry().bottom() <= item.geometry().height() + 1
    assert heights[1] >= heights[0] - 10, "the curve has the room it had"


def shown(app) -> SmallPlot:
    view = SmallPlot(Theme("light"))
    view.resize(340, 260)
    view.show_plot(rates(10.0))
    view.show()
    app.processEvents()
    return view


def test_a_zoom_stays_when_the_next_step_comes_and_a_double_click_ends_it(app):
    view = shown(app)
    view.panels[0].box.setRange(xRange=(20, 50), yRange=(1, 2), padding=0)
    view.show_plot(rates(30.0))
    app.processEvents()
    box = view.panels[0].box
    assert np.allclose(box.viewRange(), [[20, 50], [1, 2]])
    at = box.mapToScene(box.rect().center()).toPoint()
    QTest.mouseDClick(view.viewport(), Qt.MouseButton.LeftButton, pos=at)
    QTest.mouseRelease(view.viewport(), Qt.MouseButton.LeftButton, pos=at)
    (left, right), (low, high) = view.panels[0].box.viewRange()
    assert left <= 0 and right >= 100 and low <= 0 and high >= 30


def test_a_plot_that_is_as_before_is_not_built_again(app):
    """Every two seconds of a run the rates were built anew, which were as before."""
    view = shown(app)
    (panel,) = view.panels
    view.show_plot(rates(10.0))
    assert view.panels == [panel]
    view.show_plot(rates(30.0))
    assert view.panels != [panel]
    view.show_plot(None)
    before = view.grab().toImage()
    view.nothing = "No step has fired."
    view.show_plot(None)
    assert view.grab().toImage() != before


@pytest.mark.parametrize("key", ["NoModifier", "ControlModifier"])
def test_the_wheel_scrolls_the_page_and_zooms_with_ctrl(app, key):
    view = shown(app)
    before = view.panels[0].box.viewRange()
    held = Qt.KeyboardModifier[key]
    at = QPointF(200, 100)
    event = QWheelEvent(
        at, view.mapToGlobal(at), QPoint(), QPoint(0, 120),
        Qt.MouseButton.NoButton, held, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(view.viewport(), event)
    zoomed = not np.allclose(view.panels[0].box.viewRange(), before)
    assert zoomed is event.isAccepted() is (key == "ControlModifier")


@pytest.mark.parametrize("height", [None, 120])
def test_the_ground_is_that_of_the_panel_it_stands_on_in_each_theme(app, height):
    theme = Theme("light")
    view = SmallPlot(theme, height=height)
    view.resize(340, 260)
    view.show_plot(rates(10.0))
    view.show()
    for name in ("light", "dark", "light"):
        theme.choose(name)
        app.processEvents()
        ground = theme.tokens.panel if height is None else theme.tokens.sunken
        image = view.grab().toImage()
        corner = image.pixelColor(image.width() - 3, image.height() - 3)
        assert corner == QColor(ground), name


def test_pyqtgraph_makes_no_class_of_qt_that_nobody_uses() -> None:
    copy = vars(pg.Qt.QtWidgets)
    assert "QGraphicsView" in copy and "QWizard" not in copy
    assert pg.Qt.QtWidgets.QWizard.__name__ == "QWizard", "and has it when asked"
    del copy["QWizard"]


def test_the_first_and_the_last_number_stand_on_an_axis(app):
    axis = RoundAxis("bottom", 60)
    _, values = axis.tickValues(0.0, 10.0, 300)[0]
    words = axis.tickStrings(values, 1.0, 2.0)
    assert min(values) > 0.0 and max(values) < 10.0
    assert words == ["0", "2", "4", "6", "8", "10"]


def test_a_paint_that_fails_leaves_the_picture_and_is_told(app, qtbot):
    class Broken(pg.GraphicsObject):
        def boundingRect(self):  # noqa: N802
            return QRectF(0, 0, 10, 10)

        @guarded
        def paint(self, *given):
            raise ValueError("cannot be painted")

    view = shown(app)
    for _ in range(3):
        view.panels[0].box.addItem(Broken(), ignoreBounds=True)
    with qtbot.captureExceptions() as told:
        view.grab()
        view.close()
        app.processEvents()
    assert {str(one[1]) for one in told} == {"cannot be painted"} and len(told) >= 3


def test_one_that_is_dropped_goes_at_once(app):
    """One left to Python's collector ended in the thread it ran in, and crashed."""
    gc.collect()
    gc.disable()
    try:
        view = shown(app)
        left = [weakref.ref(one) for one in (view, *view.panels, view.panels[0].box)]
        del view
        assert [one() for one in left] == [None] * len(left)
    finally:
        gc.enable()


def test_every_mark_is_drawn(app):
    x = np.linspace(0.1, 0.2, 5)
    for mark in get_args(Mark):
        texts = tuple("abcde") if mark == "text" else ()
        series = Series(
            x=x, y=x, low=x - 0.01, high=x + 0.01, mark=mark, texts=texts, y_error=x / 9
        )
        view = shown(app)
        panel = Panel(label="a", series=(series,), guides=(Guide(at=0.1, text="b"),))
        view.show_plot(
            Plot(name="one", caption="", x_label="x", panels=(panel, panel), x_log=True)
        )
        image = view.grab().toImage()
        assert view.panels[1].box.addedItems and not image.isNull(), mark


@pytest.mark.parametrize(
    "low, high, told",
    [
        (7.5, 110.0, ["10", "20", "50", "100"]),
        (1.0, 1e5, ["1", "10", "100", "1000", "10⁴", "10⁵"]),
        (2e-6, 3e-5, ["2·10⁻⁶", "5·10⁻⁶", "10⁻⁵", "2·10⁻⁵"]),
        (3.2, 4.7, ["4"]),
        (0.03, 0.07, ["0.03", "0.04", "0.05", "0.06", "0.07"]),
    ],
)
def test_a_logarithmic_axis_of_less_than_two_powers_has_numbers(app, low, high, told):
    axis = RoundAxis("left", 26)
    axis.logMode = True
    ((step, values),) = axis.tickValues(np.log10(low), np.log10(high), 200)
    assert axis.tickStrings(values, 1.0, step) == told


@pytest.mark.parametrize(
    "z, told",
    [([0.0, 0.0], "all 0"), ([np.nan, np.nan], "no value"), ([0.0, 2.0], "■ 2")],
)
def test_a_map_of_one_value_makes_up_no_scale(app, z, told):
    """Nine points without a spike stood under a scale from 0 to 1e-12."""
    cells = Series(name="count", x=[0.0, 1.0], y=[0.0, 0.0], z=z, mark="cells")
    view, panel = SmallPlot(Theme("light")), Panel(label="y", series=(cells,))
    view.show_plot(Plot(name="one", caption="", x_label="x", panels=(panel,)))
    heading = re.sub(r"<[^>]*>", "", view.panels[0]._heading("R (MOhm)"))
    assert heading.endswith(told), heading
    assert heading.startswith("R (MΩ)"), "as the list of points has it"
