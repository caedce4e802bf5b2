"""What a sine sweep gives: V_C1's answer to force per frequency, and the model's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.response import Gain, gain
from tactile_lab.errors import NotIdentifiableError, QuantityError
from tactile_lab.quantity import parse
from tactile_lab.report.conclusion import NO_UNCERTAINTY, Conclusion
from tactile_lab.report.run_data import RunData, Trace
from tactile_lab.report.trial_finding import TrialFinding

LARGE = 1000
"""Degrees of freedom of a gain: hundreds of bins a cycle."""


def responses(run: RunData, trials: Sequence[TrialFinding], trace: Trace) -> list[Gain]:
    """Gain of a trace over the force, V/N, for each trial named by a frequency."""
    found = []
    for finding in trials:
        trial = finding.trial
        if trial.hold is None:
            continue
        start, end = (trial.start + edge for edge in trial.hold)
        inside = (trace.time >= start) & (trace.time <= end)
        time = trace.time[inside]
        try:
            frequency = parse(trial.label, "Hz")
            found.append(gain(time, run.force.at(time), trace.mean[inside], frequency))
        except (QuantityError, NotIdentifiableError):
            continue  # another trial, or one that was cut short
    return found


def degrees(phase: float) -> float:
    """Between -360 and 0: V_C1 falls when the force rises, and lags."""
    return float(np.degrees(phase)) - (360.0 if phase > 0 else 0.0)


def known_gain(run: RunData, found: Gain) -> Estimate:
    """The gain with its noise and the force's uncertainty."""
    gain = Estimate.of(found.gain, found.error, LARGE)
    if run.force_uncertainty is None:
        return gain
    part = float(run.force_uncertainty.of(found.amplitude)) / found.amplitude
    return gain.widened(found.gain * part)


def sine_sweep(run: RunData, trials: Sequence[TrialFinding]) -> Conclusion:
    """Gain and phase of V_C1 per frequency, and of the model."""
    measured = run.trace("V_C1")
    if measured is None:
        return Conclusion(missing=("No gain: V_C1 was not recorded.",))
    found = responses(run, trials, measured)
    if not found:
        return Conclusion(missing=("No gain: no frequency was completed.",))
    beside = run.trace("V_C1", model=True)
    expected = responses(run, trials, beside) if beside is not None else []
    known = [(g, known_gain(run, g)) for g in found]
    said = "; ".join(
        f"{g.frequency:.3g} Hz {u.value:.3g} ± {(u.high - u.low) / 2:.2g} V/N at "
        f"{degrees(g.phase):.0f}°"
        for g, u in known
    )
    sentences = [f"V_C1 answers force with {said} (95 %).".replace("-", "−")]
    if run.force_uncertainty is None:
        sentences.append(NO_UNCERTAINTY)
    if len(expected) == len(found):
        off = max(
            abs(g.gain / e.gain - 1) for g, e in zip(found, expected, strict=True)
        )
        sentences.append(f"The model's gain differs by {100 * off:.2g} % at most.")
    values = {
        "V_C1_over_force": [
            {
                "frequency_Hz": g.frequency,
                "gain_V_per_N": u.to_dict(),
                "phase_rad": g.phase,
            }
            for g, u in known
        ]
    }
    return Conclusion(tuple(sentences), values)
