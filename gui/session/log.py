"""The log of the window: what happened, when, and who says so."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from enum import Enum
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from gui.state import unmarked

KEPT = 5000
"""Newest lines that are kept."""


class Severity(Enum):
    """How much a line of the log matters."""

    INFO = "info"
    GOOD = "check"
    WARNING = "warning"
    ERROR = "error"
    NOTE = "note"


@dataclass(frozen=True)
class LogLine:
    """One line of the log.

    Attributes:
        at: wall-clock time.
        level: how much it matters.
        source: who says so: runner, coil, scope, plan, store, note, ...
        text: for a person.
        safety: whether it is about the coil's safe state.
        time: of the run it tells of, s; None where it tells of none.
        run: folder of that run; None where it is not kept.
    """

    at: datetime
    level: Severity
    source: str
    text: str
    safety: bool = False
    time: float | None = None
    run: Path | None = None


class Log(QObject):
    """Lines, the oldest first."""

    added = Signal(object)
    told = Signal(str)
    """Is to be seen where the log is not, too; "" takes it away."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[LogLine] = []

    def add(
        self,
        level: Severity,
        source: str,
        text: str,
        *,
        safety: bool = False,
        time: float | None = None,
        run: Path | None = None,
    ) -> None:
        """Put a line into the log; `time`: of the run, s, where it has one."""
        now, text = datetime.now(), unmarked(text)
        line = LogLine(now, level, source, text, safety, time, run)
        self.lines.append(line)
        del self.lines[:-KEPT]
        self.added.emit(line)

    def tell(self, level: Severity, source: str, text: str) -> None:
        """Put a line into the log of what somebody asked for and does not get.

        A low window does not show the log: this is to be seen above the lanes, too.
        """
        self.add(level, source, text)
        self.told.emit(text)
