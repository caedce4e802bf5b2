"""What is known of a run from outside: its coil while it lasts, and how it ended."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from tactile_lab.acquisition.events import RunState
from tactile_lab.bench import OffReport
from tactile_lab.errors import TactileLabError


@dataclass(frozen=True)
class CoilState:
    """What is known of the coil now; nothing where there is none.

    Attributes:
        live: the output is on, or may be: it was told to go on, and until `read` is
            there nothing more is known.
        setpoint: last sent, A.
        measured: last read back, A.
        off: how it was left; None while the run lasts.
        read: clock time of that read-back, s; None before any.
    """

    live: bool = False
    setpoint: float | None = None
    measured: float | None = None
    off: OffReport | None = None
    read: float | None = None


@dataclass(frozen=True)
class Ending:
    """How a run ended.

    Attributes:
        state: complete, aborted or faulted; refused or lost where an engine was asked.
        off: how the coil was left.
        reason: why it ended early; None if complete.
        failure: the error behind a fault.
        signal: POSIX signal that asked for the end, if one did.
    """

    state: RunState
    off: OffReport
    reason: str | None = None
    failure: BaseException | None = None
    signal: int | None = None

    @classmethod
    def refused(cls, reason: str) -> Ending:
        """The end of what was never begun."""
        off = OffReport(True, None, "No instrument was opened.")
        return cls(RunState.REFUSED, off, reason)

    def faulted_by(self, failure: Exception) -> Ending:
        """The same end where something failed after it; an earlier fault stays."""
        if self.state is RunState.FAULTED:
            return self
        known = isinstance(failure, TactileLabError)
        reason = str(failure) if known else f"{type(failure).__name__}: {failure}"
        return replace(self, state=RunState.FAULTED, reason=reason, failure=failure)

    @property
    def told(self) -> str:
        """How it ended and how the coil was left, in sentences."""
        reason = self.reason or ""
        stop = "" if not reason or reason.endswith((".", "!", "?")) else "."
        left = "" if self.off.text in reason else self.off.text
        return " ".join(f"{self.state}: {reason}{stop} {left}".split())

    @property
    def exit_code(self) -> int:
        """0 complete, 2 refused, 3 faulted, 4 safe state not verified, 128 + signal."""
        if not self.off.verified:
            return 4
        if self.state is RunState.COMPLETE:
            return 0
        if self.state is RunState.REFUSED:
            return 2
        if self.state is not RunState.ABORTED:
            return 3  # whatever came after the fault
        return 130 if self.signal is None else 128 + self.signal


@dataclass(frozen=True, kw_only=True)
class Executed(Ending):
    """How a run ended, and what it left.

    Attributes:
        folder: where it lies.
        spikes: detected on line; None where none were looked for.
        loss: samples and spikes lost; None where it cannot be told.
        duration: of the experiment, s.
        took: wall time, s.
    """

    folder: Path
    spikes: int | None
    loss: Mapping[str, int | None]
    duration: float
    took: float
