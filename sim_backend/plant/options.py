"""What of the physical world the simulated bench contains; every part can be off."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from sim_backend.plant.electromagnet import Electromagnet
from sim_backend.plant.noise import SensorNoise
from sim_backend.plant.winding import Winding
from tactile_lab.errors import ParameterError
from tactile_lab.follower import Follower
from tactile_lab.scene.tables import NOISE

SCOPE_NOISE = {**NOISE, "field": 1e-3, "temperature": 0.5e-3}
"""Standard deviation at the scope's input, V."""

_POSITIVE = ("follower_pole", "slew", "mains", "force", "warming_time")
_NOT_NEGATIVE = ("hum", "coil_lag", "eddy_lag", "hysteresis", "attraction", "pickup")


@dataclass(frozen=True, kw_only=True)
class PlantOptions:
    """Parts of the plant beyond circuit and magnet; a 0 switches a part off.

    Attributes:
        follower: whether the voltage followers have a finite speed.
        follower_pole: their bandwidth, Hz.
        slew: their slew rate, V/s.
        offset: their offset voltage, V.
        bias: input bias current of the follower at V_C2, into the node, A.
        noise: standard deviation by signal at the scope's input, V; `SCOPE_NOISE`
            for signals that are not named.
        sensor_noise: of the circuit and its sources.
        hum: amplitude of the mains hum at every input, V.
        mains: its frequency, Hz.
        coil_lag: L/R of the coil, s.
        eddy_lag: lag of the field behind the current, s.
        force: force over what the magnet gives at that field.
        hysteresis: half-width of the core's loop, A; 0.03 to 0.07 for mild steel.
        attraction: pull of the permanent magnet on the core, N; the same at every
            current, so it is no drive; 23 mN at 5 mm, 3.9 mN at 8 mm, by the
            image of a dipole in the core.
        winding: resistance of the coil and where its heat goes.
        drift: relative error of the scope's sample clock, so 50e-6 is 50 ppm; above 0
            each interval lasts longer than the scope says, and whoever asks for
            samples must count them by that longer interval, or he is early.
        warming: by which the sensor becomes warmer, K.
        warming_time: time constant with which it does, s.
        wired: fault: signal that really lies at an input, by input name.
        open_inputs: fault: inputs whose probe is not connected.
        pickup: amplitude of the hum at an open input, V.
        attenuation: fault: factor by which an input's probe divides beyond what the
            scene says.
        inverted_coil: fault: leads of the coil exchanged.
    """

    follower: bool = True
    follower_pole: float = 3e6
    slew: float = 13e6
    offset: float = 0.0
    bias: float = 65e-12
    noise: Mapping[str, float] = field(default_factory=dict)
    sensor_noise: SensorNoise = field(default_factory=SensorNoise)
    hum: float = 0.0
    mains: float = 50.0
    coil_lag: float = 1.1e-3
    eddy_lag: float = 3e-3
    force: float = 1.0
    hysteresis: float = 0.0
    attraction: float = 0.0
    winding: Winding = field(default_factory=Winding)
    drift: float = 0.0
    warming: float = 0.0
    warming_time: float = 600.0
    wired: Mapping[str, str] = field(default_factory=dict)
    open_inputs: tuple[str, ...] = ()
    pickup: float = 20e-3
    attenuation: Mapping[str, float] = field(default_factory=dict)
    inverted_coil: bool = False

    def __post_init__(self) -> None:
        for name in (*_POSITIVE, *_NOT_NEGATIVE, "offset", "bias", "drift"):
            value = getattr(self, name)
            if not math.isfinite(value) or (name in _NOT_NEGATIVE and value < 0):
                raise ParameterError(
                    f"{name} = {value} must be finite and not negative."
                )
            if name in _POSITIVE and value <= 0:
                raise ParameterError(f"{name} = {value} must be above 0.")
        for signal, volts in self.noise.items():
            if not (math.isfinite(volts) and volts >= 0):
                raise ParameterError(
                    f"noise of {signal} = {volts} V must be finite and not negative."
                )
        for name, factor in self.attenuation.items():
            if not math.isfinite(factor) or factor == 0:
                raise ParameterError(
                    f"attenuation of input {name} = {factor} must be finite and not 0."
                )
        if abs(self.drift) >= 0.01:
            raise ParameterError(
                f"drift = {self.drift} is no clock's error; give below 0.01 (1 %)."
            )

    def electromagnet(self) -> Electromagnet:
        """The coil and its core, cold and never magnetised."""
        return Electromagnet(
            coil_lag=self.coil_lag,
            eddy_lag=self.eddy_lag,
            hysteresis=self.hysteresis,
            winding=self.winding,
        )

    @property
    def speed(self) -> Follower:
        """Pole and slew of the voltage followers."""
        return Follower.of(self.follower_pole if self.follower else 0.0, self.slew)

    def warmer(self, time: float) -> float:
        """By how much the sensor is warmer at `time` s than at 0 s, K."""
        return -self.warming * math.expm1(-max(time, 0.0) / self.warming_time)

    def noise_at(self, signal: str) -> float:
        """Standard deviation of an input that carries `signal`, V."""
        return self.noise.get(signal, SCOPE_NOISE.get(signal, 0.0))
