"""The queue: what waits, what it costs, and what a STOP does to it."""

from importlib import resources

from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit

from gui.look.theme import Theme
from gui.parts import IconButton
from gui.session.queue import Queued
from gui.setup.queue import QueueView
from gui.state import WindowState
from gui.tab_order import scroll
from tactile_lab.engine.request import Request
from tactile_lab.scene.load import load

BUILT_IN = resources.files("tactile_lab.scene").joinpath("simulated_bench.toml")


def busy(lab) -> None:
    """As while a run is in progress, without one."""
    lab.session.run.request = lab.window.setup.request()
    lab.session.status.enter(WindowState.RUNNING)


def idle(lab) -> None:
    lab.session.queue.items.clear()
    lab.session.queue.held = False
    lab.session.queue.changed.emit()
    lab.session.status.enter(WindowState.READY)


def test_dropped_scene_and_run_wait_with_their_cost(lab) -> None:
    window, session = lab.window, lab.session
    busy(lab)
    window.screen_.open_path(lab.folder / "short.toml")
    assert [item.title for item in session.queue.items] == ["short"]
    lab.until(lambda: session.queue.items[0].expectation is not None)
    name = window.setup.queue.cards[0].accessibleName()
    assert name.startswith("1: short") and "samples" in name and "heat" in name
    broken = lab.folder / "2026-11-21_100000_broken"
    broken.mkdir(exist_ok=True)
    (broken / "scene.toml").write_text('[protocol]\nname = "no such"\n')
    window.screen_.open_path(broken)
    assert len(session.queue.items) == 1 and window.centre.notice.isVisible()
    idle(lab)


def test_run_that_cannot_be_planned_leaves_the_queue(lab) -> None:
    session = lab.session
    busy(lab)
    strong = lab.folder / "strong.toml"
    strong.write_text('[protocol]\nname = "pulses"\nlevels = ["5 N"]\n')
    assert session.enqueue_scene(str(strong), "strong") == ""
    lab.until(lambda: session.queue.items == [])
    assert "taken out of the queue" in session.log.lines[-1].text
    idle(lab)


def test_stop_holds_the_queue_until_it_is_resumed(lab, monkeypatch) -> None:
    window, session = lab.window, lab.session
    started: list[str] = []
    monkeypatch.setattr(
        session, "start", lambda request, title, plan: started.append(title)
    )
    busy(lab)
    for title in ("one", "two"):
        session.queue.add(
            Queued(title, window.setup.request(), session.plan.expectation)
        )
    session.stop("STOP")
    session.status.enter(WindowState.READY)
    session.queue.next()
    assert started == [] and window.setup.queue.resume.isVisible()
    window.setup.queue.resume.click()
    assert started == ["one"] and [item.title for item in session.queue.items] == [
        "two"
    ]
    idle(lab)


def test_rows_are_moved_and_taken_out_by_their_buttons(lab) -> None:
    window, session = lab.window, lab.session
    busy(lab)
    for title in ("one", "two", "three"):
        session.queue.add(
            Queued(title, window.setup.request(), session.plan.expectation)
        )

    def press(words: str) -> None:
        buttons = window.setup.queue.findChildren(IconButton)
        next(b for b in buttons if b.accessibleName() == words).click()

    press("Move one down")
    assert [item.title for item in session.queue.items] == ["two", "one", "three"]
    press("Move three up")
    press("Take two out of the queue")
    assert [item.title for item in session.queue.items] == ["three", "one"]
    press("Take one out of the queue")
    lab.app.processEvents()
    parts = window.setup.queue.cards[0].buttons
    gap = parts["close"].x() - parts["edit"].geometry().right()
    assert gap < 10, "the pencil of a single run stood in the middle of its row"
    idle(lab)


def three_waiting(lab) -> None:
    """One, two and three wait, like the form but for the hold: 1, 2 and 3 s."""
    session, asked = lab.session, lab.window.setup.request()
    busy(lab)
    for number, title in enumerate(("one", "two", "three"), start=1):
        hold = (*asked.overrides, f'protocol.hold="{number} s"')
        session.queue.add(Queued(title, Request(asked.path, hold, asked.bench)))
    lab.until(lambda: all(item.expectation for item in session.queue.items))


def type_into(field, text: str) -> None:
    edit = field.findChild(QLineEdit)
    edit.selectAll()
    QTest.keyClicks(edit, text)


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


def idle_after_run(lab) -> None:
    lab.session.queue.items.clear()
    lab.session.stop("test is over")
    lab.until(lambda: lab.session.state is WindowState.READY)
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


def test_moved_run_keeps_the_keyboard(lab) -> None:
    window, session = lab.window, lab.session
    three_waiting(lab)
    window.activateWindow()
    window.setup.queue.cards[0].buttons["down"].setFocus()
    lab.until(lambda: window.setup.queue.cards[0].buttons["down"].hasFocus())
    QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Space)
    assert [item.title for item in session.queue.items] == ["two", "one", "three"]
    assert lab.app.focusWidget() is window.setup.queue.cards[1].buttons["down"]
    window.setup.queue.cards[1].setFocus()
    QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Delete)
    assert [item.title for item in session.queue.items] == ["two", "three"]
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


def waiting(lab) -> list[Queued]:
    return lab.session.queue.items


def test_queue_only_queues_where_nothing_is_in_progress(lab) -> None:
    session, setup = lab.session, lab.window.setup
    lab.until(setup.buttons.queue.isEnabled)
    setup.buttons.queue.click()
    lab.until(lambda: waiting(lab) and waiting(lab)[0].expectation is not None)
    assert session.state is WindowState.READY and session.queue.held
    assert setup.queue.resume.isVisible()
    place = setup.run.mapTo(lab.window, setup.run.rect().topLeft())
    setup.buttons.queue.click()
    lab.until(lambda: len(waiting(lab)) == 2)
    assert setup.run.mapTo(lab.window, setup.run.rect().topLeft()) == place
    setup.queue.resume.click()
    assert session.state is WindowState.RUNNING and len(waiting(lab)) == 1
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


def test_queue_can_be_edited_while_running(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    for name in ("one", "two", "three"):
        session.queue.add(Queued(name, window.setup.request()))
    session.queue.move(session.queue.items[2], -1)
    session.queue.remove(session.queue.items[0])
    assert [item.title for item in session.queue.items] == ["three", "two"]
    assert window.setup.queue.isVisible()
    session.queue.remove(session.queue.items[1])
    first = session.run.folder
    assert session.state is WindowState.RUNNING, "a queued run waits"
    session.stop("the next one shall not follow")
    lab.until(lambda: session.state is WindowState.READY)
    assert [item.title for item in session.queue.items] == [
        "three"
    ] and not session.busy
    session.queue.add(Queued("four", window.setup.request()))
    assert session.state is WindowState.READY, "nothing starts by being queued"
    session.queue.resume()
    lab.until(lambda: session.queue.items == [] and session.state is WindowState.READY)
    assert session.run.folder != first


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


def test_two_waiting_runs_are_seen_in_a_low_panel_and_three_in_a_high_one(app) -> None:
    view = QueueView(Theme("light"))
    view.resize(286, 300)
    four = [Queued("Pulses", Request("demo"), None) for _ in range(4)]
    view.show_queue(four, held=False)
    view.show()
    port = view._area.viewport()
    for low, many in ((True, 2), (False, 3)):
        view.show_room(low=low)
        app.processEvents()
        places = [QRect(c.mapTo(port, QPoint()), c.size()) for c in view.cards]
        assert sum(port.rect().contains(place) for place in places) == many
        for card in view.cards:
            button = card.buttons["close"]
            assert card.rect().contains(button.geometry()), "no button is cut"
    view.close()


def test_a_stop_that_finds_its_run_just_over_begins_no_other(lab) -> None:
    """The window has not heard of the end when STOP is pressed."""
    session, setup = lab.session, lab.window.setup
    setup.buttons.queue.click()
    lab.until(lambda: waiting(lab) and waiting(lab)[0].expectation is not None)
    setup.run.click()
    session.queue.held = False
    assert session.run.task.join(60)
    session.stop("STOP")
    assert session.state is WindowState.ABORTING
    lab.until(lambda: session.state is WindowState.READY)
    lab.until(lambda: session.link.idle)
    assert len(waiting(lab)) == 1 and session.queue.held and not session.busy


def test_a_stop_while_the_monitor_lets_go_keeps_the_queued_run(lab) -> None:
    """It had left the queue and was dropped without a word."""
    session, setup = lab.session, lab.window.setup
    setup.buttons.queue.click()
    lab.until(lambda: waiting(lab) and waiting(lab)[0].expectation is not None)
    (item,) = waiting(lab)
    session.show_monitor(True)
    lab.until(lambda: session.monitor.source is not None)
    setup.queue.resume.click()
    session.stop("STOP")
    lab.until(lambda: not session.monitor.alive)
    assert waiting(lab) == [item] and session.queue.held and not session.busy
    session.show_monitor(True)
    lab.until(lambda: session.monitor.source is not None)
    setup.queue.resume.click()
    lab.until(lambda: session.state is WindowState.RUNNING)
    assert not waiting(lab) and not session.monitor.alive
    idle_after_run(lab)


def test_a_queued_run_begins_on_the_bench_it_was_queued_for_alone(lab) -> None:
    """Else the header would name one bench while another is driven."""
    session, setup = lab.session, lab.window.setup
    setup.buttons.queue.click()
    (item,) = waiting(lab)
    lab.until(lambda: item.expectation is not None)
    other = lab.folder / "other.toml"
    other.write_text(BUILT_IN.read_text(encoding="utf-8"), encoding="utf-8")
    session.connect_bench(str(other))
    lab.until(lambda: session.state is WindowState.READY)
    setup.queue.resume.click()
    assert not session.busy and waiting(lab) == [item] and session.queue.held
    assert "queued for sim" in session.log.lines[-1].text
    setup.edit(item)
    lab.until(lambda: setup.buttons.save.isEnabled())
    setup.save()
    lab.until(lambda: item.request.bench == str(other))
    setup.queue.resume.click()
    assert session.busy and session.run.request.bench == str(other)
    session.stop("enough")
    lab.until(lambda: session.state is WindowState.READY)
    session.connect_bench("sim")


def test_stop_forgets_a_run_that_waits_for_its_plan(lab) -> None:
    """Of the monitor alone: else the bench is asked anew, and all of that forgotten."""
    session, setup = lab.session, lab.window.setup
    session.show_monitor(True)
    lab.until(lambda: session.monitor.source is not None)
    setup.start_when_planned()
    session.stop("STOP")
    lab.until(lambda: not session.monitor.alive)
    setup.plan_now()
    lab.until(lambda: session.plan.expectation is not None)
    lab.app.processEvents()
    assert not session.busy


def test_nothing_is_queued_for_no_bench(lab) -> None:
    """By its key it was, also where the button was locked."""
    session, setup = lab.session, lab.window.setup
    session.disconnect_bench()
    session.plan.expectation = None
    setup.plan_now()
    lab.until(lambda: session.plan.expectation is not None)
    setup.enqueue()
    assert not waiting(lab) and not setup.buttons.queue.isEnabled()
    session.connect_bench("not there.toml")
    lab.until(lambda: session.state is WindowState.FAULT)
    assert not setup.buttons.queue.isEnabled()
    lab.window.banner.acknowledge.click()
