"""The bench by hand: coil within its limits, field, settings of the oscilloscope."""

from __future__ import annotations

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QGridLayout, QSlider, QWidget

from gui.look.theme import Theme
from gui.parts import STRETCH, column, label, line, line_edit, panel, push, row, say
from gui.review.scope_inputs import ScopeInputs
from gui.session.live_manual import LiveManual
from gui.state import (
    CoilKnowledge,
    CoilView,
    Snapshot,
    WindowState,
    ago,
    milliamperes,
    truth,
)
from tactile_lab.errors import QuantityError
from tactile_lab.quantity import parse, show
from tactile_lab.scene.bench_file import BenchSpec

SIDES = (
    Qt.AlignmentFlag.AlignLeft,
    Qt.AlignmentFlag.AlignHCenter,
    Qt.AlignmentFlag.AlignRight,
)


class Slider(QSlider):
    """A slider; the wheel scrolls what it stands in, never its value."""

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel to the page."""
        event.ignore()


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
        self.current = line_edit("Coil current to set", text="0 mA")
        self.slider = Slider(Qt.Orientation.Horizontal)
        self.slider.setRange(-100, 100)
        self.slider.setAccessibleName("Coil current to set, percent of the limit")
        self._scale = [label("", "small") for _ in range(3)]
        self.set = push("Set", "primary")
        self.off = push("Coil off", "danger")
        self._problem = label("", "error", wrap=True)
        self._problem.hide()
        self.now = label("—", "value")
        self.force = label("", "muted")
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
        self.slider.actionTriggered.connect(self._slid)

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
        idle = snapshot.state is WindowState.READY
        taken = on and self.begin.hasFocus()
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
        if taken:  # who took the coil by a key wants to set it
            self.current.setFocus()
            self.current.selectAll()
        if not on:
            self.current.setModified(False)
        self.check.setEnabled(idle and not on)
        self._show_coil(snapshot.coil)
        words = "not read" if field is None else show(round(field, 6), "T", 4)
        self._field.setText("reading …" if reading else words)

    def follow(self, manual: LiveManual) -> None:
        """Show what was asked of the coil, unless somebody is about to ask anew."""
        asked = manual.current
        if not manual.alive:
            say(self._problem, "")  # the entry it was of is gone
        elif not manual.opened:
            self.force.setText("opening the source …")
        edited = self.current.isModified() or self.current.hasFocus()
        if not edited and not self.slider.isSliderDown():
            self.current.setText(show(asked, "A") if asked else "0 mA")
            self.slider.setValue(round(100 * asked / self._limit) if self._limit else 0)

    def _show_coil(self, coil: CoilView | None) -> None:
        what = truth(WindowState.READY, coil)
        known = None if what is CoilKnowledge.UNKNOWN else coil
        self.now.setText("—" if known is None else milliamperes(known.current))
        if what is CoilKnowledge.UNKNOWN:
            self.force.setText("state unknown: look at the source")
        elif coil is not None and what is CoilKnowledge.WAS_OFF:
            self.force.setText(f"output off, read back {ago(coil)}")
        elif coil is None or coil.output is not True:
            self.force.setText("output off" if coil is not None else "")
        elif coil.current is None:
            self.force.setText("switched on, not read back")
        else:
            force = show(round(coil.current * self._gain, 6), "N", 3)
            self.force.setText(f"read back · drives {force}")

    def _slid(self) -> None:
        """Offer what the slider was moved to, by pointer or keys."""
        percent = self.slider.sliderPosition()
        self.current.setText(show(self._limit * percent / 100, "A", 3))
        self.current.setModified(True)

    def _set(self) -> None:
        try:
            value = parse(self.current.text(), "A")
        except QuantityError as error:
            say(self._problem, str(error))
            return
        if abs(value) > self._limit:
            limit = show(self._limit, "A")
            say(self._problem, f"{show(value, 'A')} is beyond the limit of {limit}.")
            return
        say(self._problem, "")
        self.current.setModified(False)
        self.slider.setValue(round(100 * value / self._limit) if self._limit else 0)
        self.set_asked.emit(value)

    def _lay_out(self) -> None:
        card = panel("card")
        column(
            card, label("Current", "small"), self.now, self.force, margin=12, spacing=2
        )
        chosen = QGridLayout()
        chosen.setVerticalSpacing(0)
        chosen.addWidget(self.slider, 0, 0, 1, 3)
        for place, (mark, side) in enumerate(zip(self._scale, SIDES, strict=True)):
            chosen.addWidget(mark, 1, place, side)
            chosen.setColumnStretch(place, 1)
        asked = row((self.current, 1), self.set)
        coil = (card, self.begin, asked, chosen, self._problem, self.off, self._limits)
        meter = row((self._field, 1), self.read)
        parts = (
            *(label("Coil by hand", "title"), *coil, line()),
            *(label("Field", "title"), meter, line()),
            *(label("Oscilloscope inputs", "title"), self.inputs, line()),
            *(self.check, STRETCH),
        )
        self.rows = column(self, *parts, spacing=9)
