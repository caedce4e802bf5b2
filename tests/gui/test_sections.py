"""The tables of a scene besides its protocol's, in the window."""

import json

import pytest
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit

from gui.setup.fields import QuantityEdit
from gui.setup.picker import scene_of
from tactile_lab.errors import SceneError
from tactile_lab.scene.tables import Conditions, Detect
from tactile_lab.table import described


def put(lab, table: str, key: str, text: str) -> None:
    form = lab.window.setup.tables.form(table)
    form.propose({key: text})


@pytest.fixture
def tables(lab):
    """The window's tables; as they were afterwards."""
    yield lab.window.setup.tables
    lab.window.screen_.open_scene(str(lab.folder / "short.toml"))
    form = lab.window.setup.tables.form("conditions")
    form.set_texts({"operator": "", "sensor": "", "temperature": ""})


def loaded(lab):
    return lab.window.setup.request().load()


def test_sample_rate_and_signals_are_set_in_the_window(lab, tables) -> None:
    samples = lab.session.plan.expectation.estimate.samples_stored
    put(lab, "record", "sample_rate", "100 kS/s")
    put(lab, "record", "signals", "V_C1, V_K spikes")
    lab.window.setup.plan_now()
    lab.until(lambda: lab.session.plan.request == lab.window.setup.request())
    scene = loaded(lab)
    assert scene.record.sample_rate == 1e5
    assert scene.record.signals == ("V_C1", "V_K", "spikes")
    assert lab.session.plan.expectation.estimate.samples_stored < samples / 2
    assert "Record · 2 changes" in tables.sections["record"].head.text()


def test_fields_are_made_when_a_table_is_unfolded(lab, tables) -> None:
    section = tables.sections["record"]
    put(lab, "record", "sample_rate", "100 kS/s")
    assert not section.findChildren(QLineEdit), "most stay folded"
    section.head.click()
    edit = section.form.field("sample_rate").findChild(QLineEdit)
    assert edit.isVisibleTo(section) and edit.text() == "100 kS/s"
    edit.clear()
    QTest.keyClicks(edit, "50 kS/s")
    section.head.click()
    assert loaded(lab).record.sample_rate == 5e4 and not edit.isVisibleTo(section)


def test_what_is_not_changed_is_not_said(lab, tables) -> None:
    texts = lab.window.setup.request().overrides
    assert all(text.startswith("protocol.") for text in texts)


def test_a_table_within_a_table_has_fields_of_its_own(lab, tables) -> None:
    """The noise of the channels stood in one field, as TOML with braces and quotes."""
    form = tables.form("simulated")
    assert form.value("noise.V_K").text == "20 mV"
    assert form.value("noise.V_K").parameter.title == "V_K noise"
    assert form.value("deviation.R1").parameter.title == "R1 deviation"
    put(lab, "simulated", "noise.V_K", "30 mV")
    put(lab, "simulated", "deviation.offset", "2 mV")
    scene = loaded(lab)
    assert scene.simulated.noise["V_K"] == 0.03
    assert scene.simulated.noise["V_C1"] == 5e-3, "the others stay"
    assert scene.simulated.deviation.offset == 2e-3
    assert "Simulated bench · 2 changes" in tables.sections["simulated"].head.text()


def test_words_of_a_table_stand_without_quotes(lab, tables) -> None:
    sensor = tables.form("sensor")
    assert sensor.value("start").text == "equilibrium"
    put(lab, "sensor", "sourced", "V_GS V_S")
    put(lab, "sensor", "start", '{ V_P = "0 V", V_C1 = "1 V", V_C2 = "0 V" }')
    scene = loaded(lab)
    assert scene.sensor.sourced == ("V_GS", "V_S")
    assert scene.sensor.start.V_C1 == 1.0
    put(lab, "sensor", "start", "equilibrium")
    assert loaded(lab).sensor.start == "equilibrium"


def test_a_signal_that_does_not_exist_is_refused_with_the_nearest(lab, tables) -> None:
    put(lab, "record", "signals", "V_C1, spike")
    assert "spikes" in tables.form("record").problem
    assert not lab.window.setup.run.isEnabled()
    assert tables.sections["record"].head.text().endswith("!")


def test_limits_of_the_coil_hold_for_the_run(lab, tables) -> None:
    put(lab, "bench.coil.limits", "current", "50 mA")
    lab.window.setup.plan_now()
    lab.until(lambda: lab.session.plan.problem)
    assert "50 mA" in lab.session.plan.problem
    assert loaded(lab).bench.coil.limits.current == 0.05


def test_who_measures_on_what_stays_and_is_kept_with_the_run(lab, tables) -> None:
    put(lab, "conditions", "operator", "Curie, Marie")
    put(lab, "conditions", "sensor", "S12")
    lab.window.setup.subject.pick("staircase")
    assert loaded(lab).conditions.operator == "Curie, Marie", "whatever is run"
    lab.window.screen_.open_scene(str(lab.folder / "short.toml"))
    lab.until(lambda: lab.session.plan.expectation is not None)
    lab.until(lambda: lab.session.plan.request == lab.window.setup.request())
    folder = lab.complete_run()
    notes = json.loads((folder / "run.json").read_text())["notes"]
    assert notes == {"operator": "Curie, Marie", "sensor": "S12"}


def test_a_queued_run_keeps_its_tables_when_it_is_edited(lab, tables) -> None:
    from gui.session.queue import Queued

    setup, queue = lab.window.setup, lab.session.queue
    put(lab, "record", "sample_rate", "50 kS/s")
    queue.add(Queued("slow", setup.request()))
    put(lab, "record", "sample_rate", "25 kS/s")
    lab.until(lambda: queue.items[0].expectation is not None)
    setup.edit(queue.items[0])
    assert tables.form("record").value("sample_rate").text == "50 kS/s"
    put(lab, "record", "sample_rate", "80 kS/s")
    setup.save()
    lab.until(lambda: setup.subject.edited is None)
    assert queue.items[0].request.load().record.sample_rate == 8e4
    assert tables.form("record").value("sample_rate").text == "25 kS/s"
    queue.remove(queue.items[0])


def test_one_undo_for_form_and_tables(lab, tables) -> None:
    put(lab, "record", "sample_rate", "50 kS/s")
    lab.window.setup.form.propose({"hold": "700 ms"})
    lab.window.setup.form.edits.undo()
    assert tables.form("record").value("sample_rate").text == "50 kS/s"
    lab.window.setup.form.edits.undo()
    assert tables.form("record").value("sample_rate").text == "500 kS/s"


def test_what_was_typed_for_a_protocol_is_there_when_it_is_picked_again(
    lab, tables
) -> None:
    form, subject = lab.window.setup.form, lab.window.setup.subject
    subject.pick("staircase")
    key = next(f.parameter.key for f in form.fields if f.text.endswith(" s"))
    form.propose({key: "4.5 s"})
    typed = form.texts()
    subject.pick("demo")
    assert form.texts() != typed
    subject.pick("staircase")
    assert form.texts() == typed
    form.edits.undo()
    assert form.texts() != typed, "which can be undone"


def test_a_protocol_is_picked_again_as_it_was_left_file_and_tables_with_it(
    lab, tables
) -> None:
    """100 kS/s of a scene file became the ready scene's 1 MS/s, and nobody was told."""
    subject = lab.window.setup.subject
    kind = lab.window.setup.form.protocol
    file, before = subject.path, loaded(lab)
    put(lab, "detect", "threshold", "3 V")
    put(lab, "conditions", "operator", "Curie")
    subject.pick("staircase")
    assert loaded(lab).detect.threshold != 3.0, "that is another protocol's"
    put(lab, "conditions", "operator", "Meitner")
    subject.pick(scene_of(kind.name))
    assert subject.path == file
    again = loaded(lab)
    assert (again.protocol, again.record) == (before.protocol, before.record)
    assert again.detect.threshold == 3.0
    assert again.conditions.operator == "Meitner", "who measures stays"


def test_a_scene_whose_file_is_gone_is_told_where_its_protocol_is_picked_again(
    lab, tables
) -> None:
    subject, kind = lab.window.setup.subject, lab.window.setup.form.protocol
    mine = lab.folder / "mine.toml"
    mine.write_text((lab.folder / "short.toml").read_text())
    lab.window.screen_.open_scene(str(mine))
    subject.pick("staircase")
    mine.unlink()
    with pytest.raises(SceneError, match=r"mine\.toml"):
        subject.pick(scene_of(kind.name))
    assert subject.path == scene_of(kind.name)


def test_an_emptied_field_shows_its_default_and_means_it(lab, tables) -> None:
    field = lab.window.setup.form.field("hold")
    field.put("")
    edit = field.findChild(QuantityEdit)
    assert edit.placeholderText() == "2 s"
    assert loaded(lab).protocol.hold == 2.0, "not what the scene's file has"


def test_keys_are_described_from_their_docstrings() -> None:
    assert described(Conditions)["sensor"].startswith("which specimen it is")
    assert "standard deviations of the noise" in described(Detect)["threshold"]
