"""The drivers that ship: what each can do, and how it is made.

Entry points in `pyproject.toml` name them. Nothing here imports a wire or a vendor's
library before an instrument is made, so a plan can ask what an instrument can.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from tactile_lab.bench import CoilCapability
from tactile_lab.errors import SceneError
from tactile_lab.generator import AnalogueInput
from tactile_lab.instruments.dialects import (
    coil_dialect,
    scope_dialect,
    teslameter_dialect,
    thermometer_dialect,
    voltage_dialect,
)
from tactile_lab.instruments.registry import (
    CoilDriver,
    FieldMeterDriver,
    ScopeDriver,
    ThermometerDriver,
    VoltageSourceDriver,
)
from tactile_lab.scope import ScopeCapability

if TYPE_CHECKING:
    from drivers.coil.source import CoilSource
    from drivers.picoscope.scope import PicoScope
    from drivers.teslameter import Teslameter
    from drivers.thermometer import Thermometer
    from drivers.usbtmc.scope import UsbtmcScope
    from drivers.voltage_source import SourceMeter
    from tactile_lab.clock import Clock
    from tactile_lab.instruments.meter_dialect import ThermometerDialect
    from tactile_lab.instruments.scope_dialect import ScopeDialect
    from tactile_lab.instruments.serial_dialect import CoilDialect, SerialDialect
    from tactile_lab.scene.bench_file import (
        CoilSpec,
        FieldMeterSpec,
        PortSpec,
        ScopeSpec,
        ThermometerSpec,
        VoltageSourceSpec,
    )
    from tactile_lab.voltage_source import VoltageSourceCapability

S = TypeVar("S", bound="SerialDialect")

DEFAULT_SCOPE = "rigol-ds1000z"
"""Dialect of a USBTMC scope where the bench file names none."""


def as_wired(row: S, table: PortSpec) -> S:
    """A row with what a bench file knows better of this one instrument and its link."""
    return row.of_one(serial=table.serial, timeout=table.timeout)


def _source(table: CoilSpec, clock: Clock) -> CoilSource:
    from drivers.coil.source import CoilSource

    row = as_wired(coil_dialect(table.dialect), table)
    return CoilSource(
        row,
        table.port,
        table.limits,
        clock,
        baud=table.baud,
        analogue=table.generator is not None,
    )


def _source_capability(table: CoilSpec) -> CoilCapability:
    row = coil_dialect(table.dialect)
    row.check_limits(table.limits)
    return CoilCapability(
        title=row.title,
        bipolar=row.polarity == "both",
        update_interval=row.promised_interval(table.baud),
        lists=row.lists(table.baud),
        analogue=_analogue_input(table, row),
    )


def _analogue_input(table: CoilSpec, row: CoilDialect) -> AnalogueInput | None:
    """The source's analogue input as it is wired; None where it is not."""
    wiring, mode = table.generator, row.analogue
    if wiring is None:
        return None
    if mode is None:
        raise SceneError(
            f"[coil.generator] wires the scope's generator to {row.title}, whose row "
            f'"{row.id}" has no [analogue] input. Leave [coil.generator] out, or see '
            "docs/how-to/add-a-dialect.md."
        )
    return AnalogueInput(
        gain=wiring.gain or mode.gain,
        range=mode.range,
        bandwidth=wiring.bandwidth or mode.bandwidth,
    )


def _picoscope(table: ScopeSpec, clock: Clock) -> PicoScope:
    from drivers.picoscope.scope import PicoScope

    return PicoScope(
        clock=clock,
        library=table.library,
        serial=table.serial,
        allow_usb2=table.allow_usb2,
        allow_usb_power=table.allow_usb_power,
    )


def _picoscope_capability(table: ScopeSpec) -> ScopeCapability:
    from drivers.picoscope.generator import CAPABILITY
    from drivers.picoscope.scope import GUARANTEED
    from drivers.picoscope.sdk import INPUTS, OFFSETS, RANGES

    return ScopeCapability(
        gapless=True,
        inputs=INPUTS,
        ranges=tuple(RANGES),
        bits=8,
        fastest=GUARANTEED,
        offsets=OFFSETS,
        generator=CAPABILITY,
    )


def _check_picoscope_rate(rate: float) -> None:
    from drivers.picoscope.setup import streaming_interval

    streaming_interval(1 / rate)  # it may stream faster than its maker guarantees


def _usbtmc_scope(table: ScopeSpec, clock: Clock) -> UsbtmcScope:
    from drivers.usbtmc.scope import UsbtmcScope

    return UsbtmcScope(usbtmc_dialect(table), clock=clock, serial=table.serial)


def _usbtmc_capability(table: ScopeSpec) -> ScopeCapability:
    return usbtmc_dialect(table).capability


def usbtmc_dialect(table: ScopeSpec) -> ScopeDialect:
    """How the USBTMC scope of a bench file speaks."""
    return scope_dialect(table.dialect or DEFAULT_SCOPE)


def _teslameter(table: FieldMeterSpec, clock: Clock) -> Teslameter:
    from drivers.teslameter import Teslameter

    row = as_wired(teslameter_dialect(table.dialect), table)
    return Teslameter(row, table.port, clock, baud=table.baud)


def _thermometer(table: ThermometerSpec, clock: Clock) -> Thermometer:
    from drivers.thermometer import Thermometer

    return Thermometer(thermometer_row(table), table.port, clock, baud=table.baud)


def thermometer_row(table: ThermometerSpec) -> ThermometerDialect:
    """How the thermometer of a bench file speaks of the input that it names."""
    return as_wired(thermometer_dialect(table.dialect).at(table.input), table)


def _source_meter(table: VoltageSourceSpec, clock: Clock) -> SourceMeter:
    from drivers.voltage_source import SourceMeter

    row = as_wired(voltage_dialect(table.dialect), table)
    return SourceMeter(
        table.name, row, table.port, table.limits, clock, baud=table.baud
    )


def _source_meter_capability(table: VoltageSourceSpec) -> VoltageSourceCapability:
    return voltage_dialect(table.dialect).capability(table.limits)


SERIAL_SOURCE = CoilDriver(make=_source, capability=_source_capability)
PS3000A = ScopeDriver(
    make=_picoscope, capability=_picoscope_capability, check_rate=_check_picoscope_rate
)
USBTMC = ScopeDriver(make=_usbtmc_scope, capability=_usbtmc_capability)
SERIAL_METER = FieldMeterDriver(make=_teslameter)
SERIAL_THERMOMETER = ThermometerDriver(make=_thermometer, check=thermometer_row)
SERIAL_VOLTAGE_SOURCE = VoltageSourceDriver(
    make=_source_meter, capability=_source_meter_capability
)
