"""Help opens at the panel that asked for it."""

from pathlib import Path

from PySide6.QtCore import QEvent, Qt, qVersion
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QMenu

from gui.dialogs.help import PANELS, Help


def test_each_panel_opens_the_help_at_its_own_topic(lab) -> None:
    window = lab.window
    for button, topic in (
        (window.setup.help, "Protocol"),
        (window.centre.tools.help, "Lanes"),
        (window.centre.log.help, "Steps and log"),
    ):
        button.click()
        shown = window.findChild(Help)
        assert shown.isVisible() and shown.topic == topic
        shown.hide()
    for tab, topic in enumerate(("Results", "Runs", "Manual")):
        window.review.show_tab(tab)
        window.review.help.click()
        assert window.findChild(Help).topic == topic
        window.findChild(Help).hide()
    window.review.show_tab(0)


def test_a_key_opens_the_help_at_the_panel_that_has_the_keyboard(lab) -> None:
    window = lab.window
    for focus, topic in (
        (window.setup.form.field("hold"), "Protocol"),
        (window.centre.stack.rows[0].card, "Lanes"),
        (window.centre.log.note, "Steps and log"),
        (window.page, ""),
    ):
        focus.setFocus()
        QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_F1)
        assert window.findChild(Help).topic == topic
        window.findChild(Help).hide()


def test_lanes_are_chosen_by_keys_alone(lab) -> None:
    """Their menu could only be clicked."""
    window = lab.window
    stack = window.centre.stack
    key = stack.rows[0].lane.key
    for hidden in (True, False):
        window.page.setFocus()
        QTest.keyClick(window, Qt.Key.Key_L)
        (menu,) = window.centre.tools.findChildren(QMenu)
        QTest.keyClick(menu, Qt.Key.Key_Down)
        QTest.keyClick(menu, Qt.Key.Key_Return)
        assert stack.is_hidden(key) is hidden
        lab.app.sendPostedEvents(menu, QEvent.Type.DeferredDelete)


def test_about_names_what_draws_and_its_licences(lab) -> None:
    lab.window.actions_.show_help(page=2)
    shown = lab.window.findChild(Help)
    told = [one.text() for one in shown.findChildren(QLabel)]
    (said,) = (text for text in told if "pyqtgraph" in text)
    for words in (qVersion(), "PySide6", "MIT licence", "LGPL", "CC BY 4.0"):
        assert words in said
    shown.hide()


def test_every_topic_says_something() -> None:
    assert len({title for title, _ in PANELS}) == len(PANELS)
    assert all(len(text) > 40 for _, text in PANELS)


def test_narrow_window_has_room_for_one_side_only(lab) -> None:
    window = lab.window
    window.resize(1180, 720)
    window.fold(window.review, False)
    assert window.review.isVisible() and not window.setup.isVisible()
    window.fold(window.review, True)
    assert window.setup.isVisible(), "it only made room"
    window.fold(window.review, False)
    window.fold(window.setup, False)
    assert window.setup.isVisible() and not window.review.isVisible()
    window.resize(1720, 1080)
    window.fold(window.review, False)
    assert window.setup.isVisible() and window.review.isVisible()
    window._folds = dict.fromkeys(window._folds)  # nobody has folded one by hand


def test_the_documentation_names_every_key(lab) -> None:
    page = Path(__file__).parents[2] / "docs" / "window.md"
    told = page.read_text(encoding="utf-8").partition("## Shortcuts")[2]
    keys = {one for key in lab.window.actions_.keys for one in key.keys}
    assert {one for one in keys if f"`{one}`" not in told} == set()
