"""What a wiring check found: a verdict per channel, its calibration, its hum, V_GS."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from tactile_lab.analysis.wiring import (
    NODES,
    ChannelCalibration,
    Levels,
    calibrate_channel,
    explaining_V_GS,
    hum,
    judge,
)
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.equations import rest_V_C1
from tactile_lab.model.simulate import simulate
from tactile_lab.quantity import parse, show
from tactile_lab.report.conclusion import Conclusion
from tactile_lab.report.run_data import RunData, Trace, TrialData
from tactile_lab.report.trial_finding import TrialFinding

Window = tuple[float, float]
CODE = 40e-3
"""One code where a run does not tell, V."""


def wiring_check(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """One verdict per channel, with its hum, and the V_GS that the rest explains."""
    windows = {t.trial.label: _window(t.trial) for t in trials}
    if run.circuit is None or not {"rest", "push"} <= set(windows):
        return Conclusion(("Rest and push were not both completed.",))
    traces = [t for t in run.traces if t.source == "measured"]
    calibrations, faults = _calibrated(run, traces, windows)
    rest, push = (
        _found(run, traces, windows[w], calibrations) for w in ("rest", "push")
    )
    verdicts = judge(Levels(rest, push), _expected(run, windows), faults)
    channels: dict[str, dict[str, Any]] = {}
    sentences = []
    for verdict in verdicts:
        trace = next((t for t in traces if t.signal == verdict.signal), None)
        size, said = _hum(run, trace, windows["rest"])
        known = calibrations.get(verdict.signal)
        channels[verdict.signal] = {
            "ok": verdict.ok,
            "text": verdict.text,
            "hum_V": size,
            "offset_V": known.offset if known else None,
            "gain": known.gain if known else None,
            "error_V": known.error if known else None,
        }
        sentences.append(
            f"{verdict.signal}: {'as wired' if verdict.ok else 'WRONG'}, "
            f"{verdict.text}{said}."
        )
    sentences += [
        f"{name}: offset {show(c.offset, 'V', 2)}, gain {c.gain:.3f} by 0 V and V_S, "
        f"then known to ±{show(2 * c.error, 'V', 2)} (95 %)."
        for name, c in calibrations.items()
    ]
    values: dict[str, Any] = {"channels": channels}
    if all(v.ok for v in verdicts if v.signal == "V_C1") and "V_C1" in rest:
        sentence, gate = _gate(run, rest["V_C1"], traces, calibrations.get("V_C1"))
        sentences.append(sentence)
        values["V_GS"] = gate
    return Conclusion(tuple(sentences), values)


def _calibrated(
    run: RunData, traces: Sequence[Trace], windows: Mapping[str, Window]
) -> tuple[dict[str, ChannelCalibration], dict[str, str]]:
    """Calibrations of the voltage channels, and what is wrong with those without."""
    assert run.circuit is not None
    found: dict[str, ChannelCalibration] = {}
    faults: dict[str, str] = {}
    if not {"0 V", "V_S"} <= set(windows):
        return found, faults
    for trace in traces:
        if trace.signal not in NODES:
            continue
        low, high = _mean(trace, windows["0 V"]), _mean(trace, windows["V_S"])
        try:
            found[trace.signal] = calibrate_channel(
                low, high, run.circuit.V_S, trace.code or CODE
            )
        except NotIdentifiableError as reason:
            faults[trace.signal] = str(reason)
    return found, faults


def _found(
    run: RunData,
    traces: Sequence[Trace],
    window: Window,
    calibrations: Mapping[str, ChannelCalibration],
) -> dict[str, float]:
    found = {}
    for trace in traces:
        value, known = _mean(trace, window), calibrations.get(trace.signal)
        found[trace.signal] = value if known is None else known.corrected(value)
    field = run.field_between(*window)
    if field.size:
        found["field"] = float(field.mean())
    return found


def _expected(run: RunData, windows: Mapping[str, Window]) -> Levels:
    """Rest and push by the model, and by what was set."""
    assert run.circuit is not None
    centres = np.array([sum(windows[w]) / 2 for w in ("rest", "push")])
    nodes = {}
    for signal in ("V_C1", "V_C2"):
        model = simulate(
            run.circuit, run.force, keep=(signal,), until=run.duration, tolerance=1e-6
        )
        nodes[signal] = model.sample(signal, centres)
    levels = []
    for i, name in enumerate(("rest", "push")):
        amperes = _applied(run, windows[name])
        levels.append(
            {
                **{signal: float(values[i]) for signal, values in nodes.items()},
                "V_K": 0.0,
                "coil_current": amperes,
                "field": amperes * (run.field_per_ampere or 0.0),
            }
        )
    return Levels(*levels)


def _hum(run: RunData, trace: Trace | None, window: Window) -> tuple[float | None, str]:
    """Amplitude of the mains hum at a channel's input, V, and what to say of it."""
    if trace is None:
        return None, ""
    mains = parse(run.parameters.get("mains", "50 Hz"), "Hz")
    inside = (trace.time >= window[0]) & (trace.time <= window[1])
    try:
        size = hum(trace.time[inside], trace.mean[inside], mains) / abs(trace.scale)
    except NotIdentifiableError:
        return None, ""
    half = (trace.code or CODE) / abs(trace.scale) / 2
    # half a code of the converter is as fine as it can be told
    said = f"{1e3 * size:.2g} ± {1e3 * half:.2g} mV"
    if size <= half:
        said = f"below {1e3 * half:.2g} mV"
    return size, f"; {mains:g} Hz hum {said}"


def _gate(
    run: RunData, V_C1: float, traces: Sequence[Trace], known: ChannelCalibration | None
) -> tuple[str, dict[str, float] | None]:
    """V_GS that explains V_C1 at rest."""
    assert run.circuit is not None
    code = next((t.code for t in traces if t.signal == "V_C1"), None) or CODE
    error = math.hypot(code / math.sqrt(12), known.error if known else code)
    try:
        gate = explaining_V_GS(run.circuit, V_C1, error)
    except NotIdentifiableError as reason:
        return f"{str(reason)[0].upper()}{str(reason)[1:]}.", None
    said = (
        f"V_C1 rests at {show(V_C1, 'V')}, the model at "
        f"{show(rest_V_C1(run.circuit), 'V')}: a V_GS of {show(gate.value, 'V')} "
        f"({show(gate.low, 'V')} to {show(gate.high, 'V')}, 95 %) explains it; "
        "threshold_search refines it (0.65 mN per mV)."
    )
    return said, {"value": gate.value, "low_95": gate.low, "high_95": gate.high}


def _window(trial: TrialData) -> Window:
    start, end = trial.hold or (0.0, trial.duration)
    # the second half: the followers and node A have settled
    return trial.start + (start + end) / 2, trial.start + end


def _mean(trace: Trace, window: Window) -> float:
    inside = (trace.time >= window[0]) & (trace.time <= window[1])
    return float(trace.mean[inside].mean()) if inside.any() else float("nan")


def _applied(run: RunData, window: Window) -> float:
    if run.current is None or not len(run.current):
        return 0.0
    before = run.current[:, 0] <= window[1]
    return float(run.current[before][-1, 1]) if before.any() else 0.0
