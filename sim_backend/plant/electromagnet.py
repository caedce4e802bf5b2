"""The electromagnet after a history of set-points: current, field, voltage, heat."""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass

import numpy as np

from sim_backend.plant.pieces import Pieces, join
from sim_backend.plant.step_response import Core, Moment, StepResponse
from sim_backend.plant.winding import Winding
from tactile_lab.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class _Command:
    begin: Moment
    answer: StepResponse
    rise: tuple[float, float]


class Electromagnet:
    """Coil current, field and winding temperature after a history of set-points.

    Not thread-safe; the plant's lock is around it. Times are those of the bench, s.

    Args:
        coil_lag: L/R of the coil, s; 0 for none.
        eddy_lag: lag of the field behind the current, s; 0 for none.
        hysteresis: half-width of the core's loop, A; 0.03 to 0.07 A for mild steel.
        winding: resistance and heat.
    """

    def __init__(
        self,
        *,
        coil_lag: float = 1.1e-3,
        eddy_lag: float = 3e-3,
        hysteresis: float = 0.0,
        winding: Winding | None = None,
    ) -> None:
        self.winding = winding or Winding()
        self._core = Core(coil_lag, eddy_lag, hysteresis)
        self._times: list[float] = []
        self._commands: list[_Command] = []
        self._append(self._core.virgin(), (0.0, 0.0))

    def command(self, time: float, target: float) -> bool:
        """Let the set-point be `target` A from `time` s; false if that changes nothing.

        A time before the last command's is taken as that of the last command.
        """
        last = self._commands[-1]
        time = max(time, last.begin.time)
        if target == last.begin.target:
            return False
        current = last.answer.current.at(time)
        begin = Moment(
            time,
            target,
            current,
            last.answer.effective.at(time),
            self._core.moved(last.begin.plays, current),
        )
        rise = self._rise(time)
        if time == last.begin.time:
            # superseded, but what it moved without lag stays moved
            self._commands.pop()
            self._times.pop()
        self._append(begin, rise)
        return True

    @property
    def commands(self) -> int:
        """How many commands are remembered."""
        return len(self._times)

    @property
    def last_command(self) -> float:
        """When the last command takes effect, s."""
        return self._times[-1]

    def time_of(self, command: int) -> float:
        """When remembered command number `command` takes effect, s."""
        return self._times[command]

    def forget(self, commands: int) -> None:
        """Forget the oldest `commands`; nothing before the next may be asked for."""
        del self._commands[:commands], self._times[:commands]

    def next_command(self, time: float) -> float:
        """Time of the first command after `time` s, infinite if there is none."""
        i = bisect_right(self._times, time)
        return self._times[i] if i < len(self._times) else math.inf

    def latest_command(self, time: float) -> float:
        """Time of the last command at or before `time` s."""
        return self._at(time).begin.time

    def current(self, time: float) -> float:
        """Coil current at `time` s, A."""
        return self._at(time).answer.current.at(time)

    def effective(self, time: float) -> float:
        """Current that would give the field at `time` s in an ideal core, A."""
        return self._at(time).answer.effective.at(time)

    def voltage(self, time: float) -> float:
        """Voltage at the coil's terminals, R(T) I + L dI/dt, V."""
        current, target = self.current(time), self._at(time).begin.target
        # L is the lag times R at 20 C and dI/dt is (target - I) by the lag
        return self.resistance(time) * current + self.winding.resistance * (
            target - current
        )

    def resistance(self, time: float) -> float:
        """Resistance of the winding at `time` s, Ohm."""
        return self.winding.resistance_at(self._rise(time)[0])

    def temperature(self, time: float) -> float:
        """Winding temperature above the room's at `time` s, K."""
        return self._rise(time)[0]

    def currents(self, start: float, end: float) -> Pieces:
        """Coil current over [start, end), A."""
        return join(
            [
                c.answer.current.between(low, high)
                for c, low, high in self._cut(start, end)
            ]
        )

    def effectives(self, start: float, end: float) -> Pieces:
        """Current that would give the field over [start, end) in an ideal core, A."""
        return join(
            [
                c.answer.effective.between(low, high)
                for c, low, high in self._cut(start, end)
            ]
        )

    def foreseen(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        """Knots (s, A) of `effectives` as known at `start`, blind to later commands."""
        effective = self._at(start).answer.effective
        pieces = effective.between(start, end)
        inner = pieces.start > start
        last = pieces.value[-1] + (end - pieces.start[-1]) * pieces.slope[-1]
        return (
            np.concatenate([[start], pieces.start[inner], [end]]),
            np.concatenate([[effective.at(start)], pieces.value[inner], [last]]),
        )

    def _append(self, begin: Moment, rise: tuple[float, float]) -> None:
        self._times.append(begin.time)
        self._commands.append(_Command(begin, self._core.answer(begin), rise))

    def _at(self, time: float) -> _Command:
        return self._commands[max(bisect_right(self._times, time) - 1, 0)]

    def _rise(self, time: float) -> tuple[float, float]:
        """Winding and core above the room, K; the coil's short lag is left out."""
        command = self._at(time)
        duration = max(time - command.begin.time, 0.0)
        return self.winding.after(command.rise, command.begin.target, duration)

    def _cut(self, start: float, end: float) -> list[tuple[_Command, float, float]]:
        """The commands in force during [start, end), and when each is."""
        i = max(bisect_right(self._times, start) - 1, 0)
        found: list[tuple[_Command, float, float]] = []
        while i < len(self._times) and (not found or self._times[i] < end):
            until = self._times[i + 1] if i + 1 < len(self._times) else end
            low = max(start, self._times[i])
            found.append((self._commands[i], low, min(until, end)))
            i += 1
        return found
