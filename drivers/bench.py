"""The bench a scene names, built from real drivers; nothing of it is opened."""

from __future__ import annotations

from drivers.coil.source import CoilSource
from drivers.picoscope.scope import PicoScope
from drivers.teslameter import Teslameter
from drivers.usbtmc.scope import UsbtmcScope
from tactile_lab.bench import Bench, FieldMeter, Scope
from tactile_lab.clock import Clock, RealClock
from tactile_lab.errors import SceneError
from tactile_lab.instruments.dialects import coil_dialect, meter_dialect, scope_dialect
from tactile_lab.planning.needs import Needs
from tactile_lab.scene.bench_file import CoilSpec, FieldMeterSpec, ScopeSpec
from tactile_lab.scene.scene import Scene


def open_bench(scene: Scene, needed: Needs, *, realtime: bool = True) -> Bench:
    """Drivers for the instruments `scene` needs, on this computer's time.

    Args:
        scene: its bench file names addresses and limits.
        needed: which instruments that is, as its plan has it.
        realtime: without meaning here: real instruments know no other time.

    Raises:
        SceneError: the bench file lacks an instrument the scene needs.
    """
    clock = RealClock()
    spec = scene.bench
    return Bench(
        name=spec.name,
        simulated=False,
        clock=clock,
        coil=coil_source(spec.coil, clock) if needed.coil else None,
        scope=_scope(spec.scope, clock) if needed.channels else None,
        field_meter=_meter(spec.field_meter, clock) if needed.field_meter else None,
    )


def coil_source(spec: CoilSpec | None, clock: Clock) -> CoilSource:
    """The driver of the current source `spec` describes."""
    if spec is None:
        raise SceneError("The scene drives the coil, but the bench has no [coil].")
    return CoilSource(
        coil_dialect(spec.dialect), spec.port, spec.limits, clock, baud=spec.baud
    )


def _scope(spec: ScopeSpec | None, clock: Clock) -> Scope:
    if spec is None:
        raise SceneError("The scene records scope channels; the bench has no [scope].")
    if spec.driver == "usbtmc":
        row = scope_dialect(spec.dialect or "rigol-ds1000z")
        return UsbtmcScope(row, clock=clock, serial=spec.serial)
    return PicoScope(
        clock=clock,
        library=spec.library,
        serial=spec.serial,
        allow_usb2=spec.allow_usb2,
        allow_usb_power=spec.allow_usb_power,
    )


def _meter(spec: FieldMeterSpec | None, clock: Clock) -> FieldMeter:
    if spec is None:
        raise SceneError("The scene reads the field; the bench has no [field_meter].")
    return Teslameter(meter_dialect(spec.dialect), spec.port, clock, baud=spec.baud)
