"""Asking for a file while everything else goes on."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import (
    QDialogButtonBox,
    QFileDialog,
    QLineEdit,
    QMessageBox,
    QWidget,
)

CLOSING = 50
"""Time in which Qt comes back from a question that was closed, ms."""


def ask_file(
    parent: QWidget,
    title: str,
    then: Callable[[Path], object],
    *,
    kinds: str = "",
    start: str = "",
    save: bool = False,
    folder: bool = False,
) -> None:
    """Ask for a file, or a folder; nobody waits for the answer.

    The dialog is not modal, and Qt's own: a modal one, or one of the desktop's, would
    keep clicks and keys from STOP. So would what Qt asks itself about a file that is
    there already, or is not.

    Args:
        parent: whose window it belongs to; it goes with it.
        title: of the dialog.
        then: gets the path, if one is chosen.
        kinds: endings offered, as `QFileDialog` takes them.
        start: folder, or file, that is proposed; "" is where one was last.
        save: the file need not exist.
        folder: an existing folder is asked for.
    """
    for other in parent.window().findChildren(QFileDialog):
        other.close()
    dialog = QFileDialog(parent, title, "", kinds)
    dialog.setOption(QFileDialog.Option.DontUseNativeDialog)
    dialog.finished.connect(lambda: _forget(dialog))
    dialog.setFileMode(
        QFileDialog.FileMode.Directory if folder else QFileDialog.FileMode.AnyFile
    )
    if save:
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setOption(QFileDialog.Option.DontConfirmOverwrite)
    if folder:
        dialog.setOption(QFileDialog.Option.ShowDirsOnly)
        dialog.setDirectory(start)
    elif start:
        dialog.selectFile(start)

    def chosen(name: str) -> None:
        path = Path(name)
        if save and path.exists():
            again = partial(ask_file, parent, title, then, kinds=kinds, save=True)
            _ask_to_replace(
                parent.window(), path, lambda: then(path), lambda: again(start=name)
            )
        else:
            then(path)

    dialog.fileSelected.connect(chosen)
    _accept_what_is_typed(dialog)
    dialog.show()


def _accept_what_is_typed(dialog: QFileDialog) -> None:
    """Have the button and Return take any name.

    Qt locks the button for a file of which it has not read yet what it is, and does not
    unlock it when it has. What it cannot take it says itself.
    """
    (name,) = dialog.findChildren(QLineEdit, "fileNameEdit")
    (box,) = dialog.findChildren(QDialogButtonBox)
    button = box.buttons()[0]
    name.textChanged.connect(lambda text: button.setEnabled(bool(text)))


def _forget(dialog: QFileDialog) -> None:
    """Delete a closed dialog; while it asks itself, a function of it still runs."""
    asking = dialog.findChildren(QMessageBox)
    for box in asking:
        box.close()
    if asking:
        QTimer.singleShot(CLOSING, dialog, lambda: _forget(dialog))
    else:
        dialog.deleteLater()


def _ask_to_replace(
    window: QWidget,
    path: Path,
    replace: Callable[[], object],
    again: Callable[[], object],
) -> None:
    """Ask once; Return and Esc lead back to the dialog, and lose nothing."""
    box = QMessageBox(window)
    box.setIcon(QMessageBox.Icon.Warning)
    box.setWindowTitle("Replace the file?")
    box.setText(f"{path.name} exists already.\nDo you want to replace it?")
    do = box.addButton("Replace", QMessageBox.ButtonRole.DestructiveRole)
    other = box.addButton("Choose another name", QMessageBox.ButtonRole.RejectRole)
    box.setModal(False)
    box.setDefaultButton(other)
    box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    do.clicked.connect(replace)
    other.clicked.connect(again)
    box.show()
