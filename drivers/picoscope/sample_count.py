"""Loss check of a stream that has no loss flag: samples received against the clock."""

from __future__ import annotations

from collections import deque

from tactile_lab.errors import SamplesLostError
from tactile_lab.scope import Stream

LAG = 0.01
"""Rise of the lag that is taken for a loss on a real computer, s, or `SAMPLES`."""

SAMPLES = 3
"""Rise of the lag that is taken for a loss where nothing else delays a sample."""

DRIFT = 1e-4
"""Relative difference allowed between the scope's clock and the computer's."""

WINDOW, POLLS = 1.0, 8
"""Least time, s, and least polls over which a minimum is taken: a library may hand a
part over and the rest much later, and a busy computer may be late for a while."""


class SampleCount:
    """Counts samples and compares them with elapsed time.

    After a poll has emptied all buffers, the samples received lag behind the clock by
    the transfer's latency. Lost samples raise that lag for good, so the minimum over
    the last second is compared with that over the one before (a gap), and with the
    minimum since the start (many small gaps). A poll that came later than the ring
    holds samples is taken as a loss even if the count looks right. What is lost before
    the first sample comes, or delays less than `tolerance`, cannot be seen so.

    A busy computer may halt between asking and being served, and samples of that time
    come along. So a lag lies between that at asking and that at having; a loss must
    raise it beyond both.

    Args:
        started: clock time of the stream's start, s.
        interval: between samples, s.
        depth: samples per channel that are kept for a late poll.
        tolerance: rise of the lag that is not yet a loss, s.
        drift: relative difference allowed between the two clocks.
        window: time over which a minimum is taken, s.
        polls: over which it is taken at least.
    """

    def __init__(
        self,
        *,
        started: float,
        interval: float,
        depth: int,
        tolerance: float,
        drift: float = 0.0,
        window: float = WINDOW,
        polls: int = POLLS,
    ) -> None:
        self.received = 0
        self.tolerance = tolerance
        self.window = window
        self._started = started
        self._polled = started
        self._interval = interval
        self._depth = depth
        self._drift = drift
        self._polls = polls
        self._least: float | None = None
        self._lags: deque[tuple[float, float, float]] = deque()

    @classmethod
    def of(
        cls, stream: Stream, depth: int, tolerance: float | None, *, simulated: bool
    ) -> SampleCount:
        """A count for a stream that has just begun.

        Args:
            stream: the stream.
            depth: as above.
            tolerance: as above; None for three samples, and 10 ms at least but on a
                simulated clock, which knows no latency.
            simulated: the clock is.
        """
        window, polls = WINDOW, POLLS
        if tolerance is None:
            tolerance = SAMPLES * stream.interval
            if simulated:
                window, polls = 0.0, 1
            else:
                tolerance = max(LAG, tolerance)
        return cls(
            started=stream.started,
            interval=stream.interval,
            depth=depth,
            tolerance=tolerance,
            drift=DRIFT,
            window=window,
            polls=polls,
        )

    def poll(
        self,
        now: float,
        samples: int,
        drained: bool = True,
        had: float | None = None,
        began: float | None = None,
    ) -> None:
        """Take note of a poll.

        Args:
            now: clock time at which samples were asked for, s.
            samples: a channel, that it brought.
            drained: nothing more waited to be read.
            had: clock time at which they were there, s; `now` unless given.
            began: clock time of the first of several questions, s; `now` unless given.

        Raises:
            SamplesLostError: samples are missing or cannot be vouched for.
        """
        # while a poll was held up, what it brought was copied as it came
        waited = (now if began is None else began) - self._polled
        self._polled = now if had is None else had
        self.received += samples
        if samples and drained:
            elapsed = now - self._started
            least = elapsed - self.received * self._interval
            most = least + (0.0 if had is None else had - now)
            self._least = most if self._least is None else min(self._least, most)
            self._lags.append((elapsed, least, most))
            while (
                len(self._lags) > 2 * self._polls
                and self._lags[0][0] < elapsed - 2 * self.window
            ):
                self._lags.popleft()
        holds = self._depth * self._interval
        if waited > holds * (1 + 1e-9):
            raise SamplesLostError(
                f"The scope was polled {waited:.3g} s after the poll before, but its "
                f"ring holds {holds:.3g} s: samples may be lost. Relieve the computer "
                "or lower record.sample_rate."
            )
        if samples and drained:
            self._compare(self._polls, self.window)

    def finish(self) -> None:
        """Check once more, with the last two polls alone, at the end of a stream.

        Raises:
            SamplesLostError: samples are missing, or late: poll on for `window` s.
        """
        self._compare(min(2, self._polls), 0.0)

    def _compare(self, polls: int, window: float) -> None:
        lags = list(self._lags)
        recent = sum(lag[0] > lags[-1][0] - window for lag in lags) if lags else 0
        recent = max(recent, polls)
        if self._least is None or len(lags) <= recent:
            return
        before, after = lags[:-recent], lags[-recent:]
        elapsed, now_least = after[-1][0], min(least for _, least, _ in after)
        gap = now_least - min(most for _, _, most in before)
        if gap > self.tolerance + self._drift * (elapsed - before[0][0]):
            self._refuse(elapsed, gap)
        total = now_least - self._least
        if total > self.tolerance + self._drift * elapsed:
            self._refuse(elapsed, total)

    def _refuse(self, elapsed: float, missing: float) -> None:
        raise SamplesLostError(
            f"Samples are missing: after {elapsed:.3f} s the scope has delivered "
            f"{self.received} samples a channel, about "
            f"{round(missing / self._interval)} too few by this computer's clock. "
            "Relieve the computer or lower record.sample_rate."
        )
