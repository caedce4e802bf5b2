"""Conclusions of the protocols that check and calibrate the bench."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from tactile_lab.analysis.field_calibration import (
    FieldStep,
    fit_field,
    write_calibration,
)
from tactile_lab.analysis.wiring import Levels, explaining_V_GS, hum, judge
from tactile_lab.errors import NotIdentifiableError, QuantityError
from tactile_lab.model.equations import rest_V_C1
from tactile_lab.model.simulate import simulate
from tactile_lab.quantity import parse, show
from tactile_lab.report.conclusion import Conclusion
from tactile_lab.report.run_data import RunData, Trace, TrialData
from tactile_lab.report.trial_finding import TrialFinding

FloatArray = NDArray[np.float64]

EIGHT_BITS = 16e-3
"""One code of V_C1 on the built-in bench, V: what its offset is known to."""


def calibrate_field(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """Slope, loop and uncertainty of B2(I)."""
    try:
        found = fit_field(field_steps(run, [t.trial for t in trials]))
    except NotIdentifiableError as reason:
        return Conclusion((f"No calibration: {reason}.",))
    sentences = (
        f"B2 rises by {show(found.slope.value, 'T')}/A "
        f"({show(found.slope.low, 'T')} to {show(found.slope.high, 'T')}/A), from "
        f"{show(found.offset.value, 'T', 3)} at 0 A.",
        f"The loop is {show(found.half_width, 'T', 3)} or "
        f"{show(found.half_width_current, 'A', 3)} to either side; one field value is "
        f"known to ±{show(found.uncertainty, 'T', 3)} (95 %).",
        *(f"{warning[0].upper()}{warning[1:]}." for warning in found.warnings),
    )
    values = {
        "slope_T_per_A": found.slope.value,
        "slope_low_95": found.slope.low,
        "slope_high_95": found.slope.high,
        "offset_T": found.offset.value,
        "half_width_T": found.half_width,
        "half_width_A": found.half_width_current,
        "uncertainty_T": found.uncertainty,
        "current_A": found.current.tolist(),
        "field_T": found.field.tolist(),
    }
    return Conclusion(sentences, values)


def write_calibration_file(folder: Path, run: RunData) -> Path | None:
    """The calibration of a `calibrate_field` run as calibration.csv; None if no use.

    A file that is there already stays: calibrations are never changed.
    """
    path = folder / "calibration.csv"
    if run.protocol != "calibrate_field" or path.exists():
        return None
    try:
        found = fit_field(field_steps(run, run.trials))
        date = datetime.date.fromisoformat(run.started[:10])
    except (NotIdentifiableError, ValueError):
        return None  # the report's own sentence says why
    coil = run.settings.get("coil", {}).get("identity", run.bench)
    return write_calibration(path, found, coil=coil, date=date)


def field_steps(run: RunData, trials: Sequence[TrialData]) -> list[FieldStep]:
    """Mean reading and mean current of each step of a `calibrate_field` run.

    Raises:
        NotIdentifiableError: the run has no readings.
    """
    if run.field is None or not len(run.field) or run.current is None:
        raise NotIdentifiableError("the run has no teslameter readings or no current")
    steps = []
    for trial in trials:
        if trial.hold is None or trial.pause:
            continue
        branch: Literal["rising", "falling"] = (
            "rising" if trial.label.startswith("rising") else "falling"
        )
        start, end = trial.start + trial.hold[0], trial.start + trial.hold[1]
        time, value = run.field.T
        readings = value[(time >= start) & (time <= end)]
        before = run.current[:, 0] <= end
        if readings.size < 2 or not before.any():
            continue
        applied = float(run.current[before][-1, 1])
        error = float(readings.std(ddof=1) / np.sqrt(readings.size))
        steps.append(
            FieldStep(
                branch=branch,
                current=applied,
                field=float(readings.mean()),
                error=error,
            )
        )
    return steps


def force_check(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """Independent readings over Eq. (2)."""
    levels = np.array([t.trial.level or 0.0 for t in trials])
    text = run.parameters.get("readings", "")
    try:
        readings = np.array([parse(p, "N") for p in text.split(", ") if p])
    except QuantityError as reason:
        return Conclusion((f"The readings cannot be used: {reason}",))
    if readings.size != levels.size:
        return Conclusion(
            (
                "No independent readings: enter F(I) − F(0) of each level with "
                '--set protocol.readings=["...", ...] to check Eq. (2).',
            )
        )
    strength = float(np.sum(levels**2))
    if strength == 0:
        return Conclusion(("All levels are 0 N: nothing to compare.",))
    scale = float(np.sum(levels * readings) / strength)
    left = readings - scale * levels
    freedom = max(1, levels.size - 1)
    error = float(np.sqrt(np.sum(left**2) / freedom / strength))
    said = f"The force read is {scale:.3g} ± {2 * error:.2g} times that of Eq. (2)."
    if 0.05 < scale < 0.2:
        said += (
            " A factor near 0.1 is the area A2: Table 1 prints 2.25e-3 m², a core of "
            "15 mm x 15 mm has 2.25e-4 m²."
        )
    return Conclusion((said,), {"read_over_eq2": scale, "standard_error": error})


def wiring_check(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """One verdict per channel, the mains hum, and the V_GS the rest explains."""
    if run.circuit is None or len(trials) < 2:
        return Conclusion(("Rest and push were not both completed.",))
    windows = [_window(t.trial) for t in trials[:2]]
    signals = [t for t in run.traces if t.source == "measured"]
    found = Levels(
        *({t.signal: _mean(t, w) for t in signals} | _readings(run, w) for w in windows)
    )
    model = simulate(
        run.circuit, run.force, keep=("V_C1",), until=run.duration, tolerance=1e-6
    )
    centres = np.array([sum(w) / 2 for w in windows])
    node_a = model.sample("V_C1", centres)
    silent = simulate(
        run.circuit, run.force, keep=("V_C2",), until=run.duration, tolerance=1e-6
    )
    second = silent.sample("V_C2", centres)
    amperes = [_applied(run, w) for w in windows]
    expected = Levels(
        *(
            {
                "V_C1": float(a),
                "V_C2": float(b),
                "coil_current": c,
                "field": c * (run.field_per_ampere or 0.0),
            }
            for a, b, c in zip(node_a, second, amperes, strict=True)
        )
    )
    verdicts = judge(found, expected)
    sentences = [
        f"{v.signal}: {'as wired' if v.ok else 'WRONG'}, {v.text}." for v in verdicts
    ]
    values = {"channels": {v.signal: {"ok": v.ok, "text": v.text} for v in verdicts}}
    sentences += _hum(signals, windows[0])
    if "V_C1" in found.rest:
        sentences.append(_gate(run, found.rest["V_C1"]))
    return Conclusion(tuple(sentences), values)


def _hum(signals: Sequence[Trace], window: tuple[float, float]) -> list[str]:
    said = []
    for trace in signals:
        inside = (trace.time >= window[0]) & (trace.time <= window[1])
        unit = "A" if trace.signal == "coil_current" else "V"
        try:
            size = hum(trace.time[inside], trace.mean[inside])
        except NotIdentifiableError:
            continue
        said.append(f"{trace.signal}: {show(size, unit, 2)} of 50 Hz hum.")
    return said


def _gate(run: RunData, V_C1: float) -> str:
    assert run.circuit is not None
    model = rest_V_C1(run.circuit)
    try:
        gate = explaining_V_GS(run.circuit, V_C1, EIGHT_BITS)
    except NotIdentifiableError as reason:
        return f"{str(reason)[0].upper()}{str(reason)[1:]}."
    return (
        f"V_C1 rests at {show(V_C1, 'V')}, the model at {show(model, 'V')}: a V_GS of "
        f"{show(gate.value, 'V')} ({show(gate.low, 'V')} to {show(gate.high, 'V')}) "
        "explains it; `threshold_search` refines it (0.65 mN per mV)."
    )


def monitor(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """How far the sensor sits from its threshold."""
    trace = run.trace("V_C1")
    if run.circuit is None or trace is None or not trace.time.size:
        return Conclusion()
    last = trace.mean[trace.time >= trace.time[-1] - 1.0]
    distance = float(last.mean()) - run.circuit.critical_V_C1
    where = "above" if distance > 0 else "below"
    said = (
        f"V_C1 ended {show(abs(distance), 'V', 3)} {where} the critical "
        f"{show(run.circuit.critical_V_C1, 'V')}: the sensor "
        f"{'is silent' if distance > 0 else 'fires'} at rest."
    )
    return Conclusion((said,), {"distance_to_threshold_V": distance})


def _window(trial: TrialData) -> tuple[float, float]:
    start, end = trial.hold or (0.0, trial.duration)
    # the second half: the followers and node A have settled
    return trial.start + (start + end) / 2, trial.start + end


def _mean(trace: Trace, window: tuple[float, float]) -> float:
    inside = (trace.time >= window[0]) & (trace.time <= window[1])
    return float(trace.mean[inside].mean()) if inside.any() else float("nan")


def _readings(run: RunData, window: tuple[float, float]) -> dict[str, float]:
    if run.field is None or not len(run.field):
        return {}
    time, value = run.field.T
    inside = (time >= window[0]) & (time <= window[1])
    return {"field": float(value[inside].mean())} if inside.any() else {}


def _applied(run: RunData, window: tuple[float, float]) -> float:
    if run.current is None or not len(run.current):
        return 0.0
    before = run.current[:, 0] <= window[1]
    return float(run.current[before][-1, 1]) if before.any() else 0.0
