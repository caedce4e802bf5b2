"""The part of the panel that scrolls: what the run is, its force, its parameters."""

from __future__ import annotations

from collections.abc import Sequence

from PySide6.QtWidgets import QWidget

from gui.look.theme import Theme
from gui.parts import column, label, row, scrolling, with_gutter
from gui.setup.form import Form
from gui.setup.preview import WaveformPreview

WARNINGS = 3
"""Warnings shown; the tool tip has them all."""


class Page(QWidget):
    """Description, waveform, form and warnings of one run."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self.about = label("", "muted", wrap=True)
        self.preview = WaveformPreview(theme)
        self.form = Form()
        self.warnings = label("", "warning", wrap=True)
        self.warnings.hide()
        caption = row()
        caption.addWidget(label("WAVEFORM", "section"))
        caption.addStretch(1)
        caption.addWidget(label("mN against s", "small"))
        inner = QWidget()
        inside = column(inner, spacing=9)
        inside.addWidget(self.about)
        inside.addLayout(caption)
        inside.addWidget(self.preview)
        inside.addWidget(label("PARAMETERS", "section"))
        inside.addWidget(self.form)
        inside.addWidget(self.warnings)
        inside.addStretch(1)
        column(self).addWidget(with_gutter(scrolling(inner), inside))

    def show_warnings(self, warnings: Sequence[str]) -> None:
        """Show where the bench cannot deliver what is asked."""
        self.warnings.setText("\n".join(f"⚠ {text}" for text in warnings[:WARNINGS]))
        self.warnings.setToolTip("\n".join(warnings))
        self.warnings.setVisible(bool(warnings))
