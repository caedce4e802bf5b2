"""The simulated bench: real drivers, one plant at the far ends of the wires."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sim_backend.plant.noise import SensorNoise
from sim_backend.plant.options import PlantOptions
from sim_backend.plant.plant import Plant
from sim_backend.world import WiredInputs, World
from tactile_lab.bench import Bench, Followers
from tactile_lab.clock import Clock, RealClock, SimulatedClock
from tactile_lab.engine.bench import equipped
from tactile_lab.instruments.registry import far_end
from tactile_lab.model.specimen import specimen
from tactile_lab.planning.needs import Needs
from tactile_lab.scene.scene import Scene
from tactile_lab.scope import Channel
from tactile_lab.voltage_source import SOURCED

NO_FOLLOWERS = Followers(input_bias=0.0, bandwidth=0.0)
"""Probes that lie at the nodes themselves."""


def plant_of(
    scene: Scene, world: PlantOptions | None = None, *, sampled: bool = True
) -> Plant:
    """The physical world of a scene's simulated bench, or `world` with its sensor.

    `sampled`: whether a scope may look at it.
    """
    simulated = scene.simulated
    part = specimen(scene.sensor.circuit, simulated.specimen)
    true = simulated.deviation.circuit(part)
    believed = scene.sensor.circuit
    return Plant(
        true,
        scene.bench.magnet,
        world or options(scene),
        simulated.seed,
        beyond={n: getattr(true, n) - getattr(believed, n) for n in SOURCED},
        sampled=sampled,
    )


def options(scene: Scene) -> PlantOptions:
    """Parts of the world: as the bench file has them, and how far that is wrong."""
    bench, simulated = scene.bench, scene.simulated
    scope, deviation = bench.scope, simulated.deviation
    inputs = {} if scope is None else {c.signal: c.input for c in scope.channels}
    followers = bench.followers or NO_FOLLOWERS
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
        follower=followers.bandwidth > 0,
        follower_pole=followers.bandwidth or 1.0,
        slew=followers.slew,
        offset=deviation.offset,
        bias=followers.input_bias,
        noise=simulated.noise,
        sensor_noise=SensorNoise(
            V_fire=simulated.V_fire_noise,
            V_GS=simulated.V_GS_noise,
            current=simulated.current_noise,
            hum=simulated.V_GS_hum,
        ),
        hum=simulated.hum,
        hysteresis=simulated.hysteresis,
        attraction=simulated.attraction,
        coil_lag=bench.magnet.coil_lag,
        eddy_lag=bench.magnet.eddy_lag + deviation.lag,
        force=1 + deviation.force,
        drift=simulated.clock_error,
        warming=simulated.warming,
        warming_time=simulated.warming_time,
    )


def open_bench(
    scene: Scene,
    needed: Needs,
    *,
    realtime: bool = False,
    scope_faults: Sequence[Any] = (),
    coil_faults: Sequence[Any] = (),
    meter_faults: Sequence[Any] = (),
    thermometer_faults: Sequence[Any] = (),
    voltage_faults: Sequence[Any] = (),
    world: PlantOptions | None = None,
    make: Any = None,
) -> Bench:
    """Drivers and far ends of the instruments `scene` needs; nothing is opened.

    Args:
        scene: physics, wiring, dialects.
        needed: which instruments are needed, as its plan has it.
        realtime: live in this computer's time instead of a computed one.
        scope_faults: what goes wrong with the scope, and when, as its far end takes it.
        coil_faults: the same for the current source.
        meter_faults: the same for the teslameter.
        thermometer_faults: the same for the thermometer.
        voltage_faults: the same for each source of a voltage.
        world: physics with its wiring faults, instead of the scene's.
        make: what scope there is, and how it is connected, as its far end takes it.

    Raises:
        SceneError: the bench file lacks an instrument the scene needs, or one has no
            simulated far end.
    """
    clock: Clock = RealClock() if realtime else SimulatedClock()
    scope, inputs = scene.bench.scope, None
    sampled = scope is not None and bool(needed.channels)
    plant = plant_of(scene, world, sampled=sampled)
    if scope is not None and sampled:
        import sim_backend.plant.render  # noqa: F401  compiled, so not while time runs

        inputs = WiredInputs(plant, scope.channels)
        if realtime:
            _compile(plant_of(scene, world), needed.channels)
    around = World(
        clock=clock,
        plant=plant,
        inputs=inputs,
        simulated=scene.simulated,
        faults={
            "coil": coil_faults,
            "scope": scope_faults,
            "field_meter": meter_faults,
            "thermometer": thermometer_faults,
            "voltage_source": voltage_faults,
        },
        make=make,
    )
    return equipped(
        scene,
        needed,
        clock,
        lambda kind, table: far_end(kind, table)(table, around),
        place_probes=None if inputs is None else inputs.place_probes,
        accuracy=plant.accuracy,
    )


def _compile(plant: Plant, channels: Sequence[Channel]) -> None:
    """Have the physics compiled before the clock counts, on a plant of no use."""
    plant.render(0, 256, 1e-6, 0.0, channels, full_scale=32512, shift=8)
