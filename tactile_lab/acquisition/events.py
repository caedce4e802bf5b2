"""What a run tells whoever watches it: small immutable events, through one callable.

The command line prints them, the window queues them into its own thread. Samples are
not events: a watcher polls them from `tactile_lab.acquisition.live.LiveBins`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from tactile_lab.trial import Outcome, Trial
from tactile_lab.voltage_source import HeldVoltage


class RunState(StrEnum):
    """Where a run is."""

    CONNECTING = "connecting"
    READY = "ready"
    RUNNING = "running"
    STOPPING = "stopping"
    COMPLETE = "complete"
    ABORTED = "aborted"
    FAULTED = "faulted"
    REFUSED = "refused"
    LOST = "lost"


@dataclass(frozen=True)
class StateChanged:
    """The run entered `state`; `text` says why, for a person."""

    state: RunState
    text: str


@dataclass(frozen=True)
class RecordBegun:
    """The record begins: run time 0 is `origin` s of the bench's clock.

    Attributes:
        origin: when the first sample was taken, s.
        uncertainty: of that, s.
    """

    origin: float
    uncertainty: float


@dataclass(frozen=True)
class Streaming:
    """The scope streams from now on, or pauses as planned, until told otherwise."""

    on: bool


@dataclass(frozen=True)
class TrialStarted:
    """Trial `index` begins at `start` s on the run's time axis."""

    index: int
    trial: Trial
    start: float


@dataclass(frozen=True)
class TrialEnded:
    """A trial's outcome is known."""

    outcome: Outcome


@dataclass(frozen=True)
class Progress:
    """Run time reached, and run time expected in total (None if unknown), s."""

    elapsed: float
    expected: float | None


@dataclass(frozen=True)
class CoilCurrent:
    """Set-point last sent and current read back, A, at a time on the run's axis, s.

    Attributes:
        asked: when the source was addressed, s: it acted between then and `time`.
        answered: when its answer set out, s.
    """

    time: float
    setpoint: float
    measured: float | None
    asked: float | None = None
    answered: float | None = None

    @property
    def acted(self) -> float:
        """When the source is taken to have acted, s: as it began to answer."""
        return self.time if self.answered is None else self.answered

    @property
    def doubt(self) -> float:
        """By how much it may have acted earlier or later, s."""
        asked = self.time if self.asked is None else self.asked
        return max(self.time - self.acted, self.acted - asked)

    @property
    def amperes(self) -> float:
        """As read back, or where it was not, as sent."""
        return self.setpoint if self.measured is None else self.measured


@dataclass(frozen=True)
class FieldRead:
    """Flux density, T, at a time on the run's axis, s."""

    time: float
    field: float


@dataclass(frozen=True)
class TemperatureRead:
    """Temperature of the sensor, K, at a time on the run's axis, s."""

    time: float
    kelvin: float


@dataclass(frozen=True)
class VoltageRead:
    """The source of the circuit's voltage `name` was read back, on the run's axis."""

    name: str
    held: HeldVoltage


@dataclass(frozen=True)
class SpikesSeen:
    """Newly detected spikes.

    A watcher that shows one number shows the last rate. It falls to 0 only in the eye
    of a watcher that counts the time since the last spike: silence is no event.

    Attributes:
        times: on the run's axis, s, ascending.
        rates: instantaneous rate right after each of them, 1/ISI, Hz: 0 after the
            run's first spike; the ISI may span a planned pause.
        amplitudes: of each, V: the peak of V_K, or the fall of V_C2 in a reset.
    """

    times: tuple[float, ...]
    rates: tuple[float, ...]
    amplitudes: tuple[float, ...]

    @property
    def intervals(self) -> tuple[float, ...]:
        """Time since the spike before each, s; infinite for the run's first."""
        return tuple(1 / rate if rate > 0 else math.inf for rate in self.rates)


@dataclass(frozen=True)
class Message:
    """Something a person should know; `level` is info, warning or error."""

    level: str
    text: str


Event = (
    StateChanged
    | RecordBegun
    | Streaming
    | TrialStarted
    | TrialEnded
    | Progress
    | CoilCurrent
    | FieldRead
    | TemperatureRead
    | VoltageRead
    | SpikesSeen
    | Message
)
Emit = Callable[[Event], None]


def documented(event: Event) -> dict[str, Any] | None:
    """The object other programs are told (docs/json.md); None if they are not."""
    match event:
        case StateChanged(state=state, text=text):
            told: dict[str, Any] = {"event": "state", "state": str(state), "text": text}
        case Progress(elapsed=elapsed, expected=expected):
            told = {"event": "progress", "elapsed_s": elapsed, "expected_s": expected}
        case TrialStarted(index=index, trial=trial, start=start):
            told = {"event": "trial_started", "index": index, "label": trial.label}
            told["start_s"] = start
        case TrialEnded(outcome=outcome):
            told = {"event": "trial_ended", "index": outcome.index}
            told["spikes"] = len(outcome.spike_times)
        case SpikesSeen(times=times, rates=rates, amplitudes=amplitudes):
            told = {"event": "spikes", "times_s": list(times), "rates_Hz": list(rates)}
            told["amplitudes_V"] = list(amplitudes)
        case FieldRead(time=at, field=field):
            told = {"event": "field", "time_s": at, "field_T": field}
        case TemperatureRead(time=at, kelvin=kelvin):
            told = {"event": "temperature", "time_s": at, "temperature_K": kelvin}
        case VoltageRead(name=name, held=held):
            told = {"event": "voltage", "time_s": held.time, "name": name}
            told |= {"V": held.voltage, "A": held.current}
            told["setpoint_V"] = held.setpoint
        case Message(level=level, text=text):
            told = {"event": "message", "level": level, "text": text}
        case _:
            return None
    return told


def ignore(event: Event) -> None:
    """Watch nothing."""


def until_it_fails(emit: Emit, tell: Callable[[str], None] = lambda _: None) -> Emit:
    """`emit` for as long as it works: a watcher that fails is dropped, never the run.

    Args:
        emit: a closed terminal, a window or a script with a bug.
        tell: is told, once, what failed.
    """
    failed = False

    def guarded(event: Event) -> None:
        nonlocal failed
        if failed:
            return
        try:
            emit(event)
        except Exception as failure:
            failed = True
            tell(
                "What watched this run failed and is told nothing more: "
                f"{type(failure).__name__}: {failure}."
            )

    return guarded
