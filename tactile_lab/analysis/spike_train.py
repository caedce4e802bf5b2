"""What a spike train says of a stimulus: intervals, latency, rates, adaptation.

Times are seconds, rates hertz.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.arrays import FloatArray
from tactile_lab.errors import ParameterError

SILENT_AFTER = 2.0
"""A train has fallen silent when its last interval passed this many times over."""


def intervals(spike_times: ArrayLike) -> FloatArray:
    """Interspike intervals, shape (spikes - 1,), s, Eq. (12).

    Raises:
        ParameterError: times not finite or not strictly increasing.
    """
    return np.diff(_checked(spike_times))


def adaptation_index(spike_times: ArrayLike) -> float | None:
    """Mean of (ISI[i+1] - ISI[i]) / (ISI[i+1] + ISI[i]); None below three spikes.

    0 for a regular train, positive where the train slows down, at most 1.
    """
    isi = intervals(spike_times)
    if isi.size < 2:
        return None
    return float(np.mean(np.diff(isi) / (isi[1:] + isi[:-1])))


@dataclass(frozen=True, kw_only=True)
class Response:
    """How a sensor answered one stimulus; None where there are too few spikes.

    Attributes:
        spikes: number of spikes in the whole trial.
        latency: from the stimulus's onset to the first spike after it, s.
        ramp_spikes: those of them outside the hold, while the force changes; 0 where
            there is no hold.
        peak_rate: highest instantaneous rate within the hold, Hz.
        final_rate: rate of the last two spikes at or before the hold's end, Hz.
        fall: from the highest rate within the hold to the final one, as a part of
            the former: 0.4 for a fall by 40 %; None below two rates, or without a
            hold.
        adaptation_index: of the spikes within the hold.
        intervals: whole intervals within the hold.
        silent: when firing stopped before the hold ended: the time of the last spike,
            s from the trial's start. None while it still fired.
    """

    spikes: int
    latency: float | None
    ramp_spikes: int
    peak_rate: float | None
    final_rate: float | None
    fall: float | None
    adaptation_index: float | None
    intervals: int
    silent: float | None

    @property
    def rates(self) -> tuple[float, float]:
        """Peak and final rate as a plot has them, Hz: a silent hold has 0.

        One spike has no rate: NaN.
        """
        unknown = 0.0 if self.spikes == self.ramp_spikes else math.nan
        peak, final = self.peak_rate, self.final_rate
        return unknown if peak is None else peak, unknown if final is None else final

    @property
    def counted(self) -> Response:
        """Only the numbers of spikes: where some may have been missed between them."""
        return replace(
            self, latency=None, peak_rate=None, final_rate=None, fall=None,
            adaptation_index=None, intervals=0, silent=None,
        )  # fmt: skip


def respond(
    spike_times: ArrayLike,
    *,
    onset: float | None = 0.0,
    hold: tuple[float, float] | None = None,
) -> Response:
    """Describe one trial's spikes.

    Args:
        spike_times: s from the trial's start.
        onset: when the stimulus begins, s; None where there is none, and no latency.
        hold: (start, end) of the constant part, s; None for the whole train.

    Raises:
        ParameterError: times not finite or not increasing.
    """
    times = _checked(spike_times)
    after = times[:0] if onset is None else times[times >= onset]
    held = within(times, hold)
    held_rates = 1.0 / np.diff(held)
    fall = None
    if hold is not None and held_rates.size > 1:  # one rate is no fall by 0 %
        fall = float(1.0 - held_rates[-1] / held_rates.max())
    return Response(
        spikes=int(times.size),
        latency=float(after[0] - onset) if onset is not None and after.size else None,
        ramp_spikes=int(times.size - held.size),
        peak_rate=float(held_rates.max()) if held_rates.size else None,
        final_rate=float(held_rates[-1]) if held_rates.size else None,
        fall=fall,
        adaptation_index=adaptation_index(held),
        intervals=int(held_rates.size),
        silent=_silent_from(held, hold),
    )


def within(times: ArrayLike, hold: tuple[float, float] | None) -> FloatArray:
    """The times in the closed interval `hold`; all of them where it is None."""
    t = np.asarray(times, dtype=np.float64)
    if hold is None:
        return t
    return t[(t >= hold[0]) & (t <= hold[1])]


def _silent_from(held: FloatArray, hold: tuple[float, float] | None) -> float | None:
    if hold is None or held.size < 2:
        return None
    last_interval = held[-1] - held[-2]
    if hold[1] - held[-1] > SILENT_AFTER * last_interval:
        return float(held[-1])
    return None


def _checked(spike_times: ArrayLike) -> FloatArray:
    times = np.asarray(spike_times, dtype=np.float64)
    if times.ndim != 1 or not np.all(np.isfinite(times)):
        raise ParameterError("Spike times must be a list of finite numbers in s.")
    if np.any(np.diff(times) <= 0):
        first = int(np.flatnonzero(np.diff(times) <= 0)[0])
        raise ParameterError(
            f"Spike times must increase: number {first + 2} at {times[first + 1]:g} s "
            f"follows {times[first]:g} s. Sort them and drop doubles."
        )
    return times
