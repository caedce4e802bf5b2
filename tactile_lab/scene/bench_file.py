"""Bench files: which instruments there are, how they are wired, and the geometry.

A bench file has the same tables as a scene's ``[bench]``. Without one, the built-in
simulated bench of this room is used.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, Field, ValidationInfo
from typing_extensions import TypedDict

from tactile_lab.bench import Channel, CoilLimits, Followers
from tactile_lab.errors import choices
from tactile_lab.instruments.registry import (
    BY_PERSON,
    CoilDriverName,
    MeterDriverName,
    ScopeDriverName,
)
from tactile_lab.magnetics import Magnet
from tactile_lab.quantity import Unit, Voltage
from tactile_lab.table import SceneTable

WIRED = ("V_C1", "V_C2", "V_K", "coil_current", "I_DS", "field")
"""Signals a scope channel can carry."""


def is_file(value: object) -> bool:
    """Whether a dialect or driver is named by the path of its file."""
    return isinstance(value, str) and value.endswith((".toml", ".py"))


def _located(name: str, info: ValidationInfo) -> str:
    folder: Path | None = (info.context or {}).get("folder", Path())
    return str((folder / name).resolve()) if folder and is_file(name) else name


Located = AfterValidator(_located)
"""Of a name that may be a file's: its path is relative to the bench file."""

Baud = Annotated[int, Field(ge=50, le=4_000_000)]


@dataclass(frozen=True, kw_only=True)
class GeneratorWiring(SceneTable):
    """``[coil.generator]``: the scope's generator drives the source's analogue input.

    Attributes:
        gain: current per volt of the generator, A/V, as measured with the lead in
            place; what the source's row says unless given.
        bandwidth: of the source behind that input, with the coil, Hz; the same.
    """

    gain: Annotated[float, Unit("A/V", above=0.0)] | None = None
    bandwidth: Annotated[float, Unit("Hz", above=0.0)] | None = None


@dataclass(frozen=True, kw_only=True)
class CoilSpec(SceneTable):
    """``[coil]`` of a bench: the current source.

    Attributes:
        driver: "serial", or path of a Python file with a `CoilDriver`.
        dialect: id of one that ships, or path of a TOML file with one.
        port: serial port or pyserial URL.
        baud: symbols a second; the row's own unless given.
        options: keys of the driver's own.
        limits: each narrows what model and coil allow.
        generator: how the scope's generator is wired to it; None: it is not.
    """

    driver: Annotated[CoilDriverName, Located] = "serial"
    dialect: Annotated[str, Located] = "kepco-bop"
    port: str = "sim://coil"
    baud: Baud | None = None
    options: dict[str, Any] = field(default_factory=dict)
    limits: CoilLimits = field(default_factory=CoilLimits)
    generator: GeneratorWiring | None = None


def _wired(channel: Channel) -> Channel:
    """A channel as a file may have it: what is wired is known, and so is its scale."""
    if channel.signal not in WIRED:
        known = choices(channel.signal, WIRED)
        raise ValueError(f'no scope channel can carry "{channel.signal}"; {known}')
    if not channel.input:
        raise ValueError('input is empty; name one of the scope, such as "A"')
    if channel.signal == "field":
        if not channel.tesla_per_volt:
            raise ValueError(
                "field needs tesla_per_volt, what the teslameter's analogue output "
                'means at the range its knob shows, such as "0.02 T/V"; compare two '
                "fields with its display"
            )
        if channel.coupling != "DC":
            raise ValueError('field needs coupling = "DC"')
    return channel


def _once_each(channels: tuple[Channel, ...]) -> tuple[Channel, ...]:
    for what in ("signal", "input"):
        seen = [getattr(channel, what) for channel in channels]
        for name in seen:
            if seen.count(name) > 1:
                raise ValueError(f'{what} "{name}" is wired twice')
    return channels


@dataclass(frozen=True, kw_only=True)
class ScopeSpec(SceneTable):
    """``[scope]``: the digitiser.

    Attributes:
        driver: "ps3000a" or "usbtmc", or path of a Python file with a `ScopeDriver`.
        dialect: for usbtmc, the row of the model.
        library: path of the vendor's library; the usual places unless given.
        serial: serial number, where several are attached.
        allow_usb2: accept a USB 2 port.
        allow_usb_power: accept running without the power supply.
        options: keys of the driver's own.
        channels: what is wired to which input.
    """

    driver: Annotated[ScopeDriverName, Located] = "ps3000a"
    dialect: Annotated[str, Located] | None = None
    library: str | None = None
    serial: str | None = None
    allow_usb2: bool = False
    allow_usb_power: bool = False
    options: dict[str, Any] = field(default_factory=dict)
    channels: Annotated[
        tuple[Annotated[Channel, AfterValidator(_wired)], ...],
        AfterValidator(_once_each),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class FieldMeterSpec(SceneTable):
    """``[field_meter]``: the teslameter.

    Attributes:
        driver: "serial"; "manual": a person is asked what it shows; or path of a
            Python file with a `FieldMeterDriver`.
        dialect: id of one that ships, or path of a TOML file with one.
        port: serial port or pyserial URL.
        baud: symbols a second; the row's own unless given.
        options: keys of the driver's own.
    """

    driver: Annotated[MeterDriverName, Located] = "serial"
    dialect: Annotated[str, Located] = "lakeshore-425"
    port: str = "sim://field_meter"
    baud: Baud | None = None
    options: dict[str, Any] = field(default_factory=dict)


class HandSet(TypedDict, total=False):
    """``[hand_set]``: circuit voltages set by hand, V, which decide the threshold."""

    V_GS: Voltage
    V_S: Voltage
    V_th: Voltage


@dataclass(frozen=True, kw_only=True)
class BenchSpec(SceneTable):
    """What a bench file says, ready to be used; nothing of it is opened.

    Attributes:
        file: the bench file, None for the built-in simulated bench; scenes write it.
        name: for people.
        simulated: compute the physics instead of opening instruments.
        notes: kept with each run.
        coil, scope, field_meter: None where the bench has none.
        magnet: force per current.
        followers: between circuit and scope; None: no follower loads the circuit.
        hand_set: circuit voltages set by hand, by name, V.

    Raises:
        ValueError: a port is missing or used twice, or the field is measured twice.
    """

    file: str | None = None
    name: str = "bench"
    simulated: bool = False
    notes: str = ""
    coil: CoilSpec | None = None
    scope: ScopeSpec | None = None
    field_meter: FieldMeterSpec | None = None
    magnet: Magnet
    followers: Followers | None = None
    hand_set: HandSet = field(default_factory=HandSet)

    def __post_init__(self) -> None:
        coil, meter = self.coil, self.field_meter
        for name, spec in (("coil", coil), ("field_meter", meter)):
            if spec is None or spec.driver != "serial":
                continue
            if not self.simulated and spec.port.startswith("sim:"):
                raise ValueError(
                    f"[{name}] port is missing: real instruments need one, such as "
                    '"/dev/ttyUSB0" or "COM3"; simulated = true needs none'
                )
        if meter is not None and "field" in self.signals:
            raise ValueError(
                "the field is measured twice, by [field_meter] and on a scope channel; "
                "leave one of them out"
            )
        if coil is None or meter is None or coil.driver != meter.driver:
            return
        if coil.port == meter.port:
            raise ValueError(
                f'[coil] and [field_meter] both have port = "{coil.port}"; a port has '
                "one instrument, so correct one of them"
            )

    @property
    def path(self) -> Path | None:
        """The bench file, None for the built-in simulated bench."""
        return None if self.file is None else Path(self.file)

    @property
    def signals(self) -> tuple[str, ...]:
        """What is wired to a scope channel."""
        channels = () if self.scope is None else self.scope.channels
        return tuple(channel.signal for channel in channels)

    def measures(self, signal: str) -> bool:
        """Whether an instrument of this bench measures that signal by itself."""
        metered = self.field_meter is not None and not self._by_hand
        return signal in self.signals or (signal == "field" and metered)

    @property
    def _by_hand(self) -> bool:
        """Whether a person reads the teslameter."""
        return self.field_meter is not None and self.field_meter.driver == BY_PERSON
