"""A run that goes on while it is read."""

from collections.abc import Callable
from typing import Any, cast

import numpy as np
import pytest

from tactile_lab.store.run import Run

Table = np.ndarray[Any, Any]


def begins_a_trial(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever reads the trials of any run, and their records again, finds another."""
    trials = cast(Callable[[Run], Table], cast(property, Run.trials).fget)
    records, reading = Run.records, list[Run]()

    def seen(run: Run) -> Table:
        reading.append(run)
        found = trials(run)
        reading.pop()
        return found

    def longer(run: Run, name: str) -> Table:
        rows = records(run, name)
        if reading or name != "trials":
            return rows
        return np.append(rows, np.zeros(1, rows.dtype))

    monkeypatch.setattr(Run, "trials", property(seen))
    monkeypatch.setattr(Run, "records", longer)
