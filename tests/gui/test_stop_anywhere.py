"""STOP reaches the coil whatever Qt itself opens."""

from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication, QFileDialog, QLineEdit, QMessageBox

from gui.state import WindowState


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


def test_a_question_of_a_file_dialog_is_not_modal(lab) -> None:
    window = lab.window
    window.screen_.ask_run()
    (dialog,) = window.findChildren(QFileDialog)
    dialog.findChild(QLineEdit, "fileNameEdit").setText("/no/such/folder")
    seen = seen_within(dialog.accept)
    assert seen["asked"] == 1, "Qt says that there is no such folder"
    assert seen["modal"] is None, "or no click would reach STOP"
    dialog.close()


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
