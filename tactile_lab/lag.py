"""What the field of the electromagnet makes of the source's current: two lags in a row.

The current follows the set-point with the coil's L/R; eddy currents in a solid core let
the field follow the current. With u the set-point, y the current and z the field's::

    coil y' = u - y,    eddy z' = y - z

Between two points of a piecewise-linear u both are straight lines and exponentials.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.waveform import Waveform

FINE = 2e-5
"""Largest deviation of the answer's straight pieces, as a part of the peak."""
ALIKE = 0.05
"""Lags nearer to each other than this are drawn apart by it: their exponentials would
cancel, and only the sum of the lags is ever seen."""


@dataclass(frozen=True)
class Lag:
    """Two lags in a row, s, each from 0: L/R of the coil, eddy currents of the core."""

    coil: float = 0.0
    eddy: float = 0.0

    @property
    def drawn(self) -> float:
        """By how much the straight pieces of an answer come too late at most, s.

        Two thirds of `FINE` for as long as a step's answer bends, some 30 lags.
        """
        return 20 * FINE * (self.coil + self.eddy)

    def follow(
        self, wave: Waveform, before: tuple[float, float] | None = None
    ) -> tuple[Waveform, tuple[float, float]]:
        """The wave as the field follows it, from its first to its last point.

        Args:
            wave: what the source is set to, A.
            before: current and current-like field just before, A; as if the wave's
                first value had been held for ever, unless given.

        Returns:
            The field as the current that would hold it, A; and `before` for what
            comes next.
        """
        if self.coil == 0 and self.eddy == 0:
            last = float(wave.value[-1])
            return wave, (last, last)
        fast, slow = self._apart()
        first = float(wave.value[0])
        y, z = before or (first, first)
        fine = FINE * max(wave.peak, abs(y), abs(z), 1e-12)
        pieces: list[tuple[float, float, float, float, float]] = []
        bends: list[FloatArray] = []
        ends = [(wave.start, z)]
        for start, end, u, to in wave.segments():
            lasts = end - start
            if lasts == 0:
                continue
            slope = (to - u) / lasts
            line = u - slope * (fast + slow)
            one = (y - u + slope * fast) if fast > 0 else 0.0
            apart = fast / (fast - slow) if slow > 0 else 1.0
            two = z - line - one * apart if slow > 0 else 0.0
            pieces.append((start, line, slope, one * apart, two))
            for size, lag in ((one * apart, fast), (two, slow)):
                if abs(size) > fine:
                    bends.append(start + _bends(abs(size) / fine, lag, lasts))
            y = to - slope * fast + one * _left(lasts, fast)
            left = one * apart * _left(lasts, fast), two * _left(lasts, slow)
            z = to - slope * (fast + slow) + sum(left)
            if max(map(abs, left)) < fine / 100:  # settled, and 0 A is no field
                y, z = to - slope * fast, to - slope * (fast + slow)
            ends.append((end, z))
        known = np.array(ends)
        if not bends:
            return Waveform(*known.T), (y, z)
        between = np.setdiff1d(np.concatenate(bends), known[:, 0])
        inner = _values(pieces, between, (fast, slow))
        time = np.concatenate([known[:, 0], between])
        order = np.argsort(time)
        value = np.concatenate([known[:, 1], inner])
        return Waveform(time[order], value[order]), (y, z)

    def led(self, wave: Waveform, fine: float) -> Waveform:
        """What the source must be set to that the field follows `wave`, A.

        u = z + (coil + eddy) z' + coil eddy z'', by differences over `fine` s: what
        changes faster stays behind. A wave that rests needs no lead.

        Args:
            wave: the field as the current that would hold it, A.
            fine: time between two points where it moves, s.
        """
        if self.coil == 0 and self.eddy == 0:
            return wave
        inside = np.concatenate([
            np.arange(max(start - 2 * fine, wave.start), end + 2 * fine, fine)
            for start, end, a, b in wave.segments() if a != b
        ] or [np.empty(0)])  # fmt: skip
        inside = np.unique(np.round(inside / fine)) * fine
        # no point so near an end that what differs there would be a jump
        inside = inside[
            (inside > wave.start + fine / 2) & (inside < wave.end - fine / 2)
        ]
        time = np.concatenate([[wave.start], inside, [wave.end]])
        before, at, after = (wave.at(time + by) for by in (-fine, 0.0, fine))
        slope = (after - before) / (2 * fine)
        bend = (after - 2 * at + before) / fine**2
        lead = (self.coil + self.eddy) * slope + self.coil * self.eddy * bend
        lead[[0, -1]] = 0.0  # it begins and ends at rest
        return Waveform.tidied(time, at + lead)

    def _apart(self) -> tuple[float, float]:
        """Both lags, not too alike."""
        if self.coil > 0 and abs(self.eddy / self.coil - 1) < ALIKE:
            mean = (self.coil + self.eddy) / 2
            return mean * (1 - ALIKE), mean * (1 + ALIKE)
        return self.coil, self.eddy


def _values(
    pieces: list[tuple[float, float, float, float, float]],
    time: FloatArray,
    lags: tuple[float, float],
) -> FloatArray:
    """Line and decays of the piece that each time lies in."""
    start, line, slope, one, two = np.array(pieces).T
    at = np.searchsorted(start, time, side="right") - 1
    since = time - start[at]
    value: FloatArray = line[at] + slope[at] * since
    for size, lag in zip((one, two), lags, strict=True):
        if lag > 0:
            value += size[at] * np.exp(-since / lag)
    return value


def _left(since: float, lag: float) -> float:
    """What `since` s leave of a lag's decay."""
    return math.exp(-since / lag) if lag > 0 else 0.0


def _bends(size: float, lag: float, lasts: float) -> FloatArray:
    """Times at which chords stay within 1 of ``size exp(-t/lag)``, up to `lasts` s.

    A chord of length l is off by l^2 |f''|/8: the times lie evenly in exp(-t/2 lag).
    """
    end = min(lasts, lag * math.log(4 * size))
    covered = -math.expm1(-end / (2 * lag))
    count = math.ceil(2 * math.sqrt(size / 8) * covered)
    part = np.arange(1, count + 1) / max(count, 1) * covered
    # what is left then would be stretched over the rest of a long piece
    gone = min(lasts, lag * math.log(1e4 * size))
    return np.append(-2 * lag * np.log1p(-part), gone)
