"""Force, field and current: Eq. (2) of the paper, or a measured calibration.

``F = B1 A1 A2 B2 / (4 pi mu0 r^2)``; B2 is the field of the electromagnet at the
magnet, proportional to the current or taken from a calibration. The force that drives
the sensor is counted from that at 0 A: the constant pull on the steel core is no drive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.calibration import Calibration, CalibrationFile
from tactile_lab.errors import LimitError, ParameterError
from tactile_lab.lag import Lag
from tactile_lab.long_waveform import LongWaveform
from tactile_lab.quantity import Unit, show
from tactile_lab.table import SceneTable
from tactile_lab.waveform import Waveform

MU_0 = 1.25663706127e-6
"""Permeability of vacuum, T m/A (CODATA 2022)."""
A2_PRINTED = 2.25e-3
"""A2 as Table 1 prints it, m^2; a 15 mm x 15 mm core has a tenth of it."""
ROUGH = 1.3
"""A field that was not calibrated may be so many times what is supposed, or less."""


@dataclass(frozen=True)
class ForceUncertainty:
    """How well a force is known, as half-widths of 95 % bands.

    Attributes:
        absolute: by the calibration's readings and loop, the same at every force, N.
        relative: by the geometry in Eq. (2), common to all forces, a part of each.
        unstated: whether the geometry is part of the forces and nobody has stated how
            well it is known; nothing is carried for it then.
    """

    absolute: float
    relative: float
    unstated: bool = False

    @property
    def text(self) -> str:
        """For a person: "±0.5 mN and ±4 % (95 %)"."""
        told = [f"±{show(self.absolute, 'N', 2)}"] if self.absolute else []
        if self.relative or not told:
            told.append(f"±{100 * self.relative:.2g} %")
        missing = "; that of Eq. (2)'s geometry is not stated" if self.unstated else ""
        return f"{' and '.join(told)} (95 %{missing})"

    def of(self, force: ArrayLike) -> FloatArray:
        """Half of the 95 % band of `force` N (any shape), N."""
        newtons = np.asarray(force, dtype=np.float64)
        return np.asarray(np.hypot(self.absolute, self.relative * newtons))


FieldLag = Annotated[float, Unit("s", least=0.0, most=10.0)]
"""A thick core of solid iron lags by tenths of a second; more is a mistake."""


@dataclass(frozen=True, kw_only=True)
class Magnet(SceneTable):
    """The electromagnet, the magnet on the cantilever and the distance between them.

    It is the table ``[magnet]`` of a bench file.

    Args:
        r: distance between magnet and pole face, m, above 0.
        A1: area of the permanent magnet, m^2.
        A2: area of the electromagnet's core, m^2.
        B1: field of the permanent magnet, T.
        B2_per_ampere: field of the electromagnet per current, T/A; not used where a
            calibration is given.
        calibration: measured field or force against current.
        geometry_uncertainty: half of the 95 % band of Eq. (2)'s r, A1, A2 and B1
            together, as a part of the force, from 0 to below 1; None where nobody has
            stated it.
        coil_lag: L/R of the coil, s: the current's lag behind the set-point.
        eddy_lag: lag of the field behind the current, s.
        lag_uncertainty: half of the 95 % band of their sum, s; None where nobody has
            measured the lags.
        allow_expired: use the calibration beyond its date nevertheless.
        allow_other_coil: use it with another source than it was made with.

    Raises:
        ParameterError: a value is not finite or out of range.
    """

    r: Annotated[float, Unit("m", above=0.0)]
    A1: Annotated[float, Unit("m^2", above=0.0)] = 2.827e-5
    A2: Annotated[float, Unit("m^2", above=0.0)] = A2_PRINTED
    B1: Annotated[float, Unit("T", above=0.0)] = 0.163
    B2_per_ampere: Annotated[float, Unit("T/A")] = 0.011
    calibration: Annotated[Calibration | None, CalibrationFile()] = None
    geometry_uncertainty: float | None = None
    coil_lag: FieldLag = 0.0
    eddy_lag: FieldLag = 0.0
    lag_uncertainty: FieldLag | None = None
    allow_expired: bool = False
    allow_other_coil: bool = False

    def __post_init__(self) -> None:
        for name in ("r", "A1", "A2", "B1"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise ParameterError(f"{name} = {value} must be finite and above 0.")
        if not 0 < self.newtons_per_tesla < math.inf:
            raise ParameterError(
                f"r = {self.r:g} m with A1, A2 and B1 gives {self.newtons_per_tesla:g} "
                "N/T by Eq. (2), which is no force to compute with. Look at the units; "
                "r is some millimetres."
            )
        if not math.isfinite(self.B2_per_ampere) or self.B2_per_ampere == 0:
            raise ParameterError(
                f"B2_per_ampere = {self.B2_per_ampere} T/A must be finite and not 0."
            )
        if self.geometry_uncertainty is not None and not (
            0 <= self.geometry_uncertainty < 1
        ):
            raise ParameterError(
                f"geometry_uncertainty = {self.geometry_uncertainty} must be at least "
                "0 and less than 1."
            )

    @property
    def newtons_per_tesla(self) -> float:
        """Force per field of the electromagnet, Eq. (2), N/T."""
        return self.B1 * self.A1 * self.A2 / (4 * math.pi * MU_0) / self.r / self.r

    @property
    def newtons_per_ampere(self) -> float:
        """Force per current around 0 A, N/A."""
        if self.calibration is None:
            return self.newtons_per_tesla * self.B2_per_ampere
        return self._per_unit * self.calibration.slope_at_zero

    @property
    def force_uncertainty(self) -> ForceUncertainty | None:
        """What calibration and geometry leave open; None where neither states any."""
        used = self.calibration
        stated = None if used is None else used.uncertainty
        relative = self.geometry_uncertainty if self.by_geometry else 0.0
        if stated is None and not relative:
            return None
        # F(I) - F(0) is the difference of two values of the calibration
        absolute = 0.0 if stated is None else math.sqrt(2) * stated * self._per_unit
        return ForceUncertainty(absolute, relative or 0.0, unstated=relative is None)

    @property
    def by_geometry(self) -> bool:
        """Whether forces rest on Eq. (2)'s r, A1, A2, B1: not where they were read."""
        return self.calibration is None or self.calibration.unit == "T"

    @property
    def _per_unit(self) -> float:
        """Newtons per unit of the calibration's values."""
        used = self.calibration
        return 1.0 if used and used.unit == "N" else self.newtons_per_tesla

    def field(self, current: ArrayLike) -> FloatArray:
        """Field of the electromagnet, T, at `current` A (any shape)."""
        amperes = np.asarray(current, dtype=np.float64)
        if self.calibration is None:
            return amperes * self.B2_per_ampere
        if self.calibration.unit == "T":
            return self.calibration.at(amperes)
        return self.force(amperes) / self.newtons_per_tesla

    def force(self, current: ArrayLike) -> FloatArray:
        """Drive force F(I) - F(0), N, at `current` A (any shape)."""
        amperes = np.asarray(current, dtype=np.float64)
        if self.calibration is None:
            return amperes * self.newtons_per_ampere
        change = self.calibration.at(amperes) - self.calibration.at(0.0)
        return np.asarray(self._per_unit * change)

    def reachable(self, limit: float) -> tuple[float, float]:
        """Least and largest force, N, within `limit` A and the calibration."""
        low, high = -limit, limit
        if self.calibration is not None:
            low = max(low, self.calibration.least)
            high = min(high, self.calibration.most)
        ends = np.sort(self.force(np.array([low, high])))
        return float(ends[0]), float(ends[1])

    def current_for(self, force: Waveform, limit: float = math.inf) -> Waveform:
        """The current, A, that gives `force`, N.

        Args:
            force: piecewise linear; kinks of a calibration become points of their own.
            limit: largest current magnitude the coil may carry, A.

        Raises:
            LimitError: a force lies beyond the coil's limit or the calibration; the
                reachable force is named.
        """
        if self.calibration is None and math.isinf(limit):
            return force.scaled(1 / self.newtons_per_ampere)
        low, high = self.reachable(limit)
        slack = 1e-12 * max(abs(low), abs(high))
        if force.value.min() < low - slack or force.value.max() > high + slack:
            beyond = np.maximum(low - force.value, force.value - high)
            over = float(force.value[np.argmax(beyond)])
            raise LimitError(
                f"force {show(over, 'N')} is beyond the coil: reachable is "
                f"{show(low, 'N')} to {show(high, 'N')} within {self._bounds(limit)}. "
                "Ask for less force, or bring the magnet nearer (r) in the bench file."
            )
        if self.calibration is None:
            return force.scaled(1 / self.newtons_per_ampere)
        amperes = self.calibration.current
        newtons = self.force(amperes)
        bent = force.with_points_at(newtons)
        if newtons[0] > newtons[-1]:
            amperes, newtons = amperes[::-1], newtons[::-1]
        return Waveform(bent.time, np.interp(bent.value, newtons, amperes))

    def force_for(
        self, current: Waveform, beyond: Literal["refuse", "hold"] = "refuse"
    ) -> Waveform:
        """The force, N, that `current`, A, gives.

        Args:
            current: piecewise linear.
            beyond: what to do outside the calibration; "hold" takes its last value,
                for currents that were not asked for as a force (demagnetising).

        Raises:
            LimitError: the current leaves the calibration, and `beyond` refuses that.
        """
        if self.calibration is None:
            return current.scaled(self.newtons_per_ampere)
        if beyond == "hold":
            ends = self.calibration.least, self.calibration.most
            current = current.with_points_at(np.array(ends))
            current = Waveform(current.time, np.clip(current.value, *ends))
        bent = current.with_points_at(self.calibration.current)
        return Waveform(bent.time, self.force(bent.value))

    @property
    def lag(self) -> Lag:
        """Of the field behind the set-point."""
        return Lag(self.coil_lag, self.eddy_lag)

    def lagged_force(
        self, setpoint: Waveform, before: tuple[float, float] | None = None
    ) -> tuple[Waveform, tuple[float, float]]:
        """The force, N, while the source is set to `setpoint`, lags included.

        Args:
            setpoint: A, piecewise linear; beyond the calibration its last value holds.
            before: as `Lag.follow` takes and gives it.
        """
        field, after = self.lag.follow(setpoint, before)
        return self.force_for(field, beyond="hold"), after

    def long_force(self, setpoint: Waveform) -> LongWaveform:
        """What `lagged_force` gives, in pieces."""
        return LongWaveform(lambda: self.lag.in_pieces(setpoint)).each(
            lambda field: self.force_for(field, beyond="hold")
        )

    def _bounds(self, limit: float) -> str:
        if self.calibration is None:
            return f"the limit of {show(limit, 'A')}"
        return (
            f"the limit of {show(limit, 'A')} and the calibration's "
            f"{show(self.calibration.least, 'A')} to {show(self.calibration.most, 'A')}"
        )
