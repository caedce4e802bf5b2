"""The parts that were chosen: each want by the full solver, and what is said."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Conclusion, Table
from tactile_lab.model.circuit import SATURATION_HEADROOM, Circuit
from tactile_lab.model.simulate import simulate
from tactile_lab.quantity import show
from tactile_lab.spikes.trains import Trains
from tactile_lab.studies.behaviour import (
    FIRST,
    RAMP,
    THRESHOLD_HOLD,
    push,
    silence_hold,
)
from tactile_lab.studies.specification import Specification, Wants


@dataclass(frozen=True)
class Check:
    """One want, on the chosen circuit, by the full solver.

    Attributes:
        want: its name.
        wanted, found: for a person.
        met: whether it is.
    """

    want: str
    wanted: str
    found: str
    met: bool


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """The parts that come closest to a specification.

    Attributes:
        asked: the specification.
        values: of each part, SI, as sold or to the millivolt.
        circuit: with these.
        checks: each want, by the full solver.
        conflict: the fewest wants for which no values within the parts' ranges were
            found; empty where all are met, or would be but for what is sold.
        good: share of circuits that meet all wants within the tolerances.
    """

    asked: Specification
    values: Mapping[str, float]
    circuit: Circuit
    checks: tuple[Check, ...]
    conflict: tuple[str, ...]
    good: Estimate

    @property
    def met(self) -> bool:
        """Whether every want is."""
        return all(check.met for check in self.checks)

    @property
    def conclusion(self) -> Conclusion:
        """For terminal and machines."""
        parts = Table(
            title="Parts",
            headings=("part", "value", "tolerance (2 σ)"),
            rows=tuple(
                (
                    part.name,
                    show(self.values[part.name], part.unit, 4),
                    show(2 * part.spread(self.values[part.name]), part.unit, 2),
                )
                for part in self.asked.parts
            ),
        )
        wants = Table(
            title="Wanted, and found by the full solver",
            headings=("", "wanted", "found", "met"),
            rows=tuple(
                (c.want, c.wanted, c.found, "yes" if c.met else "no")
                for c in self.checks
            ),
            note="Pushes rise within 10 ms and are held. The threshold is the least "
            "force that spikes, the rate that of the first second, silence the last "
            "spike.",
        )
        values = {
            "met": self.met,
            "conflict": list(self.conflict),
            "parts": dict(self.values),
            "wants": {check.want: check.met for check in self.checks},
            "yield": self.good,
        }
        return Conclusion(tuple(self._sentences()), values, (), (parts, wants))

    def _sentences(self) -> Iterator[str]:
        missed = [check.want for check in self.checks if not check.met]
        if not missed:
            yield f"{self.asked.title}: all that is wanted is met."
        elif len(self.conflict) > 1:
            yield (
                f"{self.asked.title}: {' and '.join(self.conflict)} cannot be had "
                "together with these parts in their ranges; the closest is shown. "
                "Widen a range or a want, or let another part be chosen."
            )
        elif self.conflict:
            yield (
                f"{self.asked.title}: {self.conflict[0]} cannot be had with these "
                "parts in their ranges; the closest is shown. Widen a range or the "
                "want, or let another part be chosen."
            )
        else:
            yield (
                f"{self.asked.title}: {' and '.join(missed)} is missed with parts as "
                "they are sold, and would be met between their values. Take a finer "
                "series, or let another voltage be set by hand."
            )
        good = self.good
        yield (
            f"Yield within the tolerances {good.value:.1%} ({good.low:.1%} to "
            f"{good.high:.1%}, Wilson's 95 % interval), nothing trimmed afterwards."
        )


def checks_of(wants: Wants, circuit: Circuit) -> Iterator[Check]:
    """Each want on a circuit, one simulation of the force itself after another.

    Raises:
        SolverError: the circuit cannot be solved.
    """
    if (want := wants.threshold) is not None:
        found = threshold_of(circuit, want.value)
        yield _check("threshold", want.value, want.within, found, "N")
    if (rated := wants.rate) is not None:
        spikes = _spikes(circuit, rated.force, FIRST)
        rate = float(Trains.of_one(spikes).mean_rate[0])
        name = f"rate at {show(rated.force, 'N')}"
        yield _check(name, rated.value, rated.within, rate, "Hz")
    if (quiet := wants.silence) is not None:
        spikes = _spikes(circuit, quiet.force, silence_hold(circuit, quiet))
        last = float(spikes[-1]) if spikes.size else math.nan
        name = f"silence at {show(quiet.force, 'N')}"
        yield _check(name, quiet.value, quiet.within, last, "s")
    if (strong := wants.unsaturated) is not None:
        yield _unsaturated(circuit, strong.force)


def threshold_of(circuit: Circuit, near: float) -> float:
    """The least force that makes it spike, N, within 0.05 % above; NaN for none.

    Looked for from a sixteenth of `near` N to sixteen times that.
    """
    low, high = near / 16, near * 16
    if not _spikes(circuit, high, THRESHOLD_HOLD).size:
        return math.nan
    while high > low * 1.0005:
        middle = math.sqrt(low * high)
        if _spikes(circuit, middle, THRESHOLD_HOLD).size:
            high = middle
        else:
            low = middle
    return high


def _spikes(circuit: Circuit, force: float, hold: float) -> FloatArray:
    found = simulate(circuit, push(hold, force)).spike_times
    return np.empty(0) if found is None else found


def _check(name: str, value: float, within: float, found: float, unit: str) -> Check:
    wanted = f"{show(value, unit)} ± {within * 100:.3g} %"
    shown = show(found, unit, 4) if math.isfinite(found) else "none"
    return Check(name, wanted, shown, abs(found / value - 1) <= within)


def _unsaturated(circuit: Circuit, force: float) -> Check:
    """Lowest V_C1 of a push, and the spikes of a T1 that does saturate beside."""
    floor = circuit.fire_voltage - SATURATION_HEADROOM
    pushed = simulate(circuit, push(FIRST, force), keep=("V_C1", "spikes"))
    times = np.linspace(0.0, RAMP + FIRST, 2001)
    lowest = float(pushed.sample("V_C1", times).min())
    real = _spikes(replace(circuit, saturation=True), force, FIRST).size
    ours = 0 if pushed.spike_times is None else pushed.spike_times.size
    return Check(
        f"no saturation to {show(force, 'N')}",
        f"V_C1 at least {show(floor, 'V')}",
        f"{show(lowest, 'V', 4)}; {ours} spikes in {FIRST:g} s, {real} where T1 can "
        "saturate",
        lowest >= floor,
    )
