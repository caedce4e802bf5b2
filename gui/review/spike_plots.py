"""Plots of spikes: their shape over each other, and the intervals between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.plot import Guide, Panel, Plot, Series
from tactile_lab.quantity import count, show
from tactile_lab.spikes.rate import NEVER, begins

if TYPE_CHECKING:
    from tactile_lab.store.spike_shapes import SpikeShapes

MOST_BINS = 60
"""Most bins of the histogram."""


@dataclass(frozen=True, eq=False)
class Intervals:
    """Intervals between spikes of one stretch of firing; silences are none.

    Attributes:
        at: of the spike that ends each, s.
        isi: its length, s.
        silences: how many pauses were left out.
    """

    at: FloatArray
    isi: FloatArray
    silences: int

    @classmethod
    def of(cls, spikes: FloatArray, steps: FloatArray = NEVER) -> Intervals:
        """Of ascending times; `steps`: when the steps of the run begin, s."""
        within = ~begins(spikes, steps)[1:]
        silences = int(np.count_nonzero(~within))
        return cls(spikes[1:][within], np.diff(spikes)[within], silences)

    def between(self, start: float, end: float) -> Intervals:
        """Those that end in [start, end] s; the silences are those of all."""
        inside = (self.at >= start) & (self.at <= end)
        return Intervals(self.at[inside], self.isi[inside], self.silences)

    @property
    def text(self) -> str:
        """Their number, median, mean, standard deviation and its ratio to the mean."""
        isi = self.isi
        left = f"{count(self.silences, 'silence')} left out"
        if not isi.size:
            return f"No interval, {left}"
        said = f"{count(isi.size, 'interval')}, {left}\n"
        said += f"median {show(np.median(isi), 's', 3)}"
        if isi.size > 1:
            mean, spread = float(isi.mean()), float(isi.std(ddof=1))
            said += f", mean {show(mean, 's', 3)}, SD {show(spread, 's', 3)}"
            said += f", CV {spread / mean:.2f}"
        return said


def shape_plot(shapes: SpikeShapes, chosen: float | None) -> Plot:
    """Spikes laid over each other at the crossing; the one at `chosen` s in full."""
    gap = np.full((shapes.times.size, 1), np.nan)
    after, values = np.hstack([shapes.after, gap]), np.hstack([shapes.values, gap])
    series = [
        Series(
            x=after.ravel(),
            y=values.ravel(),
            name=count(shapes.times.size, "spike"),
            colour="quiet",
        )
    ]
    if chosen is not None:
        one = int(np.argmin(np.abs(shapes.times - chosen)))
        after, values = shapes.after[one], shapes.values[one]
        series += [
            Series(x=after, y=values, name="this one", colour="V_K"),
            Series(x=after, y=values, mark="dots", colour="V_K"),
        ]
    level = shapes.threshold
    across = () if level is None else (Guide(at=level, along="x"),)
    return Plot(
        name="shape",
        caption="Stored samples around each spike. 0 is where the line through two of "
        "them crosses the threshold, which is dashed.",
        x_label="Time after the crossing",
        x_unit="s",
        panels=(
            Panel(
                label=shapes.signal,
                unit="V",
                prefix="",
                series=tuple(series),
                guides=(*across, Guide(at=0.0)),
            ),
        ),
    )


def interval_plot(found: Intervals) -> Plot | None:
    """How often each interval comes, and the intervals against time; None without."""
    if found.isi.size < 2:
        return None
    bins = min(MOST_BINS, len(np.histogram_bin_edges(found.isi, "auto")) - 1)
    many, edges = np.histogram(found.isi, bins=max(bins, 1))
    outline = np.repeat(many, 2).astype(np.float64)
    histogram = Panel(
        label="Intervals in each bin",
        series=(
            Series(
                x=np.repeat(edges, 2),
                y=np.concatenate(([0.0], outline, [0.0])),
                mark="filled",
                colour="rate",
            ),
        ),
        guides=(Guide(at=float(np.median(found.isi)), text="median"),),
        limits=(0.0, None),
    )
    return Plot(
        name="intervals",
        caption="Intervals between spikes of one stretch of firing, in "
        f"{count(len(many), 'bin')} of {show(edges[1] - edges[0], 's', 3)}.",
        x_label="Interval",
        x_unit="s",
        panels=(histogram,),
    )


def succession_plot(found: Intervals, chosen: float | None) -> Plot | None:
    """Each interval against the time at which it ends; None without any."""
    if not found.isi.size:
        return None
    series = [Series(x=found.at, y=found.isi, mark="dots", colour="rate")]
    if chosen is not None and chosen in found.at:
        at = found.at == chosen
        series.append(
            Series(x=found.at[at], y=found.isi[at], mark="points", colour="V_K")
        )
    return Plot(
        name="succession",
        caption="Each interval against the time of the spike that ends it.",
        x_label="Time",
        x_unit="s",
        x_prefix="",
        panels=(Panel(label="Interval", unit="s", series=tuple(series)),),
    )
