"""What a run says about the sensor's parameters, as residuals to be made small.

Two kinds of evidence are used. V_C1, bin by bin. And each pair of neighbouring spikes:
with V_C2 set to V_reset at the earlier one, the model must reach V_fire at the later
one. The second is smooth in the parameters, unlike a comparison of spike trains, whose
number of spikes jumps.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from tactile_lab.analysis.estimate import correlated
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
LEAST = 0.15e-3
"""What V_C2 at firing is known to at best, V."""
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
    ) -> None:
        self.names = names
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

    def residual(self, x: FloatArray) -> FloatArray:
        """All residuals at scaled parameters `x`, V."""
        return self.under(DrivenCircuit(self.circuit(x), self.force))

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

    def weights(self, residual: FloatArray) -> FloatArray:
        """One over the scatter of each kind of evidence; V_C1's bins may err alike."""
        traced, fired = residual[: self.bins], residual[self.bins :]
        weights = np.empty(self.size)
        if traced.size:
            alike = math.sqrt(correlated(traced))
            weights[: self.bins] = 1 / max(scatter(traced) * alike, 1e-9)
        if fired.size:
            weights[self.bins :] = 1 / max(scatter(fired), LEAST)
        return weights


class JointResiduals:
    """Residuals of one or several runs as a function of the parameters they share.

    Args:
        runs: of each run its residuals, of the same parameters, begun alike.
        scaled: whether the force of each run has a factor of its own that is fitted.
    """

    def __init__(self, runs: Sequence[Residuals], *, scaled: bool = False) -> None:
        self._runs = runs
        self._shared = runs[0].names
        self._scaled = scaled
        factors = (f"force_{i}" for i in range(1, len(runs) + 1))
        self.names = (*self._shared, *(factors if scaled else ()))
        self.size = sum(run.size for run in runs)
        ends = np.cumsum([run.size for run in runs])
        self.parts = [slice(e - r.size, e) for e, r in zip(ends, runs, strict=True)]
        traced, offsets = np.zeros(self.size, dtype=bool), np.zeros(self.size)
        for run, part in zip(runs, self.parts, strict=True):
            traced[part][: run.bins] = True
            offsets[part][: run.bins] = run.offset
        self.traced = traced
        self.offsets = offsets

    def driven(self, x: FloatArray) -> list[DrivenCircuit]:
        """Circuit and force of each run at scaled parameters `x`."""
        shared = x[: len(self._shared)]
        return [
            DrivenCircuit(run.circuit(shared), run.force.scaled(scale))
            for run, scale in zip(self._runs, self.scales(x), strict=True)
        ]

    def scales(self, x: FloatArray) -> list[float]:
        """The factor of each run's force."""
        factors = x[len(self._shared) :] if self._scaled else np.zeros(len(self._runs))
        return list(map(float, np.exp(factors)))

    def values(self, x: FloatArray) -> dict[str, float]:
        """The parameters at scaled `x`, SI, by name."""
        circuit = self.driven(x)[0].circuit
        found = {name: float(getattr(circuit, name)) for name in self._shared}
        factors = zip(self.names, x, strict=True)
        return found | {n: float(np.exp(y)) for n, y in factors if n not in found}

    def residual(self, x: FloatArray) -> FloatArray:
        """All residuals at scaled parameters `x`, V, run after run."""
        return self.under(self.driven(x))

    def under(self, driven: Sequence[DrivenCircuit]) -> FloatArray:
        """All residuals of a circuit and its force for each run, V."""
        pairs = zip(self._runs, driven, strict=True)
        return np.concatenate([run.under(one) for run, one in pairs])

    def first_weights(self) -> FloatArray:
        """A few millivolts for either kind of evidence, before anything is known."""
        return np.full(self.size, 1 / 5e-3)

    def weights(self, residual: FloatArray) -> FloatArray:
        """One over the scatter of each kind of evidence of each run."""
        pairs = zip(self._runs, self.parts, strict=True)
        return np.concatenate([run.weights(residual[part]) for run, part in pairs])


def scatter(residual: FloatArray) -> float:
    """Root mean square, V."""
    return float(np.sqrt(np.mean(residual**2)))


def _simpson(values: FloatArray, grid: FloatArray) -> float:
    """Integral over an even number of equal steps."""
    step = (grid[-1] - grid[0]) / (grid.size - 1)
    total = values[0] + values[-1] + 4 * values[1:-1:2].sum() + 2 * values[2:-1:2].sum()
    return float(total * step / 3)
