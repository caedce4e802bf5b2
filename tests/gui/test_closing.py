"""Closing the window: what is asked first, and what would be lost by it."""

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog, QFileDialog

from gui.ask_file import ask_file
from gui.dialogs.overlay import Overlay
from gui.look.theme import Theme
from gui.session.queue import Queued
from gui.session.session import Session
from gui.state import CoilKnowledge, CoilView, Snapshot, WindowState, stop_text
from gui.window import Window


def test_closing_while_running_asks_and_keeps_running_by_default(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    assert not window.close()
    assert window.closing.isVisible() and window.closing.keep.isDefault()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not window.closing.isVisible()
    assert session.state is WindowState.RUNNING, "Esc in the question is not STOP"
    assert window.isVisible()


def test_closing_can_be_declined_after_a_fault_on_closing(lab) -> None:
    window = lab.window
    lab.run()
    window.closing.say("Stopping", "as while the window leaves")
    window.closing.hide()  # as a fault leaves it
    assert not window.close()
    assert window.closing.keep.isVisible() and window.closing.keep.hasFocus()
    assert window.closing.stop.isEnabled()
    window.closing.keep.click()


def test_the_question_on_closing_tells_what_the_coil_does_now(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    lab.until(lambda: window.header.stop.truth is CoilKnowledge.LIVE)
    assert not window.close()
    window.closing.now.setText("as it was")

    def coil_is_told() -> bool:
        told = stop_text(session.state, session.coil_view()).detail
        return told in window.closing.now.text()

    lab.until(coil_is_told)
    session.stop("while it is asked")
    lab.until(lambda: not session.busy)
    lab.until(lambda: not window.closing.isVisible())
    assert window.isVisible(), "nobody answered"


def test_closing_names_what_is_queued_and_noted_for_the_next_run(lab) -> None:
    """Both were gone with the window, and nobody was asked."""
    window, session = lab.window, lab.session
    for title in ("first", "second"):
        session.queue.add(Queued(title, window.setup.request()))
    session.note("shielded <now>")
    assert not window.close() and window.closing.isVisible()
    told = window.closing.text.text()
    assert "2 queued runs</b>: “first”, “second”" in told
    assert "a note for the next run</b>: “shielded &lt;now&gt;”" in told
    assert window.closing.stop.text() == "Close anyway"
    assert window.closing.keep.hasFocus()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not window.closing.isVisible() and session.state is WindowState.READY
    assert len(session.queue.items) == 2 and session.run.waiting
    assert not window.close()
    session.run.waiting.clear()
    while session.queue.items:
        session.queue.remove(session.queue.items[0])
    window.render_state()
    assert not window.closing.isVisible(), "nothing would be lost any more"


def test_what_waits_behind_a_run_in_progress_is_named_too(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    for number in range(5):
        session.queue.add(Queued(f"run {number}", window.setup.request()))
    assert not window.close()
    assert "“run 0”, “run 1”, “run 2” and 2 more" in window.closing.text.text()
    assert "aborted" in window.closing.text.text()
    window.closing.keep.click()


def test_who_closes_anyway_is_not_asked_again(lab, tmp_path) -> None:
    session = Session(tmp_path / "runs", separate=False)
    window = Window(session, Theme("light"))
    window.show()
    session.note("of a bench that is not connected")
    assert not window.close() and window.isVisible()
    window.closing.stop.click()
    assert not window.isVisible()
    session.close()
    window.deleteLater()


def test_the_question_is_not_covered_by_a_dialog(lab, tmp_path) -> None:
    """A file dialog stays above the window it belongs to."""
    window = lab.window
    lab.run()
    ask_file(window, "Save", print, start=str(tmp_path / "there.txt"), save=True)
    (dialog,) = window.findChildren(QFileDialog)
    lab.until(dialog.isVisible)
    assert not window.close()
    assert not dialog.isVisible() and window.closing.isVisible()
    lab.until(window.closing.keep.hasFocus)
    window.closing.keep.click()


def test_no_key_covers_the_question(lab) -> None:
    """Ctrl+E opened a file dialog over it; Esc there answered the question below."""
    window = lab.window
    lab.run()
    assert not window.close()
    lab.until(window.closing.keep.hasFocus)
    for key in (Qt.Key.Key_E, Qt.Key.Key_K, Qt.Key.Key_O):
        QTest.keyClick(window.closing.keep, key, Qt.KeyboardModifier.ControlModifier)
        lab.app.processEvents()
    over = [w for w in lab.app.topLevelWidgets() if isinstance(w, QDialog)]
    over += [card for card in window.findChildren(Overlay) if card.isVisible()]
    assert [one for one in over if one.isVisible()] == [window.closing]
    window.closing.keep.click()


def test_the_question_does_not_tell_an_unknown_coil_what_to_do(lab) -> None:
    """All it said was "Coil: switch off at the source"."""
    window = lab.window
    unknown = CoilView(None, limit=2.0)
    asked = Snapshot(WindowState.RUNNING, coil=unknown, expected=9.0)
    window.closing.ask(asked, busy=True)
    assert window.closing.now.text().startswith("COIL STATE UNKNOWN: switch off")
    window.closing.keep.click()
