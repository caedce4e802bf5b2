"""The waveform of the next run at a glance, with a play-head while it runs."""

from __future__ import annotations

import numpy as np

from gui.lanes.expected import Preview
from gui.lanes.paint import zigzag
from gui.look.theme import Theme
from gui.plots.axis import GuardedLine, stroke
from gui.plots.small_plot import SmallPlot
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.trace import Trace

HEIGHT = 118
WAIT = "computing the plan …"
FIRST = f"{WAIT}\n20 s longer the first time on a computer"
"""Until a plan has come: the model's code may have to be compiled."""

COLUMNS = 300
"""Columns of the plan that are drawn."""

LETTER, LONGEST = 0.033, 6
"""Width of a letter as a part of the plan's, and letters of the longest name told."""


class WaveformPreview(SmallPlot):
    """Force against time as it will be played, in mN and s."""

    def __init__(self, theme: Theme) -> None:
        self._head: float | None = None
        self._wait = FIRST
        super().__init__(theme, self._wait, HEIGHT)
        self.setProperty("role", "card")
        self.setAccessibleName("Force of the next run against time")

    def show_preview(self, preview: Preview | None, problem: str = "") -> None:
        """Show a plan, or why there is none."""
        planned = preview is not None and preview.length > 0
        self._wait = WAIT if planned else self._wait
        self.nothing = "" if problem or planned else self._wait
        self.setAccessibleDescription(problem)
        self.show_plot(_plan(preview) if preview is not None and planned else None)

    def show_head(self, time: float | None) -> None:
        """Put the play-head at run time `time` s; None takes it away."""
        if time != self._head:
            self._head = time
            self._move_head()

    def draw(self) -> None:
        """The plan, and the play-head on it."""
        super().draw()
        pen = stroke(self._theme.tokens.text, 1.5 * self.devicePixelRatio())
        self._line = GuardedLine(pen=pen)
        self._line.setZValue(10)
        for panel in self.panels:
            panel.box.addItem(self._line, ignoreBounds=True)
        self._move_head()

    def _move_head(self) -> None:
        self._line.setVisible(self._head is not None)
        self._line.setValue(self._head or 0.0)


def _plan(preview: Preview) -> Plot:
    """The force, and the level beyond each hold where there is room."""
    time, force = preview.force.time, preview.force.value
    drawn = zigzag(Trace.line(time, force).corners(COLUMNS))
    names: list[tuple[float, float, str]] = []
    taken = 0.0
    for hold in preview.holds:
        start, end = hold.held or (hold.start, hold.end)
        inside = (time >= start) & (time <= end)
        if hold.pause or not inside.any():
            continue
        far = np.argmax(np.abs(force[inside]))
        at, text = (start + end) / 2, hold.label.replace(" mN", "")
        half = LETTER * len(text) / 2 * preview.length
        room = taken <= at - half and at + half <= preview.length
        if room and force[inside][far] and len(text) <= LONGEST:
            names.append((at, float(force[inside][far]), text))
            taken = at + half + LETTER * preview.length
    at_, level, texts = zip(*names, strict=True) if names else ((), (), ())
    low, high = min(0.0, float(force.min())), max(float(force.max()), 1e-12)
    told = Series(x=at_, y=level, mark="text", colour="ink", texts=texts)
    series = (Series(x=drawn[0], y=drawn[1], mark="filled", colour="force"), told)
    limits = (1.25 * low, high + 0.25 * (high - low))
    panel = Panel(label="", unit="N", prefix="m", series=series, limits=limits)
    return Plot(
        name="preview", caption="", x_label="", x_unit="s", x_prefix="",
        panels=(panel,), x_limits=(0.0, preview.length),
    )  # fmt: skip
