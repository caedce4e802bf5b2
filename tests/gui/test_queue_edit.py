"""The next runs prepared in the form: queued ones edited, what forbids a run."""

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit
from queued import busy, idle, idle_after_run, three_waiting, type_into, waiting

from gui.state import WindowState
from gui.tab_order import scroll
from tactile_lab.scene.load import load


def test_queued_run_is_edited_in_place_while_a_run_is_in_progress(lab) -> None:
    session, setup = lab.session, lab.window.setup
    before = setup.form.texts()
    lab.run()
    lab.until(lambda: session.state is WindowState.RUNNING)
    three_waiting(lab)
    shorter = session.queue.items[1].expectation.estimate.duration
    QTest.mouseClick(setup.queue.cards[1], Qt.MouseButton.LeftButton)
    assert setup.form.field("hold").text == "2 s"
    assert "two, 2 of 3" in setup.strip.text()
    assert not setup.run.isVisible() and setup.buttons.save.isVisible()
    type_into(setup.form.field("hold"), "7 s")
    setup.buttons.save.click()
    lab.until(lambda: setup.subject.edited is None)
    item = session.queue.items[1]
    assert [i.title for i in session.queue.items] == ["one", "two", "three"]
    assert item.request.load().protocol.hold == 7.0
    assert item.expectation.estimate.duration > shorter + 9, (
        "two holds, 5 s longer each"
    )
    assert setup.form.texts() == before, "the form shows the next run again"
    assert session.state is WindowState.RUNNING and not setup.run.isEnabled()
    idle_after_run(lab)


def test_a_waiting_run_that_was_named_by_its_parameters_is_named_anew(lab) -> None:
    """Edited to 900 ms it went on to be called "Pulses · 800 ms", also as it ran."""
    session, setup = lab.session, lab.window.setup
    before = setup.form.texts()["hold"]
    setup.form.propose({"hold": "800 ms"})
    setup.enqueue()
    lab.until(lambda: session.queue.items)
    (item,) = session.queue.items
    assert "800 ms" in item.title
    setup.edit(item)
    setup.form.propose({"hold": "900 ms"})
    setup.save()
    lab.until(lambda: setup.subject.edited is None)
    assert item.request.load().protocol.hold == 0.9
    assert "900 ms" in item.title and "800 ms" not in item.title
    setup.form.propose({"hold": before})
    idle(lab)


def test_cancel_leaves_queue_and_form_as_they_were(lab) -> None:
    session, setup = lab.session, lab.window.setup
    setup.form.propose({"hold": "800 ms"})
    before = setup.form.texts()
    three_waiting(lab)
    asked = [item.request for item in session.queue.items]
    scroll(setup, 1)
    setup.queue.cards[2].setFocus()
    QTest.keyClick(setup.queue.cards[2], Qt.Key.Key_Return)
    assert setup.form.field("hold").text == "3 s"
    first = setup.form.fields[0].findChild(QLineEdit)
    lab.until(first.hasSelectedText)  # what is typed now replaces it
    assert not first.visibleRegion().isEmpty(), "the keyboard is where nobody sees it"
    type_into(setup.form.field("hold"), "9 s")
    setup.edit(session.queue.items[0])
    assert "First save or cancel" in setup.strip.text()
    assert setup.form.field("hold").text == "9 s", "nothing typed is lost by a click"
    setup.buttons.cancel.click()
    assert setup.form.texts() == before
    assert [item.request for item in session.queue.items] == asked
    idle(lab)
    setup.form.edits.undo()


def test_edits_of_a_run_that_starts_or_goes_are_kept_in_the_form(
    lab, monkeypatch
) -> None:
    session, setup = lab.session, lab.window.setup
    started: list[str] = []
    monkeypatch.setattr(
        session, "start", lambda request, title, plan: started.append(title)
    )
    three_waiting(lab)
    setup.edit(session.queue.items[0])
    type_into(setup.form.field("hold"), "8 s")
    session.status.enter(WindowState.READY)
    session.queue.next()
    assert started == ["one"]
    assert "one has started with the parameters it had" in setup.strip.text()
    assert "Your changes stay" in setup.strip.text()
    assert setup.form.field("hold").text == "8 s" and setup.buttons.run.isVisible()
    busy(lab)
    setup.edit(session.queue.items[0])
    assert setup.form.field("hold").text == "2 s"
    session.queue.remove(session.queue.items[0])
    assert "two was taken out" in setup.strip.text()
    assert setup.form.field("hold").text == "8 s", "nothing was changed: back again"
    idle(lab)


def test_what_is_typed_on_as_a_field_goes_acts_on_nothing(lab, monkeypatch) -> None:
    """Of "95 mN" the m switched the model off and the N went to the notes."""
    session, setup, window = lab.session, lab.window.setup, lab.window
    monkeypatch.setattr(session, "start", lambda *asked: None)
    three_waiting(lab)
    for ended in (
        lambda: QTest.keyClick(window.windowHandle(), Qt.Key.Key_Return),
        lambda: QTest.mouseClick(window.centre.stack.scene, Qt.MouseButton.LeftButton),
    ):
        setup.edit(session.queue.items[0])
        lab.app.processEvents()
        field = setup.form.field("levels").findChild(QLineEdit)
        field.setFocus()
        lab.until(field.hasFocus)
        session.status.enter(WindowState.READY)
        session.queue.resume()
        twin, notice = window.centre.tools.twin, window.centre.notice
        shown = twin.isChecked()
        for key in "95 mN":
            QTest.keyClick(window.windowHandle(), key)
        assert twin.isChecked() is shown and not window.centre.log.note.hasFocus()
        assert "has gone" in notice.text()
        ended()
        assert notice.isHidden()
        QTest.keyClick(window.windowHandle(), "m")
        assert twin.isChecked() is not shown, "by somebody who means it"
        twin.setChecked(shown)
        busy(lab)
    idle(lab)


def test_edit_that_cannot_run_is_not_saved(lab) -> None:
    session, setup = lab.session, lab.window.setup
    three_waiting(lab)
    setup.edit(session.queue.items[0])
    type_into(setup.form.field("hold"), "0 s")
    save = setup.buttons.save
    assert not save.isEnabled() and "above" in save.toolTip()
    type_into(setup.form.field("hold"), "1 s")
    type_into(setup.form.field("levels"), "5 N")
    lab.until(lambda: "reach" in session.plan.problem)
    assert "reachable" in save.toolTip()
    setup.save()
    assert setup.subject.edited is session.queue.items[0]
    setup.start()
    assert session.state is WindowState.RUNNING and len(session.queue.items) == 3
    setup.buttons.cancel.click()
    idle(lab)


def test_edited_run_is_executed_as_it_was_saved(lab) -> None:
    session, setup = lab.session, lab.window.setup
    lab.run()
    setup.enqueue()
    lab.until(lambda: len(session.queue.items) == 1)
    setup.edit(session.queue.items[0])
    type_into(setup.form.field("hold"), "250 ms")
    setup.enqueue()  # Ctrl+Return saves while a run is edited, once it is planned
    lab.until(lambda: setup.subject.edited is None)
    assert len(session.queue.items) == 1
    first = session.run.folder
    session.stop("the next one follows when asked for")
    lab.until(lambda: session.state is WindowState.READY)
    setup.queue.resume.click()
    lab.until(
        lambda: session.run.folder != first and session.state is WindowState.READY
    )
    assert load(session.run.folder / "scene.toml").protocol.hold == 0.25


def test_scene_opened_during_an_edit_leaves_the_queued_run_alone(lab) -> None:
    session, setup = lab.session, lab.window.setup
    three_waiting(lab)
    asked = session.queue.items[0].request
    setup.edit(session.queue.items[0])
    type_into(setup.form.field("hold"), "9 s")
    setup.open_scene(str(lab.folder / "short.toml"))
    assert setup.subject.edited is None and session.queue.items[0].request == asked
    assert "one waits unchanged" in setup.strip.text()
    idle(lab)


def test_the_next_runs_are_prepared_during_one(lab) -> None:
    """Edit, queue, edit, queue, while a run is in progress."""
    session, setup = lab.session, lab.window.setup
    lab.run()
    running = session.run.request
    lab.window.screen_.open_scene(str(lab.folder / "short.toml"))
    for hold in ("250 ms", "350 ms"):
        type_into(setup.form.field("hold"), hold)
        setup.buttons.queue.click()
        lab.until(lambda h=hold: h in " ".join(i.title for i in waiting(lab)))
    assert [i.request.load().protocol.hold for i in waiting(lab)] == [0.25, 0.35]
    assert session.state is WindowState.RUNNING and session.run.request == running
    assert "Your next run" in setup.strip.text()
    idle_after_run(lab)


def test_one_undo_takes_back_what_was_typed_in_one_stay(lab) -> None:
    setup = lab.window.setup
    edit = setup.form.field("hold").findChild(QLineEdit)
    before = edit.text()
    lab.window.activateWindow()
    edit.setFocus()
    lab.until(edit.hasFocus)
    type_into(setup.form.field("hold"), "600 ms")
    assert edit.hasFocus() and edit.text() == "600 ms"
    QTest.keyClick(edit, Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier)
    lab.until(lambda: edit.text() == before)
    QTest.keyClick(edit, Qt.Key.Key_Y, Qt.KeyboardModifier.ControlModifier)
    lab.until(lambda: edit.text() == "600 ms")
    undo = Qt.Key.Key_Z, Qt.KeyboardModifier.ControlModifier
    lab.window.actions_.show_help()
    QTest.keyClick(lab.window, *undo)
    assert edit.text() == "600 ms", "not where a card hides the form"
    QTest.keyClick(lab.window, Qt.Key.Key_Escape)
    QTest.keyClick(lab.window, *undo)
    lab.until(lambda: edit.text() == before)


def test_invalid_value_forbids_run_and_says_why(lab) -> None:
    window = lab.window
    window.setup.form.field("hold").put("−1 s")
    window.setup.form.changed.emit()
    assert not window.setup.run.isEnabled()
    assert "Hold" in window.setup.run.toolTip()


def test_force_beyond_the_coil_forbids_run_with_the_plans_words(lab) -> None:
    window, session = lab.window, lab.session
    window.setup.form.field("levels").put("900 mN")
    window.setup.plan_now()
    lab.until(lambda: session.plan.problem)
    assert "reachable" in session.plan.problem
    assert not window.setup.run.isEnabled()
    window.setup.form.reset()
