"""What the window asks of the engine. Immutable; sent through one pipe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from gui.session.request import Request

if TYPE_CHECKING:
    from gui.session.finding import Finding
    from gui.session.fit import Beside


@dataclass(frozen=True)
class StartRun:
    """Run a request.

    Attributes:
        run: number that tells this run's messages from others'.
        request: what to run.
        out: folder for run folders.
        notes: kept with the run.
        report: whether the report is written at its end.
    """

    run: int
    request: Request
    out: Path
    notes: Mapping[str, str] = field(default_factory=dict)
    report: bool = True


@dataclass(frozen=True)
class StartWatch:
    """Watch a request that asks for no force; nothing is kept.

    Attributes:
        run: number that tells its messages from others'.
        request: what to watch.
    """

    run: int
    request: Request


@dataclass(frozen=True)
class RecordWatch:
    """Keep what a watch holds, the last minute, as a run in `out`."""

    run: int
    out: Path
    notes: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class TakeCoil:
    """Open a coil source to drive it by hand; it stays off.

    Attributes:
        run: number that tells its messages from others'.
        request: names the bench.
    """

    run: int
    request: Request


@dataclass(frozen=True)
class SetCoil:
    """Have a coil that was taken go to `current`, A."""

    run: int
    current: float


@dataclass(frozen=True)
class RenewLease:
    """The window lives: a coil that was taken may stay on for another 2 s."""

    run: int


@dataclass(frozen=True)
class ReadField:
    """Read the field once.

    Attributes:
        run: of a coil that was taken from the same bench; 0 if there is none.
        request: names the bench.
    """

    run: int
    request: Request


@dataclass(frozen=True)
class StopRun:
    """Switch the coil off and end a run, a watch or what is done by hand; why."""

    run: int
    reason: str


@dataclass(frozen=True)
class TakeNote:
    """Put a note of the user into a run's log, stamped with its time, s."""

    run: int
    text: str
    time: float


@dataclass(frozen=True)
class ErrandDone:
    """The person has done what a run waits for; `answer` is what was typed."""

    run: int
    answer: str = ""


@dataclass(frozen=True)
class MakePlan:
    """Plan a request; `serial` comes back with the answer."""

    serial: int
    request: Request


@dataclass(frozen=True)
class CheckBench:
    """Ask every instrument of a request's bench who it is; make the coil safe."""

    request: Request


@dataclass(frozen=True)
class MakeTwin:
    """Solve the model beside a finished run, in `folder`."""

    folder: Path


@dataclass(frozen=True)
class LookAtTwin:
    """Sample the twin of the run in `folder` closely.

    Attributes:
        start, end: on the run's time axis, s.
        bins: how many.
    """

    folder: Path
    start: float
    end: float
    bins: int


@dataclass(frozen=True, eq=False)
class FitSteps:
    """Fit steps, and compare what was seen with the model; `serial` comes back."""

    serial: int
    steps: tuple[Finding, ...]
    seen: Beside


@dataclass(frozen=True)
class Leave:
    """The window closes: end all runs, then the process."""


Command = (
    StartRun
    | StartWatch
    | RecordWatch
    | TakeCoil
    | SetCoil
    | RenewLease
    | ReadField
    | StopRun
    | TakeNote
    | ErrandDone
    | MakePlan
    | CheckBench
    | MakeTwin
    | LookAtTwin
    | FitSteps
    | Leave
)
