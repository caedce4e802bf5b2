"""Pushing and pulling: the drain current under positive and negative forces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.analysis.decay import Decay, fit_decay
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import Conclusion
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement, RecordedSignal
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.drain_current import BOXCAR_3DB
from tactile_lab.model.specimen import RESISTOR
from tactile_lab.plot import Guide, Mark, Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, plus_minus, show
from tactile_lab.stimulus.force import step
from tactile_lab.stimulus.levels import Levels
from tactile_lab.trial import Trials

SETTLING = 0.04
"""Time after the force is there until the coil's field and node A have followed, s: the
eddy currents' 3 ms and node A's 6 ms five times over."""
BEFORE = 0.2
"""The current before a push is averaged over so long, s."""
MARGIN = BOXCAR_3DB / 20
"""The coil's first set-point comes later than this after a trial's start, s."""


class Bipolar(Levels):
    """Forces of both signs: I_DS rises with one and falls with the other (Fig. 2c)."""

    name: ClassVar[str] = "bipolar"
    title: ClassVar[str] = "Positive and negative forces"
    signals: ClassVar[tuple[str, ...]] = ("force", "coil_current", "V_C1", "I_DS")

    levels: tuple[Force, ...] = Field(
        default=(-0.05, 0.05, -0.08, 0.1), min_length=1, description="Force held"
    )
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=5.0, description="Time at each level")
    rest: Pause = Field(default=5.0, description="Time at no force after each")

    def presentations(self) -> Trials:
        """One trial per level."""
        for level in self.ordered():
            yield step(level, ramp=self.ramp, hold=self.hold, rest=self.rest)

    def conclude(self, run: Measurement) -> Conclusion:
        """What each force does to the drain current, and tau of the film."""
        if run.trace("I_DS") is None:
            seen = run.trace("V_C1") is not None
            why = "I_DS could not be derived" if seen else "V_C1 was not recorded"
            return Conclusion(missing=(f"No drain current: {why}.",))
        pushed = [t for t in run.results if t.held is not None and t.level]
        held = [
            t
            for t in pushed
            if t.held is not None
            and not run.left_range("I_DS", t.start - BEFORE, t.held[1])
        ]
        cut = tuple(
            f"No drain current at {t.label}: V_C1 left its channel's range."
            for t in pushed
            if t not in held
        )
        if not held:
            why = "No drain current: no force was completed."
            return Conclusion(missing=cut or (why,))
        told, unknown = _told_apart(run, held)
        open_ = show(_shifted(run), "A", 2)
        cut += tuple(
            f"No drain current at {t.label}: by one code of offset of V_C1, and by R1 "
            f"and R2, {open_} may be none at all. Pull less, or use a finer range."
            for t in unknown
        )
        if not told:
            return Conclusion((), {"tau_s": None}, cut)
        try:
            tau, changes = _changes(run, told)
        except NotIdentifiableError as reason:
            why = f"No drain current: {reason}."
            return Conclusion((), {"tau_s": None}, (why, *cut))
        found = [
            _change(run, trial, change)
            for trial, change in zip(told, changes, strict=True)
        ]
        said = [
            "; ".join(_told(c) for c in found)
            + f" (95 %, R1 and R2 known to {100 * RESISTOR:g} %), from before each "
            "push to when its force was there.",
            f"Per force: {'; '.join(_sensitivity(c) for c in found)}.",
        ]
        said += run.not_stated
        said.append(
            f"The decays give tau = {tau.text('s')}, with V_S as given; one code of "
            "offset of V_C1, its converter's steps and the tolerance of R1 and R2 are "
            "in the interval."
        )
        values = {
            "I_DS_changes": found,
            "tau_s": tau,
        }
        return Conclusion(tuple(said), values, cut)

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """I_DS beside Eq. (8), as in Fig. 2c, and what is left of it."""
        trace = run.trace("I_DS")
        held = [t for t in run.results if t.held is not None]
        if trace is None or run.circuit is None or not held:
            return
        from tactile_lab.model.simulate import simulate

        def theory(circuit: Circuit) -> FloatArray:
            found = simulate(circuit, run.force, keep=("I_DS",), until=run.duration)
            return found.sample("I_DS", np.clip(trace.time, 0.0, found.duration))

        lines: list[tuple[str, Mark, str, FloatArray]]
        lines = [("Eq. (8)", "dotted", "model", theory(run.circuit))]
        with suppress(NotIdentifiableError):
            tau = _changes(run, _told_apart(run, held)[0])[0]
            named = f"with τ = {show(tau.value, 's', 3)}"
            fitted = theory(replace(run.circuit, tau=tau.value))
            lines.append((named, "dashed", "V_C1", fitted))
        yield Plot(
            name="summary",
            title="drain current",
            caption="(a) I_DS, from V_C1 by Eq. (16), under the forces applied, as in "
            "Fig. 2c. Dotted: Eq. (8) with the sensor's parameters as believed; "
            "dashed: with the time constant fitted to the decays in the holds. (b) "
            "What I_DS exceeds both by; short peaks at the ramps are what Eq. (16) "
            "averages over.",
            x_label="Time",
            x_unit="s",
            x_limits=(0.0, run.duration),
            letters=True,
            panels=(
                Panel(
                    label="I_DS",
                    unit="A",
                    series=(
                        Series(x=trace.time, y=trace.mean, colour="I_DS", name="I_DS"),
                        *(
                            Series(x=trace.time, y=y, mark=mark, colour=hue, name=name)
                            for name, mark, hue, y in lines
                        ),
                    ),
                    limits=(0.0, None),
                    height=2.2,
                ),
                Panel(
                    label="Residual",
                    unit="A",
                    series=tuple(
                        Series(x=trace.time, y=trace.mean - y, mark=mark, colour=hue)
                        for _, mark, hue, y in lines
                    ),
                    guides=(Guide(at=0.0, along="x", dashed=False),),
                    height=1.1,
                ),
            ),
        )


def _told_apart(
    run: Measurement, held: list[MeasuredTrial]
) -> tuple[list[MeasuredTrial], list[MeasuredTrial]]:
    """Holds whose drain current is more than all currents may be shifted by; others."""
    trace, least = run.trace("I_DS"), _shifted(run)
    if trace is None:
        return [], held
    known = []
    for trial in held:
        start, end = trial.held or (0.0, 0.0)
        inside = (trace.time >= start + SETTLING) & (trace.time <= end)
        if np.all(trace.mean[inside] > least):
            known.append(trial)
    return known, [trial for trial in held if trial not in known]


def _shifted(run: Measurement) -> float:
    """What V_C1's channel and the resistors leave open of all currents alike, A."""
    if run.circuit is None:
        return 0.0
    V_C1, conductance = run.trace("V_C1"), 1 / run.circuit.R1 + 1 / run.circuit.R2
    code = (0.0 if V_C1 is None else V_C1.code or 0.0) * conductance
    return math.hypot(code, _resistors(run.circuit, conductance)[1])


def _changes(
    run: Measurement, held: list[MeasuredTrial]
) -> tuple[Estimate, list[Estimate]]:
    """Tau by the decays in the holds, and what each push changed I_DS by, A.

    Raises:
        NotIdentifiableError: no rest before the first push, or holds too short.
    """
    trace, first = run.trace("I_DS"), run.results[0]
    rest = run.mean("I_DS", first.start - BEFORE, first.start + MARGIN)
    if trace is None or math.isnan(rest):
        raise NotIdentifiableError("the current at rest is not known")
    begins = np.array(
        [run.mean("I_DS", t.start - BEFORE, t.start + MARGIN) for t in held]
    )
    holds = [t.held for t in held if t.held is not None]
    averaged = 2 * float(np.median(np.diff(trace.time)))

    def fitted(offset: float, at_rest: float) -> tuple[Decay, np.ndarray[Any, Any]]:
        """With all currents shifted, and those before the pushes further, A."""
        end = rest + offset + at_rest
        found = fit_decay(
            trace.time, trace.mean + offset, holds,
            averaged=averaged, settling=SETTLING, rest=end,
        )  # fmt: skip
        size = np.array([a.value for a in found.amplitudes])
        return found, end * np.exp(size) - (begins + offset + at_rest)

    decay, changed = fitted(0.0, 0.0)
    conductance, V_C1 = 0.0, run.trace("V_C1")
    if run.circuit is not None:
        conductance = 1 / run.circuit.R1 + 1 / run.circuit.R2
    steps = run.step_bias("V_C1") * conductance
    resistors, _ = _resistors(run.circuit, conductance)
    causes = (_shifted(run), 0.0), (0.0, steps)
    # either way: tau does not follow an offset in proportion
    moved = [
        (fitted(*cause), fitted(*(-size for size in cause)))
        for cause in causes
        if any(cause)
    ]
    logarithm = Estimate(
        math.log(decay.tau.value),
        decay.tau.error / decay.tau.value,
        math.log(decay.tau.low),
        math.log(decay.tau.high),
    ).spanned(
        *(
            (math.log(up.tau.value), math.log(down.tau.value))
            for (up, _), (down, _) in moved
        )
    )
    tau = Estimate(
        decay.tau.value, decay.tau.value * logarithm.error,
        math.exp(logarithm.low), math.exp(logarithm.high),
    )  # fmt: skip
    # so many bins before each push are averaged
    noise = _scatter(run) / math.sqrt(max(BEFORE / averaged, 1.0))
    changes = []
    for i, amplitude in enumerate(decay.amplitudes):
        there = rest * math.exp(amplitude.value)
        known = Estimate(
            float(changed[i]), there * amplitude.error,
            float(changed[i]) - there * amplitude.half,
            float(changed[i]) + there * amplitude.half,
        )  # fmt: skip
        shifts = (abs(float(up[i] - down[i])) / 2 for (_, up), (_, down) in moved)
        left = steps * _unsmoothed(V_C1, *holds[i])
        by_resistors = resistors * float(changed[i])
        changes.append(known.widened(*shifts, 2 * noise, left, by_resistors))
    return tau, changes


def _unsmoothed(V_C1: RecordedSignal | None, start: float, end: float) -> float:
    """Part of a converter's error that a hold leaves by passing over its steps.

    What they make of a slow voltage is a sine of it (`analysis.converter`), whose mean
    over several periods is at most one over pi times their number.
    """
    if V_C1 is None or not V_C1.code:
        return 1.0
    inside = (V_C1.time >= start + SETTLING) & (V_C1.time <= end)
    passed = np.ptp(V_C1.mean[inside]) / V_C1.code if inside.any() else 0.0
    return min(1.0, 1 / (math.pi * max(float(passed), 1e-9)))


def _resistors(circuit: Circuit | None, conductance: float) -> tuple[float, float]:
    """What the tolerance of R1 and R2 leaves open of I_DS by Eq. (16), 95 %.

    The one part is in proportion to it, by node A's conductance, 1/Ohm; the other is
    of all currents alike, A.
    """
    if circuit is None:
        return 0.0, 0.0
    part = RESISTOR * math.hypot(1 / circuit.R1, 1 / circuit.R2) / conductance
    # V_S/(R1 + R2) flows through both where no drain current does
    alike = math.sqrt(2) * RESISTOR * circuit.V_S / (circuit.R1 + circuit.R2)
    return part, alike


def _scatter(run: Measurement) -> float:
    """Standard deviation of I_DS from bin to bin before the first push, A."""
    trace, first = run.trace("I_DS"), run.results[0]
    if trace is None:
        return 0.0
    inside = (trace.time >= first.start - BEFORE) & (trace.time <= first.start + MARGIN)
    return float(trace.mean[inside].std(ddof=1)) if inside.sum() > 2 else 0.0


def _change(run: Measurement, trial: MeasuredTrial, found: Estimate) -> dict[str, Any]:
    """What a force did to I_DS, and per force."""
    level = trial.level or math.nan
    known = run.uncertain(level)
    slope = Estimate(
        found.value / level, abs(found.error / level),
        *sorted((found.low / level, found.high / level)),
    )  # fmt: skip
    if known is not None:
        slope = slope.widened(abs(slope.value * known / level))
    return {
        "label": trial.label,
        "level_N": level,
        "level_uncertainty_N_95": known,
        "change_A": found.value,
        "change_uncertainty_A_95": found.half,
        "sensitivity_A_per_N": slope.value,
        "sensitivity_uncertainty_A_per_N_95": slope.half,
    }


def _told(change: dict[str, Any]) -> str:
    value, half = change["change_A"], change["change_uncertainty_A_95"]
    verb = "raises" if value > 0 else "lowers"
    return f"{change['label']} {verb} I_DS by {plus_minus(abs(value), half, 'A')}"


def _sensitivity(change: dict[str, Any]) -> str:
    value = change["sensitivity_A_per_N"] * 1e6
    half = change["sensitivity_uncertainty_A_per_N_95"] * 1e6
    return f"{show(change['level_N'], 'N')} {plus_minus(value, half, 'nA/mN')}"
