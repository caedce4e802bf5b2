"""Choosing a scene or a run to open."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtWidgets import QFileDialog, QWidget


def choose_scene(parent: QWidget) -> Path | None:
    """Let the user choose a scene file; None if they would rather not."""
    name, _ = QFileDialog.getOpenFileName(
        parent, "Open a scene", "", "Scenes and protocols (*.toml *.py)"
    )
    return Path(name) if name else None


def choose_run(parent: QWidget, start: Path) -> Path | None:
    """Let the user choose a run folder, beginning at `start`."""
    name = QFileDialog.getExistingDirectory(parent, "Open a run", str(start))
    return Path(name) if name else None
