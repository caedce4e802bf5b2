"""The dialog that asks for a file: what becomes of one that is there already."""

from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QDialog, QFileDialog, QLineEdit, QMessageBox

from gui.ask_file import ask_file


def press_return(lab, dialog: QDialog) -> None:
    """To what has the keyboard in a dialog, once that is there."""
    lab.until(dialog.isActiveWindow)
    QTest.keyClick(lab.app.focusWidget(), Qt.Key.Key_Return)
    lab.app.processEvents()


def test_an_existing_file_is_replaced_by_one_answer_or_asked_for_again(
    lab, tmp_path
) -> None:
    """Return in the question dropped what was to be saved, and nobody was told."""
    window, got = lab.window, list[Path]()
    there = tmp_path / "there.txt"
    there.touch()
    ask_file(window, "Save", got.append, start=str(there), save=True)
    (dialog,) = window.findChildren(QFileDialog)
    press_return(lab, dialog)
    (box,) = window.findChildren(QMessageBox)
    assert "there.txt" in box.text() and not got
    answers = {one.text() for one in box.buttons()}
    assert answers == {"Replace", "Choose another name"}
    press_return(lab, box)
    lab.until(lambda: not window.findChildren(QMessageBox))
    (dialog,) = (one for one in window.findChildren(QFileDialog) if one.isVisible())
    assert dialog.findChild(QLineEdit, "fileNameEdit").text() == "there.txt"
    assert not got
    press_return(lab, dialog)
    (box,) = window.findChildren(QMessageBox)
    next(one for one in box.buttons() if one.text() == "Replace").click()
    assert got == [there]
    lab.until(lambda: not window.findChildren(QMessageBox))
