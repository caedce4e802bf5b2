import gc
import inspect
import weakref
from functools import reduce
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QFocusEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QLineEdit, QWidget

from gui.lanes.expected import Preview, Stretch
from gui.look.theme import Theme
from gui.parts import column, push, scrolling, with_gutter
from gui.setup.fields import QuantityEdit
from gui.setup.form import Form
from gui.setup.parameter import FieldError, Kind, entry_of, listed, parameter, text_of
from gui.setup.picker import Picker
from gui.setup.preview import FIRST, WAIT, WaveformPreview, _plan
from gui.setup.subject import stated
from tactile_lab.plugins import protocol_class, protocol_names, scene_names
from tactile_lab.quantity import exact, parse
from tactile_lab.scene.load import load
from tactile_lab.table import fields_of
from tactile_lab.waveform import Waveform

NAMES = [name for name in protocol_names() if name != "waveform"]


@pytest.mark.parametrize("name", [n for n in scene_names() if n in NAMES])
def test_every_ready_scene_survives_the_form(app: QApplication, name: str) -> None:
    """Scene -> form -> overrides -> scene: the same protocol."""
    scene = load(name)
    kind = type(scene.protocol)
    form = Form()
    form.show_protocol(kind, stated(scene))
    assert form.problem == ""
    assert not {"tau", "volts_per_newton"} & form.changed_texts().keys(), "the sensor's"
    assert load(name, form.overrides()).protocol == scene.protocol


@pytest.mark.parametrize("name", NAMES)
def test_every_protocol_has_a_form_of_its_defaults(
    app: QApplication, name: str
) -> None:
    kind = protocol_class(name)
    form = Form()
    form.show_protocol(kind, {})
    assert form.problem == ""
    plain, again = (load(inspect.getfile(kind), o) for o in ((), form.overrides()))
    assert again.protocol.model_dump() == plain.protocol.model_dump()


def test_a_form_is_no_window_before_it_has_its_place(app: QApplication) -> None:
    """One flashed up for each form of a page, and took the keyboard."""
    assert not Form().isVisible()


def test_fields_are_named_as_one_speaks_of_them(app: QApplication) -> None:
    """Lasts, Most and Count say nothing; a switch is true, as in its file."""
    titles = {
        parameter(key, info).title
        for name in NAMES
        for key, info in fields_of(protocol_class(name)).items()
    }
    assert {"Frequencies", "Presentations", "Largest current", "Duration"} <= titles
    assert not {"Lasts", "Most", "Count"} & titles
    info = fields_of(protocol_class("pulses"))["demagnetise"]
    switch = parameter("demagnetise", info)
    assert (text_of(switch, False), entry_of(switch, "true")) == ("false", "true")
    assert parameter("V_GS_noise", info).title == "V_GS noise"
    assert parameter("V_th", info).title == "V_th"


@pytest.mark.parametrize(
    "name", ["record", "detect", "conditions", "coil", "sensor", "bench.magnet"]
)
def test_any_table_of_a_scene_can_be_a_form(app: QApplication, name: str) -> None:
    """Scene -> form -> overrides -> scene: the same table."""

    def table(scene):
        return reduce(getattr, name.split("."), scene)

    given = table(load(None, ["record.sample_rate=2 MS/s", "sensor.m=5.5"]))
    keys, form = fields_of(type(given)), Form()
    form.show_table(name, keys, {key: getattr(given, key) for key in keys})
    assert form.problem == ""
    assert table(load(None, form.overrides())) == given


def test_lengths_and_units_are_shown_and_checked(app: QApplication) -> None:
    form = Form()
    form.show_protocol(protocol_class("pulses"), {})
    assert form.field("levels").text == "80, 120, 160, 200 mN"
    assert form.field("hold").text == "2 s"
    hold = form.field("hold")
    hold.put("0 s")
    assert "above 0 s" in hold.value.problem
    hold.put("50 mN")
    assert "mN" in form.problem
    with pytest.raises(FieldError):
        form.overrides()
    hold.put("1500 ms")
    assert not form.problem and hold.value.is_changed


def test_typing_marks_undoes_and_redoes(app: QApplication) -> None:
    form = Form()
    form.show_protocol(protocol_class("pulses"), {})
    hold = form.field("hold")
    edit = hold.findChild(QLineEdit)
    assert isinstance(edit, QLineEdit)
    edit.selectAll()
    QTest.keyClicks(edit, "3 s")
    assert hold.value.is_changed and hold.text == "3 s"
    while form.edits:
        form.edits.undo()
    assert hold.text == "2 s" and not hold.value.is_changed
    form.edits.redo()
    assert hold.text != "2 s"


@pytest.mark.parametrize(
    ("key", "typed", "shown"),
    [
        ("hold", "300", "300 s"), ("hold", "300 ms", "300 ms"), ("hold", "", ""),
        ("hold", "x", "x"), ("levels", "0.08; 0.12", "0.08; 0.12 N"),
        ("levels", "80, 120 mN", "80, 120 mN"), ("seed", "7", "7"),
    ],
)  # fmt: skip
def test_a_number_that_is_left_shows_its_unit(
    app: QApplication, key: str, typed: str, shown: str
) -> None:
    """300 where 250 ms stood was 300 s, and nothing at the field said so."""
    form = Form()
    form.show_protocol(protocol_class("pulses"), {})
    edit = form.field(key).findChild(QLineEdit)
    assert isinstance(edit, QLineEdit)
    edit.selectAll()
    QTest.keyClick(edit, Qt.Key.Key_Delete)
    QTest.keyClicks(edit, typed)
    before = form.field(key).value.problem
    QApplication.sendEvent(edit, QFocusEvent(QEvent.Type.FocusOut))
    assert form.field(key).text == edit.text() == shown
    assert bool(form.field(key).value.problem) == bool(before)


def test_arrow_keys_step(app: QApplication) -> None:
    form = Form()
    form.show_protocol(protocol_class("pulses"), {})
    edit = form.field("hold").findChild(QLineEdit)
    assert isinstance(edit, QLineEdit)
    QTest.keyClick(edit, Qt.Key.Key_Up)
    assert form.field("hold").text == "3 s"
    QTest.keyClick(edit, Qt.Key.Key_Down)
    assert form.field("hold").text == "2 s"


@given(st.floats(1e-15, 1e9))
def test_shown_quantity_reads_back_exactly(value: float) -> None:
    assert parse(exact(value, "N"), "N") == value


@given(st.lists(st.floats(1e-6, 1e3), min_size=1, max_size=6))
def test_shown_list_reads_back_exactly(values: list[float]) -> None:
    levels = parameter("levels", protocol_class("pulses").model_fields["levels"])
    entry = entry_of(levels, listed(values, "N"))
    assert entry is not None
    texts = [part.strip().strip('"') for part in entry.strip("[]").split(",")]
    assert [parse(text, "N") for text in texts] == values


def test_kinds_are_found_from_types() -> None:
    fields = protocol_class("pulses").model_fields
    assert parameter("levels", fields["levels"]).kind is Kind.QUANTITIES
    assert parameter("hold", fields["hold"]).kind is Kind.QUANTITY
    file = protocol_class("waveform").model_fields
    assert parameter("file", file["file"]).kind is Kind.FILE
    assert parameter("duration", file["duration"]).optional


@pytest.mark.parametrize("width", [260, 312])
def test_all_fields_share_one_column(app: QApplication, width: int) -> None:
    """At the panel's least and greatest width, less its margins."""
    form = Form()
    for name in NAMES:
        form.show_protocol(protocol_class(name), {})
        form.setFixedWidth(width)
        form.show()
        app.processEvents()
        editors = [field.focusProxy() for field in form.fields]
        assert len({editor.x() for editor in editors}) == 1, name
        kinds = (Kind.SWITCH, Kind.FILE)
        wide = [f.focusProxy() for f in form.fields if f.parameter.kind not in kinds]
        assert len({editor.geometry().right() for editor in wide}) <= 1, name
    form.hide()


def test_long_list_is_shortened_where_it_is_not_edited(app: QApplication) -> None:
    form = Form()
    form.show_protocol(protocol_class("pulses"), {})
    form.setFixedWidth(276)
    form.show()
    app.processEvents()
    edit = form.field("levels").focusProxy()
    assert isinstance(edit, QuantityEdit)
    assert edit.shown == edit.text(), "the demo's levels fit the narrowest panel"
    long = ", ".join(str(level) for level in range(10, 210, 10)) + " mN"
    form.field("levels").put(long)
    edit.clearFocus()
    assert edit.shown.startswith("10, 20, 30") and edit.shown.endswith("…")
    assert edit.toolTip().startswith(long)
    form.hide()


def test_the_preview_draws_pauses_as_such_and_no_name_over_another() -> None:
    """A pause between two bursts of corners was a slope, "10 Hz" lay over itself."""
    burst = np.linspace(0.0, 10.0, 3007)
    time = np.concatenate([burst, 50.0 + burst])
    force = np.concatenate([0.1 + 0.1 * np.sin(burst * 300)] * 2)
    force[[0, 3006, 3007, -1]] = 0.0
    holds = [Stretch(a, a + 1.0, "10 Hz") for a in (5.0, 10.0, 51.0)]
    plan = _plan(Preview(force=Waveform(time, force), holds=holds, length=60.0))
    drawn, told = plan.panels[0].series
    assert np.interp(30.0, drawn.x, drawn.y) == 0.0
    assert np.max(drawn.y) == pytest.approx(0.2, rel=0.01)
    assert np.size(told.x) == 2, "one beside each burst"


def test_the_list_of_protocols_has_all_titles_when_it_is_opened(app) -> None:
    picker = Picker()
    picker.show_protocol(protocol_class("pulses"))
    assert picker.currentText() == "Pulses"
    picker.showPopup()
    titles = [picker.itemText(at) for at in range(picker.count())]
    picker.hidePopup()
    assert titles == [protocol_class(name).title for name in protocol_names()]


@pytest.mark.parametrize("name", protocol_names())
def test_any_protocol_of_the_list_can_be_chosen(app, name) -> None:
    """Those without a ready scene of their name, too: pulses and hold."""
    picker, picked = Picker(), []
    picker.show_protocol(protocol_class("pulses"))
    picker.picked.connect(picked.append)
    picker.activated.emit(picker.findData(name))
    assert load(picked[0]).protocol.name == name


def test_an_edited_form_may_be_forgotten(app: QApplication) -> None:
    """Python's collector ended the process (signal 11) where Qt's stack held edits."""
    form = Form()
    form.show_protocol(protocol_class("pulses"), {})
    for number in range(3, 7):
        form.propose({"hold": f"{number} s"})
    while form.edits:
        form.edits.undo()
    form.edits.redo()
    form.itself = form  # as the window's parts know each other
    gone = weakref.ref(form)
    del form
    gc.collect()
    assert gone() is None


def test_what_grows_in_an_area_that_scrolls_is_never_squeezed(app) -> None:
    inner, rows = QWidget(), [push(f"row {number}") for number in range(20)]
    area = with_gutter(scrolling(inner), column(inner, *rows))
    area.resize(200, 150)
    area.show()
    app.processEvents()
    for row in rows:
        row.setMinimumHeight(60)
    inner.layout().activate()  # as it is before a paint, and before the area knows
    assert [row.height() for row in rows] == [60] * 20
    tops = [row.y() for row in rows]
    assert min(b - a for a, b in pairwise(tops)) >= 60, "none lies over another"


@pytest.mark.parametrize("text", ["80,5 mN; 120,5 mN", "80,5, 120 mN", "80,5 mN"])
def test_a_decimal_comma_parts_no_values(text: str) -> None:
    """It would run 80 and 5 mN instead of 80.5 mN."""
    levels = parameter("levels", protocol_class("pulses").model_fields["levels"])
    with pytest.raises(FieldError, match="decimal point"):
        entry_of(levels, text)
    told = entry_of(levels, "80.5 mN; 120.5 mN")
    assert told == entry_of(levels, "80.5, 120.5 mN") == '["80.5 mN", "120.5 mN"]'


def test_the_first_plan_says_that_it_may_take_longer(app) -> None:
    """It stood at "computing the plan …" for as long as the model was compiled."""
    shown = WaveformPreview(Theme("light"))
    force = Waveform.through([(0.0, 0.0), (1.0, 0.05), (4.0, 0.0)])
    for preview, said in (
        (None, FIRST),
        (Preview(force, length=4.0), ""),
        (None, WAIT),
    ):
        shown.show_preview(preview)
        assert shown.nothing == said
