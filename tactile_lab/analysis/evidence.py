"""What a run says about the sensor's parameters, as residuals to be made small.

Two kinds of evidence are used. V_C1, bin by bin. And each pair of neighbouring spikes:
with V_C2 set to V_reset at the earlier one, the model must reach V_fire at the later
one. The second is smooth in the parameters, unlike a comparison of spike trains, whose
number of spikes jumps.

A spike that is seen late makes the interval before it too long and the one after it too
short: the two err together, and in a long train nearly all of that cancels. How much of
the intervals' scatter is of this kind, their own neighbours tell (`Scatter`).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.estimate import Z95, correlated
from tactile_lab.analysis.firing import Firing, charging, steps_between
from tactile_lab.analysis.twin import Measured
from tactile_lab.arrays import FloatArray
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.long_waveform import AnyWaveform
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.slices import Samples, slices

if TYPE_CHECKING:
    from tactile_lab.model.solution import Solution

VOLTAGES = frozenset({"V_GS", "V_S", "V_th", "V_fire", "V_reset"})
SCALES = {**dict.fromkeys(VOLTAGES, 0.01), "I_bias": 1e-10, "g31": 0.004}
"""Steps of parameters fitted as they are; all others are fitted by their logarithm."""
COMPUTED = 3e-7
"""What computing V_C1 to 1e-7 V leaves open of V_C2 when it fires, V."""
ROUNDS = 5
"""So often variances are weighed by what they then are."""
LEAST = 1e-9
"""Smallest scatter of any evidence, V."""
OFFSET = "V_C1's offset"
"""The cause by which all of V_C1 is off alike."""
STEPS = ("V_C1's steps", "V_C1's steps, a quarter of a code on")
"""Causes by which it is off by where it lies between two codes of its converter."""
Moved = Callable[[Circuit, Mapping[str, float]], DrivenCircuit]
LONGEST = 1.0
"""Intervals longer than this tell little about rate and much about drift, s."""


class Residuals:
    """Residuals of one identification as a function of scaled parameters."""

    def __init__(
        self,
        circuit: Circuit,
        names: tuple[str, ...],
        force: AnyWaveform,
        duration: float,
        V_C1: Measured | None,
        spike_times: FloatArray | None,
        causes: Sequence[str] = (),
        moved: Moved | None = None,
    ) -> None:
        self.names = names
        self.causes, self._moved = tuple(causes), moved
        self.force = force
        self._circuit, self._duration = circuit, duration
        self._trace = V_C1
        times = np.empty(0) if spike_times is None else np.asarray(spike_times)
        short = np.diff(times) <= LONGEST
        self._earlier, self._later = times[:-1][short], times[1:][short]
        pairs = zip(self._earlier, self._later, strict=True)
        self._straight = [steps_between(a, b) for a, b in pairs]
        self.bins = 0 if V_C1 is None else int(V_C1.time.size)
        self.offset = 0.0 if V_C1 is None else math.hypot(V_C1.resolution, V_C1.offset)
        self.size = self.bins + self._earlier.size

    @property
    def channel(self) -> tuple[str, ...]:
        """Causes by which V_C1's channel puts it off."""
        digitised = self._trace is not None and self._trace.resolution > 0
        offset = (OFFSET,) if self.bins and self.offset else ()
        return (*offset, *(STEPS if digitised else ()))

    def less_channel(
        self, misses: FloatArray, parts: Mapping[str, float]
    ) -> FloatArray:
        """Residuals less what parts of the bands of `channel` put V_C1 off by, V.

        Args:
            misses: what `under` gave, shape (size,).
            parts: by cause.
        """
        left, trace = misses.copy(), self._trace
        if trace is not None:
            off = trace.staircase(trace.value - misses[: self.bins])
            stairs = off @ [parts.get(cause, 0.0) for cause in STEPS]
            left[: self.bins] -= parts.get(OFFSET, 0.0) * self.offset + stairs
        return left

    @property
    def times(self) -> FloatArray:
        """Of each datum, shape (size,), s: the middle of a bin, or the later spike."""
        bins = np.empty(0) if self._trace is None else self._trace.time
        return np.concatenate([bins, self._later])

    def circuit(self, x: FloatArray) -> Circuit:
        """The circuit at scaled parameters `x`, 0 where the start lies."""
        changed: dict[str, Any] = {}
        for name, step in zip(self.names, x, strict=True):
            start = self._start(name)
            if name in SCALES:
                changed[name] = start + SCALES[name] * float(step)
            else:
                changed[name] = start * float(np.exp(np.clip(step, -20, 20)))
        return dataclasses.replace(self._circuit, **changed)

    def _start(self, name: str) -> float:
        if name == "V_fire":
            return self._circuit.fire_voltage
        if name == "V_reset":
            return self._circuit.reset_voltage
        return float(getattr(self._circuit, name))

    def driven(self, x: FloatArray, parts: Mapping[str, float]) -> DrivenCircuit:
        """Circuit and force at scaled parameters `x`, by parts of the causes' bands."""
        mine = {name: parts[name] for name in self.causes if name in parts}
        if self._moved is None:
            return DrivenCircuit(self.circuit(x), self.force)
        return self._moved(self.circuit(x), mine)

    def under(self, driven: DrivenCircuit) -> FloatArray:
        """All residuals of a circuit and its force, V: of V_C1, then at firing."""
        trace, until = self._trace, self._duration
        firing = Firing(driven.circuit, self._earlier, self._straight, until)
        seen = None if trace is None else trace.samples(until)
        if seen is None and not firing.misses.size:
            return np.empty(0)
        for part in self._solved(driven):
            if seen is not None:
                seen.take(part)
            firing.take(part)
        if trace is None or seen is None:
            return firing.misses
        return np.concatenate([trace.value - trace.means(seen), firing.misses])

    def late(self, driven: DrivenCircuit) -> FloatArray:
        """What of V_C2 at firing a late spike changes, V/s, shape (pairs, 2).

        Of the earlier spike, and of the later one.
        """
        circuit, ends = driven.circuit, np.column_stack([self._earlier, self._later])
        there = Samples("V_C1", ends, self._duration)
        for part in self._solved(driven):
            there.take(part)
        at = np.array([circuit.reset_voltage, circuit.fire_voltage])
        slope = charging(circuit, there.value) / circuit.C2 - at / circuit.tau_L
        left = np.exp((self._earlier - self._later) / circuit.tau_L)
        return np.column_stack([-slope[:, 0] * left, slope[:, 1]])

    def _solved(self, driven: DrivenCircuit) -> Iterator[Solution]:
        circuit, force = driven
        return slices(
            circuit, force, keep=("V_C1",), until=self._duration, tolerance=1e-7
        )

    @property
    def follows(self) -> NDArray[np.bool_]:
        """Which pair begins with the spike that the pair before ended with."""
        shared: NDArray[np.bool_] = self._earlier[1:] == self._later[:-1]
        return np.concatenate([[False], shared])[: self._later.size]


def factor_of(run: int) -> str:
    """What the factor of a run's force is called; the first run is 1."""
    return f"force_{run}"


class JointResiduals:
    """Residuals of one or several runs as a function of what they share.

    That is x: the parameters, scaled; if asked, the logarithm of a factor of each run's
    force; and of each cause of uncertainty the part of its 95 % band.

    Args:
        runs: of each run its residuals, of the same parameters, begun alike.
        scaled: whether the force of each run has a factor of its own that is fitted.

    Attributes:
        names: what is fitted.
        causes: what else is open, within bands; what V_C1's channel does among them.
        size: so many data.
    """

    def __init__(self, runs: Sequence[Residuals], *, scaled: bool = False) -> None:
        self._runs = runs
        self._shared = runs[0].names
        self._scaled = scaled
        factors = (factor_of(i) for i in range(1, len(runs) + 1))
        self.names = (*self._shared, *(factors if scaled else ()))
        of_bench = (cause for run in runs for cause in run.causes)
        of_channel = (cause for run in runs for cause in run.channel)
        self.causes = tuple(dict.fromkeys((*of_bench, *of_channel)))
        self.size = sum(run.size for run in runs)
        bins = [np.arange(run.size) < run.bins for run in runs]
        self.traced = np.concatenate(bins)

    def driven(self, x: FloatArray) -> list[DrivenCircuit]:
        """Circuit and force of each run."""
        shared = x[: len(self._shared)]
        moved = dict(zip(self.causes, x[len(self.names) :], strict=True))
        found = []
        for run, factor in zip(self._runs, self._factors(x), strict=True):
            circuit, force = run.driven(shared, moved)
            found.append(DrivenCircuit(circuit, force.scaled(factor)))
        return found

    def circuit(self, x: FloatArray) -> Circuit:
        """Of the first run, no cause counted."""
        return self._runs[0].circuit(x[: len(self._shared)])

    def values(self, x: FloatArray) -> dict[str, float]:
        """What is fitted, SI, by name."""
        circuit = self.circuit(x)
        found = {name: float(getattr(circuit, name)) for name in self._shared}
        factors = zip(self.names, x, strict=False)
        return found | {n: float(np.exp(y)) for n, y in factors if n not in found}

    def residual(self, x: FloatArray) -> FloatArray:
        """Of all data, V, run after run; then how far each cause is off.

        That is in standard deviations, so that with `weights` the sum of squares weighs
        one with the other. Shape (size + causes,).
        """
        parts = x[len(self.names) :]
        moved = dict(zip(self.causes, parts, strict=True))
        pairs = zip(self._runs, self.driven(x), strict=True)
        data = [run.less_channel(run.under(one), moved) for run, one in pairs]
        return np.concatenate([*data, Z95 * parts])

    @property
    def first(self) -> FloatArray:
        """A few millivolts for either kind of evidence, before anything is known."""
        return np.append(np.full(self.size, 1 / 5e-3), np.ones(len(self.causes)))

    def intervals(
        self, x: FloatArray, residual: FloatArray, held: float
    ) -> Scatter | None:
        """What scatter of the intervals consists of; None where there are none.

        Args:
            x: where a fit ended.
            residual: there.
            held: so many of the intervals the fit has taken up.
        """
        misses = residual[: self.size][~self.traced]
        if not misses.size:
            return None
        pairs = zip(self._runs, self.driven(x), strict=True)
        late = np.concatenate([run.late(one) for run, one in pairs])
        follows = np.concatenate([run.follows for run in self._runs])
        return Scatter.of(misses, late, follows, held)

    def weights(self, residual: FloatArray) -> FloatArray:
        """One over the scatter of each kind of evidence, of all runs; of causes 1.

        Neighbours may err alike. One scatter for all runs: of several that do not agree
        none is then followed for having fitted best.
        """
        weights = np.ones(residual.size)
        for kind, swings in ((self.traced, True), (~self.traced, False)):
            seen, of = residual[: self.size][kind], weights[: self.size]
            if seen.size:
                alike = correlated(seen, swings=swings)
                of[kind] /= max(scatter(seen) * math.sqrt(alike), LEAST)
        return weights

    def _factors(self, x: FloatArray) -> list[float]:
        """Of each run's force."""
        count = len(self._runs)
        at = len(self._shared)
        factors = x[at : at + count] if self._scaled else np.zeros(count)
        return list(map(float, np.exp(factors)))


@dataclass(frozen=True, eq=False)
class Scatter:
    """What the scatter of the intervals between spikes consists of.

    Attributes:
        timing: variance of a spike's time, s^2.
        own: variance of each interval's own, V^2; larger where neighbours miss alike.
        late: shape (pairs, 2): what a late spike changes, the earlier and later, V/s.
        follows: shape (pairs,): which pair begins with the spike the last ended with.
    """

    timing: float
    own: float
    late: FloatArray
    follows: NDArray[np.bool_]

    @classmethod
    def of(
        cls,
        misses: FloatArray,
        late: FloatArray,
        follows: NDArray[np.bool_],
        held: float = 0.0,
    ) -> Scatter:
        """The variances, none below 0, that suit squares and neighbours' products best.

        The pairs of a slow V_C2 tell what is their own, those of a fast one and what
        neighbours have in common what is timing. A fit takes up what many pairs have
        in common: of their own scatter, but hardly of timing, which cancels there.

        Args:
            misses: shape (pairs,), V.
            late: as the attribute.
            follows: as the attribute.
            held: so many of the pairs a fit has taken up.
        """
        from scipy.optimize import nnls

        each, one = np.sum(late**2, axis=1), np.ones(len(misses))
        shared = np.where(follows[1:], late[1:, 0] * late[:-1, 1], 0.0)
        design = np.block([[each, shared], [one, np.zeros_like(shared)]]).T
        seen = np.append(misses**2, misses[1:] * misses[:-1])
        timing, own = 0.0, float(np.mean(misses**2))
        for _ in range(ROUNDS):
            alone = np.maximum(timing * each + own, LEAST**2)
            # of normal errors, squares scatter by root 2 times as much as products
            spread = np.append(math.sqrt(2) * alone, np.sqrt(alone[1:] * alone[:-1]))
            size = np.linalg.norm(design / spread[:, np.newaxis], axis=0)
            found, _ = nnls(design / np.outer(spread, size), seen / spread)
            timing, own = (float(value) for value in found / size)
        own *= correlated(misses) * len(misses) / max(len(misses) - held, 1.0)
        return cls(timing, max(own, COMPUTED**2), late, follows)

    def covariance(self, gain: FloatArray) -> FloatArray:
        """Of what the intervals move by `gain`, shape (n, pairs), per V; (n, n)."""
        earlier, later = gain * self.late[:, 0], gain * self.late[:, 1]
        # each spike once: by the pair it ends and, if there is one, the pair it begins
        ended = later.copy()
        ended[:, :-1] += np.where(self.follows[1:], earlier[:, 1:], 0.0)
        first = earlier[:, ~self.follows]
        timed = ended @ ended.T + first @ first.T
        return np.asarray(self.timing * timed + self.own * (gain @ gain.T))


def scatter(residual: FloatArray) -> float:
    """Root mean square, V."""
    return float(np.sqrt(np.mean(residual**2)))
