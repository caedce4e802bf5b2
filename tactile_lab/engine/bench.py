"""The bench of a scene: the instruments it needs, as their drivers make them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from tactile_lab.bench import Bench
from tactile_lab.clock import Clock, RealClock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.registry import (
    CoilDriver,
    Driver,
    FieldMeterDriver,
    ScopeDriver,
    ThermometerDriver,
    VoltageSourceDriver,
    find_driver,
)
from tactile_lab.planning.needs import Needs
from tactile_lab.plugins import plugged_in
from tactile_lab.scene.scene import Scene

Instrument = TypeVar("Instrument")

_WANTED = {
    "coil": "drives the coil",
    "scope": "needs scope channels",
    "field_meter": "reads the field",
    "thermometer": "reads the temperature",
}


def open_bench(scene: Scene, needed: Needs, *, realtime: bool = False) -> Bench:
    """The bench `scene` names, with the instruments it needs; opens no instrument.

    Args:
        scene: its `bench` says whether physics is real or computed.
        needed: which instruments that is, as its plan has it.
        realtime: let a simulated bench keep pace with the wall clock; real instruments
            know no other time.

    Raises:
        SceneError: the bench file lacks an instrument the scene needs.
    """
    if scene.bench.simulated:
        simulate = plugged_in("tactile_lab.benches", "simulated")
        bench: Bench = simulate(scene, needed, realtime=realtime)
        return bench
    clock = RealClock()
    return equipped(
        scene,
        needed,
        clock,
        lambda kind, table: find_driver(kind, table).make(table, clock),
    )


def equipped(
    scene: Scene,
    needed: Needs,
    clock: Clock,
    make: Callable[[type[Driver[Any]], Any], Any],
    **also: Any,
) -> Bench:
    """A bench with the instruments that are needed.

    Args:
        scene: its bench file has a table for each.
        needed: what is needed of them.
        clock: the time all of them live in.
        make: makes the instrument of a kind from its table.
        also: further attributes of the bench.

    Raises:
        SceneError: the bench file lacks one.
    """
    spec = scene.bench

    def instrument(kind: type[Driver[Instrument]], wanted: bool) -> Instrument | None:
        if not wanted:
            return None
        table = getattr(spec, kind.kind)
        if table is None:
            raise SceneError(
                f"The scene {_WANTED[kind.kind]}; the bench has no [{kind.kind}]."
            )
        made: Instrument = make(kind, table)
        return made

    scope = instrument(ScopeDriver, bool(needed.channels))
    wired = spec.coil is not None and spec.coil.generator is not None
    return Bench(
        name=spec.name,
        simulated=spec.simulated,
        clock=clock,
        coil=instrument(CoilDriver, needed.coil),
        scope=scope,
        generator=getattr(scope, "generator", None) if wired else None,
        field_meter=instrument(FieldMeterDriver, needed.field_meter),
        thermometer=instrument(ThermometerDriver, needed.thermometer),
        voltage_sources={
            name: make(VoltageSourceDriver, spec.voltage_sources[name])
            for name in needed.voltages
        },
        **also,
    )
