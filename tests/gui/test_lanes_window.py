"""The lanes in a window of their own: the same lanes, all keys, and a STOP."""

from collections.abc import Iterator

import pytest
from PySide6.QtCore import QSettings, Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtTest import QTest

from gui.lanes_window import LanesWindow
from gui.state import CoilKnowledge, WindowState


@pytest.fixture
def apart(lab) -> Iterator[LanesWindow]:
    lab.window.part_lanes()
    try:
        made = lab.window.apart
        # again and again: a window that goes may have another activated
        lab.until(lambda: made.activateWindow() or made.isActiveWindow())
        yield made
    finally:
        if lab.window.apart is not None:
            lab.window.apart.close()
        lab.app.processEvents()


def test_lanes_keep_their_view_there_and_back(lab) -> None:
    window, centre = lab.window, lab.window.centre
    centre.view.show_span(0.25, 0.5)
    centre.view.place_cursors(0.3, 0.5)
    looked = centre.view.start, centre.view.width, centre.view.cursors
    sizes, readout = centre.splitter.sizes(), centre.tools.readout
    assert "A&nbsp;" in readout.text()
    window.part_lanes()
    assert centre.lanes.window() is window.apart and window.apart.isVisible()
    assert (centre.view.start, centre.view.width, centre.view.cursors) == looked
    window.part_lanes()
    assert window.apart is None
    assert centre.lanes.window() is window and centre.splitter.sizes() == sizes
    assert (centre.view.start, centre.view.width, centre.view.cursors) == looked
    lab.app.processEvents()
    assert "A&nbsp;" in readout.text(), "there is as much room as before"
    centre.view.clear_cursors()
    centre.view.show_all()


@pytest.mark.parametrize("how", ["click", Qt.Key.Key_F12, Qt.Key.Key_Escape])
def test_stop_acts_and_tells_what_the_source_answers_there(lab, apart, how) -> None:
    lab.run()
    lab.until(lambda: apart.stop.truth is CoilKnowledge.LIVE)
    assert apart.stop.words == lab.window.header.stop.words
    if how == "click":
        QTest.mouseClick(apart.stop, Qt.MouseButton.LeftButton)
    else:
        QTest.keyClick(lab.window.centre.tools, how)
    lab.until(lambda: lab.session.state is WindowState.READY)
    lab.until(lambda: apart.stop.truth is CoilKnowledge.OFF)


def test_a_press_on_stop_acts_there_through_an_open_menu(lab, apart) -> None:
    lab.run()
    lab.window.centre.tools.lanes.click()
    menu = lab.app.activePopupWidget()
    at = apart.stop.mapToGlobal(apart.stop.rect().center())
    QTest.mouseClick(menu, Qt.MouseButton.LeftButton, pos=menu.mapFromGlobal(at))
    lab.until(lambda: lab.session.state is WindowState.READY)
    assert lab.app.activePopupWidget() is None


def test_keys_act_there(lab, apart) -> None:
    tools = lab.window.centre.tools
    before = tools.zoom.isChecked()
    assert lab.app.focusWidget() is apart  # not STOP, which Space would press
    QTest.keyClick(apart, Qt.Key.Key_Z)
    assert tools.zoom.isChecked() is not before
    QTest.keyClick(apart, Qt.Key.Key_Z)
    QTest.keyClick(apart, Qt.Key.Key_L, Qt.KeyboardModifier.ControlModifier)
    assert lab.window.apart is None


@pytest.mark.parametrize("key", ["N", "Ctrl+N", "Ctrl+F"])
def test_what_a_key_puts_the_keyboard_into_is_typed_into(lab, apart, key) -> None:
    """The field got it in a window that had not: each letter of a note was a key."""
    typed = QKeySequence(key)[0]
    QTest.keyClick(apart, typed.key(), typed.keyboardModifiers())
    search, note = lab.window.review.runs.search, lab.window.centre.log.note
    lab.until(lambda: lab.app.focusWidget() is (search if key == "Ctrl+F" else note))
    assert lab.window.isActiveWindow()
    lab.window.review.show_tab(0)


def test_tab_reaches_stop_and_lanes_there(lab, apart) -> None:
    reached = []
    for _ in range(40):
        QTest.keyClick(lab.app.focusWidget() or apart, Qt.Key.Key_Tab)
        reached.append(lab.app.focusWidget())
        if len(set(map(id, reached))) < len(reached):
            break
    assert {apart.stop, lab.window.centre.tools.lanes} <= set(reached)
    assert all(one.window() is apart for one in reached)


def test_it_is_where_it_was_at_the_next_start(lab, tmp_path) -> None:
    window = lab.window
    kept, window._settings = (
        window._settings,
        QSettings(str(tmp_path / "kept.ini"), QSettings.Format.IniFormat),
    )
    try:
        window.part_lanes()
        window.apart.setGeometry(40, 50, 700, 500)
        window.part_lanes()
        window.part_lanes()
        assert window.apart.size().toTuple() == (700, 500)
    finally:
        window.part_lanes()
        window._settings = kept
