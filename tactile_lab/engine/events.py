"""What a task tells through the pipe, besides the events of `acquisition.events`.

First `Begun`, last `Ended`, always; between them whatever happens.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tactile_lab.acquisition.ending import CoilState, Ending
from tactile_lab.acquisition.events import Event
from tactile_lab.arrays import FloatArray
from tactile_lab.bench import CoilLimits
from tactile_lab.trace import Trace


@dataclass(frozen=True)
class Begun:
    """A task could be begun; its samples follow. A refused one only ends.

    Attributes:
        folder: of a run; None of the others.
        limits: of the coil; None without one.
        newtons_per_ampere: turns coil current into force.
        critical_V_C1: the sensor fires below it, V.
        simulated: whether its bench is.
        counted: whether all spikes are seen: none falls between two samples.
        shortest_interval: less than any between two spikes of the sensor, s.
    """

    folder: Path | None
    limits: CoilLimits | None
    newtons_per_ampere: float
    critical_V_C1: float
    simulated: bool
    counted: bool = True
    shortest_interval: float = 0.0


@dataclass(frozen=True, eq=False)
class Samples:
    """The newest samples by signal, decimated, and the coil just now.

    Told at least five times a second, with or without samples.
    """

    bins: dict[str, Trace]
    coil: CoilState


@dataclass(frozen=True, eq=False)
class ModelPart:
    """What the model made of the current that was applied, over a stretch of time.

    Attributes:
        bins: signal -> its bins.
        spikes: times, ascending, s.
        end: time up to which the model has come, s.
    """

    bins: dict[str, Trace]
    spikes: FloatArray
    end: float


@dataclass(frozen=True)
class PersonAsked:
    """A person is asked to do something at the bench; the run waits for the answer.

    Attributes:
        text: what.
        current: at which the field is to be read off and typed, A; None where there is
            something to do and nothing to type.
        doubt: why it is asked again, "" the first time.
    """

    text: str
    current: float | None = None
    doubt: str = ""


@dataclass(frozen=True)
class Ended:
    """A task has ended; nothing of it holds an instrument any more."""

    ending: Ending


TaskEvent = Event | Begun | Samples | ModelPart | PersonAsked | Ended
