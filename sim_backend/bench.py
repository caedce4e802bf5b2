"""The simulated bench: real drivers, one plant at the far ends of the wires."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from drivers.coil.source import CoilSource
from drivers.picoscope.scope import PicoScope
from drivers.teslameter import Teslameter
from drivers.usbtmc.scope import UsbtmcScope
from sim_backend.picoscope.faults import Fault
from sim_backend.picoscope.scope import Make
from sim_backend.picoscope.sdk import FakePs3000a
from sim_backend.plant.options import PlantOptions
from sim_backend.plant.plant import Plant
from sim_backend.plant.scope_input import BUFFERED
from sim_backend.plant.scope_source import Acquisition, Codes
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.from_row import coil_far_end, meter_far_end
from sim_backend.serial_line.wires import plug_in
from sim_backend.usbtmc.bus import SimulatedBus
from sim_backend.usbtmc.device import SimulatedDevice
from sim_backend.usbtmc.faults import UsbFault
from sim_backend.usbtmc.function import INTERFACE, UsbtmcFunction
from sim_backend.usbtmc.rigol_ds1000z import SimulatedDs1000z
from tactile_lab.bench import Bench, Channel, Scope
from tactile_lab.clock import Clock, RealClock, SimulatedClock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.dialects import coil_dialect, meter_dialect, scope_dialect
from tactile_lab.planning.needs import Needs
from tactile_lab.scene.bench_file import ScopeSpec
from tactile_lab.scene.scene import Scene
from tactile_lab.scene.tables import Simulated

SIMULATED_POLL = 0.05
"""Time between polls where nobody watches, s: fewer, larger blocks cost less."""


class WiredPlant:
    """The plant at the scope's inputs, as the bench file wires them.

    Args:
        plant: the physical world.
        wiring: what is connected to which input.
    """

    def __init__(self, plant: Plant, wiring: tuple[Channel, ...]) -> None:
        self._plant = plant
        self._wiring = {channel.input: channel for channel in wiring}
        self._probes = "circuit"

    def place_probes(self, where: str) -> None:
        """Put the probes of the circuit's voltages on "ground", "supply", "circuit"."""
        self._probes = where

    def _touches(self, name: str) -> str:
        """What the probe of input `name` touches."""
        if name not in self._wiring:
            return "none"
        signal = self._wiring[name].signal
        if signal not in BUFFERED or self._probes == "circuit":
            return signal
        return self._probes

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        """Codes and over-range flags, as the scope is set and the plant is wired."""
        channels = [
            replace(
                self._wiring.get(one.name, Channel(signal="", input="", range=1.0)),
                signal=self._touches(one.name),
                input=one.name,
                range=one.range,
                offset=one.offset,
                coupling=one.coupling,
            )
            for one in acquisition.inputs
        ]
        return self._plant.render(
            first,
            samples,
            acquisition.interval,
            acquisition.started,
            channels,
            acquisition.full_scale,
            acquisition.shift,
        )


def _compile(plant: Plant, channels: Sequence[Channel]) -> None:
    """Have the physics compiled before the clock counts, on a plant of no use."""
    plant.render(0, 256, 1e-6, 0.0, channels, full_scale=32512, shift=8)


def plant_of(scene: Scene, world: PlantOptions | None = None) -> Plant:
    """The physical world of a scene's simulated bench, or `world` with its sensor."""
    return Plant(
        scene.circuit,
        scene.bench.magnet,
        world or options(scene.simulated, _inputs(scene)),
        scene.simulated.seed,
    )


def _inputs(scene: Scene) -> dict[str, str]:
    """The scope's input of each wired signal."""
    scope = scene.bench.scope
    return {} if scope is None else {c.signal: c.input for c in scope.channels}


def options(
    simulated: Simulated, inputs: Mapping[str, str] | None = None
) -> PlantOptions:
    """Parts of the world as the scene's ``[simulated]`` table switches them.

    Args:
        simulated: the table.
        inputs: scope input by signal, for mistakes in the wiring.
    """
    inputs = inputs or {}
    here = [signal for signal in simulated.swapped if signal in inputs]
    return PlantOptions(
        wired={
            inputs[one]: other for one, other in zip(here, reversed(here), strict=True)
        },
        open_inputs=tuple(inputs[s] for s in simulated.open_probes if s in inputs),
        attenuation={
            inputs[s]: factor
            for s, factor in simulated.attenuation.items()
            if s in inputs
        },
        inverted_coil=simulated.inverted_coil,
        follower=simulated.follower,
        offset=simulated.follower_offset,
        bias=simulated.input_bias,
        noise=simulated.noise,
        hum=simulated.hum,
        hysteresis=simulated.hysteresis,
        attraction=simulated.attraction,
        coil_lag=simulated.coil_lag,
        eddy_lag=simulated.eddy_lag,
        drift=simulated.clock_error,
    )


def _mistakes(simulated: Simulated) -> tuple[SerialFault, ...]:
    """What the scene has go wrong with the current source."""
    when = simulated.coil_unplugged
    return () if when is None else (SerialFault(kind="unplug", after=when, times=None),)


def _usbtmc(
    spec: ScopeSpec, source: WiredPlant, clock: Clock, faults: Sequence[UsbFault]
) -> UsbtmcScope:
    """A USBTMC scope and its far end on a high-speed bus."""
    row = scope_dialect(spec.dialect or "rigol-ds1000z")
    device = SimulatedDevice(
        vendor=row.vendor,
        product=row.product,
        serial=spec.serial or "DS1ZSIM0001",
        function=UsbtmcFunction(SimulatedDs1000z(source, clock)),
        interface=INTERFACE,
        faults=faults,
    )
    return UsbtmcScope(row, clock=clock, backend=SimulatedBus([device], clock))


def open_bench(
    scene: Scene,
    needed: Needs,
    *,
    realtime: bool = False,
    scope_faults: Sequence[Fault] | Sequence[UsbFault] = (),
    coil_faults: Sequence[SerialFault] = (),
    meter_faults: Sequence[SerialFault] = (),
    world: PlantOptions | None = None,
    make: Make | None = None,
) -> Bench:
    """Drivers and far ends of the instruments `scene` needs; nothing is opened.

    Args:
        scene: physics, wiring, dialects.
        needed: which instruments are needed, as its plan has it.
        realtime: live in this computer's time instead of a computed one.
        scope_faults: what goes wrong with the scope, and when.
        coil_faults: the same for the current source.
        meter_faults: the same for the teslameter.
        world: physics with its wiring faults, instead of the scene's.
        make: what scope there is, and how it is connected.

    Raises:
        SceneError: the bench file lacks an instrument the scene needs.
    """
    clock: Clock = RealClock() if realtime else SimulatedClock()
    plant, spec = plant_of(scene, world), scene.bench
    coil = meter = wired = None
    scope: Scope | None = None
    if needed.coil:
        if spec.coil is None:
            raise SceneError("The scene drives the coil, but the bench has no [coil].")
        row = coil_dialect(spec.coil.dialect)
        wire = row.serial.model_copy(update={"baud": spec.coil.baud or row.serial.baud})
        source = coil_far_end(plant, row, clock)
        mistakes = (*coil_faults, *_mistakes(scene.simulated))
        far_end = plug_in(source, wire, clock, "coil", mistakes)
        coil = CoilSource(
            row, far_end.url, spec.coil.limits, clock, baud=spec.coil.baud
        )
    if needed.channels:
        if spec.scope is None:
            raise SceneError(
                "The scene needs scope channels; the bench has no [scope]."
            )
        if realtime:
            _compile(plant_of(scene, world), needed.channels)
        wired = WiredPlant(plant, spec.scope.channels)
        if spec.scope.driver == "usbtmc":
            faults = [one for one in scope_faults if isinstance(one, UsbFault)]
            scope = _usbtmc(spec.scope, wired, clock, faults)
        else:
            library = FakePs3000a(
                wired,
                clock,
                make or Make(clock_error=scene.simulated.clock_error),
                [one for one in scope_faults if isinstance(one, Fault)],
            )
            # equal clocks let the driver find a single lost sample, unequal ones not
            lag = 0.01 if scene.simulated.clock_error else None
            scope = PicoScope(
                clock=clock,
                library=library,
                lag_tolerance=lag,
                poll_interval=0.02 if realtime else SIMULATED_POLL,
            )
    if needed.field_meter:
        if spec.field_meter is None:
            raise SceneError(
                "The scene reads the field; the bench has no [field_meter]."
            )
        meter_row = meter_dialect(spec.field_meter.dialect)
        probe = meter_far_end(
            plant,
            meter_row,
            clock,
            noise=scene.simulated.field_noise,
            seed=scene.simulated.seed,
        )
        far_end = plug_in(probe, meter_row.serial, clock, "field-meter", meter_faults)
        meter = Teslameter(meter_row, far_end.url, clock)
    return Bench(
        name=spec.name,
        simulated=True,
        clock=clock,
        coil=coil,
        scope=scope,
        field_meter=meter,
        place_probes=wired.place_probes if wired is not None else None,
        accuracy=plant.accuracy,
    )
