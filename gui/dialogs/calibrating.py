"""The connect dialog's third page: force per current, assumed or measured."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QGridLayout, QLineEdit, QWidget

from gui.dialogs.bench_text import BenchChoice
from gui.look.theme import Theme
from gui.parts import STRETCH, column, label, line, line_edit, push, row, say
from gui.plots.small_plot import SmallPlot
from gui.review.conclusion import ShownConclusion
from gui.review.live_plots import loop_plot
from tactile_lab.arrays import FloatArray

MAGNET = (
    ("r", "Distance magnet to pole face"),
    ("A1", "Area of the magnet"),
    ("A2", "Area of the core"),
    ("B1", "Field of the magnet"),
    ("B2_per_ampere", "Field of the coil"),
)


class Calibrating(QWidget):
    """Geometry of Eq. (2); the field calibration with its loop; the force check."""

    field_asked = Signal()
    force_asked = Signal()
    use_asked = Signal(object)

    def __init__(self, choice: BenchChoice, theme: Theme) -> None:
        super().__init__()
        self._choice = choice
        self._file: Path | None = None
        self.fields: dict[str, QLineEdit] = {}
        self.named = label("", "muted", wrap=True)
        self.field = push("Calibrate the field", "primary")
        self.progress = label("", "muted", wrap=True)
        self.loop = SmallPlot(theme)
        self.loop.hide()
        self.findings = label("", "", wrap=True)
        self.findings.hide()
        self.use = push("Use it: save a bench file with this calibration …", "primary")
        self.use.hide()
        self.force = push("Prepare the force check")
        self._lay_out()
        self.show_choice()
        self.field.clicked.connect(self.field_asked)
        self.force.clicked.connect(self.force_asked)
        self.use.clicked.connect(lambda: self.use_asked.emit(self._file))

    def show_choice(self) -> None:
        """Fill the geometry from the choice."""
        for key, edit in self.fields.items():
            edit.setText(self._choice.magnet.get(key, ""))
        file = self._choice.magnet.get("calibration", "")
        self.named.setText(
            f"The field comes from {file}; the field per ampere below is not used."
            if file
            else "The field per ampere is assumed to be the same at every current."
        )

    def take(self) -> None:
        """Put the geometry into the choice."""
        for key, edit in self.fields.items():
            self._choice.magnet[key] = edit.text().strip()

    def show_progress(self, text: str, *, busy: bool) -> None:
        """Say how far the calibration is."""
        say(self.progress, text)
        self.field.setEnabled(not busy)
        if busy:
            self.findings.hide()
            self.use.hide()

    def show_loop(self, loop: FloatArray) -> None:
        """Show the readings so far, shape (n, 2): A and T."""
        self.loop.show_plot(loop_plot(loop))
        self.loop.setVisible(loop.shape[0] > 2)

    def show_conclusion(self, found: ShownConclusion) -> None:
        """Show slope, loop and uncertainty, and offer the file."""
        self._file = found.calibration
        self.findings.setText("\n".join(found.statements))
        self.findings.show()
        self.use.setVisible(found.calibration is not None)

    def _lay_out(self) -> None:
        grid = QGridLayout()
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(6)
        for number, (key, words) in enumerate(MAGNET):
            self.fields[key] = line_edit(words)
            at, side = divmod(number, 2)
            grid.addWidget(label(words), at, 2 * side)
            grid.addWidget(self.fields[key], at, 2 * side + 1)
        grid.setColumnStretch(1, 1)
        grid.setColumnStretch(3, 1)
        about = label(
            "Take the magnet away and put the probe in its place. The core is "
            "demagnetised, then both branches of the field are read against the "
            "current, and a dated calibration file with its uncertainty is kept.",
            "muted",
            wrap=True,
        )
        run = row(self.field, (self.progress, 1), spacing=12)
        why = label(
            "Holds some currents and compares Eq. (2) with your own reading of the "
            "force. Table 1 prints an A2 ten times too large for a 15 mm core.",
            "muted",
            wrap=True,
        )
        check = row(self.force, (why, 1), spacing=12)
        use = row(self.use, STRETCH)
        results = (self.loop, self.findings, use)
        parts = (grid, self.named, line(), about, run, *results, line(), check, STRETCH)
        column(self, *parts, spacing=10)
