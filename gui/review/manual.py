"""The bench by hand: coil within its limits, field, settings of the oscilloscope."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import (
    QGridLayout,
    QHBoxLayout,
    QLineEdit,
    QSlider,
    QWidget,
)

from gui.look.theme import Theme
from gui.parts import column, label, line, panel, push
from gui.review.scope_inputs import ScopeInputs
from gui.session.live_manual import LiveManual
from gui.state import CoilView, Snapshot, State, Truth, milliamperes, truth
from tactile_lab.errors import QuantityError
from tactile_lab.quantity import parse, show
from tactile_lab.scene.bench_file import BenchSpec

SIDES = (
    Qt.AlignmentFlag.AlignLeft,
    Qt.AlignmentFlag.AlignHCenter,
    Qt.AlignmentFlag.AlignRight,
)


class ManualView(QWidget):
    """Set a current, see what is read back, read the field, set the scope's inputs."""

    begun = Signal()
    set_asked = Signal(float)
    off_asked = Signal()
    checked = Signal()
    field_asked = Signal()

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._limit = 0.0
        self._gain = 0.0
        self._no_meter = "No bench."
        self.begin = push("Take the coil by hand …")
        self.current = QLineEdit("0 mA")
        self.current.setAccessibleName("Coil current to set")
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setRange(-100, 100)
        self.slider.setAccessibleName("Coil current to set, percent of the limit")
        self._scale = [label("", "small") for _ in range(3)]
        self.set = push("Set", "primary")
        self.off = push("Coil off", "danger")
        self._problem = label("", "error", wrap=True)
        self._problem.hide()
        self._now = label("—", "value")
        self._force = label("", "muted")
        self._limits = label("", "muted", wrap=True)
        self._field = label("not read", "value")
        self.read = push("Read")
        self.inputs = ScopeInputs()
        self.check = push("Ask the instruments again")
        self._lay_out()
        self.begin.clicked.connect(self.begun)
        self.set.clicked.connect(self._set)
        self.current.returnPressed.connect(self._set)
        self.off.clicked.connect(self.off_asked)
        self.check.clicked.connect(self.checked)
        self.read.clicked.connect(self.field_asked)
        self.slider.sliderMoved.connect(self._slid)

    def show_bench(self, spec: BenchSpec | None) -> None:
        """Show limits and inputs of another bench."""
        self.inputs.show_bench(spec)
        if spec is None:
            self._no_meter = "No bench."
            return
        meter = spec.field_meter
        self._no_meter = ""
        if meter is None:
            self._no_meter = "This bench has no teslameter of its own."
        elif meter.driver == "manual":
            self._no_meter = "A person reads this bench's teslameter."
        self._gain = spec.magnet.newtons_per_ampere
        if spec.coil is not None:
            limits = spec.coil.limits
            self._limit = limits.current
            for mark, part in zip(self._scale, (-1.0, 0.0, 1.0), strict=True):
                mark.setText(show(part * limits.current, "A"))
            self._limits.setText(
                f"Limits: {show(limits.current, 'A')}, {show(limits.slew, 'A/s')}, "
                f"{show(limits.continuous, 'A')} continuous. "
                f"{show(self._gain, 'N/A')} at this distance."
            )

    def render_snapshot(
        self, snapshot: Snapshot, field: float | None, *, reading: bool = False
    ) -> None:
        """Show read-backs; allow what the state allows; `reading`: the meter is."""
        on = snapshot.manual
        idle = snapshot.state is State.READY
        self.begin.setVisible(not on)
        self.begin.setEnabled(idle and snapshot.coil is not None)
        reason = ""
        if not idle:
            reason = "A run has the bench." if snapshot.bench else "No bench."
        elif snapshot.coil is None:
            reason = "No coil source."
        self.begin.setToolTip(reason)
        self.read.setEnabled(idle and not self._no_meter and not reading)
        self.read.setToolTip(self._no_meter)
        self.inputs.allow(idle and not on, reason)
        for widget in (self.current, self.slider, self.set, self.off):
            widget.setEnabled(on)
        if not on:
            self.current.setModified(False)
        self.check.setEnabled(idle and not on)
        self._show_coil(snapshot.coil)
        words = "not read" if field is None else show(round(field, 6), "T", 4)
        self._field.setText("reading …" if reading else words)

    @property
    def now(self) -> str:
        """The current as it was read back last."""
        return self._now.text()

    @property
    def doing(self) -> str:
        """What the coil does, in words."""
        return self._force.text()

    def follow(self, manual: LiveManual) -> None:
        """Show what was asked of the coil, unless somebody is about to ask anew."""
        asked = manual.current
        if manual.alive and not manual.opened:
            self._force.setText("opening the source …")
        edited = self.current.isModified() or self.current.hasFocus()
        if not edited and not self.slider.isSliderDown():
            self.current.setText(show(asked, "A") if asked else "0 mA")
            self.slider.setValue(round(100 * asked / self._limit) if self._limit else 0)

    def _show_coil(self, coil: CoilView | None) -> None:
        self._now.setText("—" if coil is None else milliamperes(coil.current))
        what = truth(State.READY, coil)
        if what is Truth.UNKNOWN:
            self._force.setText("state unknown: look at the source")
        elif coil is None or coil.current is None or coil.output is not True:
            self._force.setText("output off" if coil is not None else "")
        else:
            force = show(round(coil.current * self._gain, 6), "N", 3)
            self._force.setText(f"read back · drives {force}")

    def _slid(self, percent: int) -> None:
        self.current.setText(show(self._limit * percent / 100, "A", 3))
        self.current.setModified(True)

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
        self.current.setModified(False)
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
        chosen = QGridLayout()
        chosen.setVerticalSpacing(0)
        chosen.addWidget(self.slider, 0, 0, 1, 3)
        for place, (mark, side) in enumerate(zip(self._scale, SIDES, strict=True)):
            chosen.addWidget(mark, 1, place, side)
            chosen.setColumnStretch(place, 1)
        whole.addLayout(chosen)
        whole.addWidget(self._problem)
        whole.addWidget(self.off)
        whole.addWidget(self._limits)
        whole.addWidget(line())
        whole.addWidget(label("Field", "title"))
        meter = QHBoxLayout()
        meter.addWidget(self._field, 1)
        meter.addWidget(self.read)
        whole.addLayout(meter)
        whole.addWidget(line())
        whole.addWidget(label("Oscilloscope inputs", "title"))
        whole.addWidget(self.inputs)
        whole.addWidget(line())
        whole.addWidget(self.check)
        whole.addStretch(1)
