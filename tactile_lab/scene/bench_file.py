"""Bench files: which instruments there are, how they are wired, and the geometry.

A bench file has the same tables as a scene's ``[bench]``. Without one, the built-in
simulated bench of this room is used.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, cast
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field, ValidationInfo
from typing_extensions import TypedDict

from tactile_lab.bench import CoilLimits, Followers
from tactile_lab.errors import choices
from tactile_lab.instruments.registry import (
    BY_PERSON,
    CoilDriverName,
    MeterDriverName,
    ScopeDriverName,
    ThermometerDriverName,
    VoltageDriverName,
)
from tactile_lab.instruments.serial_dialect import Timeout
from tactile_lab.magnetics import Magnet
from tactile_lab.quantity import Unit, Voltage
from tactile_lab.scope import Channel
from tactile_lab.signals import AVERAGED
from tactile_lab.table import INTERNAL, SceneTable
from tactile_lab.voltage_source import SOURCED, VoltageLimits

WIRED = ("V_C1", "V_C2", "V_K", "coil_current", "I_DS", "field", "temperature")
"""Signals a scope channel can carry."""


def is_file(value: object) -> bool:
    """Whether a dialect or driver is named by the path of its file."""
    return isinstance(value, str) and value.endswith((".toml", ".py"))


def _folder(info: ValidationInfo) -> Path | None:
    """Where the bench file lies; None where paths stay as they are."""
    folder: Path | None = (info.context or {}).get("folder", Path())
    return folder


def _located(name: str, info: ValidationInfo) -> str:
    folder = _folder(info)
    return str((folder / name).resolve()) if folder and is_file(name) else name


Located = AfterValidator(_located)
"""Of a name that may be a file's: its path is relative to the bench file."""


def _beside(library: str, info: ValidationInfo) -> str:
    """A library beside the bench file; another name is the loader's to find."""
    folder = _folder(info)
    if folder is None or not (folder / library).exists():
        return library
    return str((folder / library).resolve())


SCHEMES = ("socket", "rfc2217", "spy", "hwgrep", "loop", "alt", "cp2110", "sim")
"""What stands before `://` of a port; all but the last are pyserial's."""


def _addressed(port: str) -> str:
    scheme, url, _ = port.partition("://")
    if url and scheme not in SCHEMES:
        raise ValueError(
            f"no port is reached by {scheme}://; {choices(scheme, SCHEMES)}"
        )
    if scheme not in ("socket", "rfc2217"):
        return port
    try:
        where = urlsplit(port)
        known = where.hostname and where.port
    except ValueError:  # a number that is none, or too large for one
        known = None
    if not known:
        raise ValueError(
            f'host and number of the port are needed, such as "{scheme}://10.0.0.7:5025"'
        )
    return port


Port = Annotated[str, Field(min_length=1), AfterValidator(_addressed)]
Baud = Annotated[int, Field(ge=50, le=4_000_000)]


@dataclass(frozen=True, kw_only=True)
class PortSpec(SceneTable):
    """What the tables of all instruments behind a serial port have.

    Attributes:
        driver: "serial", or path of a Python file with one.
        dialect: id of one that ships, or path of a TOML file with one.
        port: serial port or pyserial URL.
        serial: serial number, where instruments are alike: its answer to *IDN? must
            hold it.
        baud: symbols a second; the row's own unless given.
        timeout: longest wait for an answer, s, where the link is slow; the same.
        options: keys of the driver's own.
    """

    driver: str = "serial"
    dialect: Annotated[str, Located]
    port: Port
    serial: Annotated[str, Field(min_length=1)] | None = None
    baud: Baud | None = None
    timeout: Timeout | None = None
    options: dict[str, Any] = field(default_factory=dict)


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
class CoilSpec(PortSpec):
    """``[coil]`` of a bench: the current source.

    Attributes:
        driver: "serial", or path of a Python file with a `CoilDriver`.
        limits: each narrows what model and coil allow.
        generator: how the scope's generator is wired to it; None: it is not.
    """

    driver: Annotated[CoilDriverName, Located] = "serial"
    dialect: Annotated[str, Located] = "kepco-bop"
    port: Port = "sim://coil"
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
    if channel.signal == "temperature" and not channel.kelvin_per_volt:
        raise ValueError(
            'temperature needs kelvin_per_volt, such as "100 K/V" of a sensor with 10 '
            'mV/K, and zero_at where 0 V is not 0 K, such as "273.15 K" of one with '
            "0 V at 0 °C"
        )
    if channel.signal in AVERAGED and channel.coupling != "DC":
        raise ValueError(f'{channel.signal} needs coupling = "DC"')
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
        library: path of the vendor's library, from the bench file, or a name that the
            system finds; the usual places unless given.
        serial: serial number, where several are attached.
        allow_usb2: accept a USB 2 port.
        allow_usb_power: accept running without the power supply.
        options: keys of the driver's own.
        channels: what is wired to which input.
    """

    driver: Annotated[ScopeDriverName, Located] = "ps3000a"
    dialect: Annotated[str, Located] | None = None
    library: Annotated[str, AfterValidator(_beside)] | None = None
    serial: str | None = None
    allow_usb2: bool = False
    allow_usb_power: bool = False
    options: dict[str, Any] = field(default_factory=dict)
    channels: Annotated[
        tuple[Annotated[Channel, AfterValidator(_wired)], ...],
        AfterValidator(_once_each),
    ] = ()


@dataclass(frozen=True, kw_only=True)
class FieldMeterSpec(PortSpec):
    """``[field_meter]``: the teslameter.

    Attributes:
        driver: "serial"; "manual": a person is asked what it shows; or path of a
            Python file with a `FieldMeterDriver`.
    """

    driver: Annotated[MeterDriverName, Located] = "serial"
    dialect: Annotated[str, Located] = "lakeshore-425"
    port: Port = "sim://field_meter"
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class ThermometerSpec(PortSpec):
    """``[thermometer]``: the thermometer at the sensor.

    Attributes:
        driver: "serial", or path of a Python file with a `ThermometerDriver`.
        input: of the thermometer, where the sensor's is; the row's first unless given.
    """

    driver: Annotated[ThermometerDriverName, Located] = "serial"
    dialect: Annotated[str, Located] = "lakeshore-218"
    port: Port = "sim://thermometer"
    input: str | None = None
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class VoltageSourceSpec(PortSpec):
    """``[voltage_source.V_GS]``: a source meter that holds that voltage.

    Attributes:
        name: of the voltage.
        driver: "serial", or path of a Python file with a `VoltageSourceDriver`.
        limits: what may be asked of it.
    """

    name: str = field(default="", metadata=INTERNAL)
    driver: Annotated[VoltageDriverName, Located] = "serial"
    dialect: Annotated[str, Located] = "keithley-2400-voltage"
    port: Port = "sim://voltage_source"
    limits: VoltageLimits


class VoltageSources(TypedDict, total=False):
    """``[voltage_source]``: source meters by the circuit's voltage that each holds."""

    V_GS: VoltageSourceSpec
    V_S: VoltageSourceSpec
    V_th: VoltageSourceSpec


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
        coil, scope, field_meter, thermometer: None where the bench has none.
        voltage_source: source meters, by the circuit's voltage that each holds.
        magnet: force per current.
        followers: between circuit and scope; None: no follower loads the circuit.
        hand_set: circuit voltages set by hand, by name, V.

    Raises:
        ValueError: a port is missing or used twice, or field or temperature are
            measured twice.
    """

    file: str | None = None
    name: str = "bench"
    simulated: bool = False
    notes: str = ""
    coil: CoilSpec | None = None
    scope: ScopeSpec | None = None
    field_meter: FieldMeterSpec | None = None
    thermometer: ThermometerSpec | None = None
    voltage_source: VoltageSources = field(default_factory=VoltageSources)
    magnet: Magnet
    followers: Followers | None = None
    hand_set: HandSet = field(default_factory=HandSet)

    def __post_init__(self) -> None:
        ports: dict[tuple[str, str], str] = {}
        for name, spec in self.wired_by_port.items():
            inside = spec.port.startswith("sim:")
            if spec.driver == "serial" and inside and not self.simulated:
                raise ValueError(
                    f"[{name}] port is missing: real instruments need one, such as "
                    '"/dev/ttyUSB0" or "COM3"; simulated = true needs none'
                )
            other = ports.setdefault((spec.driver, spec.port), name)
            if other != name and not inside:
                raise ValueError(
                    f'[{other}] and [{name}] both have port = "{spec.port}"; a port '
                    "has one instrument, so correct one of them"
                )
        for signal, table in (("field", "field_meter"), ("temperature", "thermometer")):
            if getattr(self, table) is not None and signal in self.signals:
                raise ValueError(
                    f"the {signal} is measured twice, by [{table}] and on a scope "
                    "channel; leave one of them out"
                )

    @property
    def voltage_sources(self) -> dict[str, VoltageSourceSpec]:
        """Source meters by the voltage that each holds."""
        given = cast("dict[str, VoltageSourceSpec]", self.voltage_source)
        return {n: replace(given[n], name=n) for n in SOURCED if n in given}

    @property
    def wired_by_port(self) -> dict[str, PortSpec]:
        """Instruments that may stand behind a serial port, by their tables' names."""
        every = {
            "coil": self.coil,
            "field_meter": self.field_meter,
            "thermometer": self.thermometer,
        } | {f"voltage_source.{name}": s for name, s in self.voltage_sources.items()}
        return {name: one for name, one in every.items() if one is not None}

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
        read = {
            "field": self.field_meter is not None and not self._by_hand,
            "temperature": self.thermometer is not None,
        }
        return signal in self.signals or read.get(signal, False)

    @property
    def _by_hand(self) -> bool:
        """Whether a person reads the teslameter."""
        return self.field_meter is not None and self.field_meter.driver == BY_PERSON
