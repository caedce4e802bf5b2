"""What a run says about the sensor's parameters, as residuals to be made small.

Two kinds of evidence are used. V_C1, bin by bin. And each pair of neighbouring spikes:
with V_C2 set to V_reset at the earlier one, the model must reach V_fire at the later
one. The second is smooth in the parameters, unlike a comparison of spike trains, whose
number of spikes jumps.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from tactile_lab.analysis.estimate import Z95, correlated
from tactile_lab.analysis.twin import Measured
from tactile_lab.arrays import FloatArray
from tactile_lab.deviation import DrivenCircuit
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import I_C
from tactile_lab.model.simulate import simulate
from tactile_lab.waveform import Waveform

VOLTAGES = frozenset({"V_GS", "V_S", "V_th", "V_fire", "V_reset"})
SCALES = {**dict.fromkeys(VOLTAGES, 0.01), "I_bias": 1e-10, "g31": 0.004}
"""Steps of parameters fitted as they are; all others are fitted by their logarithm."""
STEP = 2e-3
"""Grid on which I_C is integrated between spikes, s."""
LEAST = 1e-9
"""Smallest scatter of any evidence, V."""
OFFSET = "V_C1's offset"
"""The cause by which all of V_C1 is off alike."""
Moved = Callable[[Circuit, Mapping[str, float]], DrivenCircuit]
LONGEST = 1.0
"""Intervals longer than this tell little about rate and much about drift, s."""


class Residuals:
    """Residuals of one identification as a function of scaled parameters."""

    def __init__(
        self,
        circuit: Circuit,
        names: tuple[str, ...],
        force: Waveform,
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
        self.bins = 0 if V_C1 is None else int(V_C1.time.size)
        self.offset = 0.0 if V_C1 is None else math.hypot(V_C1.resolution, V_C1.offset)
        self.size = self.bins + self._earlier.size
        self._grids = [
            np.linspace(a, b, max(8, int((b - a) / STEP)) | 1)
            for a, b in zip(self._earlier, self._later, strict=True)
        ]

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
        mine = {name: part for name, part in parts.items() if name in self.causes}
        if self._moved is None:
            return DrivenCircuit(self.circuit(x), self.force)
        return self._moved(self.circuit(x), mine)

    def under(self, driven: DrivenCircuit) -> FloatArray:
        """All residuals of a circuit and its force, V: of V_C1, then at firing."""
        circuit, force = driven
        found = simulate(
            circuit, force, keep=("V_C1",), until=self._duration, tolerance=1e-7
        )
        parts = []
        if self._trace is not None:
            parts.append(self._trace.value - self._trace.modelled(found))
        if self._grids:
            everywhere = np.concatenate(self._grids)
            current = I_C(circuit, found.sample("V_C1", everywhere)) + circuit.I_bias
            parts.append(self._at_firing(circuit, current))
        return np.concatenate(parts) if parts else np.empty(0)

    def _at_firing(self, circuit: Circuit, current: FloatArray) -> FloatArray:
        """V_C2 at each later spike, from V_reset at the earlier one, less V_fire."""
        misses, at = np.empty(len(self._grids)), 0
        for i, grid in enumerate(self._grids):
            flowing = current[at : at + grid.size]
            at += grid.size
            left = np.exp((grid - grid[-1]) / circuit.tau_L)
            charge = _simpson(flowing * left, grid) / circuit.C2
            kept = circuit.reset_voltage * left[0]
            misses[i] = charge + kept - circuit.fire_voltage
        return misses


class JointResiduals:
    """Residuals of one or several runs as a function of what they share.

    That is x: the parameters, scaled; if asked, the logarithm of a factor of each run's
    force; and of each cause of uncertainty the part of its 95 % band.

    Args:
        runs: of each run its residuals, of the same parameters, begun alike.
        scaled: whether the force of each run has a factor of its own that is fitted.

    Attributes:
        names: what is fitted.
        causes: what else is open, within bands; the offset of V_C1 among them.
        size: so many data.
    """

    def __init__(self, runs: Sequence[Residuals], *, scaled: bool = False) -> None:
        self._runs = runs
        self._shared = runs[0].names
        self._scaled = scaled
        factors = (f"force_{i}" for i in range(1, len(runs) + 1))
        self.names = (*self._shared, *(factors if scaled else ()))
        causes = dict.fromkeys(cause for run in runs for cause in run.causes)
        shifted = any(run.bins and run.offset for run in runs)
        self.causes = (*causes, *((OFFSET,) if shifted else ()))
        self.size = sum(run.size for run in runs)
        bins = [np.arange(run.size) < run.bins for run in runs]
        offsets = [of * run.offset for of, run in zip(bins, runs, strict=True)]
        self.traced = np.concatenate(bins)
        self._offsets = np.concatenate(offsets)

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
        pairs = zip(self._runs, self.driven(x), strict=True)
        data = np.concatenate([run.under(one) for run, one in pairs])
        if OFFSET in self.causes:
            data -= parts[-1] * self._offsets
        return np.concatenate([data, Z95 * parts])

    @property
    def first(self) -> FloatArray:
        """A few millivolts for either kind of evidence, before anything is known."""
        return np.append(np.full(self.size, 1 / 5e-3), np.ones(len(self.causes)))

    def weights(self, residual: FloatArray) -> FloatArray:
        """One over the scatter of each kind of evidence, of all runs; of causes 1.

        Neighbours may err alike. One scatter for all runs: of several that do not agree
        none is then followed for having fitted best.
        """
        weights = np.ones(residual.size)
        for kind in (self.traced, ~self.traced):
            seen, of = residual[: self.size][kind], weights[: self.size]
            if seen.size:
                of[kind] /= max(scatter(seen) * math.sqrt(correlated(seen)), LEAST)
        return weights

    def _factors(self, x: FloatArray) -> list[float]:
        """Of each run's force."""
        count = len(self._runs)
        at = len(self._shared)
        factors = x[at : at + count] if self._scaled else np.zeros(count)
        return list(map(float, np.exp(factors)))


def scatter(residual: FloatArray) -> float:
    """Root mean square, V."""
    return float(np.sqrt(np.mean(residual**2)))


def _simpson(values: FloatArray, grid: FloatArray) -> float:
    """Integral over an even number of equal steps."""
    step = (grid[-1] - grid[0]) / (grid.size - 1)
    total = values[0] + values[-1] + 4 * values[1:-1:2].sum() + 2 * values[2:-1:2].sum()
    return float(total * step / 3)
