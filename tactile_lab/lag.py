"""What the field of the electromagnet makes of the source's current: two lags in a row.

The current follows the set-point with the coil's L/R; eddy currents in a solid core let
the field follow the current. With u the set-point, y the current and z the field's::

    coil y' = u - y,    eddy z' = y - z

Between two points of a piecewise-linear u both are straight lines and exponentials.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.waveform import Waveform

FINE = 2e-5
"""Largest deviation of the answer's straight pieces, as a part of the peak."""
ALIKE = 0.05
"""Lags nearer to each other than this are drawn apart by it: their exponentials would
cancel, and only the sum of the lags is ever seen."""
AT_ONCE = 512
"""Points of a wave that are followed at once; each step is answered in up to 320."""


@dataclass(frozen=True)
class Lag:
    """Two lags in a row, s, each from 0: L/R of the coil, eddy currents of the core."""

    coil: float = 0.0
    eddy: float = 0.0

    @property
    def drawn(self) -> float:
        """By how much the straight pieces of an answer come too late at most, s.

        Their chords would for as long as a step's answer bends, some 30 lags, by two
        thirds of `FINE`; `evening` leaves a tenth of that of steps of 2 % of the peak.
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
        times: list[FloatArray] = []
        values: list[FloatArray] = []
        for piece in self._in_turn(wave, before):
            found, after = piece
            # each begins where the last one ended
            times.append(found.time[1 if times else 0 :])
            values.append(found.value[1 if values else 0 :])
        if len(times) > 1:
            found = Waveform(_joined(times), _joined(values))
        return found, after

    def in_pieces(self, wave: Waveform) -> Iterator[Waveform]:
        """What `follow` finds, in pieces that begin where the one before ended."""
        return (found for found, _ in self._in_turn(wave, None))

    def _in_turn(
        self, wave: Waveform, before: tuple[float, float] | None
    ) -> Iterator[tuple[Waveform, tuple[float, float]]]:
        """Pieces of what `follow` finds, each with `before` for the next."""
        if self.coil == 0 and self.eddy == 0:
            last = float(wave.value[-1])
            yield wave, (last, last)
            return
        before = before or (wave.first, wave.first)
        fine = FINE * max(wave.peak, *map(abs, before), 1e-12)
        for piece in wave.pieces(AT_ONCE):
            found, before = self._followed(piece, before, fine)
            yield found, before

    def _followed(
        self, wave: Waveform, before: tuple[float, float], fine: float
    ) -> tuple[Waveform, tuple[float, float]]:
        """As `follow`, all at once, straight pieces wrong by `fine` A at most."""
        fast, slow = self._apart()
        lasts = np.diff(wave.time)
        pieces = lasts > 0  # the others are jumps
        start, end, lasts = wave.time[:-1][pieces], wave.time[1:][pieces], lasts[pieces]
        u, to = wave.value[:-1][pieces], wave.value[1:][pieces]
        slope = (to - u) / lasts
        line = u - slope * (fast + slow)
        straight = to - slope * fast, to - slope * (fast + slow)
        left = decay(lasts, fast), decay(lasts, slow)
        decays, ends, after = self._decays(
            before, (u - slope * fast, line), straight, left, fine / 100
        )
        times = np.append(wave.start, end)
        known = np.append(before[1], ends)
        inner = [
            _bends(start, end, np.abs(sizes) / fine, lag)
            for sizes, lag in zip(decays, (fast, slow), strict=True)
            if lag > 0
        ]
        between = np.setdiff1d(np.concatenate(inner), times)
        if not between.size:
            return Waveform(times, known), after
        piece = np.searchsorted(start, between, side="right") - 1
        since = between - start[piece]
        value = line[piece] + slope[piece] * since
        for sizes, lag in zip(decays, (fast, slow), strict=True):
            value += sizes[piece] * decay(since, lag)
        times = np.concatenate([times, between])
        order = np.argsort(times)
        times, value = times[order], np.concatenate([known, value])[order]
        lasts, added = np.diff(times), order >= known.size
        piece = np.searchsorted(start, times[:-1], side="right") - 1
        since = times[:-1] - start[piece]
        beyond = excess(since, lasts, decays[0][piece], fast)
        beyond += excess(since, lasts, decays[1][piece], slow)
        value[added] += evening(lasts, beyond)[added]
        return Waveform(times, value), after

    def _decays(
        self,
        before: tuple[float, float],
        begun: tuple[FloatArray, FloatArray],
        straight: tuple[FloatArray, FloatArray],
        left: tuple[FloatArray, FloatArray],
        settled: float,
    ) -> tuple[tuple[FloatArray, FloatArray], FloatArray, tuple[float, float]]:
        """What decays in each straight piece: each begins where the last one ended.

        Args:
            before: current and field just before the first piece, A.
            begun: where the straight lines of current and field begin, A.
            straight: where they end, A.
            left: what of the decays of either lag is left at the end of each.
            settled: decays smaller than this at the end of a piece are over, A.

        Returns:
            Sizes at each begin of the decays by either lag, in the field, A; the
            field at each end, A; and both of them after the last.
        """
        fast, slow = self._apart()
        apart = fast / (fast - slow) if slow > 0 else 1.0
        y, z = before
        sizes, ends = [], []
        columns = (one.tolist() for one in (*begun, *straight, *left))
        for y_from, z_from, y_to, z_to, of_fast, of_slow in zip(*columns, strict=True):
            one = y - y_from if fast > 0 else 0.0
            quick = one * apart
            two = z - z_from - quick if slow > 0 else 0.0
            sizes.append((quick, two))
            y, z = y_to + one * of_fast, z_to + (quick * of_fast + two * of_slow)
            if abs(quick * of_fast) < settled and abs(two * of_slow) < settled:
                y, z = y_to, z_to  # 0 A is no field
            ends.append(z)
        first, second = np.array(sizes).reshape(-1, 2).T
        return (first, second), np.array(ends), (y, z)

    def late(self, wave: Waveform, later: float) -> Waveform:
        """The field, or what is in proportion to it, if the core lags by more.

        Args:
            wave: the field as it follows by these lags; as if its first value had been
                held for ever.
            later: by so much, s, above 0.
        """
        eddy = self.eddy + later
        behind, _ = Lag(eddy=eddy).follow(wave)
        return wave.scaled(self.eddy / eddy).plus(behind.scaled(later / eddy))

    def turned(self, frequency: float, later: float) -> complex:
        """A sine of the field if the core lags by `later` s more, over what it is."""
        turn = 2j * math.pi * frequency
        return (1 + turn * self.eddy) / (1 + turn * (self.eddy + later))

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
        pieces = (np.diff(wave.time) > 0) & (np.diff(wave.value) != 0)
        begin = np.maximum(wave.time[:-1][pieces] - 2 * fine, wave.start)
        ends = wave.time[1:][pieces] + 2 * fine
        first = np.round(begin / fine).astype(int)
        stop = first + np.ceil((ends - begin) / fine).astype(int)
        reach = np.append(-np.inf, np.maximum.accumulate(stop)[:-1])
        apart = np.flatnonzero(first > reach)  # where none that began before lasts
        lasts = np.maximum.reduceat(stop, apart) if apart.size else apart
        spans = map(np.arange, first[apart], lasts)
        inside = np.concatenate([np.empty(0), *spans]) * fine
        # on the way from one point of the wave to the next the lead is straight, too
        behind = np.searchsorted(wave.time, inside - 2 * fine)
        inside = inside[behind < np.searchsorted(wave.time, inside + 2 * fine)]
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


def excess(
    since: FloatArray, lasts: FloatArray, size: FloatArray | float, lag: float
) -> FloatArray:
    """What chords of a lag's decay enclose beyond it, shape (n,), times s.

    Args:
        since: when each begins after the decay, s.
        lasts: how long each lasts, s.
        size: of the decay as it began.
        lag: s.
    """
    begin = size * decay(since, lag)
    end = begin * decay(lasts, lag)
    return np.asarray(lasts * (begin + end) / 2 - lag * (begin - end))


def evening(lasts: FloatArray, excess: FloatArray) -> FloatArray:
    """What to add to the ends of chords that they enclose no excess, shape (n + 1,).

    All chords of a decay lie on one side of it: a step's answer, and the more so each
    of many small ones, came up to 15 us too late.

    Args:
        lasts: how long each of n chords lasts, s.
        excess: what each encloses beyond its curve, times s.

    Returns:
        0 at the first and the last of them.
    """
    added = np.zeros(lasts.size + 1)
    added[1:-1] = -(excess[1:] + excess[:-1]) / (lasts[1:] + lasts[:-1])
    return added


def _joined(parts: list[FloatArray]) -> FloatArray:
    """The parts as one array that a waveform need not copy, and no parts."""
    whole = np.concatenate(parts)
    whole.setflags(write=False)
    parts.clear()
    return whole


def decay(since: FloatArray, lag: float) -> FloatArray:
    """exp(-since/lag), what `since` s leave of a lag; nothing of one of 0 s."""
    return np.exp(-since / lag) if lag > 0 else np.zeros(since.size)


def _bends(
    start: FloatArray, end: FloatArray, size: FloatArray, lag: float
) -> FloatArray:
    """Times at which chords stay within 1 of each ``size exp(-t/lag)`` above 1.

    A chord of length l is off by l^2 |f''|/8: the times lie evenly in exp(-t/2 lag).

    Args:
        start: of the decays, s.
        end: of each, s.
        size: of each.
        lag: s.
    """
    bent = size > 1
    start, end, size = start[bent], end[bent], size[bent]
    bends = np.minimum(end - start, lag * np.log(4 * size))
    covered = -np.expm1(-bends / (2 * lag))
    counts = np.ceil(2 * np.sqrt(size / 8) * covered).astype(int)
    nth = np.arange(1, counts.sum() + 1) - np.repeat(np.cumsum(counts) - counts, counts)
    part = nth * np.repeat(covered / np.maximum(counts, 1), counts)
    times = np.repeat(start, counts) - 2 * lag * np.log1p(-part)
    times = np.minimum(times, np.repeat(end, counts))  # which rounding goes beyond
    # what is left then would be stretched over the rest of a long piece
    gone = np.minimum(end, start + lag * np.log(1e4 * size))
    return np.concatenate([times, gone])
