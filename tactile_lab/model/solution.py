"""The solved slice: spikes, and every signal at any time in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model import ellipse, kernel, sampling, spiking
from tactile_lab.model.circuit import SUBTHRESHOLD_LIMIT, Circuit
from tactile_lab.model.equations import I_C, I_DS, T1_currents, fires_at_rest
from tactile_lab.model.need import STAGES, Need
from tactile_lab.model.state import State
from tactile_lab.model.tableau import ORDER
from tactile_lab.spikes.rate import rate
from tactile_lab.waveform import Waveform


@dataclass(frozen=True)
class Statistics:
    """What is known of a spike train without keeping it.

    Attributes:
        count: number of spikes.
        first: time of the first, s; None without spikes.
        last: time of the last, s.
        shortest: shortest interval between two spikes, s; None below two spikes.
        longest: longest interval, s.
    """

    count: int
    first: float | None
    last: float | None
    shortest: float | None
    longest: float | None

    @property
    def mean_rate(self) -> float:
        """Intervals per time between first and last spike, Hz; 0 below two spikes."""
        if self.first is None or self.last is None or self.count < 2:
            return 0.0
        return (self.count - 1) / (self.last - self.first)


@dataclass(eq=False)
class Solution:
    """A solved slice from `before` to `end`, with dense evaluators, absolute time, s.

    Nothing changes it; it is not frozen because making it is part of every call.
    """

    circuit: Circuit
    need: Need
    force: Waveform
    before: State
    end: float
    spike_times: FloatArray
    parameters: FloatArray
    rows: FloatArray
    """The dense stores, one after the other; see `kernel.stored`."""
    memory: FloatArray
    """What the kernel counted and knows at the end; see `kernel` and `spiking`."""

    @cached_property
    def after(self) -> State:
        """The state at the end, after any jump or reset there."""
        S, before = self.memory.tolist(), self.before
        resume = None
        V_C2 = S[spiking.VOLTAGE]
        if not self.need.integrator:
            V_C2, resume = before.V_C2, before.resume
        elif S[spiking.RESUME] >= 0:
            V_C2 = self.circuit.fire_voltage
            resume = self.end + S[spiking.RESUME]
        last, previous = S[spiking.LAST], S[spiking.PREVIOUS]
        return State(
            time=self.end,
            force=S[kernel.FORCE],
            V_P=S[kernel.V_P],
            V_C1=S[kernel.Y],
            V_C2=V_C2,
            resume=resume,
            last_spike=last if last > -math.inf else None,
            previous_spike=previous if previous > -math.inf else None,
            spikes=before.spikes + int(S[spiking.COUNT]),
            error_V_C1=S[kernel.Y_ERROR],
            error_V_C2=S[spiking.ERROR],
            errors_together=S[kernel.ERRORS + ellipse.E_12],
            left_out=self.need.stale,
        )

    @cached_property
    def stages(self) -> dict[str, int]:
        """Evaluations of each stage, 0 where left out."""
        counts = self.memory
        return dict.fromkeys(STAGES, 0) | {
            "V_P": int(counts[kernel.SEGMENTS]),
            "V_C1": int(counts[kernel.STEPS] + counts[kernel.REJECTED]),
            "I_C": int(counts[kernel.EXPANSIONS]),
            "V_C2": int(counts[kernel.PIECES]),
            "spikes": int(self.memory[spiking.SEARCHES]),
        }

    @property
    def evaluations(self) -> int:
        """Evaluations of Eq. (16), of Eq. (17) or of both at once."""
        counts = self.memory.item
        of_16 = ORDER * counts(kernel.ITERATIONS)
        return int(of_16 + (ORDER + 1) * counts(kernel.EXPANSIONS))

    @property
    def error_spike_time(self) -> float:
        """Largest estimated error of a spike time, s."""
        return self.memory.item(spiking.LARGEST_ERROR)

    @property
    def error_V_C1(self) -> float:
        """Largest estimated error of V_C1, V."""
        return self.memory.item(kernel.Y_LARGEST_ERROR)

    @property
    def statistics(self) -> Statistics | None:
        """Of the spikes; None where they were left out."""
        if not self.need.integrator:
            return None
        S = self.memory
        count = int(S[spiking.COUNT])
        intervals = math.isfinite(S[spiking.SHORTEST])
        return Statistics(
            count,
            float(S[spiking.FIRST]) if count else None,
            float(S[spiking.LAST]) if count else None,
            float(S[spiking.SHORTEST]) if intervals else None,
            float(S[spiking.LONGEST]) if intervals else None,
        )

    @property
    def warnings(self) -> tuple[str, ...]:
        """Where the model leaves what it describes well."""
        found = []
        highest = self.memory[kernel.V_P_HIGHEST] + self.circuit.V_GS
        if self.need.node_a and highest > SUBTHRESHOLD_LIMIT:
            found.append(
                f"V_GS + V_P exceeds {SUBTHRESHOLD_LIMIT} V, where the exponential law "
                "of Eq. (1) ends; I_DS is overestimated there."
            )
        if self.memory[spiking.SATURATED]:
            found.append(
                "Spikes occur with V_C1 below V_fire - 0.5 V, where a real T1 "
                "saturates and the circuit stops firing; Eq. (17) cannot show it, "
                "saturation = true does."
            )
        if self.memory[spiking.DOUBT]:
            found.append(
                "V_C2 only just reaches or misses V_fire, closer than the estimated "
                "error: whether there is a spike cannot be decided."
            )
        if self.need.integrator and fires_at_rest(self.circuit):
            found.append(
                "The circuit fires at rest: its equilibrium lies above V_fire; V_C2 "
                "starts at V_reset."
            )
        return tuple(found)

    def sample(self, signal: str, times: FloatArray) -> FloatArray:
        """Values of `signal` at `times`, any shape, right-continuous.

        Raises:
            ParameterError: the signal was not kept, or a time lies outside.
        """
        if signal not in self.need.sampled or signal in ("spikes", "statistics"):
            raise ParameterError(
                f"{signal!r} was not kept as a waveform; add it to keep. Kept: "
                f"{', '.join(sorted(self.need.sampled)) or 'nothing'}."
            )
        t = np.asarray(times, dtype=np.float64)
        if t.size and not (np.min(t) >= self.before.time and np.max(t) <= self.end):
            raise ParameterError(
                f"Sample times must lie within {self.before.time:g} s to "
                f"{self.end:g} s."
            )
        return self._values(signal, np.ascontiguousarray(t).ravel()).reshape(t.shape)

    def _values(self, signal: str, t: FloatArray) -> FloatArray:
        if signal == "force":
            return self.force.at(t)
        if signal in ("V_K", "rate"):
            return self._after_spikes(signal, t)
        if signal == "I_DS":
            return I_DS(self.circuit, self._values("V_P", t), self._values("V_C1", t))
        if signal == "I_C":
            V_C1 = self._values("V_C1", t)
            if self.circuit.saturation:
                return T1_currents(self.circuit, V_C1, self._values("V_C2", t))[0]
            return I_C(self.circuit, V_C1)
        kind = ("V_P", "V_C1", "V_C2").index(signal)
        last = getattr(self.after, signal)
        rows = self._stores[kind]
        if rows.shape[0] == 0:
            return np.full(t.size, last)
        starts = np.ascontiguousarray(
            rows[:, 0] if kind == 0 else rows[:, 0] + rows[:, 1]
        )
        out = np.empty(t.size)
        sampling.sample(kind, t, starts, rows, self.spike_times, self.parameters, out)
        out[t == self.end] = last
        return out

    @cached_property
    def _stores(self) -> list[FloatArray]:
        """Rows of segments, of steps and of pieces, as `kernel` has them."""
        found, at = [], 0
        for counter, width in (
            (kernel.ROWS_0, kernel.SEGMENT_ROW),
            (kernel.ROWS_1, kernel.STEP_ROW),
            (kernel.ROWS_2, kernel.PIECE_ROW),
        ):
            end = at + int(self.memory[counter]) * width
            found.append(self.rows[at:end].reshape(-1, width))
            at = end
        return found

    def _after_spikes(self, signal: str, t: FloatArray) -> FloatArray:
        earlier = (self.before.previous_spike, self.before.last_spike)
        before = np.array([one for one in earlier if one is not None])
        spikes = np.concatenate([before, self.spike_times])
        if signal == "rate":
            return rate(spikes, t)
        last = np.searchsorted(spikes, t, side="right") - 1
        out = np.zeros(t.size)
        self.stages["V_K"] += t.size
        known = last >= 0
        since = t[known] - spikes[last[known]]
        c = self.circuit
        height = c.swing
        if c.tau_K > 0:
            # beyond 600 time constants there is nothing left but slow denormals
            out[known] = np.where(
                since < 600 * c.tau_K,
                height * np.exp(-np.minimum(since / c.tau_K, 600.0)),
                0.0,
            )
        else:
            out[known] = np.where(since == 0, height, 0.0)
        return out
