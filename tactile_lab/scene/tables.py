"""The smaller tables of a scene: what to record, detect, simulate, and how strictly."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeVar

from pydantic import AfterValidator, Field, ValidationInfo

from tactile_lab.deviation import Deviation
from tactile_lab.errors import choices
from tactile_lab.quantity import (
    Duration,
    SampleRate,
    Unit,
    parse,
)
from tactile_lab.signals import SIGNALS
from tactile_lab.table import SceneTable

Noise = Annotated[float, Unit("V", least=0.0)]
HalfWidth = Annotated[float, Unit("A", least=0.0)]
Pull = Annotated[float, Unit("N", least=0.0)]
Refractory = Annotated[float, Unit("s", least=0.0, most=10.0)]
FieldNoise = Annotated[float, Unit("T", least=0.0)]

CELSIUS, ZERO_CELSIUS = "°C", 273.15
"""Unit, and its zero in K."""

AUTO: Literal["auto"] = "auto"
"""Instead of a quantity: to be found from what is measured."""


@dataclass(frozen=True)
class OrAuto(Unit):
    """A quantity, or the text "auto"."""

    def validate(self, value: Any, info: ValidationInfo) -> Any:
        """The SI value or "auto"."""
        return AUTO if value == AUTO else super().validate(value, info)

    def write(self, value: Any) -> str:
        """Text that is read back the same."""
        return AUTO if value == AUTO else super().write(value)


Level = Annotated[float | Literal["auto"], OrAuto("V", above=0.0)]
Hysteresis = Annotated[float | Literal["auto"], OrAuto("V", least=0.0)]


def _signals(names: tuple[str, ...]) -> tuple[str, ...]:
    for name in names:
        if name not in SIGNALS:
            known = choices(name, SIGNALS)
            raise ValueError(f'signal "{name}" does not exist; {known}')
    return tuple(dict.fromkeys(names))


@dataclass(frozen=True, kw_only=True)
class Record(SceneTable):
    """``[record]``: which signals are kept and how fast the scope samples.

    Attributes:
        signals: names from `tactile_lab.signals.SIGNALS`; the protocol's own choice
            unless given.
        sample_rate: of every enabled scope channel, S/s.
        compare: whether the model is computed beside the run and in its report.
    """

    signals: Annotated[tuple[str, ...], AfterValidator(_signals)] = ()
    sample_rate: SampleRate = 1e6
    compare: bool = True


@dataclass(frozen=True, kw_only=True)
class Detect(SceneTable):
    """``[detect]``: how spikes are found on the streamed V_K.

    Attributes:
        threshold: a spike starts where V_K reaches it, V; "auto" for 7 standard
            deviations of the noise at the start of the run.
        hysteresis: V_K must fall this far below the threshold before the next, V;
            "auto", with a threshold of "auto" only, for half its height.
        refractory: nothing is found for so long after a spike, s.
    """

    threshold: Level = 0.5
    hysteresis: Hysteresis = 0.1
    refractory: Refractory = 50e-6

    def __post_init__(self) -> None:
        if isinstance(self.threshold, str) or isinstance(self.hysteresis, str):
            if self.threshold != self.hysteresis:
                raise ValueError(
                    'threshold and hysteresis must both be "auto" or both be given'
                )
        elif self.hysteresis >= self.threshold:
            raise ValueError(
                f"hysteresis {self.hysteresis:g} V must be below the threshold "
                f"{self.threshold:g} V, or V_K could never re-arm the detector."
            )

    @staticmethod
    def completed(table: Mapping[str, Any]) -> Mapping[str, Any]:
        """The table with a hysteresis that goes with the threshold unless given."""
        return (
            {"hysteresis": AUTO, **table} if table.get("threshold") == AUTO else table
        )


@dataclass(frozen=True)
class RoomTemperature(Unit):
    """A temperature in K; written in K or °C."""

    def validate(self, value: Any, info: ValidationInfo) -> float:
        """The value in K."""
        if isinstance(value, str):
            text = value.replace("degC", CELSIUS)
            if text.rstrip().endswith(CELSIUS):
                value = f"{parse(text, CELSIUS) + ZERO_CELSIUS!r} K"
        return super().validate(value, info)


Temperature = Annotated[
    float, RoomTemperature("K", least=ZERO_CELSIUS - 40, most=ZERO_CELSIUS + 100)
]


@dataclass(frozen=True, kw_only=True)
class Conditions(SceneTable):
    """``[conditions]``: under which a run is made; noted with it, changing nothing.

    Attributes:
        temperature: of the room at the sensor, K.
        operator: who runs it.
        sensor: which specimen it is; `runs --sensor` finds it.
    """

    temperature: Temperature | None = None
    operator: str = ""
    sensor: str = ""

    @property
    def notes(self) -> dict[str, str]:
        """The texts that are not empty, by name."""
        texts = {"operator": self.operator, "sensor": self.sensor}
        return {name: text for name, text in texts.items() if text}


NOISE = {
    "V_C1": 5e-3,
    "V_C2": 5e-3,
    "V_K": 20e-3,
    "coil_current": 0.5e-3,
    "I_DS": 5e-3,
}
"""Standard deviation at the scope's inputs unless a scene says otherwise, V."""

Names = TypeVar("Names", bound=Iterable[str])


def _scope_signals(names: Names) -> Names:
    for name in names:
        if name not in NOISE:
            known = choices(name, NOISE)
            raise ValueError(f'"{name}" is no scope signal; {known}')
    return names


def _with_default_noise(noise: dict[str, float]) -> dict[str, float]:
    return {**NOISE, **_scope_signals(noise)}


def _two_or_none(signals: tuple[str, ...]) -> tuple[str, ...]:
    if len(set(signals)) not in (0, 2):
        raise ValueError("name two different signals, or none")
    return signals


def _factors(factors: dict[str, float]) -> dict[str, float]:
    if 0 in _scope_signals(factors).values():
        raise ValueError("a factor must not be 0")
    return factors


Probes = Annotated[tuple[str, ...], AfterValidator(_scope_signals)]


@dataclass(frozen=True, kw_only=True)
class Simulated(SceneTable):
    """``[simulated]``: the physics of the simulated bench; no effect on a real one.

    A 0 switches a part off. Followers and lags are those of the bench file.

    Attributes:
        seed: of all noise; the same seed gives the same stored samples.
        noise: standard deviation per channel at the scope's input, V.
        field_noise: standard deviation of a teslameter's reading, T.
        V_fire_noise: standard deviation of V_fire from spike to spike, V.
        V_GS_noise: standard deviation of the gate's source, white up to 250 Hz, V.
        current_noise: standard deviation of the coil's source, the same, A.
        V_GS_hum: amplitude of 50 Hz mains hum on the gate, V.
        warming: of the sensor, K: it comes to be so much warmer than at the begin.
        warming_time: time constant with which it does, s.
        specimen: number of a specimen whose parts lie within their tolerances; 0: all
            are as marked.
        hum: amplitude of 50 Hz mains hum on every channel, V.
        hysteresis: half-width of the core's loop, A; 0.03 A to 0.07 A for mild steel.
        attraction: the magnet's pull on the core, N; the same at every current.
        clock_error: relative error of the scope's sample clock; 50e-6 is 50 ppm. More
            than the 100 ppm allowed a driver would take for lost samples.
        swapped: mistake: two signals whose probes are exchanged.
        open_probes: mistake: signals whose probe is connected to nothing.
        attenuation: mistake: factor a probe divides by beyond the channel's scale.
        inverted_coil: mistake: the coil's leads are exchanged.
        coil_unplugged: mistake: the current source's plug is pulled so long after the
            bench is opened, s; never if left out.
        deviation: what bench file and sensor have wrong.
    """

    seed: Annotated[int, Field(ge=0, le=2**63 - 1)] = 1
    noise: Annotated[dict[str, Noise], AfterValidator(_with_default_noise)] = field(
        default_factory=lambda: dict(NOISE)
    )
    field_noise: FieldNoise = 2e-6
    V_fire_noise: Noise = 0.0
    V_GS_noise: Noise = 0.0
    current_noise: HalfWidth = 0.0
    V_GS_hum: Noise = 0.0
    warming: Annotated[float, Unit("K", least=-50.0, most=50.0)] = 0.0
    warming_time: Duration = 600.0
    specimen: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    hum: Noise = 0.0
    hysteresis: HalfWidth = 0.0
    attraction: Pull = 0.0
    clock_error: Annotated[float, Field(ge=-1e-4, le=1e-4)] = 0.0
    swapped: Annotated[Probes, AfterValidator(_two_or_none)] = ()
    open_probes: Probes = ()
    attenuation: Annotated[dict[str, float], AfterValidator(_factors)] = field(
        default_factory=dict
    )
    inverted_coil: bool = False
    coil_unplugged: Duration | None = None
    deviation: Deviation = field(default_factory=Deviation)

    @property
    def irregular(self) -> dict[str, float]:
        """What makes one specimen and one spike unlike the next; 0: off."""
        return {
            "noise of V_fire": self.V_fire_noise,
            "noise of the sources": max(self.V_GS_noise, self.current_noise),
            "hum of the sensor": self.V_GS_hum,
            "spread between specimens": self.specimen,
        }


@dataclass(frozen=True, kw_only=True)
class CoilUse(SceneTable):
    """``[coil]``: how the coil plays a force, and what if it cannot follow.

    Attributes:
        strict: refuse a waveform faster than slew or update grid, do not limit it.
        way: "set-points" sent one by one, a "list" that the source plays by its own
            clock, the scope's "generator" into the source's analogue input; "auto"
            takes the first of generator, set-points, list that is accurate enough.
        accuracy: largest error of the force, as a part of its range, that is accurate
            enough; what the protocol needs unless given.
    """

    strict: bool = False
    way: Literal["auto", "set-points", "list", "generator"] = "auto"
    accuracy: Annotated[float, Field(gt=0, le=1)] | None = None
