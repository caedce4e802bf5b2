"""Loss check of a stream that has no loss flag: samples received against the clock."""

from __future__ import annotations

from collections import deque

from tactile_lab.bench import Stream
from tactile_lab.errors import SamplesLostError

_LAG, _DRIFT, _WINDOW = 0.01, 1e-4, 8


class SampleCount:
    """Counts samples and compares them with elapsed time.

    After a poll has emptied all buffers, the samples received lag behind the clock by
    the transfer's latency. Lost samples raise that lag for good, so the minimum over
    the last few polls is compared with that over as many before (a gap), and with the
    minimum since the start (many small gaps). A poll that came later than the ring
    holds samples is taken as a loss even if the count looks right.

    A busy computer may halt between asking and being served, and samples of that time
    come along. So a lag lies between that at asking and that at having; a loss must
    raise it beyond both.

    Args:
        started: clock time of the stream's start, s.
        interval: between samples, s.
        depth: samples per channel that are kept for a late poll.
        tolerance: rise of the lag that is not yet a loss, s.
        drift: relative difference allowed between the two clocks.
        window: polls over which a minimum is taken.
    """

    def __init__(
        self,
        *,
        started: float,
        interval: float,
        depth: int,
        tolerance: float,
        drift: float = 0.0,
        window: int = 8,
    ) -> None:
        self.received = 0
        self._started = started
        self._polled = started
        self._interval = interval
        self._depth = depth
        self._tolerance = tolerance
        self._drift = drift
        self._window = window
        self._least: float | None = None
        self._lags: deque[tuple[float, float, float]] = deque(maxlen=2 * window)

    @classmethod
    def of(
        cls, stream: Stream, depth: int, tolerance: float | None, *, simulated: bool
    ) -> SampleCount:
        """A count for a stream that has just begun.

        Args:
            stream: the stream.
            depth: as above.
            tolerance: as above; None for 10 ms, or three samples on a simulated clock,
                which knows no latency.
            simulated: the clock is.
        """
        window = _WINDOW
        if tolerance is None:
            tolerance = _LAG
            if simulated:
                tolerance, window = 3 * stream.interval, 1
        return cls(
            started=stream.started, interval=stream.interval, depth=depth,
            tolerance=tolerance, drift=_DRIFT, window=window,
        )  # fmt: skip

    def poll(
        self, now: float, samples: int, drained: bool = True, had: float | None = None
    ) -> None:
        """Take note of a poll.

        Args:
            now: clock time at which samples were asked for, s.
            samples: a channel, that it brought.
            drained: nothing more waited to be read.
            had: clock time at which they were there, s; `now` unless given.

        Raises:
            SamplesLostError: samples are missing or cannot be vouched for.
        """
        waited, self._polled = now - self._polled, now
        self.received += samples
        if samples and drained:
            elapsed = now - self._started
            least = elapsed - self.received * self._interval
            most = least + (0.0 if had is None else had - now)
            self._least = most if self._least is None else min(self._least, most)
            self._lags.append((elapsed, least, most))
        holds = self._depth * self._interval
        if waited > holds * (1 + 1e-9):
            raise SamplesLostError(
                f"The scope was polled {waited:.3g} s after the poll before, but its "
                f"ring holds {holds:.3g} s: samples may be lost. Relieve the computer "
                "or lower record.sample_rate."
            )
        if samples and drained:
            self._compare(self._window)

    def finish(self) -> None:
        """Check once more, with fewer polls, at the end of a stream.

        Raises:
            SamplesLostError: samples are missing.
        """
        self._compare(min(2, self._window))

    def _compare(self, recent: int) -> None:
        if self._least is None or len(self._lags) <= recent:
            return
        lags = list(self._lags)
        before, after = lags[:-recent], lags[-recent:]
        elapsed, now_least = after[-1][0], min(least for _, least, _ in after)
        gap = now_least - min(most for _, _, most in before)
        if gap > self._tolerance + self._drift * (elapsed - before[0][0]):
            self._refuse(elapsed, gap)
        total = now_least - self._least
        if total > self._tolerance + self._drift * elapsed:
            self._refuse(elapsed, total)

    def _refuse(self, elapsed: float, missing: float) -> None:
        raise SamplesLostError(
            f"Samples are missing: after {elapsed:.3f} s the scope has delivered "
            f"{self.received} samples a channel, about "
            f"{round(missing / self._interval)} too few by this computer's clock. "
            "Relieve the computer or lower record.sample_rate."
        )
