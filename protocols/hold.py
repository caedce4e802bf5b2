"""One long constant force: adaptation, if it lasts long enough until silence."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import Field

from tactile_lab.analysis.adaptation import Adaptation
from tactile_lab.analysis.adrian import ADRIAN, MARK
from tactile_lab.analysis.circuit_adaptation import CircuitAdaptation
from tactile_lab.analysis.spike_train import within
from tactile_lab.arrays import FloatArray
from tactile_lab.conclusion import NOT_SEARCHED, Conclusion
from tactile_lab.measurement import MeasuredTrial, Measurement
from tactile_lab.plot import Panel, Plot, Series
from tactile_lab.quantity import Duration, Force, Pause, plus_minus, show
from tactile_lab.stimulus.force import ForceProtocol
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform


class Hold(ForceProtocol):
    """A force ramped up and held for long (Fig. 4e, 5b, 5c)."""

    name: ClassVar[str] = "hold"
    title: ClassVar[str] = "Hold"

    level: Force = Field(default=0.15, description="Force held")
    ramp: Pause = Field(default=0.25, description="Ramp up and ramp down, each")
    hold: Duration = Field(default=10.0, description="Time at the level")
    before: Pause = Field(default=0.0, description="Time at no force before the ramp")
    rest: Pause = Field(default=2.0, description="Time at no force afterwards")

    def presentations(self) -> Trials:
        """One trial."""
        pulse = Waveform.pulse(
            self.level, ramp=self.ramp, hold=self.hold, rest=self.rest
        )
        begin = self.before + self.ramp
        if self.before > 0:
            quiet = Waveform.through([(0.0, 0.0), (self.before, 0.0)])
            pulse = quiet.then(pulse)
        yield Trial(
            force=pulse,
            label=show(self.level, "N"),
            level=self.level,
            hold=(begin, begin + self.hold),
        )

    def conclude(self, run: Measurement) -> Conclusion:
        """The circuit's own adaptation, and the exponential of the paper beside it."""
        if not run.searched:
            return Conclusion(missing=(NOT_SEARCHED,))
        held = [t for t in run.results if t.hold is not None]
        if not held:
            why = "No adaptation: no hold was completed."
            return Conclusion((), {"tau_s": None, "time_constant_s": None}, (why,))
        return _by_circuit(run, held[0]) + _by_exponential(held[0])

    def plots(self, run: Measurement) -> Iterator[Plot]:
        """The decay with its fits (Fig. 5c), beside Adrian's curves (Fig. 5d left)."""
        trial = next((t for t in run.results if t.hold is not None), None)
        if trial is None or trial.hold is None:
            return
        fit, (law, _) = trial.adaptation, run.circuit_adaptation(trial)
        if fit is None and law is None:
            return
        start, end = trial.hold
        held = within(trial.spike_times, trial.hold)
        curves, fitted = [], []
        if law is not None:
            time = np.linspace(law.hold[0], end, 600)
            curves.append(
                Series(x=time - start, y=law.rate(time), name="Eq. (15)", colour="V_C1")
            )
            fitted += [f"τ = {law.tau.text('s')}", _gate(law)]
        if fit is not None:
            time, rate = fit.drawn
            curves.append(
                Series(
                    x=time - start, y=rate, name="α exp(βt) + γ", mark="dashed",
                    colour="ink",
                )
            )  # fmt: skip
            values = (("α", fit.alpha, "Hz"), ("β", fit.beta, "1/s"))
            fitted += [
                f"{name} = {value.text(unit)}"
                for name, value, unit in (*values, ("γ", fit.gamma, "Hz"))
            ]
        middles = (held[1:] + held[:-1]) / 2 - start
        yield Plot(
            name="summary",
            title="adaptation",
            caption="Instantaneous rate during the hold, each 1/ISI in the middle of "
            "its interval, as in Fig. 5c; line: Eq. (15) at each instant, with the "
            "V_P(t) fitted to the spikes and the silence (at the end V_C2 comes behind "
            "and an interval lasts longer); dashed: α exp(βt) + γ, as in the paper, up "
            "to the last spike.",
            x_label="Time from the start of the hold",
            x_unit="s",
            panels=(
                Panel(
                    label="Rate",
                    unit="Hz",
                    series=(
                        *curves,
                        Series(
                            x=middles, y=1 / np.diff(held), mark="dots", name="1/ISI"
                        ),
                    ),
                    limits=(0, None),
                    text="\n".join(fitted),
                ),
            ),
        )
        if fit is not None and held.size > 1:
            yield _beside_adrian(middles, 1 / np.diff(held), fit)


def _beside_adrian(middles: FloatArray, rates: FloatArray, fit: Adaptation) -> Plot:
    """Falling rates over their peak against time over its constant (Fig. 5d left)."""
    tau, scaled = fit.time_constant.value, np.linspace(0, 6, 200)
    colours = zip(ADRIAN, ("V_C1", "V_C2"), strict=True)
    return Plot(
        name="adrian",
        title="adaptation beside a muscle's",
        caption="Rate over its highest against time over the time constant of its own "
        "exponential: dots, this run; dashed, Adrian and Zotterman's muscle drawn from "
        "the coefficients the paper prints (Fig. 5d, left), which are no data. So "
        "scaled, curves that fall alike lie on one another; their rates "
        f"({ADRIAN[0].rate(0):.0f} and {ADRIAN[1].rate(0):.0f} Hz at first) and time "
        "constants (1.3 and 1.0 s) are others.",
        x_label="Time over the time constant",
        panels=(
            Panel(
                label="Rate over its highest",
                series=(
                    Series(
                        x=middles / tau, y=rates / rates.max(), mark="dots",
                        name=f"this run, τ = {show(tau, 's', 3)}",
                    ),
                    *(
                        Series(
                            x=scaled,
                            y=curve.rate(-scaled / curve.beta) / curve.rate(0),
                            mark="dashed", colour=colour,
                            name=f"muscle, {curve.stimulus}",
                        )
                        for curve, colour in colours
                    ),
                ),
                limits=(0, None),
                text=MARK,
                corner="lower",
            ),
        ),
    )  # fmt: skip


def _by_circuit(run: Measurement, trial: MeasuredTrial) -> Conclusion:
    """Tau and V_GS by the circuit's own law, and where it falls silent."""
    law, why = run.circuit_adaptation(trial)
    if law is None:
        return Conclusion((), {"tau_s": None}, (f"No tau of the film: {why}.",))
    said = (
        f"By the circuit's own law, Eq. (15) with V_P(t), the film leaks with tau = "
        f"{law.tau.text('s')} and {_gate(law)} (95 %, the circuit's other parameters "
        f"as believed); the rates lie within {show(law.rms, 'Hz', 2)} of it (rms)."
    )
    measured = trial.response.silent
    if law.silent_from is not None and measured is not None:
        said += _silence(law.silent_from, measured)
    values = {
        "tau_s": law.tau, "V_GS_V": law.V_GS, "V_P_V": law.V_P, "rms_Hz": law.rms,
        "law_silent_from_s": law.silent_from,
    }  # fmt: skip
    return Conclusion((said,), values)


def _silence(by_law: float, measured: float) -> str:
    """Whether the law, going on from the sensor's last spike, is silent too."""
    if by_law <= measured:
        return (
            f" After the sensor's last spike at {measured:.4g} s it charges C2 to no "
            "other within the hold."
        )
    return (
        f" After the sensor's last spike at {measured:.4g} s it would fire on until "
        f"{by_law:.4g} s."
    )


def _by_exponential(trial: MeasuredTrial) -> Conclusion:
    """The exponential's time constant, and what it cannot tell."""
    fit = trial.adaptation
    if fit is None:
        why = f"No time constant of an exponential: {trial.why_not}."
        return Conclusion((), {"time_constant_s": None}, (why,))
    said = (
        "As in the paper, an exponential describes the falling rate with a time "
        f"constant of {fit.time_constant.text('s')}"
    )
    if fit.systematic:
        said += "; the rates leave it systematically, so that interval is too narrow"
    silent = trial.response.silent
    if silent is not None and fit.unseen >= 0.5:
        said += (
            f"; it knows no silence and expects {fit.unseen:.1f} more spikes after "
            f"the last one at {silent:.4g} s"
        )
    return Conclusion((f"{said}.",), {"time_constant_s": fit.time_constant})


def _gate(law: CircuitAdaptation) -> str:
    return f"V_GS = {plus_minus(law.V_GS.value, law.V_GS.half, 'V')}"
