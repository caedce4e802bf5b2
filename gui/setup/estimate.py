"""What the next run will cost: time, samples, disk, heat of the coil."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtWidgets import QGridLayout, QLabel, QWidget

from gui.parts import label
from gui.state import minutes
from tactile_lab.quantity import show

if TYPE_CHECKING:
    from tactile_lab.planning.estimate import Cost


def words_of(estimate: Cost) -> tuple[str, str, str, str]:
    """Run time, samples, disk and share of the coil's heat budget, for a person."""
    heat = 100 * estimate.heat / estimate.heat_budget
    return (
        minutes(estimate.duration),
        show(estimate.samples_stored, "", 3),
        show(estimate.disk, "B", 3),
        f"{heat:.0f} %",
    )


class EstimateView(QWidget):
    """Four numbers with their names above."""

    def __init__(self) -> None:
        super().__init__()
        grid = QGridLayout(self)
        grid.setContentsMargins(0, 2, 0, 2)
        grid.setHorizontalSpacing(8)
        grid.setVerticalSpacing(0)
        self._values: list[QLabel] = []
        for column, name in enumerate(("Run time", "Samples", "Disk", "Coil heat")):
            value = label("—", "strong")
            value.setAccessibleName(name)
            grid.addWidget(label(name, "small"), 0, column)
            grid.addWidget(value, 1, column)
            self._values.append(value)

    def show_estimate(self, estimate: Cost | None) -> None:
        """Show an estimate, or that there is none."""
        if estimate is None:
            for value in self._values:
                value.setText("—")
            return
        for value, text in zip(self._values, words_of(estimate), strict=True):
            value.setText(text)
        self._values[3].setToolTip(
            f"{estimate.heat:.2g} of {estimate.heat_budget:.3g} A²s; peak current "
            f"{show(estimate.peak_current, 'A', 3)}"
        )
        self._values[2].setToolTip(
            f"about {show(estimate.disk, 'B', 3)} compressed, "
            f"{show(estimate.disk_raw, 'B', 3)} before"
        )
