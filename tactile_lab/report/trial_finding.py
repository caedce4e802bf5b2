"""The numbers one trial gives, each with the reason where there is none."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_lab.analysis.adaptation import Adaptation, fit_adaptation
from tactile_lab.analysis.spike_train import Response, respond
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.report.run_data import TrialData


@dataclass(frozen=True, kw_only=True, eq=False)
class TrialFinding:
    """What one trial gave.

    Attributes:
        trial: the trial.
        response: its spikes described.
        adaptation: the fitted decay, or None.
        why_not: why there is no fit, or "".
    """

    trial: TrialData
    response: Response
    adaptation: Adaptation | None
    why_not: str

    @classmethod
    def of(cls, trial: TrialData) -> TrialFinding:
        """Compute it; too few spikes give a reason, never an error."""
        response = respond(trial.spike_times, onset=trial.onset, hold=trial.hold)
        fit, why_not = None, ""
        if response.spikes == 0:
            why_not = "no spikes"
        elif trial.hold is None:
            why_not = "no hold"
        else:
            try:
                fit = fit_adaptation(trial.spike_times, trial.hold)
            except NotIdentifiableError as error:
                why_not = f"not identifiable: {error}"
        return cls(trial=trial, response=response, adaptation=fit, why_not=why_not)
