"""Any force from a table of times and forces."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.columns import read_columns
from tactile_lab.errors import SceneError
from tactile_lab.quantity import Duration
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform


class ForceTable(ForceProtocol):
    """The force of a CSV file, ``time_s,force_N``: linear between rows.

    The same time twice is a jump. The force is held before the first row and after the
    last one.
    """

    name: ClassVar[str] = "waveform"
    title: ClassVar[str] = "Waveform from a file"

    file: str = Field(min_length=1, description="CSV with columns time_s,force_N")
    duration: Duration | None = Field(
        default=None, description="Length; the last row's time unless given"
    )

    def presentations(self) -> Trials:
        """One trial: the whole table."""
        force = read_force(Path(self.file))
        length = force.end if self.duration is None else self.duration
        if length <= 0:
            raise SceneError(
                f"{self.file}: the last row is at {force.end:g} s; give a later row or "
                'duration = "... s" above 0 s.'
            )
        yield Trial(force=force, label=Path(self.file).name, duration=length)

    def located(self, folder: Any) -> ForceTable:
        """The same with `file` found relative to `folder`, and read once to check it.

        Raises:
            SceneError: the file is missing or not such a table.
        """
        placed = self.model_copy(
            update={"file": str((Path(folder) / self.file).resolve())}
        )
        next(placed.presentations())
        return placed


def read_force(path: Path) -> Waveform:
    """The force, N against s, in a CSV file with the header ``time_s,force_N``.

    Raises:
        SceneError: not readable, not such a table, not finite, or times that decrease
            or occur more than twice; the line is named.
    """
    _, rows, lines = read_columns(path, (("time_s", "force_N"),))
    time = rows[:, 0]
    back = np.flatnonzero(np.diff(time) < 0)
    if back.size:
        i = int(back[0]) + 1
        raise SceneError(
            f"{path}, line {lines[i]}: time {time[i]:g} s follows {time[i - 1]:g} s; "
            "sort the rows by time."
        )
    triple = np.flatnonzero(time[2:] == time[:-2])
    if triple.size:
        i = int(triple[0]) + 2
        raise SceneError(
            f"{path}, line {lines[i]}: time {time[i]:g} s occurs a third time; a jump "
            "has two rows, the force before and the force after."
        )
    return Waveform(time, rows[:, 1])
