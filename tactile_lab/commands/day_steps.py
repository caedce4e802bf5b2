"""The steps of a lab's first day: what is run, what to see, and what if not."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

Results = Mapping[str, Any]


def _wired(results: Results) -> str:
    channels = (results["conclusion"] or {}).get("channels") or {}
    wrong = [name for name, found in channels.items() if not found["ok"]]
    if not channels:
        return "no channel could be judged"
    return f"not as wired: {', '.join(wrong)}" if wrong else ""


def _calibrated(results: Results) -> str:
    found = (results["conclusion"] or {}).get("slope_T_per_A")
    return "" if found else "there is no calibration"


def _forced(results: Results) -> str:
    forces = (results["conclusion"] or {}).get("F_minus_F0_by_field_N") or [None]
    return "a force could not be told from the field" if None in forces else ""


def _onset(results: Results) -> str:
    found = (results["conclusion"] or {}).get("critical_force_N")
    return "" if found else "no critical force was found"


def _fired(results: Results) -> str:
    spikes = sum(trial["spikes"] for trial in results["trials"])
    return "" if spikes else "the sensor was silent"


@dataclass(frozen=True)
class FirstDayStep:
    """One step of the first day.

    Attributes:
        name: of the scene that is run, or of the verb.
        title: for a person.
        before: what a person does first at a real bench; "" for nothing.
        see: what to see.
        otherwise: what to do if not.
        wrong: what is wrong with a run's results, "" if nothing; None for a verb.
    """

    name: str
    title: str
    see: str
    otherwise: str
    before: str = ""
    wrong: Callable[[Results], str] | None = None


STEPS = (
    FirstDayStep(
        "doctor",
        "Can this computer run an experiment?",
        "no problems; notes matter only for instruments you do not have.",
        "do what stands after `remedy`, then go on.",
    ),
    FirstDayStep(
        "devices",
        "What is attached?",
        "each of your instruments, with the row or driver that fits it.",
        "check power and cable. An instrument without a row needs one "
        "(docs/how-to/add-a-dialect.md); on the simulated bench nothing need be here.",
    ),
    FirstDayStep(
        "wiring_check",
        "Is each channel what the bench file says?",
        '"as wired" after each channel.',
        "the report names what is swapped, inverted, open or attenuated: mend the "
        "cable, or the channel in the bench file.",
        wrong=_wired,
    ),
    FirstDayStep(
        "calibrate_field",
        "What field does the coil give?",
        "a slope near that of the bench file, a loop below 5 % of full scale, little "
        "drift.",
        "a slope of the other sign: turn the probe, or exchange the coil's leads. A "
        "wide loop: a core of hard steel. Drift: let coil and meter warm up.",
        before="Take the NdFeB magnet away and put the probe on the core's axis.",
        wrong=_calibrated,
    ),
    FirstDayStep(
        "force_check",
        "Is the force what Eq. (2) says?",
        "the forces asked for, within their uncertainty. With a balance under the "
        "magnet note what it shows at each hold, and compare: tactile-lab run "
        "force_check --set 'protocol.readings=[\"50 mN\", ...]'.",
        "a tenth of the force: A2 as printed in Table 1. Otherwise check r, and that "
        "the magnet is back in its place.",
        before="Put the magnet back; without the sensor, or over a balance.",
        wrong=_forced,
    ),
    FirstDayStep(
        "threshold_search",
        "Where does the sensor begin to fire?",
        "a critical force between two that were played.",
        "no spike at all: trim V_GS (tactile-lab monitor) until V_C1 rests a few 10 mV "
        "above the threshold. Spikes without force: V_GS is too high.",
        before="Put the sensor in its place.",
        wrong=_onset,
    ),
    FirstDayStep(
        "demo",
        "Does it adapt?",
        "spikes that grow with the force and slow down within a hold.",
        "too small a force: take levels above the critical force that was found.",
        wrong=_fired,
    ),
)


def levels(results: Results) -> list[str]:
    """What each trial gave, of a run that concludes nothing."""
    from tactile_lab.quantity import show

    told = []
    for trial in results["trials"]:
        text = f"{trial['label']}: {trial['spikes']} spikes"
        text += " seen, no count" if trial["uncounted"] else ""
        peak, final = trial["peak_rate_Hz"], trial["final_rate_Hz"]
        if peak is not None and final is not None:
            text += f", from {show(peak, 'Hz', 3)} down to {show(final, 'Hz', 3)}"
        told.append(f"{text} in the hold." if trial["spikes"] else f"{text}.")
    return told
