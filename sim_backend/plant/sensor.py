"""The circuit model as the plant runs it: solved ahead in chunks that can be cut off.

What has been shown must not change when a command arrives, however the scope slices
time. So each chunk is solved as if no further command came, from a state that depends
on nothing but circuit and commands; a command cuts the chunk that it falls into and
the model goes on from there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from sim_backend.plant.pieces import Pieces, join
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest, rest_V_C2
from tactile_lab.model.state import State
from tactile_lab.model.temperature import at_temperature, temperature
from tactile_lab.waveform import Waveform

if TYPE_CHECKING:
    from tactile_lab.model.solution import Solution

SHORTEST, LONGEST = 10e-3, 60.0
"""Length of a chunk just after a command, and long after one, s; it doubles between."""
LONGEST_NOISY = 0.5
"""The same where each spike has a V_fire of its own, and ends its chunk, or where the
temperature changes, s."""
JUST = 1e-9
"""After a spike, s: its chunk ends there."""
WINDOW = 0.5
"""Part of a chunk that is sampled at once, s."""
FINE, COARSE = 5e-5, 2.5e-4
"""Distance of samples between which voltages are taken as straight, s."""
LIVELY = 50e-3
"""Time after a command for which the fine grid is used, s."""

NEEDS = {
    "V_C1": ("V_C1",),
    "V_C2": ("V_C2", "spikes"),
    "V_K": ("spikes",),
    "I_DS": ("I_DS",),
}
"""What the model must keep for a scope channel."""


class ForceSource(Protocol):
    """Where the force on the cantilever comes from."""

    def force(self, start: float, end: float) -> Waveform:
        """Force, N, on [start, end] as foreseen at `start`, blind to later commands."""
        ...

    def next_command(self, time: float) -> float:
        """Time of the first command after `time` s, infinite if there is none."""
        ...

    def latest_command(self, time: float) -> float:
        """Time of the last command at or before `time` s."""
        ...


@dataclass(eq=False)
class _Chunk:
    """A stretch solved in one go; valid until `end`, which a command may pull in."""

    state: State
    end: float
    spacing: float
    solved: Solution
    circuit: Circuit
    fired: int
    pieces: dict[tuple[str, int], Pieces] = field(default_factory=dict)

    @property
    def start(self) -> float:
        return self.state.time


class SimulatedSensor:
    """V_C1, V_C2, I_DS and spike times of the driven circuit at any time asked for.

    Only stages that something needed so far are solved. A stage first needed later
    starts from its equilibrium. Not thread-safe; the plant's lock is around it.

    Args:
        circuit: whose state it is.
        drive: force on it.
        V_fire: where V_fire is not the same at each spike: V_fire of spike number n,
            from V_fire without noise and V_reset, V.
        warmer: where its temperature changes: by how much at a time, s, it is warmer
            than `circuit` says, K.

    Attributes:
        error_spike_time, error_V_C1: largest estimated error so far, s and V.
    """

    def __init__(
        self,
        circuit: Circuit,
        drive: ForceSource,
        V_fire: Callable[[int, float, float], float] | None = None,
        warmer: Callable[[float], float] | None = None,
    ) -> None:
        self._warmer = warmer
        self.circuit = circuit
        self._circuits = [(-math.inf, circuit)]
        self._drive = drive
        self._V_fire, self._fired = V_fire, 0
        self.error_spike_time = 0.0
        self.error_V_C1 = 0.0
        self._keep: tuple[str, ...] = ()
        self._chunks: list[_Chunk] = []
        self._at_rest = float(drive.force(0.0, 0.0).value[0])

    @cached_property
    def _frontier(self) -> State:
        """The state up to which it is solved; first at rest."""
        return rest(self.circuit, force=self._at_rest)

    @property
    def latest(self) -> Circuit:
        """The circuit after all changes that were told."""
        return self._circuits[-1][1]

    def become(self, time: float, circuit: Circuit) -> None:
        """Let the circuit be another from `time` s on, not before any other change."""
        self._circuits.append((time, circuit))
        self.commanded(time)

    def need(self, signals: Iterable[str], time: float) -> None:
        """Solve what `signals` (V_C1, V_C2, V_K, I_DS) depend on, from `time` s on."""
        wanted = {name for signal in signals for name in NEEDS[signal]}
        if wanted <= set(self._keep):
            return
        self._keep = tuple(sorted(wanted | set(self._keep)))
        for i, chunk in enumerate(self._chunks):
            if chunk.end > time:
                self._frontier, self._fired = chunk.state, chunk.fired
                del self._chunks[i:]
                break
        state = self._frontier
        if state.left_out:
            circuit = self._changed(state.time)[1]
            V_C2 = rest_V_C2(circuit, state.V_C1)
            if V_C2 >= circuit.fire_voltage:
                V_C2 = circuit.reset_voltage
            self._frontier = state._replace(V_C2=V_C2, resume=None, left_out=())

    def commanded(self, time: float) -> None:
        """A command takes effect at `time` s: what was solved beyond is void."""
        if not self._chunks or time >= self._frontier.time:
            return
        for i, chunk in enumerate(self._chunks):
            if chunk.end > time:
                del self._chunks[i + (chunk.start < time) :]
                self._frontier, self._fired = chunk.state, chunk.fired
                if chunk.start < time:
                    chunk.end = time
                    self._frontier = self._advance(
                        chunk.circuit, chunk.state, time
                    ).after
                return
        raise ParameterError(f"A command at {time:g} s lies before what is kept.")

    def reach(self, time: float) -> None:
        """Solve until `time` s is covered."""
        while self._frontier.time <= time:
            self._grow()

    def pieces(self, signal: str, start: float, end: float) -> Pieces:
        """V_C1, V_C2 (V) or I_DS (A) over [start, end)."""
        parts = []
        for chunk in self._covering(start, end):
            begin, stop = max(start, chunk.start), min(end, chunk.end)
            window = max(int((begin - chunk.start) / WINDOW) - 1, 0)
            while (low := chunk.start + window * WINDOW) < stop:
                high = chunk.start + (window + 1) * WINDOW
                if high > begin:
                    sampled = self._of(chunk, signal, window)
                    parts.append(sampled.between(max(begin, low), min(stop, high)))
                window += 1
        return join(parts)

    def spikes(self, start: float, end: float) -> FloatArray:
        """Times of the spikes in [start, end), s; none from before what is kept."""
        found = []
        for chunk in self._chunks:
            times = chunk.solved.spike_times
            if chunk.end > start and chunk.start < end and times.size:
                found.append(times[(times >= start) & (times < min(end, chunk.end))])
        return np.concatenate(found) if found else np.empty(0)

    def forget(self, before: float) -> None:
        """Drop what nobody will ask for any more."""
        keep = 0
        while keep < len(self._chunks) and self._chunks[keep].end <= before:
            keep += 1
        del self._chunks[:keep]
        while len(self._circuits) > 1 and self._circuits[1][0] <= before:
            del self._circuits[0]
        for chunk in self._chunks[:1]:
            old = int((before - chunk.start) / WINDOW)
            for key in [key for key in chunk.pieces if key[1] < old]:
                del chunk.pieces[key]

    def _covering(self, start: float, end: float) -> list[_Chunk]:
        self.reach(end)
        chunks = [c for c in self._chunks if c.end > start and c.start < end]
        if not chunks or chunks[0].start > start:
            raise ParameterError(
                f"The plant has forgotten what was at {start:g} s; ask in order."
            )
        return chunks

    def _grow(self) -> None:
        state = self._frontier
        latest = self._drive.latest_command(state.time)
        calm = state.time - max(latest, self._changed(state.time)[0])
        end = state.time + min(max(calm, SHORTEST), LONGEST)
        circuit = self._next_circuit(state.time)
        if not state.left_out and state.V_C2 >= circuit.fire_voltage:
            state = state._replace(V_C2=circuit.reset_voltage, resume=None)
        if self._V_fire is not None or self._warmer is not None:
            end = min(end, state.time + LONGEST_NOISY)
        solved = self._advance(circuit, state, end)
        spacing = FINE if calm < LIVELY else COARSE
        chunk = _Chunk(state, end, spacing, solved, circuit, self._fired)
        self._chunks.append(chunk)
        cut = min(self._drive.next_command(state.time), self._next_change(state.time))
        spikes = solved.spike_times
        if self._V_fire is not None and spikes.size:
            one = float(spikes[0]) + JUST
            self._fired += one <= cut
            cut = min(cut, one)
        if cut < end:
            chunk.end = cut
            solved = self._advance(circuit, state, cut)
        self._frontier = solved.after

    def _changed(self, time: float) -> tuple[float, Circuit]:
        """The circuit at `time` s, and since when it has been that."""
        return next(one for one in reversed(self._circuits) if one[0] <= time)

    def _next_change(self, time: float) -> float:
        """When the circuit changes first after `time`, s; infinite if never."""
        return next((at for at, _ in self._circuits if at > time), math.inf)

    def _next_circuit(self, time: float) -> Circuit:
        """The circuit from `time` s on, with the V_fire of the next spike."""
        circuit = self._changed(time)[1]
        if self._warmer is not None:
            kelvin = temperature(circuit) + self._warmer(time)
            circuit = at_temperature(circuit, kelvin)
        if self._V_fire is None:
            return circuit
        fire, reset = circuit.fire_voltage, circuit.reset_voltage
        volts = self._V_fire(self._fired, fire, reset)
        return replace(circuit, V_fire=volts, V_reset=reset)

    def _advance(self, circuit: Circuit, state: State, until: float) -> Solution:
        from tactile_lab.model.advance import advance

        force = self._drive.force(state.time, until)
        keep = self._keep or ("V_C1",)
        solved = advance(circuit, state, force, until, keep=keep)
        self.error_V_C1 = max(self.error_V_C1, solved.error_V_C1)
        self.error_spike_time = max(self.error_spike_time, solved.error_spike_time)
        return solved

    def _of(self, chunk: _Chunk, signal: str, window: int) -> Pieces:
        key = signal, window
        if key not in chunk.pieces:
            low = chunk.start + window * WINDOW
            high = min(chunk.start + (window + 1) * WINDOW, chunk.solved.end)
            chunk.pieces[key] = self._sampled(chunk, signal, low, high)
        return chunk.pieces[key]

    def _sampled(self, chunk: _Chunk, signal: str, low: float, high: float) -> Pieces:
        """Straight lines between samples, and both sides of each reset of V_C2."""
        solved = chunk.solved
        count = max(1, round((high - low) / chunk.spacing))
        time = np.linspace(low, high, count + 1)
        if signal != "V_C2":
            return Pieces.through(time, solved.sample(signal, time))
        spikes = solved.spike_times
        resets = spikes + self.circuit.reset_time
        if chunk.state.resume is not None:
            resets = np.concatenate([[chunk.state.resume], resets])
        resets = resets[(resets > low) & (resets <= high)]
        spikes = spikes[(spikes > low) & (spikes <= high)]
        time = np.sort(np.concatenate([time, spikes, resets, resets]))
        value = solved.sample(signal, time)
        value[np.searchsorted(time, resets, side="left")] = chunk.circuit.fire_voltage
        # the sample may lie a rounding before the end of the reset
        after = np.searchsorted(time, resets, side="right") - 1
        value[after] = chunk.circuit.reset_voltage
        return Pieces.through(time, value)
