"""The circuit: its parameters (Table 1), SI units, and what follows from them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import cache, cached_property
from typing import Annotated, Any, Literal, get_args, get_type_hints

import numpy as np

from tactile_lab.errors import ParameterError
from tactile_lab.model import derived
from tactile_lab.quantity import Unit
from tactile_lab.table import INTERNAL, SceneTable

SMALLEST, LARGEST = 1e-60, 1e60
"""Range of positive parameters: no product of three can overflow or underflow."""
LARGEST_VOLTAGE = 1e4
SUBTHRESHOLD_LIMIT = 2.75
"""V_GS + V_P up to which the exponential law, Eq. (1), describes the PiezoFET, V."""
SATURATION_HEADROOM = 0.5
"""Real T1 saturates where V_C1 falls below V_fire less this, V (ngspice)."""


@dataclass(frozen=True)
class CircuitParameter(Unit):
    """Unit and limits of a circuit's parameter, which `Circuit` itself refuses by."""

    def allows(self, number: float) -> bool:
        """Any number, as far as a file is concerned."""
        return True


Number = Annotated[float, CircuitParameter("", above=0.0)]
Ampere = Annotated[float, CircuitParameter("A", above=0.0)]
Volt = Annotated[float, CircuitParameter("V")]
PositiveVolt = Annotated[float, CircuitParameter("V", above=0.0)]
Metre = Annotated[float, CircuitParameter("m", above=0.0)]
Second = Annotated[float, CircuitParameter("s", above=0.0)]
Ohm = Annotated[float, CircuitParameter("Ohm", above=0.0)]
Farad = Annotated[float, CircuitParameter("F", above=0.0)]

_PUT = {"V_fire": 3.56, "V_reset": 0.578, "t_eps": 8e-6}


@dataclass(frozen=True, kw_only=True)
class Circuit(SceneTable):
    """The sensor circuit of Fig. 3; the defaults are Table 1.

    Args:
        I_S: reverse current of the PiezoFET, A.
        V_GS: gate-source bias, V.
        m: slope factor.
        V_T: thermal voltage, V; 0.025 V is 290 K (kT/q).
        g31: piezoelectric voltage coefficient, V m/N; its sign is that of the force.
        h: thickness of the AlScN film, m.
        L: length of the cantilever, m.
        d: distance of the PiezoFET from the clamping, m, 0 to L.
        a: width of the cantilever, m.
        b: height of the cantilever, m.
        tau: leakage time constant of the AlScN film, s.
        R1: resistor from V_S to node A, Ohm.
        R2: resistor from node A to ground, Ohm.
        R3: resistor in T1's emitter, Ohm; not used by ``t1="direct"``.
        R_L: leak of the integrator, Ohm.
        R_k: cathode resistor over which spikes are measured, Ohm, from 0.
        C1: capacitor at node A, F.
        C2: capacitor of the integrator, F.
        V_S: supply, V.
        V_th: threshold of the firing stage, V.
        I_T1s: saturation current of T1, A; not in the paper, 2N3906 by default.
        V_fire: V_C2 at which it fires, V; None: what `firing` sets.
        V_reset: V_C2 after a spike, V, below V_fire; None: what `firing` sets.
        t_eps: time of the reset, s, from 0; None: what `firing` sets.
        t1: "emitter_resistor" (R3 in the emitter) or "direct" (V_EB = V_S - V_C1).
        firing: "lif" (V_th, 0 V, 0 s) or "put" (3.56 V, 0.578 V, 8 us from ngspice).
        saturation: let T1 saturate, by Ebers and Moll's equations instead of Eq. (17):
            V_C2 above V_C1 turns its current from C2 into node A.
        beta_F: forward current gain of T1; with `saturation` only.
        beta_R: reverse current gain of T1; with `saturation` only.
        I_bias: current of a measuring follower's input into C2, A.

    Raises:
        ParameterError: a value is not finite, impossible, or contradicts another.
    """

    I_S: Ampere = 1.216e-12
    V_GS: Volt = 1.4
    m: Number = 5.646
    V_T: PositiveVolt = 0.025
    g31: Annotated[float, CircuitParameter("V m/N")] = 0.039
    h: Metre = 500e-9
    L: Metre = 7.7e-3
    d: Annotated[float, CircuitParameter("m")] = 1.8e-3
    a: Metre = 2e-3
    b: Metre = 475e-6
    tau: Second = 8.69
    R1: Ohm = 9.58e6
    R2: Ohm = 100e6
    R3: Ohm = 100e6
    R_L: Ohm = 500e6
    R_k: Annotated[float, CircuitParameter("Ohm")] = 10e3
    C1: Farad = 680e-12
    C2: Farad = 150e-12
    V_S: PositiveVolt = 5.0
    V_th: PositiveVolt = 3.213
    I_T1s: Ampere = 1.41e-15
    beta_F: Number = 180.7
    beta_R: Number = 4.977
    V_fire: Volt | None = None
    V_reset: Volt | None = None
    t_eps: Annotated[float, CircuitParameter("s")] | None = None
    t1: Literal["emitter_resistor", "direct"] = "emitter_resistor"
    firing: Literal["lif", "put"] = "lif"
    saturation: bool = False
    I_bias: Annotated[float, CircuitParameter("A")] = field(
        default=0.0, metadata=INTERNAL
    )

    def __post_init__(self) -> None:
        for name, unit in units().items():
            value = getattr(self, name)
            if value is None and name in _PUT:
                continue
            object.__setattr__(self, name, _checked(name, value, unit))
        self._check_options()
        if not 0 <= self.d < self.L:
            raise ParameterError(
                f"d = {self.d:g} m must lie between 0 and L = {self.L:g} m."
            )
        if abs(self.g31) > LARGEST or abs(self.I_bias) > LARGEST:
            raise ParameterError(
                f"g31 = {self.g31:g} V m/N and I_bias = {self.I_bias:g} A must not "
                f"exceed {LARGEST:g} in magnitude."
            )
        if not 0 <= self.R_k <= LARGEST:
            raise ParameterError(
                f"R_k = {self.R_k:g} Ohm must lie between 0 and {LARGEST:g} Ohm."
            )
        if not 0 <= self.reset_time <= LARGEST:
            raise ParameterError(f"t_eps = {self.reset_time:g} s must be at least 0 s.")
        if self.reset_voltage >= self.fire_voltage:
            raise ParameterError(
                f"V_reset = {self.reset_voltage:g} V must be below V_fire = "
                f"{self.fire_voltage:g} V."
            )
        for what, value, low, high in (
            ("k_F of Eqs. (3)-(6), V/N,", abs(self.k_F), 0.0, 1e30),
            ("R_L C2, s,", self.tau_L, 1e-30, 1e30),
            ("C1 times R1 parallel R2, s,", self.tau_A, 1e-30, 1e30),
        ):
            if not low <= value <= high:
                raise ParameterError(
                    f"{what} is {value:g}; it must lie between {low:g} and {high:g}."
                )

    def _check_options(self) -> None:
        for name, allowed in (
            ("t1", ("emitter_resistor", "direct")),
            ("firing", ("lif", "put")),
        ):
            if getattr(self, name) not in allowed:
                raise ParameterError(
                    f"{name} = {getattr(self, name)!r} does not exist; "
                    f"choose {' or '.join(repr(a) for a in allowed)}."
                )
        if not isinstance(self.saturation, bool):
            raise ParameterError(
                f"saturation = {self.saturation!r} must be true or false."
            )

    def at(self, voltages: Mapping[str, float]) -> Circuit:
        """The same with other V_GS, V_S or V_th, V, those that `voltages` names."""
        return replace(
            self,
            V_GS=voltages.get("V_GS", self.V_GS),
            V_S=voltages.get("V_S", self.V_S),
            V_th=voltages.get("V_th", self.V_th),
        )

    def __hash__(self) -> int:
        return self._hash

    @cached_property
    def _hash(self) -> int:
        """Of the numbers alone, the same in every process; asked for in each call."""
        values = (getattr(self, name) for name in PARAMETERS)
        return hash(tuple(value for value in values if isinstance(value, float)))

    @cached_property
    def k_F(self) -> float:
        """Piezoelectric voltage per force, Eqs. (3)-(6), V/N."""
        return derived.k_F(self)

    @property
    def tau_L(self) -> float:
        """Time constant of the leaky integrator, Eq. (18), s."""
        return self.R_L * self.C2

    @property
    def tau_A(self) -> float:
        """Time constant of node A without the PiezoFET, Eq. (16), s."""
        return derived.tau_A(self)

    @property
    def tau_K(self) -> float:
        """Decay time of a spike over R_k, s."""
        return self.R_k * self.C2

    @property
    def fire_voltage(self) -> float:
        """V_C2 at which the circuit fires, Eq. (10), V."""
        if self.V_fire is not None:
            return self.V_fire
        return _PUT["V_fire"] if self.firing == "put" else self.V_th

    @property
    def reset_voltage(self) -> float:
        """V_C2 after a spike, Eq. (11), V."""
        if self.V_reset is not None:
            return self.V_reset
        return _PUT["V_reset"] if self.firing == "put" else 0.0

    @property
    def swing(self) -> float:
        """What V_C2 falls by at a spike, and V_K jumps to, V."""
        return self.fire_voltage - self.reset_voltage

    @property
    def reset_time(self) -> float:
        """Time of the reset t_eps, Eq. (11), s."""
        if self.t_eps is not None:
            return self.t_eps
        return _PUT["t_eps"] if self.firing == "put" else 0.0

    @property
    def critical_V_C1(self) -> float:
        """V_C1 below which V_C2 can reach V_fire, from Eqs. (17) and (18), V.

        Infinite where I_bias alone reaches it.
        """
        return derived.critical_V_C1(self, self.t1 == "direct")


@cache
def units() -> dict[str, Unit]:
    """Unit and limits of every parameter that is a number."""
    return {
        name: unit
        for name, hint in get_type_hints(Circuit, include_extras=True).items()
        for unit in _within(hint)
    }


def _within(hint: Any) -> list[Unit]:
    """The unit in an annotated type, or in an optional one."""
    kept = [one for one in getattr(hint, "__metadata__", ()) if isinstance(one, Unit)]
    return kept or [one for part in get_args(hint) for one in _within(part)]


def _checked(name: str, value: object, of: Unit) -> float:
    unit = of.symbol
    if isinstance(value, bool) or not isinstance(value, int | float | np.floating):
        raise ParameterError(
            f"{name} = {value!r} must be a number in {unit or 'ones'}."
        )
    number, spaced = float(value), f" {unit}" if unit else ""
    if not math.isfinite(number):
        raise ParameterError(f"{name} = {number}{spaced} must be finite.")
    if of.above is not None and not SMALLEST <= number <= LARGEST:
        raise ParameterError(
            f"{name} = {number:g}{spaced} must lie between {SMALLEST:g} and "
            f"{LARGEST:g}{spaced}."
        )
    if unit == "V" and abs(number) > LARGEST_VOLTAGE:
        raise ParameterError(
            f"{name} = {number:g} V must lie between -{LARGEST_VOLTAGE:g} and "
            f"{LARGEST_VOLTAGE:g} V."
        )
    return number


PARAMETERS = tuple(field.name for field in fields(Circuit))
"""Names of all parameters and options, in the order of Table 1."""
