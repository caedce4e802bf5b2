"""A measured calibration of the coil: field or force against current."""

from __future__ import annotations

import datetime
import hashlib
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.columns import read_columns, read_text
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.quantity import show

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler, ValidationInfo
    from pydantic_core import CoreSchema

COIL, VALID_UNTIL, HASH = "coil", "valid until", "sha256"
UNCERTAINTY = {"T": "uncertainty T (95 %)", "N": "uncertainty N (95 %)"}
"""Names in the head of a calibration file."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """Piecewise linear and monotonic between its points, refused outside them.

    Attributes:
        current: shape (n,), A, increasing, reaching from below 0 or 0 to above.
        value: shape (n,), T or N, strictly monotonic.
        unit: "T" where the field was measured, "N" where the force was.
        path: file it was read from.
        head: what the file says of itself by name; empty for a bare table.
        whole: the rows are those the head's hash was made of.
    """

    current: FloatArray
    value: FloatArray
    unit: Literal["T", "N"]
    path: Path
    head: Mapping[str, str] = field(default_factory=dict)
    whole: bool = False

    @property
    def least(self) -> float:
        """Smallest calibrated current, A."""
        return float(self.current[0])

    @property
    def most(self) -> float:
        """Largest calibrated current, A."""
        return float(self.current[-1])

    @property
    def slope_at_zero(self) -> float:
        """Change of the value per ampere on the segment that holds 0 A."""
        right = int(np.searchsorted(self.current, 0.0, side="right"))
        right = min(max(right, 1), self.current.size - 1)
        rise = self.value[right] - self.value[right - 1]
        return float(rise / (self.current[right] - self.current[right - 1]))

    @property
    def uncertainty(self) -> float | None:
        """Half of the 95 % band of one value, T or N; None where none is stated."""
        try:
            stated = float(self.head[UNCERTAINTY[self.unit]])
        except (KeyError, ValueError):
            return None
        return stated if self.whole and math.isfinite(stated) else None

    @property
    def valid_until(self) -> datetime.date | None:
        """Last day it may be used; None where none is stated."""
        try:
            return datetime.date.fromisoformat(self.head[VALID_UNTIL])
        except (KeyError, ValueError):
            return None

    def check(
        self,
        *,
        today: datetime.date | None = None,
        coil: str | None = None,
        beyond_date: bool = False,
        other_coil: bool = False,
    ) -> tuple[str, ...]:
        """What speaks against using it, one sentence each.

        Args:
            today: day of use; None: the date is not looked at.
            coil: identity of the current source in use; None: not looked at.
            beyond_date: a person takes that upon themselves: a doubt, no refusal.
            other_coil: likewise.

        Raises:
            SceneError: changed since it was written, expired, or of another coil.
        """
        if HASH not in self.head:
            return (
                f"The calibration {self.path.name} states no uncertainty, date or "
                "coil: nothing is carried into the forces. `calibrate_field` writes "
                "one that does.",
            )
        if not self.whole:
            raise SceneError(
                f"Calibration {self.path} was changed after it was written: its hash "
                "does not fit. Calibrate again (calibrate_field)."
            )
        doubts = []
        until = self.valid_until
        if today is not None and until is not None and today > until:
            said = f"Calibration {self.path} expired on {until.isoformat()}"
            if not beyond_date:
                raise SceneError(
                    f"{said}; today is {today.isoformat()}. Calibrate again "
                    "(calibrate_field), or use it as it is with [magnet] "
                    "allow_expired = true in the bench file."
                )
            doubts.append(f"{said} and was used nevertheless (allow_expired).")
        own = self.head.get(COIL, "")
        if coil and coil != own:
            said = f"Calibration {self.path} belongs to the coil {own}, not to {coil}"
            if not other_coil:
                raise SceneError(
                    f"{said}. Calibrate this one (calibrate_field), or use it as it "
                    "is with [magnet] allow_other_coil = true in the bench file."
                )
            doubts.append(f"{said}, and was used nevertheless (allow_other_coil).")
        return tuple(doubts)

    def at(self, current: ArrayLike) -> FloatArray:
        """The value at `current` A (any shape).

        Raises:
            LimitError: outside the calibrated range.
        """
        amperes = np.asarray(current, dtype=np.float64)
        slack = 1e-12 * max(abs(self.least), abs(self.most))
        outside = (amperes < self.least - slack) | (amperes > self.most + slack)
        if np.any(outside):
            wrong = float(np.ravel(amperes)[np.flatnonzero(outside)[0]])
            raise LimitError(
                f"{show(wrong, 'A')} lies outside the calibration {self.path.name}, "
                f"which covers {show(self.least, 'A')} to {show(self.most, 'A')}."
            )
        return np.asarray(np.interp(amperes, self.current, self.value))


class CalibrationFile:
    """Of a field: a calibration inside, the path of its file in bench files.

    A path is relative to the folder that the validation context names.
    """

    def read(self, value: Any, info: ValidationInfo) -> Calibration | None:
        """The calibration in the file that is named."""
        if value is None or isinstance(value, Calibration):
            return value
        if not isinstance(value, str):
            raise SceneError("a text in quotes is needed")
        folder: Path | None = (info.context or {}).get("folder", Path())
        if folder is None:
            return None
        return read_calibration((folder / value).resolve())

    def write(self, value: Calibration | None) -> str | None:
        """The path of its file."""
        return None if value is None else str(value.path)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        from pydantic_core import core_schema

        return core_schema.with_info_plain_validator_function(
            self.read,
            serialization=core_schema.plain_serializer_function_ser_schema(self.write),
        )


def read_calibration(path: Path) -> Calibration:
    """Read columns ``current_A,field_T`` or ``current_A,force_N``.

    Raises:
        SceneError: the file cannot be read or does not describe one value per current;
            the line is named.
    """
    names, rows, lines = read_columns(
        path, (("current_A", "field_T"), ("current_A", "force_N"))
    )
    current, value = rows[:, 0], rows[:, 1]
    if current.size < 2:
        raise SceneError(f"{path}: a calibration needs at least two rows.")
    back = np.flatnonzero(np.diff(current) <= 0)
    if back.size:
        raise SceneError(f"{path}, line {lines[back[0] + 1]}: currents must increase.")
    step = np.diff(value) * math.copysign(1.0, value[-1] - value[0])
    flat = np.flatnonzero(step <= 0)
    if flat.size:
        raise SceneError(
            f"{path}, line {lines[flat[0] + 1]}: {names[1]} must rise or fall all the "
            "way, so that each force belongs to one current."
        )
    if current[0] > 0 or current[-1] < 0:
        raise SceneError(f"{path}: the calibration must include 0 A.")
    head, whole = _head(read_text(path))
    unit: Literal["T", "N"] = "T" if names[1] == "field_T" else "N"
    return Calibration(current, value, unit, path, head, whole)


def table_hash(body: str) -> str:
    """SHA-256 of all of a calibration's file but the line that states it."""
    return hashlib.sha256(body.encode()).hexdigest()


def _head(text: str) -> tuple[dict[str, str], bool]:
    """Lines ``# name: value``, and whether the rest fits the hash among them."""
    lines = text.splitlines(keepends=True)
    head = {
        name.strip(): value.strip()
        for line in lines
        if line.startswith("# ")
        for name, _, value in [line[2:].partition(":")]
    }
    body = "".join(line for line in lines if not line.startswith(f"# {HASH}:"))
    return head, head.get(HASH) == table_hash(body)
