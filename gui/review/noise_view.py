"""The noise of what is monitored: its density, and what the mains put into it."""

from __future__ import annotations

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QWidget

from gui.look.theme import Theme
from gui.parts import (
    STRETCH,
    Segments,
    column,
    label,
    row,
    scrolling,
    stack,
    with_gutter,
)
from gui.plots.numbers import unbroken
from gui.plots.small_plot import SmallPlot
from gui.session.session import Session
from tactile_lab.analysis.noise import MAINS, Noise
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.jobs import noise_of_monitor
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import show

AGAIN = 2000
"""Milliseconds from one spectrum to the next."""

SIGNALS = ("V_C1", "V_C2", "V_K")

HIGHEST = 420
"""Of the plot, px."""

POINTS = 300
"""Of the density as it is drawn."""

FIRST = "No spectrum yet. The first comes once\nenough of the signal was watched."


class NoiseView(QWidget):
    """Shown while the sensor is monitored; asks the engine every two seconds."""

    def __init__(self, theme: Theme) -> None:
        super().__init__()
        self._session: Session | None = None
        self._asked = False
        title = label("Noise", "title")
        self.signals = Segments(list(SIGNALS), "Signal whose noise is shown")
        self.signals.choose(0)
        self.plot = SmallPlot(theme, FIRST)
        self.plot.setMaximumHeight(HIGHEST)
        self.said = label("", "", wrap=True)
        head = row(title, STRETCH, self.signals)
        inner = QWidget()
        parts = (self.plot, 1), self.said, STRETCH
        page = with_gutter(scrolling(inner), column(inner, *parts, spacing=9))
        stack(self, (head, page), page, spacing=9)
        self.signals.group.idClicked.connect(self._ask)
        timer = QTimer(self)
        timer.timeout.connect(self._ask)
        timer.start(AGAIN)

    def follow(self, session: Session) -> None:
        """Show the noise of what this session monitors."""
        self._session = session

    def show_noise(self, signal: str, found: Noise | None, problem: str = "") -> None:
        """Show the spectrum of a signal, or why there is none."""
        self.plot.nothing = problem or FIRST
        self.plot.show_plot(None if found is None else spectrum_plot(signal, found))
        self.said.setText("" if found is None else unbroken(told(signal, found)))

    def _ask(self) -> None:
        session = self._session
        task = None if session is None else session.monitor.task
        if session is None or task is None or self._asked or not self.isVisible():
            return
        self._asked = True
        signal = SIGNALS[self.signals.chosen]

        def answered(reply: Reply[Noise]) -> None:
            self._asked = False
            self.show_noise(signal, reply.value, reply.problem)

        session.link.ask(answered, noise_of_monitor, task.number, signal)


def told(signal: str, found: Noise) -> str:
    """What a spectrum says, and how it was obtained."""
    words = [
        f"{signal}: {show(found.rms, 'V', 3)} rms less the mean, over the last "
        f"{found.seconds:.2g} s ({found.segments} segments, Hann, bins of "
        f"{found.resolution:.2g} Hz)."
    ]
    for mains in MAINS:
        lines = [one for one in found.lines if one.mains == mains]
        sizes = ", ".join(
            f"{one.frequency:g} Hz {show(one.rms, 'V', 2)}" for one in lines
        )
        words.append(
            f"Mains of {mains:g} Hz: " + (f"{sizes} rms." if lines else "no line.")
        )
    return "\n".join(words)


def spectrum_plot(signal: str, found: Noise) -> Plot:
    """Density against frequency, with the lines of the mains marked by their size."""
    frequency, density = found.thinned(POINTS)
    ends = 10.0 ** np.floor(np.log10(density.min())), 2 * float(density.max())
    lines = found.lines
    at = [one.frequency for one in lines]
    nearest = [abs(found.frequency - f).argmin() for f in at]
    marks = Series(
        x=at,
        y=[found.density[i] for i in nearest],
        mark="points",
        colour="ink",
        name="mains" if lines else "",
        texts=tuple(f"{f:g} Hz" if n < 2 else "" for n, f in enumerate(at)),
    )
    trace = Series(x=frequency, y=density, name=signal, colour=signal)
    return Plot(
        name="noise",
        caption="Density of the noise (Welch), in bins even in the logarithm of the "
        "frequency.",
        x_label="Frequency",
        x_unit="Hz",
        x_prefix="",
        x_log=True,
        panels=(
            Panel(
                label="Noise density",
                unit="V/√Hz",
                prefix="µ",
                log=True,
                series=(trace, marks),
                limits=ends,
            ),
        ),
    )
