"""What a figure shows: margins, texts clear of each other, no time without a trial."""

import itertools

import numpy as np
import pytest
from matplotlib.colors import to_hex

from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.report import palette
from tactile_lab.report.canvas import draw, save
from tactile_lab.report.findings import find
from tactile_lab.report.overview import overview
from tactile_lab.report.splice import ClosedTime


def axes(*series, **panel):
    panels = (Panel(label="Ratio", unit="", series=series, **panel),)
    plot = Plot(name="x", caption="x.", x_label="Gap", x_unit="s", panels=panels)
    return draw(plot, "x").axes[0]


def test_a_flat_row_of_points_stands_clear_of_the_upper_end():
    joined = Series(x=[0, 1], y=[0.87, 0.88], mark="joined")
    low, high = axes(joined, limits=(0.0, None)).get_ylim()
    assert low == 0
    assert high > 0.88 * 1.03


@pytest.mark.parametrize(
    "values",
    [
        (0.0, 1.0),
        (4.3668, 4.3688),
        (-1234.51, -1234.48),
        (-1234.51, -1234.26),
        (-1234.51, -1233.5),
        (4.36877, 4.3687700001),
        (4.36877, np.nextafter(4.36877, 5)),
    ],
)
def test_the_name_of_y_stands_clear_of_its_numbers(values):
    drawn = axes(Series(x=[0, 1], y=values, mark="joined"))
    numbers = [one.get_window_extent().x0 for one in drawn.get_yticklabels()]
    name = drawn.yaxis.label.get_window_extent()
    assert 0 < name.x0 and name.x1 < min(numbers)


def test_numbers_that_differ_in_late_digits_are_told_less_a_round_one():
    """Above the axis stood "1e-7+4.36877", and its numbers were those times that."""
    y = [4.36877012, 4.36877031]
    panel = Panel(
        label="tau", unit="s", series=(Series(x=[0, 1], y=y, mark="joined"),),
        guides=(Guide(at=4.3687702, along="x", text="mean"), Guide(at=0.5)),
    )  # fmt: skip
    drawn = draw(Plot(name="x", caption="x.", x_label="Run", panels=(panel,)), "x")
    (one,) = drawn.axes
    assert one.get_ylabel() == "tau less 4.36877 s (ns)"
    assert one.yaxis.get_offset_text().get_text() == ""
    mean, upright, line = one.lines
    assert line.get_ydata() == pytest.approx([120, 310])
    assert mean.get_ydata() == pytest.approx([200, 200])
    assert upright.get_xdata() == [0.5, 0.5]
    numbers = [text.get_text() for text in one.get_yticklabels()]
    assert {"150", "200", "250", "300"} <= set(numbers)


def test_what_counts_has_whole_numbers_and_each_of_a_few():
    dots = Series(x=[0, 1], y=[1, 5], mark="dots")
    scans = axes(dots, limits=(0.5, 5.5), whole=True, height=1.3)
    low, high = scans.get_ylim()
    assert [y for y in scans.get_yticks() if low < y < high] == [1, 2, 3, 4, 5]


@pytest.mark.parametrize(("count", "told"), [(5, 5), (24, 12)])
def test_numbers_at_values_of_their_own_can_be_read(count, told):
    """Of 24 frequencies each had its number, one over the other."""
    at = np.geomspace(0.01, 0.8, count)
    panel = Panel(label="Gain", series=(Series(x=at, y=at, mark="points"),))
    plot = Plot(
        name="x", caption="x.", x_label="Frequency", x_unit="Hz", x_prefix="",
        x_log=True, x_ticks=tuple(at.tolist()), panels=(panel,),
    )  # fmt: skip
    labels = [
        one for one in draw(plot, "x").axes[0].get_xticklabels() if one.get_text()
    ]
    assert len(labels) == told and labels[0].get_text() == "0.01"
    boxes = [one.get_window_extent() for one in labels]
    assert all(one.x1 < two.x0 for one, two in itertools.pairwise(boxes))


def test_dollars_in_names_are_no_formula(tmp_path):
    odd = "a$b_{$ of V_C1"
    at = Series(x=[0.0, 1.0], y=[0.0, 1.0], mark="text", texts=(odd, odd))
    panel = Panel(
        label=odd, series=(Series(x=[0.0, 1.0], y=[0.0, 1.0], name=odd), at),
        guides=(Guide(at=0.5, text=odd),), text=odd, note=odd,
    )  # fmt: skip
    plot = Plot(name="x", caption=odd, x_label=odd, panels=(panel,))
    figure = draw(plot, odd, odd, simulated=True)
    save(figure, tmp_path / "x")
    assert figure.texts[0].get_text().replace("\\$", "$") == odd
    assert "$V_{C1}$" in figure.axes[0].get_xlabel()


@pytest.mark.parametrize("apart", [0.01, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("level", [0.1, -0.1])
def test_labels_of_trials_close_together_can_be_read(apart, level):
    x = np.arange(12) * apart
    texts = tuple(f"{at:g} s, press {n}" for n, at in enumerate(x))
    labels = Series(x=x, y=np.full(12, level), mark="text", texts=texts)
    span = Series(x=[0.0, 40.0], y=[0.0, level], mark="line")
    shown = [text for text in axes(span, labels).texts if text.get_visible()]
    boxes = [text.get_window_extent() for text in shown]
    assert boxes
    for n, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:n])


def test_labels_of_presses_of_nearly_one_force_can_be_read():
    """In a trim's figure the last two ran into each other, the first into the axis."""
    x = np.arange(12.0) * 1.6 + 1.0
    level = np.array([90.0] * 10 + [88.0, 92.0])
    texts = tuple(f"{f:g} mN at 1.4083 V" for f in level)
    labels = Series(x=x, y=level, mark="text", texts=texts)
    drawn = axes(Series(x=[0.0, 19.5], y=[0.0, 90.0], mark="line"), labels,
                 limits=(0.0, 115.0), height=1.15)  # fmt: skip
    boxes = [t.get_window_extent() for t in drawn.texts if t.get_visible()]
    assert len(boxes) > 6
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    inside = [drawn.bbox.x0 - 1 < b.x0 and b.x1 < drawn.bbox.x1 + 1 for b in boxes]
    assert all(inside)


def test_no_line_of_the_grid_runs_through_the_numbers_of_a_fit():
    line = Series(x=[0.0, 1.0], y=[0.0, 1.0], mark="line")
    drawn = axes(line, text="tau = 8.69 s (8.66 to 8.72 s, 95 %)")
    (told,) = drawn.texts
    plate = told.get_bbox_patch()
    assert plate is not None and to_hex(plate.get_facecolor()) == palette.PAPER.light
    assert plate.get_alpha() > 0.7
    assert told.zorder > max(g.get_zorder() for g in drawn.get_ygridlines())


def test_a_logarithmic_axis_has_numbers_that_do_not_run_into_each_other():
    onset = Series(x=[0.0047, 0.012, 0.03, 0.06], y=[1.0, 2.0, 3.0, 4.0], mark="points")
    panels = (Panel(label="Latency", series=(onset,)),) * 2
    plot = Plot(name="x", caption="x.", x_label="Onset", x_unit="s", x_log=True,
                panels=panels)  # fmt: skip
    figure = draw(plot, "x")
    figure.canvas.draw()
    upper, lower = figure.axes
    told = [t for t in lower.get_xticklabels(which="both") if t.get_text()]
    assert {"5", "10", "20", "50"} <= {t.get_text() for t in told}
    assert not any("10^" in t.get_text() for t in told)
    boxes = [t.get_window_extent() for t in told]
    assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
    numbers = upper.get_xticklabels(which="both")
    assert not any(t.get_text() and t.get_visible() for t in numbers)


def test_a_figure_closes_up_over_recoveries(rate_force):
    shown = overview(find(rate_force).run)
    force, voltage, *_ = shown.panels
    cuts = [g for g in force.guides if g.to is None]
    assert len(cuts) == 3
    duration = shown.x_limits[1]
    assert duration == pytest.approx(rate_force.duration - 150.0)
    holds = [g.at - 0.25 for g in force.guides if g.to is not None]
    assert holds == pytest.approx([0.0, 2.0, 4.0, 6.0])
    pushed = force.series[0]
    assert pushed.x[-1] == pytest.approx(duration)
    assert np.interp(4.5, pushed.x, pushed.y) == pytest.approx(0.15)
    V_C1 = next(s for s in voltage.series if s.name == "V_C1")
    known = V_C1.x[np.isfinite(V_C1.x)]
    assert np.all(np.diff(known) > -1e-9)
    assert known[-1] <= duration
    *_, last = draw(shown, "a run").axes
    assert "recoveries left out" in last.get_xlabel()


def test_a_run_without_recoveries_is_left_as_it_is(demo):
    axis, time = ClosedTime(demo), np.linspace(0, demo.duration, 7)
    assert axis.cuts == ()
    assert axis.closed(time).tolist() == time.tolist()
    assert axis.shown(time).all()


def test_bands_of_many_holds_are_one_path_where_each_lies():
    """One patch each took 10 kB, 72 MB in the figure of an hour."""
    bands = [Guide(at=n, to=n + 0.5, colour="band") for n in range(1000)]
    told = Guide(at=2000.0, to=2001.0, colour="quiet", text="here")
    line = Series(x=[0.0, 1.0], y=[0.0, 1.0])
    shown = axes(line, guides=(*bands, told))
    drawn = {to_hex(p.get_facecolor()): p.get_path() for p in shown.patches}
    assert set(drawn) == {palette.BAND.light.lower(), palette.RULE.light.lower()}
    outline = drawn[palette.BAND.light.lower()]
    rectangles = outline.vertices.reshape(-1, 5, 2)
    factor = rectangles[1, 0, 0]
    assert np.allclose(rectangles[:, 0, 0], factor * np.arange(1000))
    assert np.allclose(rectangles[:, 2, 0], factor * (np.arange(1000) + 0.5))
    assert [t.get_text() for t in shown.texts] == ["here"]
    assert shown.get_xlim()[1] >= 2001 * factor, "what is shaded is in view"
