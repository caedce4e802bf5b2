"""Plots of a run that goes on: rates against force, and the loop of a calibration."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from gui.session.fit import FittedRate
from tactile_lab.analysis.spike_train import within
from tactile_lab.arrays import FloatArray
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.plot import Mark, Panel, Plot, Series
from tactile_lab.quantity import count

COLOURS = ("rate", "force", "V_C1", "V_C2", "V_K")
"""Of the steps whose rates lie over each other, the newest first."""

COLUMNS: dict[str, tuple[str, str, Callable[[MeasuredTrial], float | None]]] = {
    "force": ("N", "m", lambda step: step.level),
    "start": ("s", "", lambda step: step.start),
    "spikes": ("", "", lambda step: None if step.uncounted else step.response.spikes),
    "first spike": ("s", "m", lambda step: step.response.latency),
    "peak rate": ("Hz", "", lambda step: step.response.peak_rate),
    "final rate": ("Hz", "", lambda s: s.response.final_rate if s.complete else None),
    "fall": ("%", "", lambda s: _percent(s.response.fall) if s.complete else None),
}
"""What a step can be drawn by: unit, its prefix, and the value of a step, SI.

Where STOP cut a step short its last rate is not final.
"""


def column_plot(trials: Sequence[MeasuredTrial], y: str, x: str) -> Plot | None:
    """One column of the steps against another; None where no step has both.

    Args:
        trials: the steps so far.
        y: what is drawn, of `COLUMNS`.
        x: what it is drawn against.
    """
    (y_unit, y_prefix, up), (x_unit, x_prefix, along) = COLUMNS[y], COLUMNS[x]
    both = [(along(step), up(step)) for step in trials]
    told = [(a, b) for a, b in both if a is not None and b is not None]
    if not told:
        return None
    at, value = np.array(told, dtype=float).T
    name = f"{len(told)} of {count(len(both), 'step')}"
    return Plot(
        name="columns",
        caption=f"{y.capitalize()} of each step against its {x}.",
        x_label=x,
        x_unit=x_unit,
        x_prefix=x_prefix,
        panels=(
            Panel(
                label=y,
                unit=y_unit,
                prefix=y_prefix,
                series=(Series(x=at, y=value, name=name, mark="points"),),
            ),
        ),
    )


def _percent(share: float | None) -> float | None:
    return None if share is None else 100 * share


def rate_plot(
    trials: Sequence[MeasuredTrial], model: Sequence[tuple[float, float]] = ()
) -> Plot | None:
    """Peak and final rate of each step against its force; None before one fired.

    Of steps that came to their end: a rate in the midst of a hold is not its final one.

    Args:
        trials: the steps so far.
        model: force, N, and peak rate, Hz, of the model's steps.
    """
    steps = [
        (t.level, *t.response.rates)
        for t in trials
        if t.level is not None and t.complete and not t.uncounted
    ]
    if not any(peak > 0 for _, peak, _ in steps):
        return None
    force, peak, final = np.array(sorted(steps)).T
    # the same force twice is two results, not a line between them
    mark: Mark = "joined" if np.unique(force).size == force.size else "points"
    series = [
        Series(x=force, y=peak, name="peak", mark=mark),
        Series(x=force, y=final, name="final", mark=mark, colour="force"),
    ]
    if model:
        at, rate = np.array(sorted(model)).T
        mark = "line" if np.unique(at).size == at.size else "crosses"
        series.append(Series(x=at, y=rate, name="model", mark=mark, colour="model"))
    return Plot(
        name="rates",
        caption="Highest and final rate of each step against its force.",
        x_label="force",
        x_unit="N",
        x_prefix="m",
        panels=(_rates(series),),
    )


def train_plot(
    trials: Sequence[MeasuredTrial], laws: Sequence[FittedRate] = ()
) -> Plot | None:
    """The rate in the newest holds against the time since each began; None without."""
    series: list[Series] = []
    fitted = {one.step: one.law for one in laws}
    fired = [
        t
        for t in trials
        if t.hold and not t.uncounted and within(t.spike_times, t.hold).size > 1
    ]
    alike = len({t.label for t in fired}) < len(fired)
    numbers = {t.start: f"no. {at}" for at, t in enumerate(trials, 1)}
    for colour, trial in zip(COLOURS, fired[: -len(COLOURS) - 1 : -1], strict=False):
        begin = trial.hold[0] if trial.hold else 0.0
        times = within(trial.spike_times, trial.hold or (0.0, np.inf))
        series.append(
            Series(
                x=times[1:] - begin,
                y=1 / np.diff(times),
                name=f"{trial.label}, {numbers[trial.start]}" if alike else trial.label,
                mark="dots",
                colour=colour,
            )
        )
        if (law := fitted.get(trial.start)) is not None:
            since = law.time - trial.start - begin
            series.append(Series(x=since, y=law.mean, mark="dashed", colour=colour))
    if not series:
        return None
    return Plot(
        name="trains",
        caption="1/ISI in the newest holds against the time since the force stood "
        "still. Dashed: the fitted law α exp(βt) + γ, where it can be told.",
        x_label="time in the hold",
        x_unit="s",
        x_prefix="",
        panels=(_rates(series),),
    )


def _rates(series: Sequence[Series]) -> Panel:
    """One panel of rates, from 0 up."""
    return Panel(
        label="rate", unit="Hz", prefix="", series=tuple(series), limits=(0.0, None)
    )


def loop_plot(loop: FloatArray) -> Plot | None:
    """The field against the current, and what it differs from a straight line.

    The loop is a few percent of the field: only the difference shows its shape.

    Args:
        loop: readings, shape (n, 2): A and T.
    """
    current, field = loop.T
    if current.size < 3 or np.ptp(current) == 0:
        return None
    rest = field - np.polyval(np.polyfit(current, field, 1), current)
    panels = []
    for label, values in (("field", field), ("field less a straight line", rest)):
        line = Series(x=current, y=values, colour="force")
        newest = Series(x=current[-1:], y=values[-1:], mark="points", colour="V_C1")
        panels.append(Panel(label=label, unit="T", series=(line, newest), height=1.6))
    return Plot(
        name="loop",
        caption="Both branches of the field against the current.",
        x_label="coil current",
        x_unit="A",
        panels=tuple(panels),
    )
