"""The plots in the window, as painted."""

from dataclasses import replace

import pytest
from PySide6.QtCore import QRect
from PySide6.QtGui import QImage

from gui.look.theme import Theme
from gui.review.plot_view import PlotView
from tactile_lab.plot import Panel, Plot, Series


def painted(app, names: list[str], part: QRect) -> QImage:
    series = [Series(x=[0, 1], y=[i, 1 + i]) for i in range(len(names))]
    named = tuple(replace(s, name=name) for s, name in zip(series, names, strict=True))
    panel = Panel(label="Highest rate", unit="Hz", series=named)
    plot = Plot(name="one", caption="", x_label="Force", x_unit="N", panels=(panel,))
    view = PlotView(Theme("light"))
    view.resize(340, 260)
    view.show_plot(plot)
    return view.grab(part).toImage()


@pytest.mark.parametrize("names", [["Eq. (15)", "simulated bench", "silent"], ["one"]])
def test_a_legend_is_not_painted_over_the_heading(app, names):
    label, legend = QRect(0, 0, 100, 20), QRect(100, 0, 240, 40)
    bare = [""] * len(names)
    assert painted(app, names, label) == painted(app, bare, label)
    assert painted(app, names, legend) != painted(app, bare, legend)
