"""Tab goes through the window as one reads it, whatever was made when."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QPushButton, QWidget

from gui.dialogs.about_run import AboutRun
from gui.dialogs.connect import Connect
from gui.dialogs.help import Help
from gui.menu import GearMenu
from gui.parts import Segments
from gui.tab_order import in_reading_order, reach


def names(root: QWidget) -> list[str]:
    return [one.accessibleName() for one in in_reading_order(root)]


def press_tab(lab, *, back: bool = False) -> QWidget:
    key = Qt.Key.Key_Backtab if back else Qt.Key.Key_Tab
    QTest.keyClick(lab.app.focusWidget(), key)
    return lab.app.focusWidget()


def test_everything_that_takes_the_keyboard_has_a_name(lab) -> None:
    lab.runs(1)
    for tab in (0, 1, 2):
        lab.window.review.show_tab(tab)
        lab.app.processEvents()
        assert all(names(lab.window.page)), tab
    lab.window.review.show_tab(0)


def test_form_is_read_from_its_head_to_its_buttons(lab) -> None:
    setup = lab.window.setup
    setup.form.show_protocol(setup.form.protocol, {})  # fields made last come first
    lab.app.processEvents()
    titles = [field.parameter.title for field in setup.form.fields]
    read = names(setup)
    at = read.index("Protocol")
    assert read[at + 1 : at + 1 + len(titles)] == titles
    assert read[at + 1 + len(titles)] == "Record"  # the scene's other tables
    assert read[-2:] == ["Run", "Queue"]
    setup.form.set_texts(lab.texts)


def test_tab_walks_forth_and_back_and_skips_what_is_locked(lab) -> None:
    window = lab.window
    window.activateWindow()
    lab.until(window.isActiveWindow)
    window.setup.picker.setFocus()
    assert press_tab(lab) is window.setup.form.fields[0].focusProxy()
    assert press_tab(lab, back=True) is window.setup.picker
    lab.run()
    lab.until(lambda: not window.setup.run.isEnabled())
    window.setup.buttons.queue.setFocus()
    assert press_tab(lab, back=True) is not window.setup.run


def test_tab_comes_to_the_choice_that_is_made(lab) -> None:
    """Of those between which arrows choose it came to the first, until one had it."""
    segments = Segments(["1 s", "5 s", "Run"], "Visible time")
    segments.setParent(lab.window)
    segments.show()
    stops = [names(segments)]
    for chosen in (2, 1, -1):
        segments.choose(chosen)
        stops.append(names(segments))
    segments.deleteLater()
    every = [f"Visible time: {text}" for text in ("1 s", "5 s", "Run")]
    assert stops == [every, every[2:], every[1:2], every]


def test_a_field_stays_in_sight_as_what_it_says_is_told(lab) -> None:
    """Why its text cannot be used took the room in which it stood."""
    window = lab.window
    window.resize(1366, 728)
    area = window.setup.tables.parentWidget().parentWidget().parentWidget()
    fields = [field.focusProxy() for field in window.setup.form.fields]
    reach(fields[0])
    area.verticalScrollBar().setValue(0)
    while lab.app.focusWidget() in fields[:-1] and not area.verticalScrollBar().value():
        press_tab(lab)
    seen = lab.app.focusWidget()
    assert seen.visibleRegion().boundingRect() == seen.rect(), "all of its ring"
    height = area.height()
    window.setup._show_warnings(["Spikes are missed at this sample rate. " * 4])
    lab.until(lambda: area.height() < height)
    assert seen.visibleRegion().boundingRect() == seen.rect()
    window.setup._show_warnings(())
    window.resize(1720, 1080)
    window.page.setFocus()


@pytest.mark.parametrize("size", [(1366, 728), (845, 493)])
def test_pages_take_the_keyboard_along(lab, size: tuple[int, int]) -> None:
    """It stayed in a field that was scrolled away; in a choice they chose another."""
    window, form = lab.window, lab.window.setup.form
    window.resize(*size)
    lab.app.processEvents()
    area = window.setup.tables.parentWidget().parentWidget().parentWidget()
    bar, texts = area.verticalScrollBar(), form.texts()
    reach(form.fields[0].focusProxy())
    for key in (Qt.Key.Key_PageDown, Qt.Key.Key_PageUp):
        before, places = None, []
        while bar.value() != before:
            before = bar.value()
            places.append(press(lab, key))
            assert area.isAncestorOf(places[-1])
            seen = places[-1].visibleRegion().boundingRect()
            assert seen == places[-1].rect(), places[-1].accessibleName()
        assert len({*places}) > 1, "page by page"
    assert places[-1] in [field.focusProxy() for field in form.fields], "at its start"
    assert form.texts() == texts
    window.resize(1720, 1080)
    window.page.setFocus()


def test_pages_scroll_past_what_presses_and_moves_something(lab) -> None:
    """The keyboard would come to the slider of the coil, which the next page moves."""
    window = lab.window
    window.resize(845, 493)
    window.fold(window.review, False)
    window.review.show_tab(2)
    manual = window.review.manual
    manual.begin.setFocus()
    for _ in range(4):
        has = press(lab, Qt.Key.Key_PageDown)
        assert has is not manual.slider
        assert has is manual.begin or not isinstance(has, QPushButton)
    window.review.show_tab(0)
    window.fold(window.setup, False)
    window._folds = dict.fromkeys(window._folds)  # nobody has folded one by hand
    window.resize(1720, 1080)
    window.page.setFocus()


def test_locking_what_has_the_keyboard_gives_it_to_no_button(lab) -> None:
    window = lab.window
    window.activateWindow()
    lab.until(window.isActiveWindow)
    window.setup.run.setFocus()
    QTest.keyClick(window.setup.run, Qt.Key.Key_Space)
    lab.until(lambda: not window.setup.run.isEnabled())
    assert lab.app.focusWidget() is window.page
    lab.until(lambda: window.setup.run.isEnabled())


def press(lab, key, held=Qt.KeyboardModifier.NoModifier) -> QWidget:
    QTest.keyClick(lab.app.focusWidget() or lab.window, key, held)
    return lab.app.focusWidget()


def test_a_key_goes_from_panel_to_panel_and_back(lab) -> None:
    window, key = lab.window, Qt.Key.Key_F6
    window.page.setFocus()
    panels = (window.setup, window.centre.lanes, window.centre.record, window.review)
    for panel in panels:
        assert panel.isAncestorOf(press(lab, key))
    assert window.header.isAncestorOf(press(lab, key))
    back = press(lab, key, Qt.KeyboardModifier.ShiftModifier)
    assert window.review.isAncestorOf(back)
    window.page.setFocus()


def test_what_a_card_says_is_scrolled_by_key(lab) -> None:
    window = lab.window
    window.actions_.show_help()
    bar = window.findChild(Help)._area.verticalScrollBar()
    lab.until(lambda: bar.maximum() > 0)
    press(lab, Qt.Key.Key_PageDown)
    assert bar.value() > 0
    press(lab, Qt.Key.Key_PageUp)
    assert bar.value() == 0


def test_the_menu_opens_by_key(lab) -> None:
    lab.window.page.setFocus()
    press(lab, Qt.Key.Key_F10)
    lab.until(lambda: isinstance(lab.app.activePopupWidget(), GearMenu))
    lab.app.activePopupWidget().close()


def test_a_card_takes_the_keyboard_and_gives_it_back(lab) -> None:
    """Enter in the card below would have opened the run again."""
    lab.runs(1)
    window = lab.window
    window.screen_.list_runs()
    window.review.show_tab(1)
    lab.until(lambda: window.review.runs.cards)

    def asked() -> bool:
        """Again and again: a list that was read anew has new cards."""
        window.review.runs.cards[0].setFocus()
        press(lab, Qt.Key.Key_F10, Qt.KeyboardModifier.ShiftModifier)
        return lab.app.activePopupWidget() is not None

    lab.until(asked)
    menu = lab.app.activePopupWidget()
    about = next(one for one in menu.actions() if one.text().startswith("About"))
    menu.close()
    about.trigger()
    shown = window.findChild(AboutRun)
    lab.until(lambda: shown.isAncestorOf(lab.app.focusWidget()))
    press(lab, Qt.Key.Key_Escape)
    assert not shown.isVisible()
    focus = lab.app.focusWidget()
    assert window.review.isAncestorOf(focus) or focus is window.page
    window.page.setFocus()
    window.review.show_tab(0)


def test_every_control_of_connect_has_a_name(lab) -> None:
    lab.window.actions_.connect_dialog()
    dialog = lab.window.findChild(Connect)
    lab.app.processEvents()
    assert all(names(dialog))
    dialog.hide()


def test_tab_stays_in_an_open_card_and_the_header(lab) -> None:
    window = lab.window
    window.activateWindow()
    lab.until(window.isActiveWindow)
    window.actions_.show_help()
    seen = []
    for _ in range(12):
        seen.append(press_tab(lab))
    assert window.header.stop in seen, "STOP is always within reach"
    covered = (window.setup, window.centre, window.review)
    assert not any(part.isAncestorOf(one) for one in seen for part in covered)
