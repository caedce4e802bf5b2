"""The coil by hand, within its limits; the field and the scope's settings beside it."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QGridLayout, QHBoxLayout, QLineEdit, QSlider, QWidget

from gui.look.theme import Theme
from gui.parts import column, label, line, panel, push
from gui.state import CoilView, Snapshot, State, milliamperes
from tactile_lab.errors import QuantityError
from tactile_lab.quantity import parse, show
from tactile_lab.scene.bench_file import BenchSpec


class ManualView(QWidget):
    """Set a current, see what is read back, see how the scope is wired."""

    begun = Signal()
    set_asked = Signal(float)
    off_asked = Signal()
    checked = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._limit = 0.0
        self._gain = 0.0
        self.begin = push("Take the coil by hand …")
        self.current = QLineEdit("0 mA")
        self.current.setAccessibleName("Coil current to set")
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(-100, 100)
        self.slider.setAccessibleName("Coil current to set, percent of the limit")
        self.set = push("Set", "primary")
        self.off = push("Coil off", "danger")
        self._problem = label("", "error", wrap=True)
        self._problem.hide()
        self._now = label("—", "value")
        self._force = label("", "muted")
        self._limits = label("", "muted", wrap=True)
        self._field = label("not read", "value")
        self._wiring = QGridLayout()
        self.check = push("Ask the instruments again")
        self._lay_out()
        self.begin.clicked.connect(self.begun)
        self.set.clicked.connect(self._set)
        self.current.returnPressed.connect(self._set)
        self.off.clicked.connect(self.off_asked)
        self.check.clicked.connect(self.checked)
        self.slider.sliderMoved.connect(self._slid)

    def show_bench(self, spec: BenchSpec | None) -> None:
        """Show limits and wiring of another bench."""
        while (item := self._wiring.takeAt(0)) is not None:
            widget = item.widget()
            if widget is not None:
                widget.deleteLater()
        if spec is None:
            return
        self._gain = spec.magnet.newtons_per_ampere
        if spec.coil is not None:
            limits = spec.coil.limits
            self._limit = limits.current
            self._limits.setText(
                f"Limits: {show(limits.current, 'A')}, {show(limits.slew, 'A/s')}, "
                f"{show(limits.continuous, 'A')} for ever. "
                f"{show(self._gain, 'N/A')} at this distance."
            )
        channels = spec.scope.channels if spec.scope is not None else ()
        for row, channel in enumerate(channels):
            texts = (
                channel.input,
                channel.signal,
                f"±{show(channel.range, 'V')}"
                + (f" at {show(-channel.offset, 'V')}" if channel.offset else ""),
                channel.coupling,
            )
            for where, text in enumerate(texts):
                role = "strong" if where == 0 else "" if where == 1 else "muted"
                self._wiring.addWidget(label(text, role), row, where)

    def render_snapshot(self, snapshot: Snapshot, field: float | None) -> None:
        """Show read-backs; allow what the state allows."""
        on = snapshot.manual
        idle = snapshot.state is State.READY
        self.begin.setVisible(not on)
        self.begin.setEnabled(idle and snapshot.coil is not None)
        reason = (
            ""
            if idle
            else "A run has the coil."
            if snapshot.coil
            else "No coil source."
        )
        self.begin.setToolTip(reason)
        for widget in (self.current, self.slider, self.set, self.off):
            widget.setEnabled(on)
        self.check.setEnabled(idle and not on)
        self._show_coil(snapshot.coil)
        self._field.setText("not read" if field is None else show(round(field, 6), "T"))

    def _show_coil(self, coil: CoilView | None) -> None:
        self._now.setText("—" if coil is None else milliamperes(coil.current))
        if coil is None or coil.current is None or coil.output is not True:
            self._force.setText("output off" if coil is not None else "")
        else:
            force = show(round(coil.current * self._gain, 6), "N", 3)
            self._force.setText(f"read back · drives {force}")

    def _slid(self, percent: int) -> None:
        self.current.setText(show(self._limit * percent / 100, "A", 3))

    def _set(self) -> None:
        try:
            value = parse(self.current.text(), "A")
        except QuantityError as error:
            self._say(str(error))
            return
        if abs(value) > self._limit:
            self._say(
                f"{show(value, 'A')} is beyond the limit of {show(self._limit, 'A')}."
            )
            return
        self._say("")
        self.slider.setValue(round(100 * value / self._limit) if self._limit else 0)
        self.set_asked.emit(value)

    def _say(self, problem: str) -> None:
        self._problem.setText(problem)
        self._problem.setVisible(bool(problem))

    def _lay_out(self) -> None:
        whole = column(self, spacing=9)
        whole.addWidget(label("Coil by hand", "title"))
        card = panel("card")
        inside = column(card, margin=12, spacing=2)
        inside.addWidget(label("Current", "small"))
        inside.addWidget(self._now)
        inside.addWidget(self._force)
        whole.addWidget(card)
        whole.addWidget(self.begin)
        row = QHBoxLayout()
        row.addWidget(self.current, 1)
        row.addWidget(self.set)
        whole.addLayout(row)
        whole.addWidget(self.slider)
        whole.addWidget(self._problem)
        whole.addWidget(self.off)
        whole.addWidget(self._limits)
        whole.addWidget(line())
        whole.addWidget(label("Field", "title"))
        whole.addWidget(self._field)
        whole.addWidget(line())
        whole.addWidget(label("Oscilloscope inputs", "title"))
        self._wiring.setHorizontalSpacing(12)
        self._wiring.setVerticalSpacing(4)
        whole.addLayout(self._wiring)
        whole.addWidget(self.check)
        whole.addStretch(1)
