"""What background threads tell the window. Immutable, taken from one queue."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from gui.lanes.twinned import TwinSlice
from gui.session.request import Request
from gui.state import Fault
from tactile_lab.acquisition.events import Event
from tactile_lab.bench import OffReport

if TYPE_CHECKING:
    # loading these takes a second: the window is on screen before
    from gui.session.expect import Expectation
    from tactile_lab.acquisition.execution import Executed, Execution


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


@dataclass(frozen=True, eq=False)
class Begun:
    """A run exists; its samples can be polled."""

    execution: Execution


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
class Reported:
    """A run's report is written, or why not."""

    folder: Path
    problem: str


@dataclass(frozen=True)
class FieldByHand:
    """The field was read on request, or why not."""

    mean: float | None
    text: str


@dataclass(frozen=True, eq=False)
class Errand:
    """A person is asked to do something at the bench; `done` lets the run go on."""

    text: str
    done: threading.Event


@dataclass(frozen=True, eq=False)
class Twinned:
    """The twin of a run has come further."""

    execution: Execution
    part: TwinSlice


Told = (
    Event
    | Planned
    | Checked
    | Begun
    | Refused
    | Ended
    | Broken
    | Reported
    | Errand
    | FieldByHand
    | Twinned
    | Line
)
