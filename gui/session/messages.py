"""What background threads tell the window. Immutable, taken from one queue."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from gui.lanes.twin import TwinSlice
from gui.session.request import Request
from gui.state import Fault
from tactile_lab.acquisition.events import Event
from tactile_lab.bench import CoilLimits, OffReport
from tactile_lab.trace import Trace

if TYPE_CHECKING:
    # loading these takes a second: the window is on screen before
    from gui.session.expectation import Expectation
    from gui.session.fit import Fit
    from tactile_lab.acquisition.ending import CoilState, Executed


class Level(Enum):
    """How much a line of the log matters."""

    INFO = "info"
    GOOD = "check"
    WARNING = "warning"
    ERROR = "error"
    NOTE = "note"


@dataclass(frozen=True)
class Line:
    """One line of the log.

    Attributes:
        at: wall-clock time.
        level: how much it matters.
        source: who says so: runner, coil, scope, plan, store, note, ...
        text: for a person.
        safety: whether it is about the coil's safe state.
    """

    at: datetime
    level: Level
    source: str
    text: str
    safety: bool = False


@dataclass(frozen=True, eq=False)
class Planned:
    """The answer to a request for a plan; `serial` tells which."""

    serial: int
    request: Request
    expectation: Expectation | None
    problem: str


@dataclass(frozen=True)
class Identified:
    """One instrument answered, or did not."""

    role: str
    identity: str
    problem: str


@dataclass(frozen=True)
class Checked:
    """The bench was asked who is there, and the coil was made safe.

    Attributes:
        bench: name of the bench.
        simulated: whether its physics is computed.
        found: one entry per instrument of the bench.
        off: how the coil was left; None without a coil.
    """

    bench: str
    simulated: bool
    found: tuple[Identified, ...]
    off: OffReport | None


@dataclass(frozen=True)
class Begun:
    """A run exists; its samples follow.

    Attributes:
        limits: of its coil; None without one.
        newtons_per_ampere: turns coil current into force.
        critical_V_C1: the sensor fires below it, V.
    """

    limits: CoilLimits | None
    newtons_per_ampere: float
    critical_V_C1: float


@dataclass(frozen=True, eq=False)
class Samples:
    """The newest samples of a run by signal, decimated, and the coil just now."""

    bins: dict[str, Trace]
    coil: CoilState


@dataclass(frozen=True)
class Refused:
    """A run or a check could not begin."""

    fault: Fault


@dataclass(frozen=True)
class Ended:
    """A run has ended and its folder is closed."""

    done: Executed


@dataclass(frozen=True)
class Broken:
    """A run's thread ended by an error that is no fault of the bench."""

    fault: Fault
    off: OffReport | None


@dataclass(frozen=True)
class Recorded:
    """The last minute of a watch is a run now, or why not."""

    folder: Path | None
    problem: str


@dataclass(frozen=True)
class Reported:
    """A run's report is written, or why not."""

    folder: Path
    problem: str


@dataclass(frozen=True)
class CoilByHand:
    """The coil driven by hand, just now. Each is answered by renewing the lease.

    Attributes:
        coil: what its thread knows.
        opened: the source has answered.
        acted: the source acknowledged something since this was told last.
        read_back: and its current was read back.
    """

    coil: CoilState
    opened: bool
    acted: bool
    read_back: bool


@dataclass(frozen=True)
class HandOff:
    """The coil is driven by hand no more.

    Attributes:
        off: how it was left; None if nobody knows.
        problem: why it ended by itself, "" if it was asked to.
        opened: whether the source was touched at all.
    """

    off: OffReport | None
    problem: str
    opened: bool = True


@dataclass(frozen=True)
class FieldByHand:
    """The field was read on request, or why not."""

    mean: float | None
    text: str


@dataclass(frozen=True)
class Errand:
    """A person is asked to do something at the bench; the run waits for it.

    Attributes:
        text: what.
        current: at which the field is to be read off and typed, A; None where there is
            something to do and nothing to type.
        doubt: why it is asked again, "" the first time.
    """

    text: str
    current: float | None = None
    doubt: str = ""


@dataclass(frozen=True, eq=False)
class Twinned:
    """The twin of a run in progress has come further."""

    part: TwinSlice


@dataclass(frozen=True, eq=False)
class Twins:
    """The twin of a finished run, or why there is none."""

    folder: Path
    whole: TwinSlice | None
    problem: str


@dataclass(frozen=True, eq=False)
class TwinSeen:
    """A part of the twin of a finished run, seen closely."""

    folder: Path
    part: TwinSlice


@dataclass(frozen=True, eq=False)
class Fitted:
    """The fit that was asked for as `serial`; None where it broke."""

    serial: int
    found: Fit | None


@dataclass(frozen=True)
class Gone:
    """A run's thread has ended; nothing of it holds an instrument any more."""


@dataclass(frozen=True)
class Lost:
    """The engine has ended by itself; `driving` is whether it had a coil or a scope."""

    why: str
    driving: bool


Told = (
    Event
    | Planned
    | Checked
    | Begun
    | Refused
    | Ended
    | Broken
    | Recorded
    | Reported
    | Errand
    | CoilByHand
    | HandOff
    | FieldByHand
    | Samples
    | Twinned
    | Twins
    | TwinSeen
    | Fitted
    | Gone
    | Lost
    | Line
)
