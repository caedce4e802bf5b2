"""The bar above the lanes while the sensor is monitored: its state, and Record."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QFrame, QLabel, QSizePolicy, QWidget

from gui.lanes.lane import title_of
from gui.parts import STRETCH, bar, column, filled, label, push, set_role
from gui.plots.numbers import number
from tactile_lab.engine.sensor import SensorState
from tactile_lab.measurement import BETWEEN_SAMPLES, TOO_FAST

RATES = {
    "": "Rate",
    BETWEEN_SAMPLES: "Rate: spikes missed",
    TOO_FAST: "Rate: too fast",
}
"""The title of the rate, by why there is none."""

WIDE = 760
"""Width from which on there is room for all of it, px."""


class MonitorBar(QFrame):
    """V_C1, V_C2, rate and the distance to the threshold, for trimming V_GS by hand."""

    record_asked = Signal()
    closed = Signal()

    def __init__(self) -> None:
        super().__init__()
        self.setAccessibleName("Monitor")
        whole = bar(self, (14, 5, 10, 5), 20)
        self._values: dict[str, QLabel] = {}
        boxes: list[QWidget] = []
        titles: list[QLabel] = []
        for name in ("V_C1", "V_C2", "Rate", "To the threshold"):
            box, shown = QFrame(), title_of(name)
            value, title = label("—", "value"), label(shown, "small")
            value.setAccessibleName(name)
            column(box, title, value, spacing=0)
            self._values[name] = value
            whole.addWidget(box)
            boxes.append(box)
            titles.append(title)
        *_, self._rate, self._threshold = titles
        self._threshold.setMinimumWidth(132)
        self.side = label("", "pill")
        self.side.setSizePolicy(QSizePolicy.Policy.Fixed, QSizePolicy.Policy.Fixed)
        self._kept = label("", "muted")
        tip = "Keep what was seen, up to the last 60 s, as a run"
        self.record = push("Record", tip=tip)
        self.record.clicked.connect(self.record_asked)
        off = push("Stop watching")
        off.clicked.connect(self.closed)
        filled(whole, (self.side, STRETCH, self._kept, self.record, off))
        self._minor = [self._kept, *boxes[:-1]]
        self.hide()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Say less where there is less room: the lanes have voltages and rate, too."""
        super().resizeEvent(event)
        for part in self._minor:
            part.setVisible(event.size().width() >= WIDE)

    @property
    def words(self) -> str:
        """What the bar says, in one line."""
        values = ", ".join(f"{n} {v.text()}" for n, v in self._values.items())
        return f"{values}, {self.side.text()}"

    def show_sensor(self, now: SensorState, *, recording: bool) -> None:
        """Show where the sensor stands; whether the last minute is being kept."""
        distance = now.distance
        for name, text in (
            ("V_C1", _volts(now.V_C1)),
            ("V_C2", _volts(now.V_C2)),
            ("Rate", "—" if now.unrated else f"{number(now.rate, 2)} Hz"),
            (
                "To the threshold",
                "—" if distance is None else f"{number(1e3 * abs(distance), 0)} mV",
            ),
        ):
            self._values[name].setText(text)
        self._rate.setText(RATES[now.unrated])
        self._rate.setToolTip(now.unrated)
        critical = f" {now.critical_V_C1:.3f} V"
        if distance is None:
            self.side.setText("opening the oscilloscope …")
            set_role(self.side, "pill")
        elif distance > 0:
            self._threshold.setText(f"Above threshold{critical}")
            self.side.setText("silent")
            set_role(self.side, "pill-ok")
        else:
            self._threshold.setText(f"Below threshold{critical}")
            self.side.setText("fires")
            set_role(self.side, "pill-warn")
        self._kept.setText(
            "coil off" if distance is None else f"coil off · {now.held:.0f} s held"
        )
        self.record.setText("Recording …" if recording else "Record")
        self.record.setEnabled(distance is not None and not recording)
        self.show()


def _volts(value: float | None) -> str:
    return "—" if value is None else f"{number(value, 3)} V"
