"""Counts streamed samples: where they lie in the record and in time."""

from __future__ import annotations

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import RecordingError
from tactile_lab.scope import Stream

Segment = tuple[int, float, float, float, float, float]
"""A row of `layout.RECORDS["segments"]`."""


class SampleCounter:
    """Keeps count of the samples of a run, stream after stream, gap after gap.

    Attributes:
        taken: samples per channel that were recorded.
        segment: the running stretch as its record says.
    """

    def __init__(self) -> None:
        self.taken = 0
        self.segment: Segment = (0, 0.0, 0.0, 0.0, 0.0, 0.0)
        self._stream: Stream | None = None
        self._expected = 0
        self._begins: list[tuple[int, int]] = []

    def stream(self, stream: Stream, start: float) -> None:
        """A stream starts; its first sample is at `start` s on the run's axis."""
        self._stream, self._expected = stream, 0
        self._begin(stream, start)

    def skip_to(self, first: int) -> tuple[int, float] | None:
        """Samples missing before stream index `first`, and its run time, s.

        Returns:
            None where none is missing; else a new stretch has begun.

        Raises:
            RecordingError: no stream, or samples that came already.
        """
        if self._stream is None:
            raise RecordingError("Samples came before any stream had started.")
        missing = first - self._expected
        if missing < 0:
            raise RecordingError(
                f"Samples {first} to {self._expected - 1} came twice; the scope "
                "driver repeats data. Restart the scope."
            )
        if missing == 0:
            return None
        at = self.reached + missing * self.segment[2]
        self._expected = first
        self._begin(self._stream, at)
        return missing, at

    @property
    def reached(self) -> float:
        """Run time just past the newest sample, s."""
        _, start, interval, *_ = self.segment
        return start + (self._expected - self._begins[-1][0]) * interval

    def take(self, samples: int) -> None:
        """So many samples per channel follow."""
        self._expected += samples
        self.taken += samples

    def stored(self, samples: FloatArray) -> FloatArray:
        """Indices in the record of (fractional) indices in the stream."""
        streamed = np.array([begin[0] for begin in self._begins])
        stored = np.array([begin[1] for begin in self._begins])
        which = np.searchsorted(streamed, samples, side="right") - 1
        found: FloatArray = samples - streamed[which] + stored[which]
        return found

    def align(self, offset: float, drift: float, uncertainty: float) -> None:
        """Correct the running stretch's place in time; see `Recorder.align`."""
        first, start, interval, host, _, _ = self.segment
        self.segment = (first, start + offset, interval, host, drift, uncertainty)

    def _begin(self, stream: Stream, start: float) -> None:
        """Samples from here on follow one another from `start` s on."""
        self._begins = [one for one in self._begins if one[0] < self._expected]
        self._begins.append((self._expected, self.taken))
        host = stream.started + self._expected * stream.interval
        self.segment = (
            self.taken,
            start,
            stream.interval,
            host,
            0.0,
            stream.uncertainty,
        )
