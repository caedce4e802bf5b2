"""The run's figure in the manner of the paper's Fig. 4a-c and 5a, b.

Three panels on one time axis: (a) force; (b) V_C1, V_C2 and I_DS; (c) spike train and
instantaneous rate.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from tactile_lab.quantity import show
from tactile_lab.report import palette
from tactile_lab.report.canvas import HEAD_HEIGHT, axes, blank, heading
from tactile_lab.report.findings import Findings, stretches
from tactile_lab.report.run_data import RunData, Trace
from tactile_lab.report.splice import spliced
from tactile_lab.report.trial_finding import TrialFinding

FloatArray = NDArray[np.float64]

CAPTION = (
    "(a) Force. (b) Voltages and drain current: mean and, shaded, the extremes within "
    "each bin; dotted: the model driven by the applied current. (c) Spikes detected "
    "on V_K (ticks) and the instantaneous rate 1/ISI (dots). Grey bands: holds."
)
WIDTH = 7.2
LEFT, RIGHT = 0.72, 0.3
FOOT, HEAD, GAP = 0.5, HEAD_HEIGHT, 0.18
SHARP = {"V_C2", "V_K"}
"""Signals that jump within a bin: their extremes are the trace, not their mean."""
DRAWN_BINS = 1600
"""More bins than a printed column can show only swell the file."""


def figure(findings: Findings) -> Figure:
    """Draw the run; panels without a recorded signal are left out."""
    run, cuts = spliced(findings.run)
    voltages = [t for name in ("V_C1", "V_C2") if (t := run.trace(name))]
    drain = run.trace("I_DS")
    heights = {"a": 1.15}
    if voltages:
        heights["b"] = 1.9
    if drain:
        heights["i"] = 0.95
    spikes = run.searched or any(t.spike_times.size for t in run.trials)
    if spikes:
        heights["c"] = 1.75
    total = FOOT + HEAD + sum(heights.values()) + GAP * (len(heights) - 1)
    drawn = blank(WIDTH, total)
    panels = _stack(drawn, heights, total)
    _force(panels["a"], run)
    if voltages:
        _voltages(panels["b"], voltages, run.trace("V_C1", model=True))
        if run.protocol == "monitor" and run.circuit is not None:
            _critical(panels["b"], run.circuit.critical_V_C1)
    if drain:
        _drain(panels["i"], drain)
    if spikes:
        played = [trial for trial in findings.run.trials if not trial.pause]
        start = {
            id(was): now.start for was, now in zip(played, run.trials, strict=True)
        }
        _spikes(
            panels["c"], [(start[id(found.trial)], found) for found in findings.trials]
        )
    _finish(panels, run, cuts)
    subtitle = " · ".join(
        part for part in (run.scene or run.protocol, run.run, run.started) if part
    )
    heading(drawn, run.title, subtitle, simulated=run.simulated)
    return drawn


def _stack(drawn: Figure, heights: dict[str, float], total: float) -> dict[str, Axes]:
    panels: dict[str, Axes] = {}
    top, first = total - HEAD, None
    for name, height in heights.items():
        box = (LEFT, top - height, WIDTH - LEFT - RIGHT, height)
        panels[name] = axes(drawn, box, share=first)
        first = first or panels[name]
        top -= height + GAP
    return panels


def _finish(panels: dict[str, Axes], run: RunData, cuts: tuple[float, ...]) -> None:
    """Letters, hold bands, the one labelled time axis."""
    letters = {"a": "a", "b": "b", "c": "c"}
    if "b" not in panels and "i" in panels:
        letters["i"] = "b"
    *upper, last = panels.values()
    for panel in upper:
        panel.tick_params(axis="x", labelbottom=False, length=0)
        panel.spines["bottom"].set_visible(False)
    for name, panel in panels.items():
        for cut in cuts:
            panel.axvline(
                cut, color=palette.QUIET.light, lw=0.6, ls=(0, (2, 2)), zorder=1
            )
        for trial in run.trials:
            if trial.hold is not None and not trial.pause:
                start, end = (trial.start + edge for edge in trial.hold)
                panel.axvspan(start, end, color=palette.BAND.light, lw=0, zorder=0)
        panel.yaxis.set_label_coords(-0.42 / (WIDTH - LEFT - RIGHT), 0.5)
        if name in letters:
            panel.annotate(
                letters[name],
                (0, 1),
                (-0.58 * 72, -1),
                xycoords="axes fraction",
                textcoords="offset points",
                weight="bold",
                size=10,
                color=palette.INK.light,
                va="top",
            )
    last.set_xlim(0, run.duration)
    last.set_xlabel("Time (s), recoveries left out (dotted)" if cuts else "Time (s)")
    last.xaxis.set_major_locator(MaxNLocator(10, steps=[1, 2, 5, 10]))


def _force(panel: Axes, run: RunData) -> None:
    time, force = run.force.time, run.force.value * 1e3
    time = np.append(time, max(run.duration, time[-1]))
    force = np.append(force, force[-1])
    panel.fill_between(
        time, 0, force, color=palette.FORCE.light, alpha=0.14, lw=0, zorder=1
    )
    if run.force_uncertainty is not None:
        # only where there is a force: at rest its zero is a definition
        known = np.where(force == 0, 0.0, run.force_uncertainty.of(force * 1e-3) * 1e3)
        panel.fill_between(
            time, force - known, force + known,
            color=palette.FORCE.light, alpha=0.3, lw=0, zorder=2,
        )  # fmt: skip
    panel.plot(time, force, color=palette.FORCE.light, lw=1.2)
    low, high = min(0.0, float(force.min())), max(0.0, float(force.max()))
    span = (high - low) or 1.0
    panel.set_ylim(low - (0.22 if low < 0 else 0) * span, high + 0.26 * span)
    panel.set_ylabel("Force (mN)")
    panel.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    for trial in run.trials:
        if trial.pause or trial.level is None or trial.hold is None:
            continue
        middle = trial.start + sum(trial.hold) / 2
        half = run.uncertain(trial.level) or 0.0
        panel.annotate(
            show(trial.level, "N", 3),
            (middle, (trial.level + math.copysign(half, trial.level)) * 1e3),
            (0, 3 if trial.level >= 0 else -3),
            textcoords="offset points",
            ha="center",
            va="bottom" if trial.level >= 0 else "top",
            size=7.5,
            color=palette.FORCE.light,
        )


def _voltages(panel: Axes, traces: list[Trace], model: Trace | None) -> None:
    colours = {"V_C1": palette.V_C1, "V_C2": palette.V_C2}
    # V_C2's saw-tooth lies under the slow V_C1, which must stay readable
    for order, trace in enumerate(reversed(traces)):
        colour = colours[trace.signal].light
        width = 1.3 if trace.signal == "V_C1" else 0.5
        _line(panel, trace, 1.0, colour, width, 3 + order)
    for trace in traces:
        symbol = f"$V_{{C{trace.signal[-1]}}}$"
        panel.plot([], [], color=colours[trace.signal].light, lw=1.6, label=symbol)
    if model is not None:
        look: Any = {"color": palette.TWIN.light, "lw": 0.8, "ls": (0, (1, 2.5))}
        for piece in stretches(model.time):
            panel.plot(model.time[piece], model.mean[piece], zorder=6, **look)
        panel.plot([], [], label="$V_{C1}$ of the model", **look)
    panel.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 0.98),
        ncol=3,
        frameon=False,
        fontsize=7.5,
        labelcolor=palette.INK.light,
        handlelength=1.2,
        borderaxespad=0,
        borderpad=0,
        columnspacing=1.2,
    )
    panel.set_ylabel("Voltage (V)")
    if len(traces) > 1:
        panel.set_ylim(bottom=min(0.0, panel.get_ylim()[0]))
    panel.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))


def _critical(panel: Axes, V_C1: float) -> None:
    """Where V_C1 makes the sensor fire: what somebody who trims V_GS looks at."""
    panel.axhline(V_C1, color=palette.V_C1.light, lw=0.8, ls=(0, (4, 2)), zorder=2)
    panel.annotate(
        f"fires below {show(V_C1, 'V')}", (0.01, V_C1), (0, -3),
        xycoords=panel.get_yaxis_transform(), textcoords="offset points", va="top",
        size=7, color=palette.V_C1.light,
    )  # fmt: skip


def _drain(panel: Axes, trace: Trace) -> None:
    _line(panel, trace, 1e9, palette.I_DS.light, 1.1, 3)
    panel.set_ylabel("$I_{DS}$ (nA)")
    panel.set_ylim(bottom=min(0.0, float(trace.mean.min() * 1.05e9)))
    panel.yaxis.set_major_locator(MaxNLocator(3, steps=[1, 2, 5, 10]))
    if trace.source == "derived":
        panel.annotate(
            "from $V_{C1}$, Eq. (16)",
            (1, 1),
            (0, 3),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="right",
            va="bottom",
            size=6.5,
            color=palette.QUIET.light,
        )


def _line(
    panel: Axes, trace: Trace, scale: float, colour: str, width: float, order: float
) -> None:
    """A trace with its extremes; gaps stay open."""
    together = -(-trace.time.size // DRAWN_BINS)
    for piece in stretches(trace.time):
        time = _binned(trace.time[piece], together, np.mean)
        mean = _binned(trace.mean[piece], together, np.mean) * scale
        if trace.low is not None and trace.high is not None:
            low = _binned(trace.low[piece], together, np.min) * scale
            high = _binned(trace.high[piece], together, np.max) * scale
            if trace.signal in SHARP:
                panel.fill_between(
                    time, low, high, color=colour, lw=width, zorder=order
                )
                continue
            panel.fill_between(
                time, low, high, color=colour, alpha=0.25, lw=0, zorder=order - 0.5
            )
        panel.plot(time, mean, color=colour, lw=width, zorder=order)


def _binned(
    values: FloatArray, together: int, how: Callable[..., FloatArray]
) -> FloatArray:
    """Every `together` neighbours as one; the last few of a stretch on their own."""
    whole = values.size // together * together
    cells = how(values[:whole].reshape(-1, together), axis=1)
    if whole == values.size:
        return cells
    return np.append(cells, how(values[whole:]))


def _spikes(panel: Axes, findings: list[tuple[float, TrialFinding]]) -> None:
    highest = 0.0
    across = panel.get_xaxis_transform()
    for start, finding in findings:
        trial = finding.trial
        times = trial.spike_times + start
        panel.vlines(
            times, 0.86, 0.98, transform=across, color=palette.V_K.light, lw=0.7
        )
        if times.size >= 2:
            rates = 1 / np.diff(times)
            highest = max(highest, float(rates.max()))
            _rate(panel, times[1:], rates)
        if finding.adaptation is not None and trial.hold is not None:
            held = np.linspace(*trial.hold, 100)
            panel.plot(
                held + start,
                finding.adaptation.rate(held),
                color=palette.INK.light,
                lw=0.9,
                ls=(0, (4, 2)),
                zorder=4,
            )
    panel.set_ylim(0, highest / 0.78 if highest else 1.0)
    panel.set_ylabel("Rate (Hz)")
    panel.yaxis.set_major_locator(MaxNLocator(4, steps=[1, 2, 5, 10]))
    panel.annotate(
        _caption([finding for _, finding in findings]),
        (1, 1),
        (0, 3),
        xycoords="axes fraction",
        textcoords="offset points",
        ha="right",
        va="bottom",
        size=6.5,
        color=palette.QUIET.light,
    )


def _rate(panel: Axes, at: FloatArray, rates: FloatArray) -> None:
    panel.plot(
        at, rates, drawstyle="steps-post", color=palette.RATE.light, lw=0.6, alpha=0.6
    )
    size = 3.2 if at.size < 200 else 1.4
    panel.plot(at, rates, "o", color=palette.RATE.light, ms=size, mew=0)


def _caption(findings: list[TrialFinding]) -> str:
    spikes = sum(f.response.spikes for f in findings)
    text = f"{spikes} spikes (ticks), instantaneous rate 1/ISI (dots)"
    if any(f.adaptation for f in findings):
        text += ", fit α exp(βt) + γ (dashed)"
    return text
