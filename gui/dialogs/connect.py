"""The connect dialog: instruments, wiring, calibration; saves a bench file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import (
    QFileDialog,
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QStackedWidget,
    QTableWidget,
    QTableWidgetItem,
    QWidget,
)

from gui.dialogs.bench_text import Choice, save_bench, start_choice
from gui.dialogs.instruments import Instruments
from gui.dialogs.overlay import Overlay
from gui.parts import Segments, column, label, push
from gui.session.messages import Level
from tactile_lab.errors import TactileLabError

if TYPE_CHECKING:
    from gui.window import Window

COLUMNS = ("Input", "Signal", "Range", "Offset", "Shunt")
MAGNET = (
    ("r", "Distance magnet to pole face"),
    ("A1", "Area of the magnet"),
    ("A2", "Area of the core"),
    ("B1", "Field of the magnet"),
    ("B2_per_ampere", "Field of the coil"),
)


class Wiring(QWidget):
    """What is connected to which input, and the geometry of the magnet."""

    def __init__(self, choice: Choice) -> None:
        super().__init__()
        self._choice = choice
        self.table = QTableWidget(len(choice.channels), len(COLUMNS))
        self.table.setAccessibleName("Oscilloscope inputs")
        self.table.setHorizontalHeaderLabels(list(COLUMNS))
        self.table.verticalHeader().hide()
        self.table.horizontalHeader().setStretchLastSection(True)
        self.table.setMinimumHeight(160)
        for row, cells in enumerate(choice.channels):
            for where, text in enumerate(cells):
                self.table.setItem(row, where, QTableWidgetItem(text))
        self.fields: dict[str, QLineEdit] = {}
        grid = QGridLayout()
        for row, (key, words) in enumerate(MAGNET):
            edit = QLineEdit(choice.magnet.get(key, ""))
            edit.setAccessibleName(words)
            self.fields[key] = edit
            grid.addWidget(label(words), row, 0)
            grid.addWidget(edit, row, 1)
        self.check = push("Prepare the wiring check")
        whole = column(self, spacing=10)
        whole.addWidget(
            label(
                "The wiring check makes a small push and says whether each channel is "
                "what this table says: swapped, inverted, open, wrong attenuation.",
                "muted",
                wrap=True,
            )
        )
        whole.addWidget(self.table)
        whole.addLayout(grid)
        whole.addWidget(self.check)

    def take(self) -> None:
        """Put the table and the geometry into the choice."""
        rows = []
        for row in range(self.table.rowCount()):
            cells = [self.table.item(row, where) for where in range(len(COLUMNS))]
            texts = [cell.text().strip() if cell else "" for cell in cells]
            rows.append((texts[0], texts[1], texts[2], texts[3], texts[4]))
        self._choice.channels = rows
        for key, edit in self.fields.items():
            self._choice.magnet[key] = edit.text().strip()


class Calibration(QWidget):
    """Which calibrations there are, and how to run them."""

    def __init__(self) -> None:
        super().__init__()
        self.field = push("Prepare the field calibration")
        self.force = push("Prepare the force check")
        whole = column(self, spacing=10)
        whole.addWidget(label("Field of the coil", "title"))
        whole.addWidget(
            label(
                "Demagnetises the core, runs conditioning loops, then both branches of "
                "the field against the current with the teslameter at the magnet's "
                "place. Results shows the loop while it runs; the report writes a "
                "dated calibration file that a bench file names under [magnet].",
                "",
                wrap=True,
            )
        )
        whole.addWidget(self.field)
        whole.addSpacing(10)
        whole.addWidget(label("Force", "title"))
        whole.addWidget(
            label(
                "Holds some currents and compares Eq. (2) with your own reading of the "
                "force. Table 1 prints an A2 ten times too large for a 15 mm core.",
                "",
                wrap=True,
            )
        )
        whole.addWidget(self.force)
        whole.addStretch(1)


class Connect(Overlay):
    """Three pages and one file."""

    def __init__(self, window: Window) -> None:
        super().__init__(window, 720)
        self._main = window
        self._choice = start_choice()
        self.instruments = Instruments(self._choice)
        self.wiring = Wiring(self._choice)
        self.calibration = Calibration()
        self.name = QLineEdit(self._choice.name)
        self.name.setAccessibleName("Name of the bench")
        self.problem = label("", "error", wrap=True)
        self.problem.hide()
        self._pages = QStackedWidget()
        for page in (self.instruments, self.wiring, self.calibration):
            self._pages.addWidget(page)
        self._tabs = Segments(["Instruments", "Wiring", "Calibration"], "Page")
        self._tabs.choose(0)
        self._tabs.group.idClicked.connect(self._pages.setCurrentIndex)
        self.save = push("Save bench file and connect …", "primary")
        self.open_file = push("Open bench file …")
        self.close_button = push("Close")
        self._lay_out()
        self.save.clicked.connect(self._ask_and_save)
        self.open_file.clicked.connect(self._ask_and_open)
        self.close_button.clicked.connect(self.hide)
        self.wiring.check.clicked.connect(lambda: self._prepare("wiring_check"))
        self.calibration.field.clicked.connect(lambda: self._prepare("calibrate_field"))
        self.calibration.force.clicked.connect(lambda: self._prepare("force_check"))

    def save_to(self, path: Path) -> bool:
        """Write the bench file and connect; whether it can be used."""
        choice = self.instruments.take()
        self.wiring.take()
        choice.name = self.name.text().strip() or "my bench"
        try:
            save_bench(choice, path)
        except (TactileLabError, OSError) as error:
            self._say(str(error))
            return False
        self._say("")
        self._main.session.log(Level.GOOD, "bench", f"Saved {path}")
        self.hide()
        self._main.session.connect_bench(str(path))
        return True

    def _ask_and_save(self) -> None:
        name, _ = QFileDialog.getSaveFileName(
            self, "Save the bench file", "bench.toml", "Bench files (*.toml)"
        )
        if name:
            self.save_to(Path(name))

    def _ask_and_open(self) -> None:
        name, _ = QFileDialog.getOpenFileName(
            self, "Open a bench file", "", "Bench files (*.toml)"
        )
        if name:
            self.hide()
            self._main.session.connect_bench(name)

    def _prepare(self, scene: str) -> None:
        self.hide()
        self._main.opening.open_scene(scene)

    def _say(self, problem: str) -> None:
        self.problem.setText(problem)
        self.problem.setVisible(bool(problem))
        self.open()

    def _lay_out(self) -> None:
        head = QHBoxLayout()
        head.addWidget(label("Connect instruments", "big"))
        head.addStretch(1)
        head.addWidget(self._tabs)
        named = QHBoxLayout()
        named.addWidget(label("Name of the bench"))
        named.addWidget(self.name, 1)
        foot = QHBoxLayout()
        foot.addWidget(self.open_file)
        foot.addStretch(1)
        foot.addWidget(self.close_button)
        foot.addWidget(self.save)
        whole = column(self.card, margin=22, spacing=14)
        whole.addLayout(head)
        whole.addLayout(named)
        whole.addWidget(self._pages, 1)
        whole.addWidget(self.problem)
        whole.addLayout(foot)
        self._pages.setMinimumHeight(400)


def show_connect(window: Window) -> None:
    """Open the dialog."""
    found = window.findChild(Connect)
    shown = found if isinstance(found, Connect) else Connect(window)
    shown.open()
    shown.instruments.scan.setFocus()
