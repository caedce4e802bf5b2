"""A vibration on an indentation at each of some frequencies: do spikes lock to it?"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator, Mapping
from functools import partial
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from tactile_lab.analysis.phase_locking import (
    PhaseLocking,
    phase_locking,
    phases_of,
)
from tactile_lab.analysis.spike_train import within
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion, Table
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, Unit, printed, show
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.stimulus.frequencies import (
    Frequency,
    by_label,
    check_rising,
    spaced,
)
from tactile_lab.stimulus.indentation import balanced, on_indentation, turned_over
from tactile_lab.trial import Trial, Trials

PushForce = Annotated[float, Unit("N", above=0.0)]


class Vibration(ForceProtocol):
    """A sine on top of a constant force, at each of some frequencies (as for RA, PC).

    Half of the presentations begin with its other half: see `turned_over`.
    Only a source that keeps time by itself follows it: see `[coil] way`.
    """

    name: ClassVar[str] = "vibration"
    title: ClassVar[str] = "Vibration"
    accuracy: ClassVar[float] = 0.02

    base: Force = Field(default=0.15, description="Force the vibration stands on")
    amplitude: PushForce = Field(default=0.08, description="Of the sine")
    lowest: Frequency = Field(default=10.0, description="First frequency")
    highest: Frequency = Field(default=100.0, description="Last frequency")
    count: int = Field(
        default=4, ge=1, le=200, title="Frequencies", description="Frequencies"
    )
    presentations_each: int = Field(
        default=6, ge=1, le=1000, description="Presentations of each frequency"
    )
    down: Duration = Field(default=0.1, description="Time down, and up again")
    lasts: Duration = Field(
        default=0.4, title="Duration", description="Time of the vibration"
    )
    rest: Pause = Field(default=2.0, description="Time at no force after each")

    @model_validator(mode="after")
    def _rising(self) -> Vibration:
        check_rising(self.lowest, self.highest)
        if self.lasts * self.lowest < 2.5:
            raise ValueError(
                f"lasts = {self.lasts:g} s holds fewer than 2.5 cycles of "
                f"{self.lowest:g} Hz; make it longer or the lowest frequency higher"
            )
        return self

    def frequencies(self) -> list[float]:
        """The frequencies, evenly spaced on a logarithmic scale, Hz."""
        return spaced(self.lowest, self.highest, self.count)

    def presentations(self) -> Trials:
        """All presentations of one frequency, then those of the next."""
        labels = {frequency: label for label, frequency in self._by_label.items()}
        for frequency in self.frequencies():
            forces = [
                on_indentation(
                    self.base,
                    partial(self._sine, frequency, amplitude),
                    down=self.down,
                    lasts=self.lasts,
                    rest=self.rest,
                    highest=frequency,
                )
                for amplitude in (self.amplitude, -self.amplitude)
            ]
            for number in range(self.presentations_each):
                force, hold = forces[turned_over(number)]
                yield Trial(force=force, label=labels[frequency], hold=hold)

    def _locking(self, run: Measurement) -> tuple[dict[float, PhaseLocking], list[str]]:
        return locking(run, self._by_label, self.presentations_each)

    @property
    def _by_label(self) -> dict[str, float]:
        return by_label(self.frequencies(), 4)

    @staticmethod
    def _sine(frequency: float, amplitude: float, time: FloatArray) -> FloatArray:
        return np.asarray(amplitude * np.sin(2 * np.pi * frequency * time))

    def conclude(self, run: Measurement) -> Conclusion:
        """Vector strength and phase at each frequency."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        found, missing = self._locking(run)
        if not found:
            return Conclusion(missing=tuple(missing))
        locked = [f for f, one in found.items() if one.locked]
        said = (
            "Spikes are not locked to the vibration at any frequency."
            if not locked
            else "Spikes are locked to the vibration at "
            + ", ".join(f"{f:.4g} Hz" for f in locked)
            + " (Rayleigh, p < 0.01)."
        )
        values = [
            {
                "frequency_Hz": f,
                "vector_strength": one.strength,
                "phase_rad": one.phase,
                "phase_uncertainty_rad_95": _phase_half(run, f, one),
                "spikes": one.spikes,
                "chance": one.chance,
            }
            for f, one in found.items()
        ]
        table = Table(
            headings=("Frequency", "Spikes", "Vector strength (95 %)", "Phase", "p"),
            rows=tuple(_row(run, f, one) for f, one in found.items()),
            note=timing_note(run),
        )
        return Conclusion(
            (said,), {"phase_locking": values}, tuple(missing), tables=(table,)
        )

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """Vector strength and phase against frequency."""
        found, _ = self._locking(run)
        if len(found) < 2:
            return
        at = tuple(found)
        known = list(found.values())
        least = [np.sqrt(3 / one.spikes) for one in known]
        yield Plot(
            name="summary",
            title="phase locking",
            caption="Vector strength of the spikes against the force's own cycle, "
            "shaded: its 95 % interval, and the phase of their mean with its own: 0 is "
            "where the force is largest. Dotted: what chance alone exceeds in 5 % of "
            "cases (Rayleigh).",
            x_label="Frequency",
            x_unit="Hz",
            x_prefix="",
            x_log=True,
            x_ticks=at,
            panels=(
                Panel(
                    label="Vector strength",
                    series=(
                        Series(
                            x=at, y=[one.strength.value for one in known],
                            low=[one.strength.low for one in known],
                            high=[one.strength.high for one in known], mark="points",
                        ),
                        Series(x=at, y=least, mark="dotted", colour="quiet"),
                    ),
                    limits=(0, 1),
                    height=1.8,
                ),
                Panel(
                    label="Phase",
                    unit="°",
                    series=(
                        Series(
                            x=at, y=[float(np.degrees(one.phase)) for one in known],
                            y_error=[
                                float(np.degrees(_phase_half(run, f, one)))
                                for f, one in found.items()
                            ],
                            mark="points",
                        ),
                    ),
                    guides=(Guide(at=0.0, along="x"),),
                    limits=(-180, 180),
                    height=1.55,
                ),
            ),
        )  # fmt: skip


def locking(
    run: Measurement, labels: Mapping[str, float], presentations_each: int
) -> tuple[dict[float, PhaseLocking], list[str]]:
    """Phase locking at each frequency, found by its label; and what is missing."""
    by_frequency: dict[float, list[tuple[bool, MeasuredTrial]]] = {}
    for trial in run.results:
        frequency = labels.get(trial.label)
        if frequency is not None:
            trials = by_frequency.setdefault(frequency, [])
            trials.append((turned_over(len(trials) % presentations_each), trial))
    found, missing = {}, []
    for frequency, each in by_frequency.items():
        whole = [(turned, one) for turned, one in each if one.complete and one.held]
        try:
            phases = [_phases(run, frequency, one) for one in balanced(whole)]
            if whole and not phases:
                raise NotIdentifiableError(
                    "the sensor's own rhythm cancels out in presentations of both "
                    "halves of the sine alone, and there are of one"
                )
            if phases:
                found[frequency] = phase_locking(phases)
        except NotIdentifiableError as why:
            missing.append(f"No vector strength at {frequency:.4g} Hz: {why}.")
    if not found and not missing:
        missing.append("No vector strength: no vibration was completed.")
    return found, missing


def _phases(run: Measurement, frequency: float, trial: MeasuredTrial) -> FloatArray:
    """Phases of a presentation's spikes against the force's own cycle, rad."""
    spikes = within(trial.spike_times, trial.hold) + trial.start
    return phases_of(spikes, run.force.at, frequency, trial.held or (0.0, 0.0))


def _phase_half(run: Measurement, frequency: float, one: PhaseLocking) -> float:
    """Half of the 95 % interval of a phase, rad: its scatter, clocks and lag."""
    clock = 2 * math.pi * frequency * (run.clock_uncertainty or 0.0)
    late = cmath.phase(run.turned(frequency))
    return min(math.hypot(one.phase_half, clock, late), math.pi)


def _row(run: Measurement, frequency: float, one: PhaseLocking) -> tuple[str, ...]:
    strength, half = one.strength, _phase_half(run, frequency, one)
    return (
        f"{frequency:.4g} Hz",
        str(one.spikes),
        f"{strength.value:.2f} ({strength.low:.2f} to {strength.high:.2f})",
        printed(f"{np.degrees(one.phase):.0f}° ± {np.degrees(half):.0f}°"),
        "< 0.001" if one.chance < 1e-3 else f"{one.chance:.2g}",
    )


def timing_note(run: Measurement) -> str:
    """How well spikes are timed against the force, which is an error of each phase."""
    told = "Phase: ± 95 %, its scatter over presentations"
    aligned, lag = run.clock_uncertainty, run.lag_uncertainty
    told += f", clock and coil aligned to {show(aligned, 's', 2)}" if aligned else ""
    told += f", lags of the force known to {show(lag, 's', 2)}" if lag else ""
    unknown = [] if aligned else ["how well the sample clock is aligned with the coil"]
    unknown += [] if lag else ["how well the lags of the force are known"]
    if unknown:
        told += f"; not known, and not in it: {', '.join(unknown)}"
    return f"{told}. p takes spikes as independent."
