"""Is each channel what the bench file says it is? Verdicts from a rest and a push."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.estimate import Estimate
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import show

TOLERANCE = 0.15
"""A voltage may differ from the model by this part of itself, and by 0.25 V."""
SLACK = 0.25
FACTORS = (10.0, 0.1, 100.0, 0.01)
DEAD = 0.02
"""A channel whose voltage is below this part of what it should be is not connected."""


@dataclass(frozen=True)
class Verdict:
    """On one channel.

    Attributes:
        signal: which.
        ok: whether it is what the bench file says.
        text: what was found and, where not ok, what it probably is.
    """

    signal: str
    ok: bool
    text: str


@dataclass(frozen=True)
class Levels:
    """Mean of each signal at rest and during the push, by name, SI."""

    rest: Mapping[str, float]
    push: Mapping[str, float]


def judge(found: Levels, expected: Levels) -> tuple[Verdict, ...]:
    """One verdict per measured signal.

    Args:
        found: as measured.
        expected: by the model, and for the coil by what was set.
    """
    verdicts = []
    for signal in found.rest:
        if signal in ("V_C1", "V_C2"):
            verdicts.append(_voltage(signal, found, expected))
        elif signal in ("coil_current", "field") and expected.push.get(signal):
            verdicts.append(_drive(signal, found, expected))
    return tuple(verdicts)


def _voltage(signal: str, found: Levels, expected: Levels) -> Verdict:
    rest, should = found.rest[signal], expected.rest[signal]
    change = found.push[signal] - rest
    wanted = expected.push[signal] - should
    says = f"{show(rest, 'V', 3)} at rest, {_signed(change)} by the push"
    other = "V_C2" if signal == "V_C1" else "V_C1"
    if _near(rest, should) and change * wanted > 0 and _similar(change, wanted):
        return Verdict(signal, True, says)
    if _near(rest, expected.rest[other]) and _near(found.rest.get(other, rest), should):
        return Verdict(signal, False, f"{says}: swapped with {other}")
    if abs(rest) < DEAD * abs(should):
        return Verdict(signal, False, f"{says}: open probe, or no supply")
    for factor in FACTORS:
        if _near(rest / factor, should):
            return Verdict(
                signal, False, f"{says}: {factor:g} times too much, check the probe's "
                "attenuation against `scale`",
            )  # fmt: skip
    if _near(rest, should) and change * wanted < 0 and _similar(-change, wanted):
        return Verdict(
            signal, False, f"{says}: the force acts the other way, so the coil or the "
            "magnet is reversed",
        )  # fmt: skip
    if _near(rest, should):
        return Verdict(
            signal, False, f"{says}, {_signed(wanted)} expected: the force is not "
            "what Eq. (2) says, or the magnet is away",
        )  # fmt: skip
    return Verdict(
        signal, False, f"{says}, {show(should, 'V', 3)} expected: check V_GS and V_S"
    )


def _drive(signal: str, found: Levels, expected: Levels) -> Verdict:
    unit = "A" if signal == "coil_current" else "T"
    change = found.push[signal] - found.rest[signal]
    wanted = expected.push[signal] - expected.rest[signal]
    says = f"{_signed(change, unit)} by the push, {_signed(wanted, unit)} expected"
    ratio = change / wanted if wanted else math.nan
    # a shunt read by 8 bits and an uncalibrated field are rough
    if 0.5 < ratio < 2:
        return Verdict(signal, True, says)
    if abs(ratio) < DEAD * 5:
        return Verdict(signal, False, f"{says}: not connected, or no current flows")
    if -2 < ratio < -0.5:
        return Verdict(signal, False, f"{says}: reversed")
    for factor in FACTORS:
        if 0.5 < ratio / factor < 2:
            return Verdict(signal, False, f"{says}: {factor:g} times, check the scale")
    return Verdict(signal, False, f"{says}: check wiring and scale")


def _near(value: float, should: float) -> bool:
    return abs(value - should) <= SLACK + TOLERANCE * abs(should)


def _similar(value: float, should: float) -> bool:
    return 0.3 * abs(should) <= abs(value) <= 3 * abs(should)


def _signed(value: float, unit: str = "V") -> str:
    return ("+" if value >= 0 else "") + show(value, unit, 3)


def hum(time: ArrayLike, values: ArrayLike, frequency: float = 50.0) -> float:
    """Amplitude of a sine of that frequency in a trace, in the trace's unit.

    Args:
        time: s; at least four points a cycle.
        values: any unit.
        frequency: mains, Hz.

    Raises:
        NotIdentifiableError: too coarse or too short for that frequency.
    """
    t, y = np.asarray(time, float), np.asarray(values, float)
    if t.size < 8 or np.median(np.diff(t)) > 0.25 / frequency:
        raise NotIdentifiableError(
            f"the trace is too coarse to show {frequency:g} Hz; sample faster"
        )
    phase = 2 * np.pi * frequency * t
    design = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(t), t - t[0]])
    sine, cosine = np.linalg.lstsq(design, y, rcond=None)[0][:2]
    step = float(np.median(np.diff(t)))
    return float(np.hypot(sine, cosine) / np.sinc(frequency * step))


def explaining_V_GS(circuit: Circuit, V_C1: float, error: float) -> Estimate:
    """V_GS that explains a rest V_C1, Eqs. (8) and (16), with its uncertainty.

    Args:
        circuit: all else.
        V_C1: at rest, V.
        error: standard uncertainty of V_C1 with the channel's calibration, V.

    Raises:
        NotIdentifiableError: no V_GS gives that V_C1.
    """

    def at(volts: float) -> float:
        current = (circuit.V_S - volts) / circuit.R1 - volts / circuit.R2
        if current <= 0 or volts <= 0:
            raise NotIdentifiableError(
                f"no V_GS explains V_C1 = {volts:.3g} V at rest: check R1, R2 and V_S"
            )
        on = -math.expm1(-volts / circuit.V_T)
        return circuit.m * circuit.V_T * math.log(current / (circuit.I_S * on))

    middle = at(V_C1)
    sensitivity = abs(at(V_C1 - 1e-4) - middle) / 1e-4
    return Estimate.of(middle, sensitivity * error, 10_000)
