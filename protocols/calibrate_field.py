"""Field of the electromagnet against current, both branches of its hysteresis."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.quantity import Duration, Pause
from tactile_lab.stimulus.demagnetise import demagnetising
from tactile_lab.stimulus.force import PushCurrent
from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

BEYOND, LEAST_BEYOND = 0.2, 0.2
"""The current turns outside the range by this part of it, at least by so many A: twice
the half-width of a soft core's loop, so that both branches are settled in the range."""
REPEATED = 3
"""Steps of the falling branch that are read again at the end."""
RAMP = 0.5
"""Time in which the current goes from one step to the next, s: it never overshoots."""


class CalibrateField(Protocol):
    """Demagnetise, condition, then step the current down and up and read the field.

    At the end the first steps are read again: the drift. The winding's resistance tells
    how much it warmed. Take the NdFeB magnet away first: it adds 163 mT. Each step
    keeps the direction it is approached from, because the two branches differ.
    `analysis.field_calibration` makes the calibration file of the readings.
    """

    name: ClassVar[str] = "calibrate_field"
    title: ClassVar[str] = "Field calibration"
    signals: ClassVar[tuple[str, ...]] = ("coil_current", "field")

    most: PushCurrent = Field(default=1.0, description="Largest calibrated current")
    points: int = Field(
        default=21, ge=5, le=401, description="Steps on each branch, ends included"
    )
    settle: Pause = Field(default=0.3, description="Wait after each step")
    dwell: Duration = Field(default=1.0, description="Reading time on each step")
    loops: int = Field(default=2, ge=0, le=10, description="Conditioning loops")

    def trials(self) -> Trials:
        """Pauses for preparation, then one trial per step."""
        turn = self.most + max(BEYOND * self.most, LEAST_BEYOND)
        yield demagnetising(turn)
        quarter = 2.0
        loop = Waveform(
            np.array([0.0, 1.0, 3.0, 4.0]) * quarter, np.array([0.0, turn, -turn, 0.0])
        )
        for number in range(self.loops):
            yield self._move(f"conditioning {number + 1}", loop)
        up, last = np.linspace(-self.most, self.most, self.points), 0.0
        for branch, levels, start in (
            ("falling", up[::-1], turn),
            ("rising", up, -turn),
        ):
            yield self._move("turn", Waveform.through([(0.0, last), (2.0, start)]))
            last = start
            for level in levels.tolist():
                yield self._step(last, level, branch)
                last = level
        # the first steps once more, by the same way: what differs is drift
        yield self._move("turn", Waveform.through([(0.0, last), (2.0, turn)]))
        last = turn
        for level in up[::-1][:REPEATED].tolist():
            yield self._step(last, level, "again")
            last = level
        yield self._move("back to 0 A", Waveform.through([(0.0, last), (2.0, 0.0)]))

    def _move(self, label: str, current: Waveform) -> Trial:
        """A move of the current that is neither streamed nor stored."""
        nothing = Waveform.constant(0.0)
        return Trial(force=nothing, current=current, label=label, pause=True)

    def _step(self, last: float, level: float, branch: str) -> Trial:
        begin = RAMP + self.settle
        end = begin + self.dwell
        return Trial(
            force=Waveform.constant(0.0),
            current=Waveform.through([(0.0, last), (RAMP, level), (end, level)]),
            label=f"{branch} {level * 1e3:.0f} mA".replace("-", "−"),
            hold=(begin, end),
        )
