"""What a scene needs and what it leaves out, each with its reason, for people."""

from __future__ import annotations

from tactile_lab.instruments.registry import voltage_capability
from tactile_lab.planning.needs import Needs, compared
from tactile_lab.planning.timeline import Timeline
from tactile_lab.planning.warn import threshold_of
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.scene.tables import AUTO
from tactile_lab.signals import AVERAGED, FIELD_AVERAGING, MODEL_ONLY, SIGNALS
from tactile_lab.voltage_source import VoltageLimits

NOT_RECORDED = "field is not recorded, so it is not compared with the current"

NOTHING_ALIKE = "nothing recorded is predicted by it"
PROBES_MOVED = "the probes are moved, so the protocol asks it for rest and push alone"

Reasons = tuple[tuple[str, str], ...]


def uses(scene: Scene, needed: Needs) -> Reasons:
    """(what, why) of everything a run opens, enables, computes or reads."""
    bench, stored = scene.bench, needed.stored
    enabled = {channel.signal for channel in needed.channels}
    found: list[tuple[str, str]] = []
    if needed.coil and bench.coil is not None:
        found.append(("coil source", f"{bench.coil.dialect} plays the force"))
    if needed.channels and bench.scope is not None:
        names = ", ".join(c.input for c in needed.channels)
        found.append(("scope", f"{bench.scope.driver}, inputs {names}"))
    for channel in needed.channels:
        name = channel.signal
        why = "stored" if name in stored else "streamed, not stored"
        if name in AVERAGED:
            why = f"kept as means of {show(FIELD_AVERAGING, 's')}"
        if name == needed.detect_on:
            why += f"; spikes are detected on it{_threshold(scene, name)}"
        found.append((f"channel {channel.input}: {name}", why))
    if needed.field_meter and bench.field_meter is not None:
        found.append(("teslameter", f"{bench.field_meter.dialect} reads the field"))
    if needed.thermometer and bench.thermometer is not None:
        read = f"{bench.thermometer.dialect} reads the sensor's temperature"
        found.append(("thermometer", read))
    if needed.asked_field:
        found.append(("a person", "reads the teslameter at each hold"))
    for name, volts in needed.voltages.items():
        spec = bench.voltage_sources[name]
        can = voltage_capability(spec)
        does = "sets" if name in scene.protocol.sets else "holds"
        found.append(
            (
                f"source of {name}",
                f"{spec.dialect} {does} it, {show(volts, 'V', 6)} to begin with, in "
                f"steps of {show(can.resolution, 'V')}; reads it back within "
                f"{show(can.uncertainty(volts), 'V', 2)}; then {_rest(spec.limits)}",
            )
        )
    for name in scene.record.signals:
        if name == "force":
            found.append((name, "derived from the applied current and the magnet"))
        elif name == "spikes":
            found.append((name, f"detected on {needed.detect_on} as it streams"))
        elif name == "rate":
            found.append((name, "derived from the spikes"))
        elif name == "I_DS" and name not in enabled:
            found.append((name, "derived from V_C1 by Eq. (16)"))
    if compared(scene, needed):
        found.append(("model beside the run", "from the applied current; compared"))
    if bench.simulated:
        found.append(("plant", "computes coil, magnet, sensor and noise"))
    for path in scene.files:
        found.append((path.name, "file the scene names"))
    return tuple(found)


def leaves_out(scene: Scene, needed: Needs, drive: Timeline) -> Reasons:
    """(what, why) of all that is neither opened, enabled, stored nor computed."""
    bench = scene.bench
    found: list[tuple[str, str]] = []
    if not needed.coil:
        found.append(("coil source", "no trial asks for a force"))
    if not needed.channels:
        found.append(("scope", "no recorded signal comes from it"))
    enabled = {channel.signal for channel in needed.channels}
    if needed.asked_field:
        found.append(("port of a teslameter", "a person reads it"))
    elif not needed.field_meter:
        why = "a scope channel has the field" if "field" in enabled else NOT_RECORDED
        found.append(("teslameter", why))
    if bench.thermometer is not None and not needed.thermometer:
        found.append(("thermometer", "temperature is not recorded"))
    found += [
        (f"source of {name}", "neither [sensor] sourced nor the protocol names it")
        for name in bench.voltage_sources
        if name not in needed.voltages
    ]
    for channel in bench.scope.channels if bench.scope is not None else ():
        if channel.signal not in enabled:
            found.append(
                (f"channel {channel.input}: {channel.signal}", "nothing needs it")
            )
        elif channel.signal not in (*needed.stored, *AVERAGED):
            found.append(
                (f"samples of {channel.signal}", "needed as they stream, not recorded")
            )
    if needed.detect_on is None:
        found.append(("spike detection", "neither spikes nor rate are recorded"))
    for name in SIGNALS:
        if name not in scene.record.signals and name not in enabled:
            found.append((name, "not recorded"))
        elif name in MODEL_ONLY:
            found.append((name, "exists only in the model"))
    if any(step.trial.pause for step in drive.steps):
        found.append(("samples of pauses", "recovery is neither streamed nor stored"))
    if not compared(scene, needed):
        found.append(("model beside the run", _not_compared(scene)))
    if bench.simulated:
        off = "off in [simulated]: not computed"
        world = scene.simulated
        found += [(what, off) for what, on in world.irregular.items() if not on]
    else:
        found.append(("simulated instruments", "the bench is real"))
    found.append(("window", "Qt is loaded by `tactile-lab gui` alone"))
    return tuple(found)


def _not_compared(scene: Scene) -> str:
    """Why no model is computed beside the run."""
    protocol = scene.protocol
    if not scene.record.compare:
        return "record.compare = false"
    if protocol.moves_probes:
        return PROBES_MOVED
    if protocol.sets:
        return f"{', '.join(protocol.sets)} is another from trial to trial"
    if scene.compared:
        return "no current is applied that would drive it"
    return NOTHING_ALIKE


def _rest(limits: VoltageLimits) -> str:
    """Where a source is left."""
    return f"rests at {show(limits.rest, 'V')}" if limits.rest else "goes to 0 V, off"


def _threshold(scene: Scene, name: str) -> str:
    """What decides a threshold that is not given."""
    if name != "V_K" or scene.detect.threshold != AUTO:
        return ""
    about = show(threshold_of(scene), "V")
    return f", threshold from its noise at the start, about {about}"
