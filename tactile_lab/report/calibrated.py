"""What a run's calibration file says of itself: uncertainty, age, coil."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path

from tactile_lab.analysis.field_calibration import check_calibration
from tactile_lab.errors import SceneError

UNCERTAINTY = "uncertainty T (95 %)"


@dataclass(frozen=True)
class Provenance:
    """Of one calibration file.

    Attributes:
        uncertainty: half of the 95 % band of a field value, T; None if not stated.
        warnings: why it should not be trusted, one sentence each.
    """

    uncertainty: float | None
    warnings: tuple[str, ...]


def provenance(path: Path, started: str, coil: str) -> Provenance:
    """Check a calibration file against the day of the run and the coil used.

    Files that `write_calibration` did not write state nothing and are said to.

    Args:
        path: the file, or the run's copy of it.
        started: date and time of the run, "2026-11-21 ...".
        coil: identity of the coil source; "" if it is not known.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as reason:
        return Provenance(None, (f"The calibration cannot be read again: {reason}.",))
    if "# sha256:" not in text:
        return Provenance(
            None, (f"The calibration {path.name} states no uncertainty and no date.",)
        )
    try:
        day = datetime.date.fromisoformat(started[:10])
    except ValueError:
        day = None
    try:
        head = check_calibration(path, coil=coil or None, today=day)
        return Provenance(float(head[UNCERTAINTY]), ())
    except (SceneError, KeyError, ValueError) as reason:
        return Provenance(None, (str(reason),))
