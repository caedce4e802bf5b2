"""Gain and phase of a signal that follows a sine."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.estimate import Estimate, correlated
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import NotIdentifiableError

HARMONICS = 6
"""So many harmonics of the answer are told apart from noise, with points enough."""
FEWEST = 1.4
"""Cycles from which on a sine is told apart from drift: of 1.2 its gain is known ten
times worse, of one the answer, and its interval, may be anything."""
NOT_YET = 1.5
"""A cause so many times further from its sine than ever later is not yet on it."""
MOST_LINES = 8
"""Lines of the answer's noise that are told apart from it, at most."""
LINE = 30.0
"""Power of a line over the median of its neighbours': of 2000 bins of noise alone one
reaches it once in a million times."""
AROUND = 20
"""Bins of the spectrum on either side of a line that tell the noise below it."""
MOST_BESSEL = 0.5819
"""The Bessel function J1 nowhere exceeds this."""
HEIGHTS = 9
"""Of an answer, within half a code of the one found, that are tried for what codes do
to its phase: to one of them they may do nothing."""


@dataclass(frozen=True)
class Gain:
    """Response to a sine of one frequency.

    Attributes:
        frequency: Hz.
        gain: amplitude of the answer over that of the cause, in their units.
        phase: of the answer against the cause, rad, -pi to pi.
        amplitude: of the cause, in its unit.
    """

    frequency: float
    gain: Estimate
    phase: Estimate
    amplitude: float


def gain(
    time: ArrayLike,
    cause: ArrayLike,
    answer: ArrayLike,
    frequency: float,
    step_bias: float = 0.0,
    code: float | None = None,
    leak: float | None = None,
) -> Gain:
    """Gain and phase at `frequency`, the answer's harmonics and slow drift allowed for.

    A cause that comes onto its sine late, as a coil's force does, is looked at from
    then on: what it did before, a transient would be taken for.

    Args:
        time: s, at least `FEWEST` cycles once the cause is on its sine.
        cause: such as the force, N.
        answer: such as V_C1, V.
        frequency: Hz.
        step_bias: how far means of the answer may be off by a converter's steps, in its
            unit (`tactile_lab.analysis.converter`). They move a sine's amplitude A by
            2 b J1(2 pi A/step) at most, about 2/pi b sqrt(step/A), b = step/pi where no
            noise smooths them and the bias where some does, and its phase not at all;
            but that of an answer in stairs, whose way up has other levels than its way
            down.
        code: one step of that converter, in the answer's unit; what is left of the
            steps repeats with it and is no scatter either.
        leak: time constant with which a transient dies away, s; fitted if given.

    Intervals hold the scatter of the answer, correlated as it is, and the steps. What
    answers the cause beside its sine, such as steps of a source, is no scatter, and no
    more are lines far above the sine, such as the mains' hum: they move it not.

    Raises:
        NotIdentifiableError: too few cycles or points, or no cause.
    """
    t = np.asarray(time, dtype=np.float64)
    given_by, answered = np.asarray(cause), np.asarray(answer)
    begun = _begun(t, given_by, frequency) if t.size else 0
    t, given_by, answered = t[begun:], given_by[begun:], answered[begun:]
    cycles = float(np.ptp(t)) * frequency if t.size else 0.0
    if t.size < 12 or cycles < FEWEST:
        raise NotIdentifiableError(
            f"{cycles:.1f} cycles of {frequency:g} Hz, or {t.size} points, are too "
            f"few: {FEWEST} cycles and 12 points on the sine are needed"
        )
    phase = 2 * np.pi * frequency * t
    slow = (t - t.mean()) / (t[-1] - t[0])
    harmonics = min(HARMONICS, max(1, t.size // 12))
    waves = [f(n * phase) for n in range(1, harmonics + 1) for f in (np.sin, np.cos)]
    drift = [np.ones_like(t), slow, slow**2]
    if leak is not None:
        drift.append(np.exp((t[0] - t) / leak))
    lines: list[FloatArray] = []
    for _ in range(MOST_LINES + 1):
        design = np.column_stack([*waves, *drift, *lines])
        inverse = np.linalg.pinv(design)
        left, seen, beside = _left_over(design, inverse, given_by, answered, code)
        found = _line(left, above=(HARMONICS + 1) * cycles)
        if not found:
            break
        lines += found
    into, out = inverse @ given_by, inverse @ answered
    given, got = complex(into[0], into[1]), complex(out[0], out[1])
    if abs(given) < 1e-12:
        raise NotIdentifiableError(f"there is no cause at {frequency:g} Hz")
    freedom = t.size - design.shape[1] - beside
    alike = correlated(left)
    scatter = math.sqrt(float(np.sum(left**2)) / max(freedom, 1))
    size = max(abs(got), 1e-300)
    # sine and cosine are not known alike where drift is allowed for: along the answer
    # lies the gain, across it the phase
    turned = (got.conjugate() / size) * (inverse[0] + 1j * inverse[1])
    along, across = (
        scatter * math.sqrt(alike * float(np.sum(part**2)))
        for part in (turned.real, turned.imag)
    )
    free = max(1, int(freedom / alike))
    step = code or 2 * step_bias
    first = min(step_bias, step / math.pi)
    codes = 2 * first * min(MOST_BESSEL, math.sqrt(step / size) / math.pi)
    aside = first * _aside(turned.imag, seen, step, size) if first else 0.0
    ratio = got / given
    return Gain(
        frequency,
        Estimate.of(abs(ratio), along / abs(given), free).widened(codes / abs(given)),
        Estimate.of(float(np.angle(ratio)), across / size, free).widened(aside / size),
        abs(given),
    )


def _begun(time: FloatArray, cause: FloatArray, frequency: float) -> int:
    """The first point from which the cause is on the sine of its second half."""
    phase = 2 * np.pi * frequency * time
    sine = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(time)])
    half = time.size // 2
    away = np.abs(cause - sine @ (np.linalg.pinv(sine[half:]) @ cause[half:]))
    later = float(away[half:].max())
    not_yet = np.flatnonzero(away[:half] > NOT_YET * later + 1e-9 * np.ptp(cause))
    return int(not_yet[-1]) + 1 if not_yet.size else 0


def _aside(across: FloatArray, seen: FloatArray, step: float, size: float) -> float:
    """How far a converter whose codes err by a sine, of amplitude 1, turns an answer.

    Args:
        across: how far each point of it moves it across its sine, shape (n,).
        seen: the answer without its noise, shape (n,).
        step: one code, in its unit.
        size: of its sine.
    """
    heights = 1 + np.linspace(-0.5, 0.5, HEIGHTS) * min(step / size, 1.0)
    moved = np.exp(2j * np.pi / step * heights[:, None] * seen) * across
    # wherever the codes lie: a sine and a cosine of the voltage
    ways = np.hypot(moved.real.sum(axis=1), moved.imag.sum(axis=1))
    return float(ways.max())


def _left_over(
    design: FloatArray,
    inverse: FloatArray,
    cause: FloatArray,
    answer: FloatArray,
    code: float | None,
) -> tuple[FloatArray, FloatArray, int]:
    """What the sine and all that is known leave of an answer, and what they do not.

    The latter without what a converter's codes make of it. Last, columns beside
    `design`.

    Args:
        design: what is fitted, shape (n, columns), sine and cosine first.
        inverse: of it.
        cause: shape (n,).
        answer: shape (n,).
        code: as `gain` takes it.
    """
    into, out = inverse @ cause, inverse @ answer
    seen = design @ out
    left = answer - seen
    beside: list[FloatArray] = []
    # what the cause does beside its sine, such as a source's steps, is no scatter: the
    # answer follows it, a little late
    steps = cause - design @ into
    if np.abs(steps).max() > 1e-9 * math.hypot(into[0], into[1]):
        beside += [steps, np.gradient(steps)]
    real = len(beside)
    if code:
        turn = 2 * np.pi * seen / code
        beside += [np.sin(turn), np.cos(turn)]
    if beside:
        known = np.column_stack(beside)
        known -= design @ (inverse @ known)
        made = np.linalg.pinv(known) @ left
        left -= known @ made
        seen += known[:, :real] @ made[:real]
    return left, seen, len(beside)


def _line(left: FloatArray, above: float) -> list[FloatArray]:
    """The largest line in a residual's spectrum: what it is made of; [] if none is.

    Beside sine and cosine these have what a line that comes and goes, or lies a little
    beside, has: the same times time.

    Args:
        left: shape (n,), evenly spaced.
        above: cycles in it from which on to look.
    """
    window = np.hanning(left.size)
    size = np.abs(np.fft.rfft(left * window))
    first = math.ceil(above) + AROUND
    if size.size < first + AROUND:
        return []
    at = first + int(np.argmax(size[first : size.size - 2]))
    near = np.r_[size[at - AROUND : at - 3], size[at + 4 : at + AROUND + 1]]
    if size[at] ** 2 <= LINE * float(np.median(near**2)):
        return []
    # between two bins: of a sine, this window makes the larger neighbour tell where
    side = 1 if size[at + 1] > size[at - 1] else -1
    ratio = size[at + side] / size[at]
    cycles = at + side * (2 * ratio - 1) / (1 + ratio)
    slow = np.linspace(-1, 1, left.size)
    phase = np.pi * cycles * (left.size - 1) / left.size * slow
    return [f(phase) * part for part in (1, slow) for f in (np.sin, np.cos)]
