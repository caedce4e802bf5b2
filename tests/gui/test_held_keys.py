"""A key that is held down acts once where it acts once."""

import pytest
from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QKeyEvent

from gui.held_keys import HeldKeys

CTRL, NONE = Qt.KeyboardModifier.ControlModifier, Qt.KeyboardModifier.NoModifier
Kind, Key = QEvent.Type, Qt.Key


def event(kind, key, mods=NONE, at=0, *, repeats=False) -> QKeyEvent:
    text = "m" if key == Key.Key_M else ""
    made = QKeyEvent(kind, key, mods, text, repeats)
    made.setTimestamp(at)
    return made


def test_a_press_at_the_time_of_its_release_is_the_key_still_down(app) -> None:
    """As X11 repeats it, where Qt did not find both in its queue."""
    keys = HeldKeys()
    assert not keys.is_held(event(Kind.KeyPress, Key.Key_L, at=5))
    assert not keys.is_held(event(Kind.KeyRelease, Key.Key_L, at=700))
    assert keys.is_held(event(Kind.KeyPress, Key.Key_L, at=700))
    assert not keys.is_held(event(Kind.KeyPress, Key.Key_K, at=700))
    assert not keys.is_held(event(Kind.KeyPress, Key.Key_L, at=701))
    assert keys.is_held(event(Kind.KeyPress, Key.Key_L, at=740, repeats=True))


@pytest.mark.parametrize(
    ("key", "kept"), [(Key.Key_Return, True), (Key.Key_L, True), (Key.Key_Z, False)]
)
def test_a_held_shortcut_is_not_asked_for_again_but_undo(lab, key, kept) -> None:
    """Return queues, L parts the lanes: each once; held, it comes to nobody."""
    lab.window.page.setFocus()
    asked = event(Kind.ShortcutOverride, key, CTRL, repeats=True)
    asked.ignore()
    lab.app.sendEvent(lab.window.page, asked)
    assert asked.isAccepted() is kept, "accepted: it is no shortcut"
    first = event(Kind.ShortcutOverride, key, CTRL)
    first.ignore()
    lab.app.sendEvent(lab.window.page, first)
    assert not first.isAccepted()


def test_a_held_letter_switches_once_and_an_arrow_goes_on(lab) -> None:
    window, view = lab.window, lab.window.centre.view

    def hold(key) -> None:
        for repeats in (False, True, True):
            pressed = event(Kind.KeyPress, key, repeats=repeats)
            lab.app.sendEvent(window.page, pressed)

    hold(Key.Key_C)
    assert view.cursors is not None
    window.page.setFocus()
    hold(Key.Key_C)
    assert view.cursors is None
    view.show_span(0.5, 0.1)
    hold(Key.Key_Left)
    assert view.start == pytest.approx(0.5 - 3 * 0.01)
    view.show_all()
