"""What a protocol was run for, in one or two sentences and as numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tactile_lab.analysis.decay import fit_decay
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.rate_force import eq15_rate, mean_slope, onset
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.drain_current import BOXCAR_3DB
from tactile_lab.quantity import show
from tactile_lab.report.bench_conclusions import (
    calibrate_field,
    force_check,
    monitor,
)
from tactile_lab.report.conclusion import NO_UNCERTAINTY, Conclusion
from tactile_lab.report.critical_gate import critical_gate
from tactile_lab.report.preparation import force_at_zero
from tactile_lab.report.run_data import RunData, Trace
from tactile_lab.report.sweep import sine_sweep
from tactile_lab.report.trial_finding import TrialFinding
from tactile_lab.report.wiring import wiring_check

LATE = 0.15
"""A coil set over a serial line is late: the first part of a hold still rises, s."""
FROM_SPIKES = frozenset({"hold", "rate_force", "repeat", "threshold_search"})
"""Protocols that are run for the spikes."""
NOT_SEARCHED = (
    "No result: spikes were not looked for. Put spikes into record.signals; that needs "
    "V_K (or V_C2, by its resets) on a channel."
)


def conclude(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """The conclusion of the run's protocol; an empty one where it has none."""
    how = _BY_PROTOCOL.get(run.protocol)
    own = Conclusion()
    if run.protocol in FROM_SPIKES and not run.searched:
        own = Conclusion(missing=(NOT_SEARCHED,))
    elif how is not None and trials:
        own = how(run, trials)
    elif how is not None:
        own = Conclusion(missing=("No trial was completed: there is no result.",))
    return own + force_at_zero(run)


def _hold(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    held = [t for t in trials if t.trial.hold is not None]
    fit = next((t.adaptation for t in held if t.adaptation is not None), None)
    if fit is None:
        why = held[0].why_not if held else "no hold was completed"
        return Conclusion((), {"time_constant_s": None}, (f"No time constant: {why}.",))
    tau = fit.time_constant
    sentence = (
        f"The rate falls with a time constant of {tau.value:.3g} s ({tau.low:.3g} to "
        f"{tau.high:.3g} s, 95 %)."
    )
    return Conclusion((sentence,), {"time_constant_s": tau.to_dict()})


def _critical_force(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    forces = [float(t.trial.level or 0.0) for t in trials]
    try:
        found = onset(forces, [t.response.spikes for t in trials])
    except NotIdentifiableError as reason:
        return Conclusion(
            (), {"critical_force_N": None}, (f"No critical force: {reason}.",)
        )
    ramp, hold = (run.parameters.get(name, "?") for name in ("ramp", "hold"))
    sentence = (
        f"Critical force: between {show(found.silent, 'N')} (silent) and "
        f"{show(found.fires, 'N')} (fires), for a ramp of {ramp} and a hold of {hold}."
    )
    values = {
        "critical_force_N": found.middle,
        "critical_force_half_width_N": found.half_width,
    }
    known, said = run.uncertain(found.middle), NO_UNCERTAINTY
    if known is not None:
        whole = math.hypot(found.half_width, known)
        values["critical_force_uncertainty_N_95"] = whole
        said = f"With the calibration's uncertainty: ±{show(whole, 'N', 2)} (95 %)."
    gate = critical_gate(run, trials, found, known or 0.0)
    return Conclusion((sentence, said), values) + gate


def _rate_force(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    critical = _critical_force(run, trials)
    rated = [t for t in trials if t.response.peak_rate is not None]
    critical = _with_slope(run, critical, rated)
    if run.circuit is None or not rated:
        return critical
    ratios = []
    for finding in rated:
        hold, level = finding.trial.hold, finding.trial.level
        if hold is not None and level is not None:
            expected = eq15_rate(run.circuit, level, hold[0])
            if expected > 0:
                ratios.append((finding.response.peak_rate or 0.0) / expected)
    if not ratios:
        return critical
    sentence = (
        f"The highest rates are {min(ratios):.2f} to {max(ratios):.2f} of what Eq. "
        "(15) gives for the current at the end of the ramp, which knows no adaptation."
    )
    return critical + Conclusion((sentence,), {"peak_rate_over_eq15": ratios})


def _with_slope(
    run: RunData, critical: Conclusion, rated: Sequence[TrialFinding]
) -> Conclusion:
    """The conclusion with the mean slope of rate over force above onset."""
    levelled = [t for t in rated if t.trial.level is not None]
    try:
        slope = mean_slope(
            [float(t.trial.level or 0.0) for t in levelled],
            [t.response.peak_rate or 0.0 for t in levelled],
            run.force_uncertainty,
        )
    except NotIdentifiableError as reason:
        return critical + Conclusion(
            (), {"slope_Hz_per_N": None}, (f"No slope: {reason}.",)
        )
    low, high = slope.low * 1e-3, slope.high * 1e-3
    said = (
        f"Above onset the highest rate rises by {slope.value * 1e-3:.3g} Hz/mN "
        f"({low:.3g} to {high:.3g} Hz/mN, 95 %) on average; the curve bends."
    )
    return critical + Conclusion((said,), {"slope_Hz_per_N": slope.to_dict()})


def _repeat(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    counts = [t.response.spikes for t in trials]
    rates = [t.response.peak_rate for t in trials]
    values: dict[str, Any] = {"spikes": counts, "peak_rates_Hz": rates}
    if rates[0] is None or len(counts) < 2:
        why = "No decrement: the first presentation gave no rate."
        return Conclusion((), values, (why,))
    rated = [r for r in rates if r is not None]
    sentence = (
        f"Peak rate from one presentation to the next: "
        f"{', '.join(f'{r:.3g}' for r in rated)} Hz"
    )
    silent = len(rates) - len(rated)
    if silent:
        sentence += f"; the other {silent} gave fewer than two spikes"
    return Conclusion((f"{sentence}.",), values)


def _bipolar(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    trace = run.trace("I_DS")
    if trace is None:
        return Conclusion(missing=("No drain current: V_C1 was not recorded.",))
    changes: list[dict[str, Any]] = []
    sentences = []
    margin = BOXCAR_3DB / 20
    for finding in trials:
        hold, start = finding.trial.hold, finding.trial.start
        if hold is None:
            continue
        before = _mean(trace.time, trace.mean, start - 0.1, start + margin)
        begin = start + hold[0]
        during = _mean(trace.time, trace.mean, begin, begin + 0.1)
        if np.isnan(before) or np.isnan(during):
            continue
        changes.append(_change(run, finding.trial.level, during - before))
        sentences.append(
            f"{finding.trial.label}: I_DS from {show(before, 'A', 3)} to "
            f"{show(during, 'A', 3)}"
        )
    if not changes:
        return Conclusion(missing=("No drain current: no force was completed.",))
    said = ["; ".join(sentences) + "."]
    per_force = [_sensitivity(c) for c in changes if c["level_N"]]
    if per_force:
        said.append(f"Per force: {'; '.join(per_force)}.")
    if run.force_uncertainty is None:
        said.append(NO_UNCERTAINTY)
    values: dict[str, Any] = {"I_DS_changes": changes}
    missing = []
    tau, why_not = _tau(trace, trials)
    if tau is None:
        missing.append(f"No tau: {why_not}.")
    else:
        said.append(
            f"The decay gives tau = {tau.value:.3g} s ({tau.low:.3g} to {tau.high:.3g} "
            "s, 95 %)."
        )
        values["tau_s"] = tau.to_dict()
    return Conclusion(tuple(said), values, tuple(missing))


def _change(run: RunData, level: float | None, change: float) -> dict[str, Any]:
    """What a force did to I_DS, and per force."""
    known = run.uncertain(level)
    found: dict[str, Any] = {
        "level_N": level,
        "level_uncertainty_N_95": known,
        "change_A": change,
        "sensitivity_A_per_N": None,
        "sensitivity_uncertainty_A_per_N_95": None,
    }
    if level:
        found["sensitivity_A_per_N"] = change / level
        if known is not None:
            found["sensitivity_uncertainty_A_per_N_95"] = abs(
                change / level * known / level
            )
    return found


def _sensitivity(change: dict[str, Any]) -> str:
    value = change["sensitivity_A_per_N"] * 1e6
    known = change["sensitivity_uncertainty_A_per_N_95"]
    spread = "" if known is None else f" ± {known * 1e6:.2g}"
    return f"{show(change['level_N'], 'N')} {value:.3g}{spread} nA/mN"


def _tau(trace: Trace, trials: Sequence[TrialFinding]) -> tuple[Estimate | None, str]:
    """Tau from the strongest trial, its end known from the rest before the first."""
    first = trials[0].trial
    rest = _mean(trace.time, trace.mean, first.start - 0.2, first.start + 0.02)
    held = [t.trial for t in trials if t.trial.hold is not None]
    if np.isnan(rest) or not held:
        return None, "the current at rest is not known"
    strongest = max(held, key=lambda t: abs(t.level or 0.0))
    start, end = strongest.hold or (0.0, 0.0)
    window = (strongest.start + start + LATE, strongest.start + end)
    try:
        averaged = 2 * float(np.median(np.diff(trace.time)))
        found = fit_decay(trace.time, trace.mean, window, averaged=averaged, rest=rest)
    except NotIdentifiableError as reason:
        return None, str(reason)
    return found.tau, ""


def _mean(time: np.ndarray, values: np.ndarray, start: float, end: float) -> float:
    inside = (time >= start) & (time <= end)
    return float(values[inside].mean()) if inside.any() else float("nan")


_BY_PROTOCOL: dict[str, Callable[[RunData, Sequence[TrialFinding]], Conclusion]] = {
    "hold": _hold,
    "threshold_search": _critical_force,
    "rate_force": _rate_force,
    "repeat": _repeat,
    "bipolar": _bipolar,
    "sine_sweep": sine_sweep,
    "calibrate_field": calibrate_field,
    "force_check": force_check,
    "wiring_check": wiring_check,
    "monitor": monitor,
}
