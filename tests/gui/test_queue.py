"""The queue: what waits, what it costs, and what a STOP does to it."""

from gui.parts import IconButton
from gui.session.session import Queued
from gui.state import State


def busy(lab) -> None:
    """As while a run is in progress, without one."""
    lab.session._enter(State.RUNNING)


def idle(lab) -> None:
    lab.session.queue.clear()
    lab.session.queue_held = False
    lab.session.queue_changed.emit()
    lab.session._enter(State.READY)


def test_dropped_scene_and_run_wait_with_their_cost(lab) -> None:
    window, session = lab.window, lab.session
    busy(lab)
    window.opening.open_path(lab.folder / "short.toml")
    assert [item.title for item in session.queue] == ["short"]
    lab.until(lambda: session.queue[0].expectation is not None)
    text = [
        one.text() for one in window.setup.queue.findChildren(type(window.setup.about))
    ]
    assert any("samples" in words and "heat" in words for words in text), text
    broken = lab.folder / "2026-11-21_100000_broken"
    broken.mkdir(exist_ok=True)
    (broken / "scene.toml").write_text('[protocol]\nname = "no such"\n')
    window.opening.open_path(broken)
    assert len(session.queue) == 1 and window.centre.notice.isVisible()
    idle(lab)


def test_run_that_cannot_be_planned_leaves_the_queue(lab) -> None:
    session = lab.session
    busy(lab)
    strong = lab.folder / "strong.toml"
    strong.write_text('[protocol]\nname = "pulses"\nlevels = ["5 N"]\n')
    assert session.enqueue_scene(str(strong), "strong") == ""
    lab.until(lambda: session.queue == [])
    assert "taken out of the queue" in session.lines[-1].text
    idle(lab)


def test_stop_holds_the_queue_until_it_is_resumed(lab, monkeypatch) -> None:
    window, session = lab.window, lab.session
    started: list[str] = []
    monkeypatch.setattr(
        session, "start", lambda request, title, plan: started.append(title)
    )
    busy(lab)
    for title in ("one", "two"):
        session.enqueue(Queued(title, window.setup.request(), session.expectation))
    session.stop("STOP")
    session._enter(State.READY)
    session._next_in_queue()
    assert started == [] and window.setup.queue.resume.isVisible()
    window.setup.queue.resume.click()
    assert started == ["one"] and [item.title for item in session.queue] == ["two"]
    idle(lab)


def test_rows_are_moved_and_taken_out_by_their_buttons(lab) -> None:
    window, session = lab.window, lab.session
    busy(lab)
    for title in ("one", "two", "three"):
        session.enqueue(Queued(title, window.setup.request(), session.expectation))

    def press(words: str) -> None:
        buttons = window.setup.queue.findChildren(IconButton)
        next(b for b in buttons if b.accessibleName() == words).click()

    press("Move one down")
    assert [item.title for item in session.queue] == ["two", "one", "three"]
    press("Move three up")
    press("Take two out of the queue")
    assert [item.title for item in session.queue] == ["three", "one"]
    idle(lab)
