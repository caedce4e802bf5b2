"""The instruments that ship on their simulated far ends, each from table and world.

Entry points in `pyproject.toml` name them; each imports its driver and far end when it
is asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from drivers.registered import thermometer_row, usbtmc_dialect
from tactile_lab.errors import SceneError
from tactile_lab.instruments.dialects import (
    coil_dialect,
    teslameter_dialect,
    voltage_dialect,
)

if TYPE_CHECKING:
    from drivers.coil.source import CoilSource
    from drivers.picoscope.scope import PicoScope
    from drivers.teslameter import Teslameter
    from drivers.thermometer import Thermometer
    from drivers.usbtmc.scope import UsbtmcScope
    from drivers.voltage_source import SourceMeter
    from sim_backend.world import WiredInputs, World
    from tactile_lab.scene.bench_file import (
        CoilSpec,
        FieldMeterSpec,
        ScopeSpec,
        ThermometerSpec,
        VoltageSourceSpec,
    )

SIMULATED_POLL = 0.05
"""Time between polls where nobody watches, s: fewer, larger blocks cost less."""


def serial_source(table: CoilSpec, world: World) -> CoilSource:
    """A serial current source that drives the plant's coil."""
    from drivers.coil.source import CoilSource
    from sim_backend.coil.list_mode import ListFault
    from sim_backend.coil.source import coil_far_end
    from sim_backend.serial_line.faults import SerialFault
    from sim_backend.serial_line.wires import plug_in

    row = coil_dialect(table.dialect).of_one(serial=None, timeout=table.timeout)
    wire = row.serial.at(table.baud)
    given = world.faults.get("coil", ())
    faults = [one for one in given if isinstance(one, SerialFault)]
    if (when := world.simulated.coil_unplugged) is not None:
        faults.append(SerialFault(kind="unplug", after=when, times=None))
    source = coil_far_end(world.plant, row, world.clock)
    if table.generator is not None:
        source.wire_analogue_input()
    for one in given:
        if isinstance(one, ListFault):
            source.list.fault = one
    far_end = plug_in(source, wire, world.clock, "coil", faults)
    return CoilSource(
        row,
        far_end.url,
        table.limits,
        world.clock,
        baud=table.baud,
        analogue=table.generator is not None,
    )


def ps3000a(table: ScopeSpec, world: World) -> PicoScope:
    """A PicoScope 3404D at the plant's voltages, behind its vendor's functions."""
    from drivers.picoscope.scope import PicoScope
    from sim_backend.picoscope.scope import SIMULATED, UnitModel
    from sim_backend.picoscope.sdk import FakePs3000a

    clock_error = world.simulated.clock_error
    library = FakePs3000a(
        _wired(world),
        world.clock,
        world.make
        or UnitModel(serial=table.serial or SIMULATED, clock_error=clock_error),
        world.faults.get("scope", ()),
        world.plant.analogue_input,
    )
    return PicoScope(
        clock=world.clock,
        library=library,
        serial=table.serial,
        # equal clocks let the driver find a single lost sample; unequal ones do not
        lag_tolerance=0.01 if clock_error else None,
        poll_interval=SIMULATED_POLL if world.clock.simulated else 0.02,
    )


def usbtmc(table: ScopeSpec, world: World) -> UsbtmcScope:
    """A Rigol DS1000Z at the plant's voltages, on a high-speed bus."""
    from drivers.usbtmc.scope import UsbtmcScope
    from sim_backend.usbtmc.bus import SimulatedBus
    from sim_backend.usbtmc.device import SimulatedDevice
    from sim_backend.usbtmc.function import INTERFACE, UsbtmcFunction
    from sim_backend.usbtmc.rigol_ds1000z import SimulatedDs1000z

    row = usbtmc_dialect(table)
    scope = SimulatedDs1000z(
        _wired(world), world.clock, clock_error=world.simulated.clock_error
    )
    device = SimulatedDevice(
        vendor=row.vendor,
        product=row.product,
        serial=table.serial or "DS1ZSIM0001",
        function=UsbtmcFunction(scope),
        interface=INTERFACE,
        faults=world.faults.get("scope", ()),
    )
    backend = SimulatedBus([device], world.clock)
    return UsbtmcScope(row, clock=world.clock, backend=backend)


def serial_meter(table: FieldMeterSpec, world: World) -> Teslameter:
    """A serial teslameter in the plant's field."""
    from drivers.teslameter import Teslameter
    from sim_backend.serial_line.wires import plug_in
    from sim_backend.teslameter import meter_far_end

    row = teslameter_dialect(table.dialect).of_one(serial=None, timeout=table.timeout)
    probe = meter_far_end(
        world.plant,
        row,
        world.clock,
        noise=world.simulated.field_noise,
        seed=world.simulated.seed,
    )
    faults = world.faults.get("field_meter", ())
    far_end = plug_in(probe, row.serial, world.clock, "field-meter", faults)
    return Teslameter(row, far_end.url, world.clock)


def serial_thermometer(table: ThermometerSpec, world: World) -> Thermometer:
    """A serial thermometer at the plant's sensor."""
    from drivers.thermometer import Thermometer
    from sim_backend.serial_line.wires import plug_in
    from sim_backend.thermometer import (
        SensorFault,
        SimThermometer,
        thermometer_far_end,
    )

    row = thermometer_row(table)
    warm = thermometer_far_end(world.plant, row, world.clock, seed=world.simulated.seed)
    given = world.faults.get("thermometer", ())
    for one in given:
        if isinstance(one, SensorFault) and isinstance(warm, SimThermometer):
            warm.fault = one  # a row does not say what its model answers then
    faults = [one for one in given if not isinstance(one, SensorFault)]
    far_end = plug_in(warm, row.serial, world.clock, "thermometer", faults)
    return Thermometer(row, far_end.url, world.clock)


def serial_voltage_source(table: VoltageSourceSpec, world: World) -> SourceMeter:
    """A serial source meter on one voltage of the plant's circuit."""
    from drivers.voltage_source import SourceMeter
    from sim_backend.serial_line.wires import plug_in
    from sim_backend.voltage_source import LoadFault, voltage_far_end

    row = voltage_dialect(table.dialect).of_one(serial=None, timeout=table.timeout)
    clock = world.clock
    given = world.faults.get("voltage_source", ())
    source = voltage_far_end(
        world.plant, table.name, row, clock, seed=world.simulated.seed
    )
    for one in given:
        if isinstance(one, LoadFault):
            source.fault = one
    faults = [one for one in given if not isinstance(one, LoadFault)]
    far_end = plug_in(source, row.serial, clock, table.name, faults)
    return SourceMeter(table.name, row, far_end.url, table.limits, clock)


def _wired(world: World) -> WiredInputs:
    if world.inputs is None:
        raise SceneError("A simulated scope needs inputs that are wired.")
    return world.inputs
