"""The preview: planned force and what the model makes of it, one panel per signal."""

from __future__ import annotations

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.simulate import Result
from tactile_lab.planning.current import cut
from tactile_lab.planning.outcome import joined
from tactile_lab.planning.plan import Plan
from tactile_lab.planning.timeline import Timeline
from tactile_lab.plot import Guide, Panel, Plot, Series, spike_train
from tactile_lab.signals import SIGNALS
from tactile_lab.spikes.rate import rates_between

POINTS = 4000
LANES = ("V_P", "V_C1", "I_DS", "I_C", "V_C2")
HEIGHT = 1.25
"""Of a panel, inches."""


def preview_plot(plan: Plan) -> Plot:
    """The planned force, and below it the model's signals as far as recorded."""
    panels = [_force(plan.timeline)]
    recorded, said = plan.scene.record.signals, ""
    if plan.preview is not None:
        times, spikes = _times(plan.preview), plan.preview.spike_times
        shown = [name for name in LANES if name in recorded]
        if spikes is None and "rate" in recorded:
            shown.append("rate")
        panels += [_lane(plan.preview, name, times) for name in shown]
        if spikes is not None:
            train, told = spike_train(spikes, 0.0, plan.timeline.duration)
            panels += [train, _rate(spikes, plan.timeline)]
            said = f" {told}; rate: 1/ISI, none across a silence."
    return Plot(
        name="preview",
        caption="The planned force and the model under it. Grey bands: recoveries."
        + said,
        x_label="Time",
        x_unit="s",
        x_prefix="",
        x_limits=(0.0, plan.timeline.duration),
        panels=tuple(panels),
    )


def _force(drive: Timeline) -> Panel:
    """As planned, and dashed as asked where the coil cannot follow."""
    force, limited = drive.force, bool(drive.warnings)
    series = [
        Series(
            x=force.time,
            y=force.value,
            name="planned" if limited else "",
            colour="force",
        )
    ]
    if limited:
        asked = joined(
            [(s.start, cut(s.trial.force, s.trial.length)) for s in drive.steps]
        )
        line = Series(
            x=asked.time, y=asked.value, name="asked", mark="dashed", colour="quiet"
        )
        series.insert(0, line)
    return Panel(
        label="Force",
        unit="N",
        prefix="m",
        series=tuple(series),
        guides=tuple(
            Guide(at=s.start, to=s.start + s.trial.length, colour="band")
            for s in drive.steps
            if s.trial.pause
        ),
        height=HEIGHT,
    )


def _lane(result: Result, name: str, times: FloatArray) -> Panel:
    series = Series(x=times, y=result.sample(name, times), colour=name)
    return Panel(
        label=SIGNALS[name].title,
        unit=SIGNALS[name].unit,
        series=(series,),
        height=HEIGHT,
    )


def _rate(spikes: FloatArray, drive: Timeline) -> Panel:
    middles, rates = rates_between(spikes, np.array([s.start for s in drive.steps]))
    return Panel(
        label="Rate",
        unit="Hz",
        prefix="",
        series=(Series(x=middles, y=rates, mark="dots"),),
        limits=(0.0, 1.08 * float(rates.max(initial=0.0)) or 1.0),
        height=HEIGHT,
    )


def _times(result: Result) -> FloatArray:
    """An even grid, and both sides of each reset."""
    times = np.linspace(0.0, result.duration, POINTS)
    if result.spike_times is not None:
        spikes = result.spike_times
        times = np.sort(np.concatenate([times, spikes, np.nextafter(spikes, -np.inf)]))
    return times
