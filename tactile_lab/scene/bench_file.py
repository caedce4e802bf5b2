"""Bench files: which instruments there are, how they are wired, and the geometry.

A bench file has the same tables as a scene's ``[bench]``. Without one, the built-in
simulated bench of this module is used.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from tactile_lab.bench import Channel, CoilLimits
from tactile_lab.calibration import read_calibration
from tactile_lab.errors import nearest
from tactile_lab.instruments.registry import (
    CoilDriverName,
    MeterDriverName,
    ScopeDriverName,
)
from tactile_lab.magnetics import Magnet
from tactile_lab.quantity import Unit
from tactile_lab.scene.tables import Table

Length = Annotated[float, Unit("m", above=0.0)]
Area = Annotated[float, Unit("m^2", above=0.0)]
Field_ = Annotated[float, Unit("T", above=0.0)]
FieldPerCurrent = Annotated[float, Unit("T/A")]
Resistance = Annotated[float, Unit("Ohm", above=0.0)]
PositiveVoltage = Annotated[float, Unit("V", above=0.0)]
PositiveCurrent = Annotated[float, Unit("A", above=0.0)]
Slew = Annotated[float, Unit("A/s", above=0.0)]
Heat = Annotated[float, Unit("A^2 s", above=0.0)]
Positive = Annotated[float, Unit("s", above=0.0)]
AnyVoltage = Annotated[float, Unit("V")]

FieldPerVoltage = Annotated[float, Unit("T/V")]

OWN_FILES = ("dialect", "driver")
"""Keys of an instrument that may name a file of the user's own."""

WIRED = ("V_C1", "V_C2", "V_K", "coil_current", "I_DS", "field")
"""Signals a scope channel can carry."""


def is_file(value: object) -> bool:
    """Whether a dialect or driver is named by the path of its file."""
    return isinstance(value, str) and value.endswith((".toml", ".py"))


class LimitsTable(Table):
    """``[coil.limits]``; each narrows what model and coil allow."""

    current: PositiveCurrent = 2.0
    slew: Slew = 5.0
    compliance: PositiveVoltage = 14.0
    continuous: PositiveCurrent = 0.6
    heat: Heat = 30.0
    recovery: Positive = 60.0
    resistance: Resistance | None = None


class CoilSpec(Table):
    """``[coil]`` of a bench: the current source.

    Attributes:
        driver: "serial", or path of a Python file with a `CoilDriver`.
        dialect: id of one that ships, or path of a TOML file with one.
        port: serial port or pyserial URL.
        baud: symbols a second; the row's own unless given.
        limits: see `CoilLimits`.
        options: keys of the driver's own.
    """

    driver: CoilDriverName = "serial"
    dialect: str = "kepco-bop"
    port: str = "sim://coil"
    baud: int | None = Field(default=None, ge=50, le=4_000_000)
    limits_table: LimitsTable = Field(default=LimitsTable(), alias="limits")
    options: dict[str, Any] = Field(default={})

    @property
    def limits(self) -> CoilLimits:
        """Limits as drivers take them, SI."""
        table = self.limits_table
        return CoilLimits(
            **{name: getattr(table, name) for name in type(table).model_fields}
        )


class ChannelTable(Table):
    """One entry of ``[[scope.channels]]``.

    Attributes:
        signal: what is wired to it.
        input: the scope's name for the input.
        range: full scale, V.
        offset: analogue offset added before digitising, V.
        coupling: "DC" or "AC".
        scale: signal unit per volt; 10 for a 10:1 probe.
        shunt: instead of `scale` for coil_current: the shunt's resistance, Ohm.
        tesla_per_volt: instead of `scale` for field: what the analogue output of a
            teslameter means, T/V.
        zero: voltage at the input where the signal is 0, V.
    """

    signal: str
    input: str = Field(min_length=1)
    range: PositiveVoltage = 5.0
    offset: AnyVoltage = 0.0
    coupling: Literal["DC", "AC"] = "DC"
    scale: float = 1.0
    shunt: Resistance | None = None
    tesla_per_volt: FieldPerVoltage | None = None
    zero: AnyVoltage = 0.0

    @field_validator("signal")
    @classmethod
    def _known(cls, signal: str) -> str:
        if signal not in WIRED:
            hint = nearest(signal, WIRED)
            raise ValueError(
                f'no scope channel can carry "{signal}"; {hint + " " if hint else ""}'
                f"Known: {', '.join(WIRED)}."
            )
        return signal

    @model_validator(mode="after")
    def _scaled(self) -> ChannelTable:
        if self.scale == 0:
            raise ValueError("scale must not be 0")
        if self.shunt is not None and self.signal != "coil_current":
            raise ValueError("shunt belongs to the signal coil_current")
        if self.shunt is not None and self.scale != 1.0:
            raise ValueError("give either shunt or scale, not both")
        self._check_field()
        return self

    def _check_field(self) -> None:
        given = self.tesla_per_volt
        if self.signal != "field":
            if given is not None:
                raise ValueError("tesla_per_volt belongs to the signal field")
            return
        if not given:
            raise ValueError(
                "field needs tesla_per_volt, what the teslameter's analogue output "
                'means at the range its knob shows, such as "0.02 T/V"; compare two '
                "fields with its display"
            )
        if self.scale != 1.0:
            raise ValueError("give either tesla_per_volt or scale, not both")
        if self.coupling != "DC":
            raise ValueError('field needs coupling = "DC"')

    def channel(self) -> Channel:
        """The channel as drivers take it, SI."""
        return Channel(
            signal=self.signal,
            input=self.input,
            range=self.range,
            offset=self.offset,
            coupling=self.coupling,
            scale=self._scale(),
            zero=self.zero,
        )

    def _scale(self) -> float:
        if self.tesla_per_volt is not None:
            return self.tesla_per_volt
        return self.scale if self.shunt is None else 1 / self.shunt


class ScopeSpec(Table):
    """``[scope]``: the digitiser.

    Attributes:
        driver: "ps3000a" or "usbtmc", or path of a Python file with a `ScopeDriver`.
        dialect: for usbtmc, the row of the model.
        library: path of the vendor's library; the usual places unless given.
        serial: serial number, where several are attached.
        allow_usb2: accept a USB 2 port.
        allow_usb_power: accept running without the power supply.
        options: keys of the driver's own.
        wiring: entries of ``[[scope.channels]]``.
    """

    driver: ScopeDriverName = "ps3000a"
    dialect: str | None = None
    library: str | None = None
    serial: str | None = None
    allow_usb2: bool = False
    allow_usb_power: bool = False
    options: dict[str, Any] = Field(default={})
    wiring: tuple[ChannelTable, ...] = Field(default=(), alias="channels")

    @field_validator("wiring")
    @classmethod
    def _once_each(cls, wiring: tuple[ChannelTable, ...]) -> tuple[ChannelTable, ...]:
        for what in ("signal", "input"):
            seen = [getattr(entry, what) for entry in wiring]
            for name in seen:
                if seen.count(name) > 1:
                    raise ValueError(f'{what} "{name}" is wired twice')
        return wiring

    @property
    def channels(self) -> tuple[Channel, ...]:
        """All wired channels as drivers take them."""
        return tuple(entry.channel() for entry in self.wiring)


class FieldMeterSpec(Table):
    """``[field_meter]``: the teslameter.

    Attributes:
        driver: "serial"; "manual": a person is asked what it shows; or path of a
            Python file with a `FieldMeterDriver`.
        dialect: id of one that ships, or path of a TOML file with one.
        port: serial port or pyserial URL.
        baud: symbols a second; the row's own unless given.
        options: keys of the driver's own.
    """

    driver: MeterDriverName = "serial"
    dialect: str = "lakeshore-425"
    port: str = "sim://field_meter"
    baud: int | None = Field(default=None, ge=50, le=4_000_000)
    options: dict[str, Any] = Field(default={})


class MagnetTable(Table):
    """``[magnet]``: geometry of Eq. (2), or a calibration (see `Magnet`).

    Attributes:
        allow_expired, allow_other_coil: use the calibration nevertheless.
    """

    r: Length
    A1: Area = 2.827e-5
    A2: Area = 2.25e-3
    B1: Field_ = 0.163
    B2_per_ampere: FieldPerCurrent = 0.011
    geometry_uncertainty: float | None = Field(default=None, ge=0, lt=1)
    calibration: str | None = None
    allow_expired: bool = False
    allow_other_coil: bool = False


class HandSet(Table):
    """``[hand_set]``: circuit voltages set by hand, which decide the threshold."""

    V_GS: AnyVoltage | None = None
    V_S: AnyVoltage | None = None
    V_th: AnyVoltage | None = None


class BenchTable(Table):
    """A whole bench file; in a scene's ``[bench]`` also `file`, its path.

    Attributes:
        file: bench file that the other tables change; scenes only.
        name: for people.
        simulated: compute the physics instead of opening instruments.
        notes: kept with each run.
    """

    file: str | None = None
    name: str = "bench"
    simulated: bool = False
    notes: str = ""
    coil: CoilSpec | None = None
    scope: ScopeSpec | None = None
    field_meter: FieldMeterSpec | None = None
    magnet: MagnetTable
    hand_set: HandSet = HandSet()

    @model_validator(mode="after")
    def _reachable(self) -> BenchTable:
        for name in ("coil", "field_meter"):
            spec = getattr(self, name)
            if spec is None or spec.driver != "serial":
                continue
            if not self.simulated and spec.port.startswith("sim:"):
                raise ValueError(
                    f"[{name}] port is missing: real instruments need one, such as "
                    '"/dev/ttyUSB0" or "COM3"; simulated = true needs none'
                )
        wired = self.scope.wiring if self.scope is not None else ()
        if self.field_meter is not None and "field" in {one.signal for one in wired}:
            raise ValueError(
                "the field is measured twice, by [field_meter] and on a scope channel; "
                "leave one of them out"
            )
        coil, meter = self.coil, self.field_meter
        if coil is None or meter is None or coil.driver != meter.driver:
            return self
        if coil.port == meter.port:
            raise ValueError(
                f'[coil] and [field_meter] both have port = "{coil.port}"; a port has '
                "one instrument, so correct one of them"
            )
        return self


@dataclass(frozen=True, kw_only=True, eq=False)
class BenchSpec:
    """What a bench file says, ready to be used; nothing of it is opened.

    Attributes:
        name: for people.
        simulated: physics is computed.
        path: the bench file, None for the built-in simulated bench.
        coil, scope, field_meter: None where the bench has none.
        magnet: force per current.
        hand_set: circuit voltages set by hand, by name, V.
        notes: for people.
        table: the file's contents, for the resolved scene.
    """

    name: str
    simulated: bool
    path: Path | None
    coil: CoilSpec | None
    scope: ScopeSpec | None
    field_meter: FieldMeterSpec | None
    magnet: Magnet
    hand_set: dict[str, float]
    notes: str
    table: BenchTable

    def measures(self, signal: str) -> bool:
        """Whether an instrument of this bench measures that signal by itself."""
        wired = () if self.scope is None else self.scope.channels
        meter = self.field_meter
        by_itself = meter is not None and meter.driver != "manual"
        return any(channel.signal == signal for channel in wired) or (
            signal == "field" and by_itself
        )

    @classmethod
    def of(cls, table: BenchTable, path: Path | None, folder: Path) -> BenchSpec:
        """The bench described by `table`; its files are found relative to `folder`.

        Raises:
            SceneError: the calibration file cannot be used.
        """
        values = {name: getattr(table.magnet, name) for name in ("r", "A1", "A2", "B1")}
        table = _with_files(table, folder)
        calibration = None
        if table.magnet.calibration is not None:
            calibration = read_calibration(
                (folder / table.magnet.calibration).resolve()
            )
            placed = table.magnet.model_copy(
                update={"calibration": str(calibration.path)}
            )
            table = table.model_copy(update={"magnet": placed})
        return cls(
            name=table.name,
            simulated=table.simulated,
            path=path,
            coil=table.coil,
            scope=table.scope,
            field_meter=table.field_meter,
            magnet=Magnet(
                **values,
                B2_per_ampere=table.magnet.B2_per_ampere,
                calibration=calibration,
                geometry_uncertainty=table.magnet.geometry_uncertainty,
            ),
            hand_set={
                name: getattr(table.hand_set, name)
                for name in HandSet.model_fields
                if getattr(table.hand_set, name) is not None
            },
            notes=table.notes,
            table=table,
        )


def _with_files(table: BenchTable, folder: Path) -> BenchTable:
    """`table` with a user's own dialects and drivers found relative to `folder`."""
    placed = {}
    for name in ("coil", "scope", "field_meter"):
        spec = getattr(table, name)
        if spec is not None:
            files = {
                key: str((folder / getattr(spec, key)).resolve())
                for key in OWN_FILES
                if is_file(getattr(spec, key))
            }
            placed[name] = spec.model_copy(update=files)
    return table.model_copy(update=placed)
