"""A measured calibration of the coil: field or force against current."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tactile_lab.errors import LimitError, SceneError
from tactile_lab.quantity import show
from tactile_lab.scene.columns import read_columns


@dataclass(frozen=True, eq=False)
class Calibration:
    """Piecewise linear and monotonic between its points, refused outside them.

    Attributes:
        current: shape (n,), A, increasing, reaching from below 0 or 0 to above.
        value: shape (n,), T or N, strictly monotonic.
        unit: "T" where the field was measured, "N" where the force was.
        path: file it was read from.
    """

    current: NDArray[np.float64]
    value: NDArray[np.float64]
    unit: Literal["T", "N"]
    path: Path

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

    def at(self, current: ArrayLike) -> NDArray[np.float64]:
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
    return Calibration(current, value, "T" if names[1] == "field_T" else "N", path)
