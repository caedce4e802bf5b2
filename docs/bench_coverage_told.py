"""What the runs of docs/bench-coverage.md tell with an interval, and what is true."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from protocols.rate_force import RateForce
from protocols.sine_sweep import SineSweep
from tactile_lab.analysis.charging import Charging
from tactile_lab.analysis.estimate import Estimate
from tactile_lab.analysis.rate_force import RateLaw
from tactile_lab.model.circuit import Circuit
from tactile_lab.model.equations import rest
from tactile_lab.model.simulate import simulate
from tactile_lab.report.identified import identify_run
from tactile_lab.report.run_data import RunData
from tactile_lab.waveform import Waveform

Told = Iterator[tuple[str, float, float, float, float]]
"""(name, value, low, high, truth)"""


@dataclass(frozen=True)
class Truth:
    """What is true of a repeat's bench.

    Attributes:
        circuit: with its true parameters.
        force: on the run's time axis, N.
        scale: of the force over that believed.
        field: of the electromagnet per current, T/A, and to either side of it the
            width of the core's loop, A.
    """

    circuit: Circuit
    force: Waveform
    scale: float
    field: tuple[float, float]


def of(name: str, found: dict[str, Any] | None, truth: float) -> Told:
    """One estimate as results.json has it."""
    if found is not None:
        yield name, found["value"], found["low_95"], found["high_95"], truth


def around(name: str, value: float | None, half: float | None, truth: float) -> Told:
    """One number with the half-width of its band."""
    if value is not None and half is not None:
        yield name, value, value - half, value + half, truth


def hold(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """Tau and V_GS by the circuit's own law."""
    yield from of("tau", values.get("tau_s"), true.circuit.tau)
    yield from of("V_GS", values.get("V_GS_V"), true.circuit.V_GS)


def bipolar(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """Tau, changes of I_DS and the same per force."""
    yield from of("tau", values.get("tau_s"), true.circuit.tau)
    made = simulate(true.circuit, true.force, keep=("V_P",), until=run.duration)
    for change in values.get("I_DS_changes", ()):
        trial = next(t for t in run.results if t.label == change["label"])
        assert trial.held is not None
        arrived, _ = trial.held
        later = 0.1  # the force is wholly there; V_P is followed back to `arrived`
        V_P = made.sample("V_P", np.array([trial.start - 0.1, arrived + later]))
        V_P[1] *= np.exp(later / true.circuit.tau)
        before, after = (at_rest(true.circuit, float(v)) for v in V_P)
        sign = "push" if change["level_N"] > 0 else "pull"
        yield from around(
            f"I_DS change, {sign}", change["change_A"],
            change["change_uncertainty_A_95"], after - before,
        )  # fmt: skip
        yield from around(
            f"I_DS per force, {sign}", change["sensitivity_A_per_N"],
            change["sensitivity_uncertainty_A_per_N_95"],
            (after - before) / (change["level_N"] * true.scale),
        )  # fmt: skip


def at_rest(circuit: Circuit, V_P: float) -> float:
    """I_DS where node A has followed V_P, A."""
    from tactile_lab.model.equations import I_DS, rest_V_C1

    return float(I_DS(circuit, V_P, rest_V_C1(circuit, V_P)))


def sine_sweep(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """Gain and phase of each frequency, the truth by a long sine."""
    from tactile_lab.analysis.response import gain

    assert isinstance(run.protocol, SineSweep)
    amplitude = run.protocol.amplitude * true.scale
    for found in values.get("V_C1_over_force", ()):
        f = found["frequency_Hz"]
        cycles = max(8, int(100 * f) + 1)
        phase = np.arange(cycles * 200 + 1) / 200
        force = Waveform(phase / f, amplitude * np.sin(2 * np.pi * phase))
        made = simulate(true.circuit, force, keep=("V_C1",))
        # of one cycle a drift could not be told from the sine
        last = np.linspace((cycles - 2) / f, cycles / f, 4001)
        settled = gain(last, force.at(last), made.sample("V_C1", last), f)
        name = f"{f:.3g} Hz"
        yield from of(f"gain, {name}", found["gain_V_per_N"], settled.gain.value)
        phases = found["phase_rad"]
        turn = 2 * np.pi * round((phases["value"] - settled.phase.value) / (2 * np.pi))
        yield from of(f"phase, {name}", phases, settled.phase.value + turn)


def threshold(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """The critical force and the V_GS that explains it."""
    yield from around(
        "critical force",
        values.get("critical_force_N"), values.get("critical_force_uncertainty_N_95"),
        critical(run, true),
    )  # fmt: skip
    if "V_GS_low_V" in values:
        low, high = values["V_GS_low_V"], values["V_GS_high_V"]
        yield "V_GS", (low + high) / 2, low, high, true.circuit.V_GS


def rate_force(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """Slopes of the rate; the truth of the true sensor at the force that is named."""
    exact = Estimate(true.circuit.V_GS, 0.0, true.circuit.V_GS, true.circuit.V_GS)
    one = Estimate(1.0, 0.0, 1.0, 1.0)
    law = RateLaw(
        V_GS=exact, scale=one, intervals=0, correlation=0.0,
        charging=Charging(true.circuit),
    )  # fmt: skip
    assert isinstance(run.protocol, RateForce)
    yield from of("V_GS", values.get("rate_law_V_GS_V"), true.circuit.V_GS)
    yield from of("force over stated", values.get("rate_law_scale"), true.scale)
    for which, found in zip(
        ("least", "largest"), values.get("slopes") or (), strict=False
    ):
        truth = law.slope(found["force_N"], run.protocol.ramp).value
        yield from of(f"slope at the {which} force", found["slope_Hz_per_N"], truth)


def wiring(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """Offset and gain of each voltage channel, and V_GS."""
    for name in ("V_C1", "V_C2"):
        found = values.get("channels", {}).get(name, {})
        offset = found.get("offset_V"), found.get("offset_uncertainty_V_95")
        # on 0 V and V_S the probe bypasses the follower
        yield from around("offset of a channel", *offset, 0.0)
        gain = found.get("gain"), found.get("gain_uncertainty_95")
        yield from around("gain of a channel", *gain, 1.0)
    yield from of("V_GS", values.get("V_GS"), true.circuit.V_GS)


def calibration(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """The slope of B2(I), and a field by the mean curve on either branch."""
    if "slope_T_per_A" not in values:
        return
    per, loop = true.field
    low, high = values["slope_low_95"], values["slope_high_95"]
    yield "slope of B2(I)", values["slope_T_per_A"], low, high, per
    for branch in (-1, 1):
        known = float(np.interp(0.5, values["current_A"], values["field_T"]))
        yield from around(
            "field at 0.5 A",
            known,
            values["uncertainty_T"],
            per * (0.5 + branch * loop),
        )


def force_check(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """Forces by the field that was read."""
    forces = values.get("F_minus_F0_by_field_N", ())
    bands = values.get("F_minus_F0_uncertainty_N_95", ())
    for trial, force, band in zip(run.results, forces, bands, strict=False):
        if trial.held is not None and trial.level:
            truth = float(true.force.at(sum(trial.held) / 2))
            yield from around("F(I) - F(0) by the field", force, band, truth)


def critical(run: RunData, true: Truth) -> float:
    """Least true force that fires, with ramp and hold as the coil gave them, N."""
    trial = next(t for t in run.results if t.level)
    start, end = trial.start, trial.start + trial.duration
    full = true.force.at((start + end) / 2)
    time, value = true.force.time, true.force.value / full
    inside = (time > start) & (time < end)
    shape = Waveform(
        np.concatenate([[0.0], time[inside] - start]),
        np.concatenate([[0.0], value[inside]]),
    )
    low, high = 0.05, 0.2
    while high - low > 1e-6:
        middle = (low + high) / 2
        spikes = simulate(
            true.circuit, shape.scaled(middle), keep=("spikes",), tolerance=1e-7
        ).spike_times
        assert spikes is not None
        low, high = (low, middle) if spikes.size else (middle, high)
    return high


def identification(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """V_GS, tau and the input bias from V_C1 and spikes."""
    names = ("V_GS", "tau", "I_bias")
    for name, found in identify_run(run, names).estimates.items():
        yield from of(name, found.to_dict(), getattr(true.circuit, name))


def ideal(run: RunData, true: Truth) -> RunData:
    """The run with the true force, and the true sensor's spikes under it."""
    made = simulate(true.circuit, true.force, keep=("spikes",), until=run.duration)
    assert made.spike_times is not None
    trials = []
    for trial in run.trials:
        since = made.spike_times - trial.start
        spikes = since[(since >= 0) & (since < trial.duration)]
        trials.append(replace(trial, spike_times=spikes))
    return replace(run, trials=tuple(trials), force=true.force)


def latencies(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """The first spike of each step, as the table of any run has it."""
    for trial, truly in zip(run.results, ideal(run, true).results, strict=True):
        if (truth := truly.response.latency) is not None:
            found = trial.response.latency, trial.clock_uncertainty
            yield from around("latency", *found, truth)


def touches(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """Latency after half the force, at each onset."""
    truly = concluded(ideal(run, true))["touches"]
    for found, truth in zip(values["touches"], truly, strict=True):
        name = f"latency, {1e3 * found['onset_s']:.0f} ms"
        if truth["latency_s"] is not None:
            told = found["latency_s"], found["latency_uncertainty_s_95"]
            yield from around(name, *told, truth["latency_s"])


def concluded(run: RunData) -> dict[str, Any]:
    """What its protocol concludes of a run, as results.json has it."""
    return run.protocol.conclude(run).plain


def trimmed(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """The critical force at the V_GS found; its stated one is that wanted."""
    if values.get("V_GS_V") is None:
        return
    off = true.circuit.V_GS - run.circuit.V_GS if run.circuit else 0.0
    at = replace(true, circuit=replace(true.circuit, V_GS=values["V_GS_V"] + off))
    yield from around(
        "critical force", values["critical_force_N"],
        values.get("critical_force_uncertainty_N_95"), critical(run, at),
    )  # fmt: skip


def drifting(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """The critical force as it is followed, and its drift where nothing drifts."""
    force = critical(run, true)
    for found in values["critical_forces"]:
        yield from around(
            "critical force", found["force_N"], found["uncertainty_N_95"], force
        )
    yield from of("drift", values.get("drift_N_per_h"), 0.0)


def watched(run: RunData, values: dict[str, Any], true: Truth) -> Told:
    """How far V_C1 is from where the sensor fires, at rest."""
    yield from around(
        "V_C1 to its critical", values.get("distance_to_threshold_V"),
        values.get("distance_to_threshold_uncertainty_V_95"),
        rest(true.circuit).V_C1 - true.circuit.critical_V_C1,
    )  # fmt: skip
