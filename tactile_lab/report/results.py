"""The machine-readable results.json: every documented key always present, no NaN."""

from __future__ import annotations

import json
from dataclasses import asdict
from typing import Any

import numpy as np

from tactile_lab.analysis.adaptation import Adaptation
from tactile_lab.analysis.circuit_adaptation import CircuitAdaptation
from tactile_lab.analysis.twin import Twin
from tactile_lab.measurement import MeasuredTrial
from tactile_lab.report.findings import Findings
from tactile_lab.report.run_data import RunData
from tactile_lab.report.twin import to_dict

SCHEMA = 1


def results(findings: Findings) -> dict[str, Any]:
    """The findings as plain values; units are in the keys, missing numbers are None."""
    run = findings.run
    loss = run.loss
    return {
        "schema": SCHEMA,
        "run": run.run,
        "title": run.title,
        "protocol": run.protocol.name,
        "scene": run.scene,
        "started": run.started,
        "status": run.status,
        "simulated": run.simulated,
        "bench": run.bench,
        "duration_s": run.duration,
        "took_s": run.took,
        "force_uncertainty_95": None
        if run.force_uncertainty is None
        else {
            "absolute_N": run.force_uncertainty.absolute,
            "relative": None
            if run.force_uncertainty.unstated
            else run.force_uncertainty.relative,
        },
        "spikes": sum(t.response.spikes for t in run.results),
        "trials": [_trial(run, t) for t in run.results],
        "loss": None
        if loss is None
        else {
            "samples": loss.samples,
            "samples_produced": loss.samples_produced,
            "spikes": loss.spikes,
            "spikes_online": loss.spikes_online,
            "covered_s": loss.covered,
            "streamed_s": loss.streamed,
        },
        "overrange_s": {
            t.signal: t.overrange.tolist()
            for t in run.traces
            if t.source == "measured" and t.overrange.size
        },
        "conclusion": findings.conclusion.plain,
        "error_budget_95": {
            what: budget.plain for what, budget in findings.conclusion.budgets.items()
        },
        "statements": list(findings.conclusion.sentences),
        "tables": [asdict(table) for table in findings.conclusion.tables],
        "plots": [plot.to_dict() for plot in findings.answers],
        "twin": None
        if findings.beside is None
        else {**_twin(findings.beside.twin), **to_dict(findings.beside)},
        "accuracy": run.accuracy or None,
        "notes": list(findings.notes),
        "missing": list(findings.missing),
        "warnings": list(run.warnings),
        "assumptions": list(run.assumptions),
        "parameters": dict(run.parameters),
        "sensor": dict(run.sensor),
        "calibration": dict(run.calibration),
    }


def as_json(findings: Findings) -> str:
    """`results` as JSON text with full double precision."""
    text = json.dumps(results(findings), indent=2, ensure_ascii=False, allow_nan=False)
    return text + "\n"


def _trial(run: RunData, trial: MeasuredTrial) -> dict[str, Any]:
    response, fit = trial.response, trial.adaptation
    law, why_not = run.circuit_adaptation(trial)
    return {
        "label": trial.label,
        "complete": trial.complete,
        "level_N": trial.level,
        "level_uncertainty_N_95": run.uncertain(trial.level),
        "start_s": trial.start,
        "duration_s": trial.duration,
        "hold_s": None if trial.hold is None else list(trial.hold),
        "rest_V_C1_V": trial.rest,
        "drift_V": trial.drift,
        "spikes": response.spikes,
        "ramp_spikes": response.ramp_spikes,
        "uncounted": trial.uncounted or None,
        "skipped": trial.skipped,
        "spike_times_s": [float(t) for t in trial.spike_times],
        "latency_s": response.latency,
        "latency_uncertainty_s": None
        if response.latency is None
        else trial.clock_uncertainty,
        "peak_rate_Hz": response.peak_rate,
        "final_rate_Hz": response.final_rate,
        "fall": response.fall,
        "adaptation_index": response.adaptation_index,
        "silent_from_s": response.silent,
        "adaptation": None if fit is None else _adaptation(fit),
        "adaptation_why_not": trial.why_not or None,
        "circuit_adaptation": None if law is None else _circuit_adaptation(law),
        "circuit_adaptation_why_not": why_not or None,
    }


def _twin(twin: Twin) -> dict[str, Any]:
    matched = twin.spikes
    return {
        "voltages": {
            r.signal: {
                "offset_V": _finite(r.offset),
                "rms_V": _finite(r.rms),
                "band_95_V": _finite(r.band),
                "tolerance_V_95": _finite(np.median(r.tolerance)),
                "within_tolerance": _finite(r.within),
            }
            for r in twin.residuals
        },
        "spikes": None
        if matched is None
        else {
            "matched": int(matched.measured.size),
            "missed": matched.missed,
            "extra": matched.extra,
            "offsets_s": [float(o) for o in matched.offsets],
            "offset_tolerances_s_95": [_finite(t) for t in matched.tolerance],
            "within_tolerance": _finite(matched.within),
            "rate_errors": [float(e) for e in matched.rate_error],
            "rate_error_tolerances_95": [_finite(t) for t in matched.rate_tolerance],
        },
    }


def _finite(value: float | np.floating[Any]) -> float | None:
    return float(value) if np.isfinite(value) else None


def _adaptation(fit: Adaptation) -> dict[str, Any]:
    return {
        "alpha_Hz": fit.alpha.to_dict(),
        "beta_per_s": fit.beta.to_dict(),
        "gamma_Hz": fit.gamma.to_dict(),
        "time_constant_s": fit.time_constant.to_dict(),
        "irregularity": fit.irregularity,
        "r_squared": fit.r_squared,
        "intervals": fit.intervals,
        "chance_of_misfit": fit.chance,
        "spikes_expected_in_silence": fit.unseen,
    }


def _circuit_adaptation(law: CircuitAdaptation) -> dict[str, Any]:
    return {
        "tau_s": law.tau.to_dict(),
        "V_GS_V": law.V_GS.to_dict(),
        "V_P_V": law.V_P.to_dict(),
        "scatter_at_firing_V": law.scatter,
        "rms_Hz": law.rms,
        "intervals": law.intervals,
        "silent_from_s": law.silent_from,
    }
