"""What a person is asked in a run: the card that waits for the answer."""

from collections.abc import Iterator

import pytest
from benches import READ_BY_HAND
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest

from gui.state import WindowState
from tactile_lab.acquisition.ending import Ending
from tactile_lab.engine.commands import answer
from tactile_lab.engine.engine import Engine
from tactile_lab.engine.events import Ended, PersonAsked
from tactile_lab.engine.link import RemoteTask
from tactile_lab.engine.request import Request
from tactile_lab.quantity import show
from tactile_lab.store.run import Run


def test_run_waits_for_a_person_until_it_is_done_or_stopped(lab) -> None:
    window, session = lab.window, lab.session
    done: list[object] = []
    session.run.task = RemoteTask(0, lambda *said: done.append(said))
    session.status.enter(WindowState.RUNNING)
    session.run.take(PersonAsked("Put the probes on 0 V."))
    lab.until(window.question.isVisible)
    assert "0 V" in window.question.text.text()
    assert window.question.entry.isHidden(), "there is nothing to type"
    window.question.done.click()
    assert done == [(Engine.say, answer, "")] and not window.question.isVisible()
    window.centre.write_note()
    session.run.take(PersonAsked("Put them on V_S."))
    lab.until(window.question.isVisible)
    for key in (Qt.Key.Key_A, Qt.Key.Key_Space, Qt.Key.Key_Return):
        QTest.keyClick(lab.app.focusWidget(), key)  # of a note that is typed just then
    lab.until(lambda: window.question.heeds_keys)
    for key in (Qt.Key.Key_A, Qt.Key.Key_Space, Qt.Key.Key_Return):
        QTest.keyClick(lab.app.focusWidget(), key)  # nor after a pause in typing it
    assert len(done) == 1 and window.question.isVisible(), "nobody moved the probes"
    for part in (window.question.done, window.question.stop):  # Tab, Enter: Done
        QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Tab)
        assert lab.app.focusWidget() is part
    session.run.take(Ended(Ending.refused("stopped at the bench")))
    session.acknowledge()
    assert not window.question.isVisible(), "a run that ended waits for nobody"


def test_a_key_pressed_as_the_question_comes_does_not_answer_it(
    lab, monkeypatch
) -> None:
    """Space, meant for Freeze, said that the probes were moved; STOP's keys act."""
    window, session, done = lab.window, lab.session, []
    card, stopped = window.question, []
    window.page.setFocus()
    session.run.task = RemoteTask(0, lambda *said: done.append(said))
    session.status.enter(WindowState.RUNNING)
    session.run.take(PersonAsked("Put the probes on 0 V."))
    assert card.isVisible() and not card.heeds_keys
    with monkeypatch.context() as spied:
        spied.setattr(session, "stop", lambda *reason: stopped.append(reason))
        for key in (Qt.Key.Key_Escape, Qt.Key.Key_F12):
            QTest.keyClick(lab.app.focusWidget(), key)
    assert len(stopped) == 2
    for key in (Qt.Key.Key_Space, Qt.Key.Key_Return, Qt.Key.Key_Tab):
        QTest.keyClick(lab.app.focusWidget(), key)
    assert not done and card.isVisible() and card.done.hasFocus()
    lab.until(lambda: card.heeds_keys)
    QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Space)
    assert done == [(Engine.say, answer, "")] and not card.isVisible()
    session.run.take(PersonAsked("The field?", current=0.5))
    QTest.keyClicks(lab.app.focusWidget(), "12")  # the end of a note
    assert card.entry.text() == ""
    lab.until(lambda: card.heeds_keys)
    QTest.keyClicks(lab.app.focusWidget(), "5.4")
    assert card.entry.text() == "5.4"
    session.run.take(Ended(Ending.refused("stopped at the bench")))
    session.acknowledge()


@pytest.fixture
def calibrating(lab) -> Iterator:
    """A short calibration in progress on a bench whose teslameter a person reads."""
    (lab.folder / "by-hand.toml").write_text(READ_BY_HAND)
    short = ("protocol.points=5", "protocol.loops=0", 'record.signals=["field"]')
    request = Request("calibrate_field", short, str(lab.folder / "by-hand.toml"))
    lab.session.start(request, "Calibration")
    lab.until(lambda: lab.window.question.isVisible() or lab.session.status.fault)
    yield lab
    lab.session.source, lab.session.plan.expectation = (
        None,
        None,
    )  # the plan is shown again


def test_a_person_reads_the_field_for_a_calibration(calibrating) -> None:
    lab = calibrating
    session, card = lab.session, lab.window.question
    asked: list[float] = []
    while session.state is WindowState.RUNNING:
        errand = session.run.asked
        assert not card.doubt.text() or card.doubt.isHidden()
        asked.append(errand.current)
        held = card.coil.text().replace("\u00a0", " ")
        assert f"holds {show(errand.current, 'A')}" in held
        assert ("heat" in card.coil.text()) is (abs(errand.current) > 0.6)
        assert not card.done.isEnabled(), "nothing is typed yet"
        lab.until(lambda: card.heeds_keys)
        QTest.keyClicks(card.entry, f"{10.8 * errand.current:.2f}")
        QTest.keyClick(card.entry, Qt.Key.Key_Return)
        lab.until(lambda: session.run.asked or session.state is not WindowState.RUNNING)
    lab.until(lambda: not session.busy)
    assert session.status.fault is None
    assert asked[:5] == pytest.approx([1.0, 0.5, 0.0, -0.5, -1.0])
    assert lab.window.screen_.ending.endswith("spikes not looked for")
    with Run.load(session.run.folder) as run:
        assert run.field["field"] == pytest.approx([10.8e-3 * i for i in asked])
    assert card.isHidden() and session.coil_view().verified_off
    assert session.run.field == pytest.approx(10.8e-3 * asked[-1])
    assert session._chips._meter().value == "—", "it was read in the run"


def test_what_is_no_field_is_not_sent_and_what_is_doubted_asked_again(
    calibrating,
) -> None:
    lab = calibrating
    session, card = lab.session, lab.window.question
    lab.until(lambda: card.heeds_keys)
    card.entry.setText("10.8 A")
    assert not card.done.isEnabled() and "A" in card.understood.text()
    QTest.keyClick(card.entry, Qt.Key.Key_Return)
    assert session.run.asked is not None
    card.entry.setText("−8000 µT")
    assert card.understood.text() == "= −8 mT" and card.done.isEnabled()
    card.done.click()
    lab.until(lambda: session.run.asked is not None)
    assert "check sign" in card.doubt.text() and card.doubt.isVisible()
    assert "−8 mT at 1 A" in card.before.text()
    assert card.entry.text() == "", "a second Enter alone confirms nothing"
    card.stop.click()
    lab.until(lambda: not session.busy)
    assert card.isHidden() and session.coil_view().verified_off
