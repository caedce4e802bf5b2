"""``[[stimulus]]``: what presses on the skin, where, and when."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import SceneError
from tactile_lab.quantity import Duration, Pause, Unit, show
from tactile_lab.skin import contact
from tactile_lab.skin.braille import dots
from tactile_lab.skin.layout import Array, Length, Place
from tactile_lab.table import SceneTable

Angle = Annotated[float, Unit("deg")]
Strength = Annotated[float, Unit("N", above=0.0)]
Pressure = Annotated[float, Unit("Pa", above=0.0)]
Speed = Annotated[float, Unit("m/s", least=0.0)]
Frequency = Annotated[float, Unit("Hz", above=0.0)]
Part = Annotated[float, Field(ge=0, le=1)]
PER_CYCLE, PER_DEPTH = 4, 2
"""Points in a cycle of vibration, and while a load moves by the depth of the taxels,
within which no stress can change faster; `forces` finds more between them."""
MOST_POINTS = 1e6
"""Most of these points for one taxel."""


@dataclass(frozen=True, kw_only=True)
class Stimulus(SceneTable, ABC):
    """What every load has: a place, a time course and a motion.

    It is pressed at `start`, fully after `ramp`, for `hold`, and taken away as fast;
    again every `period` if it is pressed more than once.

    Attributes:
        at: where its centre is at first, x and y, m.
        start: s.
        ramp: s.
        hold: s.
        times: how often it is pressed.
        period: from one press to the next, s.
        speed: along the surface, m/s.
        towards: direction of that motion, from the x axis, degrees.
        rests: after `start` it stands still for so long, s; then it slips.
        vibration: amplitude of a vibration, a part of the strength.
        frequency: of that vibration, Hz.
    """

    kind: ClassVar[str]
    at: tuple[Place, Place] = (0.0, 0.0)
    start: Pause = 0.0
    ramp: Duration = 0.05
    hold: Pause = 1.0
    times: Annotated[int, Field(ge=1, le=1_000_000)] = 1
    period: Duration | None = None
    speed: Speed = 0.0
    towards: Angle = 0.0
    rests: Pause = 0.0
    vibration: Part = 0.0
    frequency: Frequency = 30.0

    def __post_init__(self) -> None:
        once = 2 * self.ramp + self.hold
        if self.times > 1 and (self.period or 0.0) < once:
            raise SceneError(
                f"pressed {self.times} times for {show(once, 's')}: write a period of "
                "at least that"
            )

    @property
    @abstractmethod
    def strength(self) -> float:
        """Force, N, or pressure, Pa, while it is held."""

    @abstractmethod
    def loads(self, array: Array) -> FloatArray:
        """What it is made of, rows as `contact` describes, shape (n, COLUMNS)."""

    @property
    def corners(self) -> FloatArray:
        """When a press begins, holds, is taken away and ends, s, shape (times, 4)."""
        once = np.cumsum([self.start, self.ramp, self.hold, self.ramp])
        again = (self.period or 0.0) * np.arange(self.times)
        return np.asarray(again[:, None] + once)

    def points(self, depth: float, duration: float) -> FloatArray:
        """Between which times its force is smooth up to `duration`, s."""
        corners = self.corners
        corners = corners[corners[:, 0] < duration]
        if not corners.size:
            return np.empty(0)
        first, last = float(corners[0, 0]), min(float(corners[-1, 3]), duration)
        step = min(
            depth / (PER_DEPTH * self.speed) if self.speed else math.inf,
            1 / (PER_CYCLE * self.frequency) if self.vibration else math.inf,
        )
        dense = np.empty(0)
        if step < math.inf:
            count = (last - first) / step
            if count > MOST_POINTS:
                raise SceneError(
                    f"{count:.3g} points of force are needed for one taxel; at most "
                    f"{MOST_POINTS:g} are computed. Make duration, speed or frequency "
                    "smaller"
                )
            dense = np.linspace(first, last, math.ceil(count) + 1)
        slips = [self.start + self.rests] if self.speed else []
        middles = (corners[:, 1:] + corners[:, :-1]) / 2
        return np.concatenate([dense, slips, corners.ravel(), middles.ravel()])


def _rows(kind: int, *columns: ArrayLike) -> FloatArray:
    """Loads of one kind, from columns after the kind."""
    wide = np.broadcast_arrays(float(kind), *columns, *[0.0] * (6 - len(columns)))
    return np.stack([np.atleast_1d(c) for c in wide], axis=1)


@dataclass(frozen=True, kw_only=True)
class ForceStimulus(Stimulus):
    """What presses with a force.

    Attributes:
        force: N, on each of its contacts.
    """

    force: Strength = 1.0

    @property
    def strength(self) -> float:
        """N."""
        return self.force


@dataclass(frozen=True, kw_only=True)
class PressureStimulus(Stimulus):
    """What presses with a pressure.

    Attributes:
        pressure: Pa.
    """

    pressure: Pressure = 50e3

    @property
    def strength(self) -> float:
        """Pa."""
        return self.pressure


@dataclass(frozen=True, kw_only=True)
class Sphere(ForceStimulus):
    """``kind = "sphere"``: a rigid ball, Hertz's contact.

    Attributes:
        radius: m.
    """

    kind: ClassVar[str] = "sphere"
    radius: Length = 5e-3

    def loads(self, array: Array) -> FloatArray:
        """One ball.

        Raises:
            SceneError: Hertz's contact would be wider than the ball itself.
        """
        force = self.force * (1 + self.vibration)
        contact_radius = (0.75 * force * self.radius / array.modulus) ** (1 / 3)
        if contact_radius > self.radius:
            raise SceneError(
                f"a ball of radius {show(self.radius, 'm')} pressed with "
                f"{show(force, 'N')} would touch the layer within "
                f"{show(contact_radius, 'm')}: Hertz's contact is far narrower than "
                f"the ball. Press with less than "
                f"{show(array.modulus * self.radius**2 / 0.75, 'N')}, or make radius "
                "or modulus larger"
            )
        return _rows(contact.SPHERE, 0.0, 0.0, self.radius / array.modulus)


@dataclass(frozen=True, kw_only=True)
class Punch(ForceStimulus):
    """``kind = "punch"``: a rigid cylinder with a flat end.

    Attributes:
        radius: m.
    """

    kind: ClassVar[str] = "punch"
    radius: Length = 2e-3

    def loads(self, array: Array) -> FloatArray:
        """One punch."""
        return _rows(contact.PUNCH, 0.0, 0.0, self.radius)


@dataclass(frozen=True, kw_only=True)
class Grating(PressureStimulus):
    """``kind = "grating"``: parallel ridges of even pressure; one of them is an edge.

    Attributes:
        ridge: width of a ridge, m.
        spacing: from a ridge to the next, m.
        ridges: number of them.
        angle: of the normal of the ridges, from the x axis, degrees.
    """

    kind: ClassVar[str] = "grating"
    ridge: Length = 1e-3
    spacing: Length = 2e-3
    ridges: Annotated[int, Field(ge=1, le=10_000)] = 20
    angle: Angle = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.ridges > 1 and self.spacing <= self.ridge:
            raise SceneError(
                f"ridges {show(self.ridge, 'm')} wide and {show(self.spacing, 'm')} "
                "apart overlap: spacing goes from one ridge to the next"
            )

    def loads(self, array: Array) -> FloatArray:
        """A strip each."""
        middle = self.spacing * (np.arange(self.ridges) - (self.ridges - 1) / 2)
        way = math.radians(self.angle)
        edges = (middle - self.ridge / 2, middle + self.ridge / 2)
        return _rows(contact.STRIP, 0.0, 0.0, math.cos(way), math.sin(way), *edges)


@dataclass(frozen=True, kw_only=True)
class Texture(PressureStimulus):
    """``kind = "texture"``: a plate whose pressure is a random, isotropic pattern.

    Attributes:
        roughness: standard deviation of the pressure, a part of its mean,
            `pressure`; above 0.3 it would pull here and there.
        longest, shortest: wave lengths, m.
        seed: of the pattern.
    """

    kind: ClassVar[str] = "texture"
    roughness: Annotated[float, Field(gt=0, le=0.3)] = 0.2
    longest: Length = 10e-3
    shortest: Length = 1e-3
    seed: Annotated[int, Field(ge=0)] = 1
    WAVES: ClassVar = 48

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.shortest > self.longest:
            raise SceneError(
                f"shortest = {show(self.shortest, 'm')} is longer than longest = "
                f"{show(self.longest, 'm')}"
            )

    def loads(self, array: Array) -> FloatArray:
        """Waves of equal size, their lengths spread evenly on a logarithmic scale."""
        drawn = np.random.default_rng(self.seed)
        n = self.WAVES
        spread = (np.arange(n) + drawn.uniform(size=n)) / n
        k = 2 * np.pi / (self.longest * (self.shortest / self.longest) ** spread)
        way, phase = drawn.uniform(0, 2 * np.pi, (2, n))
        size = self.roughness * math.sqrt(2 / n)
        waves = _rows(
            contact.WAVE, 0.0, 0.0, k * np.cos(way), k * np.sin(way), phase, size
        )
        return np.concatenate([_rows(contact.UNIFORM), waves])


@dataclass(frozen=True, kw_only=True)
class Braille(ForceStimulus):
    """``kind = "braille"``: the dots of a text; the middle of its cells is at `at`.

    Attributes:
        text: letters a to z, digits and spaces.
        radius: of a dot's flat top, m.
        dot_pitch: between the dots of a cell, m.
        cell_pitch: from a cell to the next, m; both as in European signs (EN 15823).
    """

    kind: ClassVar[str] = "braille"
    text: str = "braille"
    force: Strength = 0.1
    radius: Length = 0.6e-3
    dot_pitch: Length = 2.5e-3
    cell_pitch: Length = 6e-3

    def __post_init__(self) -> None:
        super().__post_init__()
        dots(self.text)  # refuses what has none

    def loads(self, array: Array) -> FloatArray:
        """A flat punch for each dot."""
        cells, columns, rows = dots(self.text).T
        middle = (int(cells.max()) if cells.size else 0) / 2
        x = self.cell_pitch * (cells - middle) + self.dot_pitch * (columns - 0.5)
        return _rows(contact.PUNCH, x, self.dot_pitch * (1 - rows), self.radius)


KINDS: dict[str, type[Stimulus]] = {
    kind.kind: kind for kind in (Sphere, Punch, Grating, Texture, Braille)
}
