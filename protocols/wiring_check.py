"""A small safe step: is each channel what the bench file says it is?"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from tactile_lab.analysis.error_budget import ErrorBudget
from tactile_lab.analysis.estimate import Z95
from tactile_lab.analysis.wiring import (
    NODES,
    ChannelCalibration,
    SignalLevels,
    calibrate_channel,
    explaining_V_GS,
    hum,
    judge,
)
from tactile_lab.conclusion import Conclusion
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.measurement import MeasuredTrial, Measurement, RecordedSignal
from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import Duration, Unit, plus_minus, show
from tactile_lab.stimulus.force import step
from tactile_lab.trial import Probes, Protocol, Trial, Trials
from tactile_lab.waveform import Waveform

SmallForce = Annotated[float, Unit("N", above=0.0, most=0.1)]
Mains = Annotated[float, Unit("Hz", above=0.0, most=100.0)]
Window = tuple[float, float]
CODE = 40e-3
"""One code where a run does not tell, V."""
QUIET = ("0 V", "V_S", "rest")
"""Windows in which a voltage stands still: its scatter there is noise."""


class WiringCheck(Protocol):
    """Probes on 0 V, on V_S, then rest, a small push, rest: channels are judged.

    The first two give offset and gain of each voltage channel; a person puts the probes
    there. The push must lower V_C1 and raise V_C2; the shunt and the teslameter must
    show the current's sign and size. All voltage channels are set to see 0 V to V_S.
    """

    name: ClassVar[str] = "wiring_check"
    title: ClassVar[str] = "Wiring check"
    signals: ClassVar[tuple[str, ...]] = (
        "force", "coil_current", "field", "V_C1", "V_C2", "V_K",
    )  # fmt: skip
    as_wired: ClassVar[bool] = True
    moves_probes: ClassVar[bool] = True
    checks: ClassVar[Literal["wiring"]] = "wiring"

    calibrate: bool = Field(
        default=True, description="First put the probes on 0 V and on V_S"
    )
    push: SmallForce = Field(default=0.05, description="Force of the step")
    hold: Duration = Field(default=2.0, description="Time at each part")
    mains: Mains = Field(default=50.0, description="Frequency of the hum looked for")

    def trials(self) -> Trials:
        """Calibration of the channels, rest, push, rest."""
        if self.calibrate:
            yield self._quiet("0 V", "ground")
            yield self._quiet("V_S", "supply")
        yield self._quiet("rest")
        yield step(self.push, ramp=0.25, hold=self.hold, rest=0.5, label="push")
        yield self._quiet("rest again")

    def _quiet(self, label: str, probes: Probes = "circuit") -> Trial:
        return Trial(
            force=Waveform.through([(0.0, 0.0), (self.hold, 0.0)]),
            label=label,
            hold=(0.0, self.hold),
            probes=probes,
        )

    def conclude(self, run: Measurement) -> Conclusion:
        """A verdict per channel, with its hum, and the V_GS that the rest explains."""
        windows = {t.label: _window(t) for t in run.results}
        if run.circuit is None or not {"rest", "push"} <= set(windows):
            return Conclusion(("Rest and push were not both completed.",))
        calibrations, faults = _calibrated(run, run.circuit, windows)
        rest, push = (_found(run, windows[w], calibrations) for w in ("rest", "push"))
        expected = _expected(run, run.circuit, windows)
        bands = {
            t.signal: _bands(run, t, calibrations.get(t.signal), windows)
            for t in run.traces
            if t.signal in NODES
        }
        verdicts = judge(SignalLevels(rest, push, bands), expected, faults)
        channels: dict[str, dict[str, Any]] = {}
        sentences = []
        for verdict in verdicts:
            trace = run.trace(verdict.signal)
            size, said = self._hum(trace, windows["rest"])
            known = calibrations.get(verdict.signal)
            channels[verdict.signal] = {
                "ok": verdict.ok,
                "text": verdict.text,
                "hum_V": size,
                "offset_V": known.offset if known else None,
                "gain": known.gain if known else None,
                "offset_uncertainty_V_95": known.known if known else None,
                "gain_uncertainty_95": known.gain_known if known else None,
                "error_V": known.error if known else None,
            }
            sentences.append(
                f"{verdict.signal}: {'as wired' if verdict.ok else 'WRONG'}, "
                f"{verdict.text}{said}."
            )
        sentences += [f"{name}: {c.text}." for name, c in calibrations.items()]
        found = Conclusion(tuple(sentences), {"channels": channels})
        if "V_C1" in rest and all(v.ok for v in verdicts if v.signal == "V_C1"):
            found += _gate(run, run.circuit, rest["V_C1"], bands["V_C1"][0])
        return found

    def _hum(
        self, trace: RecordedSignal | None, window: Window
    ) -> tuple[float | None, str]:
        """Amplitude of the mains hum at a channel's input, V, and what to say of it."""
        if trace is None:
            return None, ""
        inside = (trace.time >= window[0]) & (trace.time <= window[1])
        try:
            shown = hum(trace.time[inside], trace.mean[inside], self.mains)
        except NotIdentifiableError:
            return None, ""
        size = shown / abs(trace.scale)
        half = (trace.code or CODE) / abs(trace.scale) / 2
        # half a code of the converter is as fine as it can be told
        said = plus_minus(size, half, "V")
        if size <= half:
            said = f"below {show(half, 'V', 2)}"
        return size, f"; {self.mains:g} Hz hum {said}"


def _window(trial: MeasuredTrial) -> Window:
    start, end = trial.held or (trial.start, trial.start + trial.duration)
    # the second half: the followers and node A have settled. Not its last instants: the
    # record's last value there may reach into what comes next
    return (start + end) / 2, end - 0.02 * (end - start)


def _known(
    run: Measurement, trace: RecordedSignal, windows: Mapping[str, Window]
) -> float:
    """Half of the band of a mean, V: what converter's steps and noise may leave."""

    def left(window: Window) -> float:
        steps = run.step_bias(trace.signal, *window) if trace.code else CODE / 2
        return steps + Z95 * run.error_of_mean(trace.signal, *window)

    return max(left(windows[name]) for name in QUIET if name in windows)


def _bands(
    run: Measurement,
    trace: RecordedSignal,
    known: ChannelCalibration | None,
    windows: Mapping[str, Window],
) -> tuple[float, float]:
    """Halves of the bands of a voltage's mean and of a change of it, V."""
    if known is not None:
        return Z95 * known.error, 2 * known.known
    one = _known(run, trace, windows)
    # the channel's offset may be a code; a change knows it not
    return math.hypot(one, CODE), 2 * one


def _calibrated(
    run: Measurement, circuit: Circuit, windows: Mapping[str, Window]
) -> tuple[dict[str, ChannelCalibration], dict[str, str]]:
    """Calibrations of the voltage channels, and what is wrong with those without."""
    found: dict[str, ChannelCalibration] = {}
    faults: dict[str, str] = {}
    if not {"0 V", "V_S"} <= set(windows):
        return found, faults
    for trace in run.traces:
        if trace.signal not in NODES:
            continue
        low, high = (
            run.mean(trace.signal, *windows[w], cut_off=True) for w in ("0 V", "V_S")
        )
        try:
            found[trace.signal] = calibrate_channel(
                low, high, circuit.V_S, _known(run, trace, windows)
            )
        except NotIdentifiableError as reason:
            faults[trace.signal] = str(reason)
    return found, faults


def _found(
    run: Measurement, window: Window, calibrations: Mapping[str, ChannelCalibration]
) -> dict[str, float]:
    """Mean of each signal in the window, corrected where its channel is calibrated."""
    found = {}
    for trace in run.traces:
        # a voltage past the range's end is a finding here
        value = run.mean(trace.signal, *window, cut_off=True)
        known = calibrations.get(trace.signal)
        found[trace.signal] = value if known is None else known.corrected(value)
    field = run.field_between(*window)
    if field.size:
        found["field"] = float(field.mean())
    return found


def _expected(
    run: Measurement, circuit: Circuit, windows: Mapping[str, Window]
) -> SignalLevels:
    """Rest and push by the model, and by what was set."""
    from tactile_lab.model.simulate import simulate

    centres = np.array([sum(windows[w]) / 2 for w in ("rest", "push")])
    nodes = {}
    for signal in ("V_C1", "V_C2"):
        model = simulate(
            circuit, run.force, keep=(signal,), until=run.duration, tolerance=1e-6
        )
        nodes[signal] = model.sample(signal, centres)
    levels = []
    for i, name in enumerate(("rest", "push")):
        amperes = run.current_at(windows[name][1]) or 0.0
        levels.append(
            {
                **{signal: float(values[i]) for signal, values in nodes.items()},
                "V_K": 0.0,
                "coil_current": amperes,
                "field": amperes * (run.field_per_ampere or 0.0),
            }
        )
    return SignalLevels(levels[0], levels[1])


def _gate(run: Measurement, circuit: Circuit, V_C1: float, half: float) -> Conclusion:
    """V_GS that explains V_C1 at rest, whose band has half this width, V."""
    from tactile_lab.model.equations import rest_V_C1

    budgets = {"V_C1 at rest": ErrorBudget("V", {"converter": half})}
    try:
        gate = explaining_V_GS(circuit, V_C1, half / Z95, run.displaced.values())
        alone = explaining_V_GS(circuit, V_C1, half / Z95)
        moved = run.left_open(circuit, lambda c: explaining_V_GS(c, V_C1, 0.0).value)
    except NotIdentifiableError as reason:
        said = f"{str(reason)[0].upper()}{str(reason)[1:]}."
        return Conclusion((said,), {"V_GS": None}, budgets=budgets)
    said = (
        f"V_C1 rests at {plus_minus(V_C1, half, 'V')}, the model at "
        f"{show(rest_V_C1(circuit), 'V')}: a V_GS of {show(gate.value, 'V')} "
        f"({show(gate.low, 'V')} to {show(gate.high, 'V')}, a bound rather than a 95 % "
        "interval: a converter's steps may err all one way) explains it; "
        f"threshold_search refines it ({1 / abs(circuit.k_F):.2g} mN per mV)."
    )
    values = {
        "value": gate.value,
        "low_95": gate.low,
        "high_95": gate.high,
        "is_bound": True,
    }
    budgets["V_GS"] = ErrorBudget("V", {"converter": alone.half, **moved})
    return Conclusion((said,), {"V_GS": values}, budgets=budgets)
