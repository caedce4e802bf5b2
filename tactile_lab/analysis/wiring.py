"""Is each channel what the bench file says it is? Verdicts from a rest and a push."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from tactile_lab.analysis.estimate import Z95, Estimate
from tactile_lab.errors import NotIdentifiableError
from tactile_lab.magnetics import ROUGH
from tactile_lab.model.circuit import Circuit
from tactile_lab.quantity import plus_minus, show

NODES = ("V_C1", "V_C2", "V_K")
"""Voltages of the circuit, each on a probe of its own."""
TOLERANCE = 0.15
"""A voltage may differ from the model by this part of itself, and by 0.25 V."""
SLACK = 0.25
CLEARLY = 1.2
"""An offset or gain beyond so many of its own uncertainty is corrected."""
FACTORS = (10.0, 0.1, 100.0, 0.01)
DEAD = 0.02
"""A channel whose voltage is below this part of what it should be is not connected."""
GAIN_ERROR = 0.1
"""A gain further from 1 than this is no calibration but a mistake."""
SHUNT = 0.05
"""Part of the current by which the shunt may differ from the source's read-back."""
SHUNT_NOTABLE = 0.02
"""The least difference of them that is remarked on, A."""
LEAK = 0.3
"""A shunt that shows more where none flows, A, carries another signal."""


def shunt_agrees(seen: float, amperes: float) -> bool:
    """Whether what a shunt shows, A, is the current that the source reads back, A."""
    return abs(seen - amperes) <= SHUNT * abs(amperes) + SHUNT_NOTABLE


@dataclass(frozen=True)
class ChannelVerdict:
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
class SignalLevels:
    """Mean of each signal at rest and during the push, by name, SI.

    Attributes:
        known: of a voltage, halves of the 95 % bands of its mean and of a change of it.
    """

    rest: Mapping[str, float]
    push: Mapping[str, float]
    known: Mapping[str, tuple[float, float]] = field(default_factory=dict)


@dataclass(frozen=True)
class ChannelCalibration:
    """Offset and gain of one channel, from its probe on 0 V and on the supply.

    Attributes:
        offset: shown at 0 V, V.
        gain: volts shown per volt.
        known: half of the band of one mean, V: what the converter's steps and the
            noise leave.
        supply: at which the gain was taken, V.
    """

    offset: float
    gain: float
    known: float
    supply: float

    @property
    def gain_known(self) -> float:
        """How far the gain may be off: both its ends at the end of their bands."""
        return 2 * self.known / self.supply

    @property
    def corrects(self) -> bool:
        """Whether offset or gain is beyond what their own uncertainty could make."""
        offset, gain = abs(self.offset), abs(self.gain - 1)
        return offset > CLEARLY * self.known or gain > CLEARLY * self.gain_known

    def corrected(self, shown: float) -> float:
        """The voltage where the channel shows `shown` V."""
        return (shown - self.offset) / self.gain if self.corrects else shown

    @property
    def error(self) -> float:
        """Standard uncertainty of a voltage so corrected, V.

        An offset that is not corrected is still there, and what is not known of it.
        """
        left = 0.0 if self.corrects else abs(self.offset)
        return math.hypot(self.known, self.known + left) / Z95

    @property
    def text(self) -> str:
        """For a person: offset and gain with their uncertainty, and what is done."""
        said = (
            f"offset {plus_minus(self.offset, self.known, 'V')}, gain "
            f"{plus_minus(self.gain, self.gain_known)} by 0 V and V_S (bounds: a "
            "converter's steps and the noise)"
        )
        if self.corrects:
            return f"{said}, corrected"
        return f"{said}: within their own uncertainty, nothing is corrected"


def calibrate_channel(
    at_ground: float, at_supply: float, supply: float, known: float
) -> ChannelCalibration:
    """Offset and gain of a channel.

    Args:
        at_ground: mean shown with the probe on 0 V, V.
        at_supply: mean shown with the probe on the supply, V.
        supply: the supply, V.
        known: half of the 95 % band of a mean, V.

    Raises:
        NotIdentifiableError: offset or gain is absurd; the text says what it may be.
    """
    gain = (at_supply - at_ground) / supply
    shows = f"shows {show(at_ground, 'V', 3)} on 0 V and {show(at_supply, 'V', 3)} on "
    shows += f"{show(supply, 'V', 3)}"
    if abs(gain) < DEAD:
        raise NotIdentifiableError(f"{shows}: open probe")
    if gain < 0:
        raise NotIdentifiableError(f"{shows}: the probe is reversed")
    for factor in FACTORS:
        if abs(gain / factor - 1) < TOLERANCE:
            raise NotIdentifiableError(f"{shows}: {_attenuated(factor)}")
    if gain > 1 + GAIN_ERROR:
        # past the end of the range: how much too large cannot be told
        raise NotIdentifiableError(f"{shows} or more: {_attenuated(10)}")
    if abs(gain - 1) > GAIN_ERROR:
        raise NotIdentifiableError(f"{shows}: a gain of {gain:.3g}; check the probe")
    if abs(at_ground) > SLACK:
        raise NotIdentifiableError(
            f"{shows}: an offset of {show(at_ground, 'V', 3)}; check the probe's ground"
        )
    return ChannelCalibration(at_ground, gain, known, supply)


def judge(
    found: SignalLevels, expected: SignalLevels, faults: Mapping[str, str] | None = None
) -> tuple[ChannelVerdict, ...]:
    """One verdict per measured signal.

    Args:
        found: as measured, corrected where calibrated.
        expected: by the model, and for the coil by what was set.
        faults: what is wrong by the calibration at 0 V and V_S, by signal.
    """
    faults = faults or {}
    verdicts = []
    for signal in found.rest:
        if signal in faults:
            verdicts.append(ChannelVerdict(signal, False, faults[signal]))
        elif signal in NODES and signal in expected.rest:
            verdicts.append(_voltage(signal, found, expected))
        elif signal in ("coil_current", "field") and expected.push.get(signal):
            verdicts.append(_drive(signal, found, expected))
    return tuple(verdicts)


def _voltage(
    signal: str, found: SignalLevels, expected: SignalLevels
) -> ChannelVerdict:
    rest, should = found.rest[signal], expected.rest[signal]
    change = found.push[signal] - rest
    wanted = expected.push[signal] - should
    says = f"{show(rest, 'V', 3)} at rest, {_signed(change)} by the push"
    if signal in found.known:
        of_mean, of_change = found.known[signal]
        says = (
            f"{plus_minus(rest, of_mean, 'V')} at rest, "
            f"{_signed(change, half=of_change)} by the push"
        )

    def wrong(text: str) -> ChannelVerdict:
        return ChannelVerdict(signal, False, f"{says}{text}")

    alike = change * wanted > 0 and _similar(change, wanted)
    if _near(rest, should) and (alike or max(abs(change), abs(wanted)) < SLACK / 5):
        return ChannelVerdict(signal, True, says)
    for other in NODES:
        if other != signal and _swapped(signal, other, found, expected):
            return wrong(f": swapped with {other}")
    if abs(rest) < DEAD * abs(should):
        if abs(found.rest.get("coil_current", 0.0)) > LEAK:
            return wrong(": swapped with coil_current")
        return wrong(": open probe, or no supply")
    for factor in FACTORS:
        if abs(should) > SLACK and _near(rest / factor, should):
            return wrong(f": {_attenuated(factor)}")
    if _near(rest, should) and change * wanted < 0 and _similar(-change, wanted):
        return wrong(": the force acts the other way, so the coil is inverted or the "
                     "magnet reversed")  # fmt: skip
    if _near(rest, should):
        return wrong(f", {_signed(wanted)} expected: the force is not what Eq. (2) "
                     "says, or the magnet is away")  # fmt: skip
    return wrong(f", {show(should, 'V', 3)} expected: check V_GS and V_S")


def _swapped(one: str, other: str, found: SignalLevels, expected: SignalLevels) -> bool:
    """Whether each of the two shows what the other should."""
    if other not in found.rest or other not in expected.rest:
        return False
    if _near(expected.rest[one], expected.rest[other]):
        return False
    return _near(found.rest[one], expected.rest[other]) and _near(
        found.rest[other], expected.rest[one]
    )


def _attenuated(factor: float) -> str:
    much = (
        f"{factor:g} times too much"
        if factor > 1
        else f"{1 / factor:g} times too little"
    )
    return f"{much}: check the probe's attenuation against `scale`"


def _drive(signal: str, found: SignalLevels, expected: SignalLevels) -> ChannelVerdict:
    unit = "A" if signal == "coil_current" else "T"
    change = found.push[signal] - found.rest[signal]
    wanted = expected.push[signal] - expected.rest[signal]
    if signal == "coil_current" and abs(found.rest[signal]) > LEAK:
        return ChannelVerdict(
            signal, False, f"{show(found.rest[signal], unit, 3)} although none flows: "
            "another signal's probe lies on its input",
        )  # fmt: skip
    says = f"{_signed(change, unit)} by the push, {_signed(wanted, unit)} expected"
    ratio = change / wanted if wanted else math.nan
    if signal == "coil_current" and shunt_agrees(change, wanted):
        return ChannelVerdict(signal, True, says)
    if 0.5 < ratio < 2:
        says += f", {100 * ratio:.0f} % of it"
        if signal == "coil_current":
            return ChannelVerdict(
                signal, False, f"{says}: check the shunt and its resistance in the "
                "bench file",
            )  # fmt: skip
        if 1 / ROUGH <= ratio <= ROUGH:
            return ChannelVerdict(signal, True, says)
        return ChannelVerdict(
            signal, True, f"{says}: its sign is right, its size is not what the bench "
            "file's [magnet] has; calibrate_field measures it",
        )  # fmt: skip
    if abs(ratio) < DEAD * 5:
        return ChannelVerdict(
            signal, False, f"{says}: not connected, or no current flows"
        )
    if -2 < ratio < -0.5:
        return ChannelVerdict(signal, False, f"{says}: reversed")
    for factor in FACTORS:
        if 0.5 < ratio / factor < 2:
            return ChannelVerdict(signal, False, f"{says}: {_attenuated(factor)}")
    return ChannelVerdict(signal, False, f"{says}: check wiring and scale")


def _near(value: float, should: float) -> bool:
    return abs(value - should) <= SLACK + TOLERANCE * abs(should)


def _similar(value: float, should: float) -> bool:
    return 0.3 * abs(should) <= abs(value) <= 3 * abs(should)


def _signed(value: float, unit: str = "V", half: float | None = None) -> str:
    text = show(value, unit, 3) if half is None else plus_minus(value, half, unit)
    return text if text.startswith("−") else f"+{text}"


def hum(time: ArrayLike, values: ArrayLike, frequency: float = 50.0) -> float:
    """Amplitude of a sine of that frequency in a trace, in the trace's unit.

    The trace's ends weigh nothing (Hann's window), or hum of another frequency would be
    seen by where it happens to begin and end.

    Args:
        time: s; at least two and a half points a cycle.
        values: any unit.
        frequency: mains, Hz.

    Raises:
        NotIdentifiableError: too coarse or too short for that frequency.
    """
    t, y = np.asarray(time, float), np.asarray(values, float)
    if t.size < 8 or np.median(np.diff(t)) > 0.4 / frequency:
        raise NotIdentifiableError(
            f"the trace is too coarse to show {frequency:g} Hz; sample faster"
        )
    phase = 2 * np.pi * frequency * t
    design = np.column_stack([np.sin(phase), np.cos(phase), np.ones_like(t), t - t[0]])
    soft = np.hanning(t.size + 2)[1:-1]
    fitted = np.linalg.lstsq(design * soft[:, np.newaxis], y * soft, rcond=None)[0]
    sine, cosine = fitted[:2]
    step = float(np.median(np.diff(t)))
    return float(np.hypot(sine, cosine) / np.sinc(frequency * step))


def explaining_V_GS(
    circuit: Circuit, V_C1: float, error: float, displaced: Collection[Circuit] = ()
) -> Estimate:
    """V_GS that explains a rest V_C1, Eqs. (8) and (16), with its uncertainty.

    Args:
        circuit: all else.
        V_C1: at rest, V.
        error: standard uncertainty of V_C1 with the channel's calibration, V.
        displaced: the circuit with each thing that is not known of it at the end of its
            95 % band.

    Raises:
        NotIdentifiableError: no V_GS gives that V_C1.
    """

    def at(volts: float, circuit: Circuit = circuit) -> float:
        current = (circuit.V_S - volts) / circuit.R1 - volts / circuit.R2
        if current <= 0 or volts <= 0:
            raise NotIdentifiableError(
                f"no V_GS explains V_C1 = {volts:.3g} V at rest: check R1, R2 and V_S"
            )
        on = -math.expm1(-volts / circuit.V_T)
        return circuit.m * circuit.V_T * math.log(current / (circuit.I_S * on))

    middle = at(V_C1)
    sensitivity = abs(at(V_C1 - 1e-4) - middle) / 1e-4
    moved = (abs(at(V_C1, other) - middle) for other in displaced)
    return Estimate.of(middle, sensitivity * error, 10_000).widened(*moved)
