"""What is done at a bench by hand, done by keys alone."""

import pytest
from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLineEdit, QWidget

from gui.dialogs.connect import Connect
from gui.dialogs.preferring import PreferencesCard
from gui.review.run_card import RunCard
from gui.state import FaultNotice, WindowState

KEY, HELD = Qt.Key, Qt.KeyboardModifier


def press(lab, key: Qt.Key, held: HELD = HELD.NoModifier) -> QWidget:
    """Press a key where the keyboard is; where the keyboard is after."""
    QTest.keyClick(lab.app.focusWidget() or lab.window, key, held)
    return lab.app.focusWidget()


@pytest.fixture
def window(lab):
    lab.window.page.setFocus()
    yield lab.window
    lab.window.page.setFocus()
    lab.window.review.show_tab(0)


@pytest.mark.parametrize("key", [KEY.Key_Return, KEY.Key_Enter])
def test_enter_presses_the_button_that_has_the_keyboard(lab, window, key) -> None:
    window.actions_.show_preferences()
    card = window.findChild(PreferencesCard)
    assert press(lab, key) is card.folder and card.isVisible(), "that is a field"
    card.close_button.setFocus()
    press(lab, key)
    assert not card.isVisible()


def test_what_is_locked_leaves_the_keyboard_to_its_card(lab, window) -> None:
    """It went on to a button: Space would have opened a file dialog."""
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    dialog.show_page(1)
    dialog.wiring.check.setFocus()
    dialog._running = dialog._wiring
    dialog._say_progress("Preparing", busy=True)
    assert lab.app.focusWidget() is dialog.card
    dialog._end("")
    assert lab.app.focusWidget() is dialog.wiring.check, "the check can be made again"
    dialog.hide()


def test_a_fault_is_reached_and_acknowledged(lab, window) -> None:
    lab.session.status.fault = FaultNotice("The source is silent.", "Look at it.")
    window.setup.form.fields[0].setFocus()
    lab.session.status.enter(WindowState.FAULT)
    assert press(lab, KEY.Key_F6) is window.banner.show_log, "from the form, too"
    assert window.setup.isAncestorOf(press(lab, KEY.Key_F6))
    assert window.centre.isAncestorOf(press(lab, KEY.Key_F6)), "a fault read is left"
    assert press(lab, KEY.Key_F6, HELD.ShiftModifier) is not window.banner.show_log
    window.banner.show_log.setFocus()
    assert press(lab, KEY.Key_Tab) is window.banner.acknowledge
    press(lab, KEY.Key_Return)
    lab.until(lambda: lab.session.state is WindowState.READY)
    assert lab.app.focusWidget() is window.page, "no button gets what is gone had"


def test_a_tab_takes_the_keyboard(lab, window) -> None:
    manual = window.review.manual
    press(lab, KEY.Key_3, HELD.ControlModifier)
    assert lab.app.focusWidget().accessibleName() == "Tab Manual"
    for _ in range(3):  # beside the tabs are the run's folder and the help
        focus = press(lab, KEY.Key_Tab)
    assert focus is manual.begin


def test_arrows_move_the_slider_of_the_coil(lab, window) -> None:
    window.review.show_tab(2)
    manual = window.review.manual
    manual.begin.setFocus()
    press(lab, KEY.Key_Return)
    lab.until(lambda: lab.session.manual.opened and manual.slider.isEnabled())
    assert lab.app.focusWidget() is manual.current, "not a button of the header"
    assert manual.current.selectedText() == "0 mA", "what is typed replaces it"
    manual.slider.setFocus()
    for _ in range(3):
        press(lab, KEY.Key_Right)
    window.render_state()
    assert manual.current.text() == "60 mA" and manual.slider.value() == 3
    lab.session.stop("test is over")
    lab.until(lambda: not lab.session.manual.alive)


def test_a_list_read_anew_keeps_keyboard_and_choice(lab, window) -> None:
    """Another run was chosen, and Enter would have opened it."""
    folders, runs = set(lab.runs(2)), window.review.runs
    window.review.show_tab(1)
    window.screen_.list_runs()
    lab.until(lambda: folders <= {card.entry.folder for card in runs.cards})
    lab.until(lambda: runs.cards[1].isVisible())
    runs.cards[1].setFocus()
    chosen = runs.cards[1].entry
    runs._show()
    runs._show()  # again before the keyboard is back
    assert runs._chosen == chosen == runs.cards[1].entry
    lab.until(lambda: isinstance(lab.app.focusWidget(), RunCard))


def test_arrows_move_the_cursor_that_was_brought_last(lab, window) -> None:
    view = window.centre.view
    view.show_span(0.0, 1.0)
    press(lab, KEY.Key_1)
    _, b = view.cursors
    assert view.cursors[0] == pytest.approx(0.5)
    press(lab, KEY.Key_Right)
    assert view.cursors == pytest.approx((0.5025, b))
    press(lab, KEY.Key_2)
    press(lab, KEY.Key_Left)
    assert view.cursors == pytest.approx((0.5025, 0.4975))
    view.show_span(0.6, 0.1)
    press(lab, KEY.Key_Right)
    assert view.start < view.cursors[1] < view.end, "what is moved is seen"
    view.clear_cursors()


def test_arrows_at_the_last_choice_move_nothing_else(lab, window) -> None:
    """They went on to the lanes: one too many moved view, or cursor."""
    view = window.centre.view
    view.show_span(1.0, 1.0)
    window.review.show_tab(3)
    window.review.focus_tab()
    assert press(lab, KEY.Key_Right).accessibleName() == "Tab Spikes"
    assert view.start == 1.0
    press(lab, KEY.Key_Left)
    assert window.review.tab == 2 and view.start == 1.0


@pytest.mark.parametrize("table", ["log", "steps"])
def test_keys_act_from_a_table_too(lab, window, table: str) -> None:
    """Qt searched the lines for each letter."""
    view, results = window.centre.view, window.review.results
    has = window.centre.log.table if table == "log" else results.table
    window.centre.open_log()
    results.table.show()
    has.setFocus()
    view.show_span(1.0, 1.0)
    press(lab, KEY.Key_1)
    assert view.cursors is not None and has.hasFocus()
    view.clear_cursors()
    press(lab, KEY.Key_Right)
    assert view.start > 1.0
    assert press(lab, KEY.Key_N) is window.centre.log.note
    results.show_kind(fires=True)


def test_a_key_that_can_do_nothing_says_why(lab, window) -> None:
    """A locked button has a tool tip for that; who pressed a key was told nothing."""
    field, notice = window.setup.form.fields[0], window.centre.notice
    before = field.text
    field.put("heavy")
    field.changed.emit()
    for key in (KEY.Key_R, KEY.Key_Return):
        window.centre.say("")
        press(lab, key, HELD.ControlModifier)
        assert "heavy" in notice.text() and notice.isVisible()
    field.put(before)
    field.changed.emit()
    assert not notice.isVisible(), "what was in the way has gone"
    lab.session.plan.expectation = None  # as before the first: the key is remembered
    press(lab, KEY.Key_R, HELD.ControlModifier)
    lab.until(lambda: lab.session.state is WindowState.RUNNING)
    press(lab, KEY.Key_R, HELD.ControlModifier)
    assert "in progress" in notice.text() and notice.isVisible()
    lab.until(lambda: lab.session.state is WindowState.READY)
    assert not notice.isVisible()
    lab.until(lambda: window.screen_.run is not None and lab.session.link.idle)


def test_a_lane_is_made_higher(lab, window) -> None:
    stack = window.centre.stack
    upper, lower = stack.visible_rows()[:2]
    before = stack.arrangement.weight(upper.lane), stack.arrangement.weight(lower.lane)
    upper.card.setFocus()
    press(lab, KEY.Key_Down, HELD.AltModifier)
    weight = stack.arrangement.weight
    assert weight(upper.lane) > before[0] and weight(lower.lane) < before[1]
    stack.forget_arrangement()


def test_esc_in_a_note_that_is_typed_ends_the_typing_alone(lab, window) -> None:
    """It closed the card, and all that was typed in it was lost."""
    card = window.runs.card
    card.show_run(lab.runs(1)[0])
    card.add.click()
    lab.until(lambda: isinstance(lab.app.focusWidget(), QLineEdit))
    lab.until(lambda: lab.app.focusWidget() is not card.title)
    press(lab, KEY.Key_Escape)
    assert card.isVisible() and lab.session.state is WindowState.READY
    press(lab, KEY.Key_Escape)
    assert not card.isVisible()
