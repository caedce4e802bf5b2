"""Free running without force, to watch the sensor while V_GS is trimmed by hand."""

from __future__ import annotations

import math
from typing import ClassVar

from pydantic import Field

from tactile_lab.analysis.error_budget import ErrorBudget
from tactile_lab.conclusion import Conclusion
from tactile_lab.errors import LimitError
from tactile_lab.measurement import Measurement
from tactile_lab.quantity import Duration, plus_minus, show
from tactile_lab.trial import Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

MOST_PARTS = 10_000
"""Parts that one run may have."""


class NoForce(Protocol):
    """No force at all: V_C1, V_C2 and the rate, live, until stopped or `duration`."""

    name: ClassVar[str] = "monitor"
    title: ClassVar[str] = "Monitor"
    signals: ClassVar[tuple[str, ...]] = ("V_C1", "V_C2", "V_K", "spikes")
    counts: ClassVar[bool] = False

    duration: Duration = Field(default=600.0, description="Ends by itself after this")
    part: Duration = Field(default=10.0, description="Length of one trial")

    def trials(self) -> Trials:
        """Equal parts without force."""
        if self.duration > MOST_PARTS * self.part:
            raise LimitError(
                f"{show(self.duration, 's')} in parts of {show(self.part, 's')} are "
                f"more than {MOST_PARTS} parts. Lengthen protocol.part, or shorten "
                "protocol.duration."
            )
        left, number = self.duration, 0
        while left > 1e-9:
            length, number = min(self.part, left), number + 1
            yield Trial(
                force=Waveform.constant(0.0),
                duration=length,
                label=f"part {number}",
                level=0.0,
            )
            left -= length

    def conclude(self, run: Measurement) -> Conclusion:
        """How far the sensor sits from its threshold."""
        trace = run.trace("V_C1")
        if run.circuit is None or trace is None or not trace.time.size:
            return Conclusion()
        end, critical = float(trace.time[-1]), run.circuit.critical_V_C1
        distance = run.mean("V_C1", end - 1.0, end) - critical
        # an offset of its channel, its steps, and where the threshold may lie
        converter = math.hypot(trace.code or 0.0, run.step_bias("V_C1"))
        moved = run.left_open(run.circuit, lambda other: other.critical_V_C1)
        budget = ErrorBudget("V", {"converter": converter, **moved})
        half = budget.whole
        where = "above" if distance > 0 else "below"
        tells = f"the sensor {'is silent' if distance > 0 else 'fires'} at rest"
        if abs(distance) <= half:
            tells = "whether the sensor fires at rest cannot be told"
        said = (
            f"V_C1 ended {plus_minus(abs(distance), half, 'V')} {where} the critical "
            f"{show(critical, 'V')} (95 %: one code of offset of V_C1, its converter's "
            "steps, and what the bench states of the follower's input bias and the "
            f"temperature; the circuit as believed): {tells}."
        )
        values = {
            "distance_to_threshold_V": distance,
            "distance_to_threshold_uncertainty_V_95": half,
        }
        return Conclusion((said,), values, budgets={"V_C1 to its critical": budget})
