"""The queue: what waits, what it costs, and what a STOP does to it."""

from importlib import resources

from PySide6.QtCore import QPoint, QRect, Qt
from PySide6.QtTest import QTest
from queued import busy, idle, idle_after_run, three_waiting, waiting

from gui.look.theme import Theme
from gui.parts import IconButton
from gui.session.queue import Queued
from gui.setup.queue import QueueView
from gui.state import WindowState
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.request import Request

BUILT_IN = resources.files("tactile_lab.scene").joinpath("simulated_bench.toml")


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


def test_moved_run_keeps_the_keyboard(lab) -> None:
    window, session = lab.window, lab.session
    three_waiting(lab)
    window.activateWindow()
    window.setup.queue.cards[0].buttons["down"].setFocus()
    lab.until(lambda: window.setup.queue.cards[0].buttons["down"].hasFocus())
    QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Space)
    assert [item.title for item in session.queue.items] == ["two", "one", "three"]
    assert lab.app.focusWidget() is window.setup.queue.cards[1].buttons["down"]
    QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Return)
    assert [item.title for item in session.queue.items] == ["two", "three", "one"]
    assert window.setup.subject.edited is None, "Enter is the button's, not the row's"
    lab.until(window.setup.queue.cards[2].hasFocus)
    QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Delete)
    assert [item.title for item in session.queue.items] == ["two", "three"]
    idle(lab)


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


def test_a_plan_that_takes_long_says_so_at_the_buttons(lab, monkeypatch) -> None:
    """Run stayed grey, or did nothing, and the cost was that of the plan before."""
    window, session = lab.window, lab.session
    setup, held = window.setup, []
    buttons = setup.buttons

    def wait(seconds: float) -> None:
        session.plan._asked -= seconds
        setup._wait_on()

    monkeypatch.setattr(session.link, "ask", lambda *asked: held.append(asked))
    session.plan.expectation = None
    setup.form.propose({"hold": "400 ms"})
    setup.plan_now()
    assert buttons.run.text() == "Run", "most plans take a moment"
    wait(3.2)
    assert buttons.run.text() == "Planning, 3 s" and not buttons.run.isEnabled()
    assert "plan is being computed" in buttons.run.toolTip()
    assert setup.estimate._values[0].text() == "—"
    assert setup.preview.plot is None and "plan" in setup.preview.nothing
    item = Queued("one", setup.request())
    session.queue.add(item)
    setup.edit(item)
    wait(2.0)
    assert buttons.save.text() == "Planning, 2 s"
    setup.cancel()
    session.queue.remove(item)
    monkeypatch.undo()
    setup.form.propose({"hold": "x"})
    problem = setup.problem.text()
    held[-1][0](Reply(None, ""))  # of what the form asked for before
    assert problem and setup.problem.text() == problem, "it counts no more"
    setup.form.propose({"hold": "300 ms"})
    setup.plan_now()
    lab.until(lambda: session.plan.expectation is not None)
    assert buttons.run.text() == "Run" and buttons.run.isEnabled()


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


def test_between_two_runs_the_strip_tells_which_begins(lab, monkeypatch) -> None:
    """It went on to say that a run was stopping: the one before, which had ended."""
    window, session = lab.window, lab.session
    begin = session.start

    def start(request, title, plan) -> None:
        begin(request, title, plan)
        if title == "two":  # no word of it comes for a while
            monkeypatch.setattr(session, "poll", lambda: False)

    monkeypatch.setattr(session, "start", start)
    for title in ("one", "two"):
        session.queue.add(
            Queued(title, window.setup.request(), session.plan.expectation)
        )
    session.queue.resume()
    lab.until(lambda: session.run.title == "two")
    progress = window.centre.progress
    lab.until(lambda: progress.text == "two begins | ", longest=5.0)
    assert session.state is WindowState.RUNNING and session.source is None
    session.stop()
    lab.until(lambda: progress.text.startswith("Stopping"), longest=5.0)
    assert "stopped at" not in progress.text, "nothing of it has been"
    monkeypatch.undo()
    lab.until(lambda: not session.busy)
    session.acknowledge()


def test_the_strip_tells_that_a_refused_run_did_not_begin(lab, monkeypatch) -> None:
    progress, session = lab.window.centre.progress, lab.session
    monkeypatch.setattr(session, "poll", lambda: False)
    strong = Request(str(lab.folder / "short.toml"), ('protocol.levels=["5 N"]',))
    session.start(strong, "Strong")
    lab.until(lambda: progress.text == "Strong begins | ")
    monkeypatch.undo()
    lab.until(lambda: session.state is WindowState.FAULT)
    lab.until(lambda: progress.text != "Strong begins | ")
    session.acknowledge()
