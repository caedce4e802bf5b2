"""STOP reaches the coil whatever Qt itself opens."""

from PySide6.QtCore import QEvent, QMimeData, QObject, QPoint, Qt, QTimer
from PySide6.QtGui import QDragEnterEvent, QGuiApplication, QKeyEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QDialogButtonBox,
    QFileDialog,
    QLineEdit,
    QMessageBox,
    QToolButton,
)
from shiboken6 import isValid

from gui.ask_file import ask_file
from gui.dialogs.overlay import Overlay
from gui.state import WindowState
from gui.tab_order import in_reading_order


def seen_within(box_opens) -> dict[str, object]:
    """What is true while Qt waits for an answer to a question of its own."""
    seen: dict[str, object] = {}

    def look() -> None:
        boxes = [
            one
            for one in QApplication.topLevelWidgets()
            if isinstance(one, QMessageBox) and one.isVisible()
        ]
        seen["asked"] = len(boxes)
        seen["modal"] = QApplication.activeModalWidget()
        for one in boxes:
            one.reject()

    QTimer.singleShot(300, look)
    box_opens()
    return seen


def drawn(button: QToolButton) -> int:
    """How many of its pixels, its border aside, are no background."""
    image = button.grab().toImage()
    ground, inner = image.pixel(4, 4), range(4, image.width() - 4)
    return sum(image.pixel(x, y) != ground for x in inner for y in inner)


def test_a_question_of_a_file_dialog_is_not_modal(lab) -> None:
    window = lab.window
    window.screen_.ask_run()
    (dialog,) = window.findChildren(QFileDialog)
    dialog.findChild(QLineEdit, "fileNameEdit").setText("/no/such/folder")
    assert drawn(dialog.findChild(QToolButton, "toParentButton")) > 50, "not a speck"
    seen = seen_within(dialog.accept)
    assert seen["asked"] == 1, "Qt says that there is no such folder"
    assert seen["modal"] is None, "or no click would reach STOP"
    dialog.close()


def test_a_file_that_is_typed_fast_can_be_opened(lab) -> None:
    """Qt had not read yet what it is, and locked the button for good."""
    window, scene = lab.window, lab.folder / "short.toml"
    ask_file(window, "Open", print, start=str(lab.folder / "other.toml"))
    (dialog,) = window.findChildren(QFileDialog)
    name = dialog.findChild(QLineEdit, "fileNameEdit")
    name.clear()
    QTest.keyClicks(name, str(scene))
    (box,) = dialog.findChildren(QDialogButtonBox)
    assert box.button(QDialogButtonBox.StandardButton.Open).isEnabled()
    dialog.close()


def test_a_file_dialog_that_asks_outlives_its_question(lab) -> None:
    """Its own function waits within: the program ended by a "double free"."""
    window = lab.window
    window.screen_.ask_run()
    (dialog,) = window.findChildren(QFileDialog)
    dialog.findChild(QLineEdit, "fileNameEdit").setText("/no/such/folder")
    outlived: list[bool] = []

    def close_while_it_asks() -> None:
        window.screen_.ask_run()  # closes the one before
        lab.app.processEvents()
        outlived.append(isValid(dialog) and not dialog.isVisible())

    QTimer.singleShot(0, close_while_it_asks)
    dialog.accept()
    assert outlived == [True]
    lab.until(lambda: not isValid(dialog))
    (after,) = window.findChildren(QFileDialog)
    assert after.isVisible()
    after.close()


def test_a_key_that_is_held_down_acts_once(lab) -> None:
    window, log = lab.window, lab.session.log
    window.actions_.show_help()
    before = len(log.lines)
    for repeated in (False, True, True):
        pressed = QKeyEvent(
            QEvent.Type.KeyPress, Qt.Key.Key_Escape, Qt.KeyboardModifier.NoModifier,
            "", repeated,
        )  # fmt: skip
        QApplication.sendEvent(window, pressed)
    assert not any(card.isVisible() for card in window.findChildren(Overlay))
    off = [line for line in log.lines[before:] if line.source == "safety"]
    assert not off, "Esc closed the help; nothing was switched off"


class KeysTaken(QObject):
    """As Qt takes them from the whole program while text or a file is dragged."""

    def eventFilter(self, watched: QObject, event: QEvent) -> bool:  # noqa: N802
        return isinstance(event, QKeyEvent)


def test_stop_acts_while_something_is_dragged(lab, monkeypatch) -> None:
    window, taken = lab.window, KeysTaken()
    stopped: list[str] = []
    data = QMimeData()  # which the event does not keep
    enters = QDragEnterEvent(
        QPoint(300, 300),
        Qt.DropAction.CopyAction,
        data,
        Qt.MouseButton.LeftButton,
        Qt.KeyboardModifier.NoModifier,
    )
    with monkeypatch.context() as spied:
        spied.setattr(lab.session, "stop", stopped.append)
        lab.app.installEventFilter(taken)
        try:
            QApplication.sendEvent(window.windowHandle(), enters)
            QTest.keyClick(window.windowHandle(), Qt.Key.Key_F12)
        finally:
            lab.app.removeEventFilter(taken)
    assert stopped == ["STOP by F12"]


def test_esc_closes_the_dialog_that_got_the_keyboard_below_a_menu(lab) -> None:
    """To Qt the main window stayed the active one: Esc was STOP, again and again."""
    window, log = lab.window, lab.session.log
    window.screen_.ask_scene()
    (dialog,) = window.findChildren(QFileDialog)
    lab.app.processEvents()
    window.activateWindow()
    lab.until(window.isActiveWindow)
    window.actions_.show_menu()
    menu = QApplication.activePopupWidget()
    dialog.activateWindow()
    lab.until(lambda: QGuiApplication.focusWindow() == dialog.windowHandle())
    before = len(log.lines)
    for shown in (menu, dialog):
        QTest.keyClick(shown.windowHandle(), Qt.Key.Key_Escape)
        assert not (isValid(shown) and shown.isVisible())
    assert len(log.lines) == before, "nothing was switched off"


def test_esc_closes_the_uppermost_first(lab) -> None:
    """A dialog before the card that asked for it, whichever has the keyboard."""
    window, log = lab.window, lab.session.log
    window.actions_.show_preferences()
    (card,) = (one for one in window.findChildren(Overlay) if one.isVisible())
    before = len(log.lines)
    for takes in (QFileDialog, type(window)):
        window.screen_.ask_scene()
        lab.app.processEvents()
        (dialog,) = window.findChildren(QFileDialog)
        keyboard = dialog if takes is QFileDialog else window
        QTest.keyClick(keyboard.windowHandle(), Qt.Key.Key_Escape)
        assert card.isVisible()
        assert not (isValid(dialog) and dialog.isVisible())
        lab.app.processEvents()
    QTest.keyClick(window.windowHandle(), Qt.Key.Key_Escape)
    assert not card.isVisible()
    assert len(log.lines) == before, "nothing was switched off"


def test_esc_in_the_header_is_as_anywhere(lab, monkeypatch) -> None:
    """Within the header it closes the card below; where none is open it is STOP."""
    window, stopped = lab.window, []
    window.fold(window.setup, True)  # which adds a button
    controls = in_reading_order(window.header)
    assert window.header.stop in controls and len(controls) > 4
    with monkeypatch.context() as spied:
        spied.setattr(lab.session, "stop", stopped.append)
        for number, control in enumerate(controls):
            window.actions_.show_help()
            control.setFocus(Qt.FocusReason.TabFocusReason)
            QTest.keyClick(control, Qt.Key.Key_Escape)
            assert not any(card.isVisible() for card in window.findChildren(Overlay))
            assert len(stopped) == number and control.hasFocus()
            QTest.keyClick(control, Qt.Key.Key_Escape)
            assert stopped[number:] == ["STOP by Esc"]
    window.fold(window.setup, False)
    window._folds = dict.fromkeys(window._folds)  # nobody has folded one by hand


def test_stop_acts_while_qt_waits_for_an_answer(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()

    def ask() -> None:
        QMessageBox.warning(window, "Something", "Really?")

    def press() -> None:
        window.header.stop.click()

    QTimer.singleShot(150, press)
    seen = seen_within(ask)
    assert seen["asked"] == 1 and seen["modal"] is None
    assert session.state in (WindowState.ABORTING, WindowState.READY)
    lab.until(lambda: session.state is WindowState.READY)
