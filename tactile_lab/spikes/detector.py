"""Spike detection on streamed codes: Eq. (19) with hysteresis and a refractory time.

The same samples give the same spikes however they are sliced into blocks, so the spikes
found on line can be found again in the stored samples.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from tactile_lab.errors import ParameterError
from tactile_lab.spikes.crossings import (
    INSIDE,
    MODE,
    PEAK,
    UP,
    Codes,
    Spikes,
    scan,
)
from tactile_lab.spikes.detection import DEVIATIONS, Detection

SPIKE = np.dtype([("sample", "f8"), ("amplitude", "i2"), ("width", "f4")])
"""One spike: interpolated sample index of the crossing, peak code, width in samples.

For polarity -1 the amplitude is the smallest code. The width is NaN where the
signal never came back.
"""

QUARTILES_APART = 1.349
"""Distance of the quartiles of Gaussian noise, in standard deviations."""

_ROOM = 1024  # spikes one call of the loop can hold; it is called again


class Detector:
    """On-line detector of one channel.

    A spike begins where the code crosses `threshold` upwards (reaching it counts,
    Eq. 19) and ends where it has fallen to `threshold - hysteresis`. A crossing less
    than `refractory` after the last spike is no spike. The detector arms itself only
    once the signal is at or below the release level, so a record that starts inside
    a spike does not count it.

    Args:
        threshold: code.
        hysteresis: codes, at least 1.
        refractory: samples, at least 0.
        polarity: +1 for spikes that rise, -1 for spikes that fall through threshold.

    Raises:
        ParameterError: a setting outside its range.
    """

    def __init__(
        self,
        *,
        threshold: int,
        hysteresis: int,
        refractory: int = 0,
        polarity: Literal[1, -1] = 1,
    ) -> None:
        if not -32768 <= threshold <= 32767:
            raise ParameterError(
                f"Spike threshold {threshold} is no 16-bit code; choose one from "
                "−32768 to 32767, inside the channel's range."
            )
        if hysteresis < 1:
            raise ParameterError(
                f"Spike hysteresis is {hysteresis} codes; at least 1 is needed."
            )
        if refractory < 0:
            raise ParameterError(
                f"Refractory time is {refractory} samples; it must be 0 or more."
            )
        if polarity not in (1, -1):
            raise ParameterError(f"Spike polarity is {polarity}; give +1 or -1.")
        self._sign = polarity
        self._threshold = polarity * threshold
        self._release = self._threshold - hysteresis
        self._refractory = refractory
        self._found = np.recarray(_ROOM, dtype=SPIKE)
        self._next: int | None = None
        self._reset()

    def _reset(self) -> None:
        self._state = np.zeros(3, dtype=np.int64)
        self._times = np.array([0.0, np.nan, -np.inf])

    def feed(self, first: int, codes: Codes) -> Spikes:
        """Spikes that ended in these samples, shape (k,), dtype `SPIKE`.

        Args:
            first: index of the first sample; where it does not continue the last
                block, what was pending is closed and the detector arms anew.
            codes: shape (n,), int16.
        """
        parts = []
        if self._next is not None and first != self._next:
            parts.append(self.flush())
        codes = np.ascontiguousarray(codes, dtype=np.int16)
        done = 0
        while done < codes.size:
            done, count = scan(
                codes, done, first, self._sign, self._threshold, self._release,
                self._refractory, self._state, self._times, self._found,
            )  # fmt: skip
            if count:
                parts.append(self._found[:count].view(SPIKE, np.ndarray).copy())
        self._next = first + codes.size
        if not parts:
            return np.empty(0, dtype=SPIKE)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    @property
    def begun(self) -> float | None:
        """Sample at which the spike began that is not yet over; None: there is none."""
        return float(self._times[UP]) if self._state[MODE] == INSIDE else None

    def flush(self) -> Spikes:
        """The spike still open, if any, with width NaN; then start anew."""
        pending = np.empty(int(self._state[MODE] == INSIDE), dtype=SPIKE)
        if pending.size:
            peak = self._sign * int(self._state[PEAK])
            pending[0] = (self._times[UP], peak, np.nan)
        self._reset()
        self._next = None
        return pending


class ResetDetector:
    """Detector of V_C2's resets, for benches that wire no V_K.

    A reset is a fall of at least `drop` codes within `span` samples. V_C2 otherwise
    moves with 75 ms, so a slow crossing of any level is no spike. Amplitudes are half
    the fall in codes (a fall can exceed 16 bits), times interpolate the fall itself.

    Args:
        drop: codes, above 0; about half of V_fire - V_reset.
        span: samples the edge may take, at least 1.
        refractory: samples.

    Raises:
        ParameterError: a setting outside its range.
    """

    def __init__(self, *, drop: int, span: int = 2, refractory: int = 0) -> None:
        if drop < 4 or drop > 65534:
            raise ParameterError(
                f"A reset of {drop} codes cannot be detected; give 4 to 65534 codes."
            )
        if span < 1:
            raise ParameterError(f"Reset span is {span} samples; at least 1 is needed.")
        self._span = span
        half = drop // 2
        self._inner = Detector(
            threshold=half, hysteresis=max(1, half // 2), refractory=refractory
        )
        self._tail = np.empty(0, dtype=np.int16)
        self._next: int | None = None

    def feed(self, first: int, codes: Codes) -> Spikes:
        """Resets that ended in these samples; see `Detector.feed`."""
        parts = []
        if self._next is not None and first != self._next:
            parts.append(self.flush())
        codes = np.asarray(codes, dtype=np.int16)
        joined = np.concatenate([self._tail, codes])
        start = first - self._tail.size + self._span
        if joined.size > self._span:
            # half codes, so that the largest fall still fits 16 bits
            half = joined >> 1
            parts.append(
                self._inner.feed(start, half[: -self._span] - half[self._span :])
            )
        self._tail = joined[-self._span :].copy()
        self._next = first + codes.size
        return np.concatenate(parts) if parts else np.empty(0, dtype=SPIKE)

    @property
    def begun(self) -> float | None:
        """Sample at which the reset began that is not yet over; None: there is none."""
        return self._inner.begun

    def flush(self) -> Spikes:
        """The reset still open, if any; then start anew."""
        self._tail = np.empty(0, dtype=np.int16)
        self._next = None
        return self._inner.flush()


def detector_of(detection: Detection) -> Detector | ResetDetector:
    """A fresh detector of these settings."""
    if detection.kind == "reset":
        return ResetDetector(
            drop=detection.threshold,
            span=detection.span,
            refractory=detection.refractory,
        )
    return Detector(
        threshold=detection.threshold,
        hysteresis=detection.hysteresis,
        refractory=detection.refractory,
        polarity=detection.polarity,
    )


def compile_search() -> None:
    """Compile the loop, or load it from disk, before samples wait for it."""
    Detector(threshold=1, hysteresis=1).feed(0, np.zeros(1, dtype=np.int16))


def detect(codes: Codes, detection: Detection, *, first: int = 0) -> Spikes:
    """All spikes of a whole record; equal to any block-wise feeding of a detector."""
    detector = detector_of(detection)
    return np.concatenate([detector.feed(first, codes), detector.flush()])


def estimate(codes: Codes, *, step: int = 1) -> tuple[int, int]:
    """(threshold, hysteresis) in codes, for spikes that rise from a record's noise.

    Median plus `DEVIATIONS` standard deviations, the deviation taken from the distance
    of the quartiles, which rare spikes do not move. Each code stands for all values of
    its step, so noise of about one step is measured, not rounded. A signal that rests
    on one code is taken to have half a step of noise.

    Args:
        codes: shape (n,), a stretch of the channel, quiet most of the time.
        step: distance of neighbouring codes (256 for left-justified 8 bit).

    Raises:
        ParameterError: no samples, or the threshold lies beyond the codes.
    """
    if codes.size == 0:
        raise ParameterError("A threshold cannot be estimated from no samples.")
    low, baseline, high = _quartiles(codes, step)
    deviation = (high - low) / QUARTILES_APART
    distance = DEVIATIONS * max(deviation, step / 2)
    threshold = round(baseline + distance)
    if not -32768 <= threshold <= 32767:
        raise ParameterError(
            f"The noise of {deviation:.0f} codes puts the threshold at {threshold}, "
            "beyond the channel's range; set detect.threshold or a wider range."
        )
    return threshold, max(1, round(distance / 2))


def _quartiles(codes: Codes, step: int) -> tuple[float, float, float]:
    """Quartiles of values that were rounded to `step`: even within each code's step."""
    values, counts = np.unique(codes, return_counts=True)
    below = np.concatenate([[0], np.cumsum(counts)])
    # each code's step begins with all samples below it and ends with its own as well
    edges = np.stack([values - step / 2, values + step / 2], axis=1).ravel()
    ranks = np.stack([below[:-1], below[1:]], axis=1).ravel()
    found = np.interp(np.array([0.25, 0.5, 0.75]) * codes.size, ranks, edges)
    return float(found[0]), float(found[1]), float(found[2])
