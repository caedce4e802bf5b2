"""Choosing a scene or a run to open."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QFileDialog

if TYPE_CHECKING:
    from gui.window import Window


def ask_scene(window: Window) -> None:
    """Let the user choose a scene file."""
    name, _ = QFileDialog.getOpenFileName(
        window, "Open a scene", "", "Scenes and protocols (*.toml *.py)"
    )
    if name:
        window.opening.open_path(Path(name))


def ask_run(window: Window) -> None:
    """Let the user choose a run folder."""
    name = QFileDialog.getExistingDirectory(
        window, "Open a run", str(window.session.out)
    )
    if name:
        window.opening.open_path(Path(name))
