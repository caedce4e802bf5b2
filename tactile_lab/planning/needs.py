"""What a scene needs: the closure of what it records and plays.

The runner, the benches and `plan` all ask here, so that what is not needed is not
opened, enabled, streamed, stored or computed by any of them.
"""

from __future__ import annotations

from collections.abc import Mapping, Set
from dataclasses import dataclass, field

from tactile_lab.errors import LimitError, SceneError
from tactile_lab.instruments.registry import (
    BY_PERSON,
    check_scope,
    check_thermometer,
    scope_capability,
    voltage_capability,
)
from tactile_lab.planning.ranges import Expected, expected, fitted, widened
from tactile_lab.planning.timeline import Timeline, timeline
from tactile_lab.scene.scene import Scene
from tactile_lab.scope import Channel
from tactile_lab.signals import AVERAGED
from tactile_lab.voltage_source import why_not

SAMPLED = ("V_C1", "V_C2", "V_K", "coil_current")
"""Signals that come from a scope channel and in no other way."""


@dataclass(frozen=True, kw_only=True)
class Needs:
    """What one run of a scene opens, enables and keeps.

    Attributes:
        coil: whether the current source is opened: not where no trial asks for force.
        field_meter: whether the teslameter is opened.
        asked_field: whether a person is asked for the field at each hold.
        thermometer: whether the thermometer is opened.
        voltages: of the circuit, by name, V, that source meters hold as it begins.
        channels: scope channels to enable, in the bench's order; none: no scope.
        stored: signals of those that are stored sample by sample.
        detect_on: signal spikes are detected on ("V_K", or "V_C2" by its resets where
            no V_K is wired); None where no spikes are asked for.
        guaranteed_rate: streaming rate the scope's maker guarantees for so many
            channels, S/s; infinite where it is not known.
        gapless: whether the scope streams without gaps; true without a scope.
        expected: what the model gives V_C1 and V_C2, where they are streamed.
    """

    coil: bool
    field_meter: bool
    asked_field: bool
    thermometer: bool
    voltages: Mapping[str, float]
    channels: tuple[Channel, ...]
    stored: tuple[str, ...]
    detect_on: str | None
    guaranteed_rate: float
    gapless: bool = True
    expected: Expected = field(default_factory=dict)


def compared(scene: Scene, needed: Needs) -> bool:
    """Whether a run has a model beside it: the applied current drives that."""
    return scene.compared and needed.coil


def needs(scene: Scene, drive: Timeline | None = None) -> Needs:
    """The closure of `scene`.

    Args:
        scene: what is to be run.
        drive: its trials through the coil; driven here unless given.

    Raises:
        SceneError: something asked for is not wired or not there on this bench, or the
            threshold lies outside the range of the channel it is looked for on.
        LimitError: the scope cannot stream so, or the coil cannot play it.
    """
    drive = drive or timeline(scene, through_coil=True)
    asked, recorded = scene.asked, set(scene.record.signals)
    scope, meter = scene.bench.scope, scene.bench.field_meter
    wired = {c.signal: c for c in scope.channels} if scope is not None else {}
    derives_I_DS = "I_DS" not in wired  # from V_C1 by Eq. (16)
    detect_on = _detected_on(asked, wired)
    streamed = _streamed(scene, asked, wired) | ({detect_on} if detect_on else set())
    _check_wired(scene, streamed, wired)
    if detect_on == "V_K":
        _check_threshold(scene, wired["V_K"])
    channels = tuple(c for name, c in wired.items() if name in streamed)
    metered = "field" in asked and "field" not in wired
    if metered and meter is None:
        raise SceneError(
            f"{scene.name} records the field, but bench {scene.bench.name} has "
            "neither [field_meter] nor a scope channel with the signal field."
        )
    by_hand = meter is not None and meter.driver == BY_PERSON
    warm = "temperature" in asked and "temperature" not in wired
    if warm:
        _check_thermometer(scene)
    seen = expected(scene, channels, drive)
    channels, rate, gapless = _as_the_scope_can(scene, channels, seen, detect_on)
    return Needs(
        coil=drive.drives,
        field_meter=metered and not by_hand,
        asked_field=metered and by_hand,
        thermometer=warm,
        voltages=_voltages(scene, drive),
        channels=channels,
        stored=tuple(
            name
            for name in wired
            if (name in recorded and name not in AVERAGED)
            or (name == "V_C1" and "I_DS" in recorded and derives_I_DS)
        ),
        detect_on=detect_on,
        guaranteed_rate=rate,
        gapless=gapless,
        expected=seen,
    )


def _voltages(scene: Scene, drive: Timeline) -> Mapping[str, float]:
    """What source meters hold as the run begins, V.

    Raises:
        SceneError: the bench has no source for one of them.
        LimitError: the scene or a trial asks for more than its limits allow.
    """
    held, sources = scene.sourced, scene.bench.voltage_sources
    for name in held:
        if name not in sources:
            raise SceneError(
                f"{scene.name} has a source meter hold {name}, but bench "
                f"{scene.bench.name} has no [voltage_source.{name}]. Add it, or leave "
                f"{name} out of [sensor] sourced and set it by hand."
            )
        voltage_capability(sources[name])
    if drive.steps:
        held = {**held, **drive.steps[0].trial.voltages}
    for wanted in (held, *(step.trial.voltages for step in drive.steps)):
        for name, volts in wanted.items():
            if name not in scene.sourced:
                raise SceneError(
                    f"protocol {scene.protocol.name} sets {name}, but declares "
                    f"sets = {scene.protocol.sets!r}; add it there."
                )
            if why := why_not(sources[name].limits, volts, name):
                raise LimitError(why)
    return held


def _detected_on(asked: Set[str], wired: Mapping[str, Channel]) -> str | None:
    """Signal that spikes are detected on, None where nobody asks for them."""
    if not asked & {"spikes", "rate"}:
        return None
    return "V_K" if "V_K" in wired or "V_C2" not in wired else "V_C2"


def _streamed(scene: Scene, asked: Set[str], wired: Mapping[str, Channel]) -> set[str]:
    """Signals that must come from the scope, detection apart."""
    names = {name for name in SAMPLED if name in asked}
    if "I_DS" in asked:
        names.add("I_DS" if "I_DS" in wired else "V_C1")
    return names | {name for name in AVERAGED if name in asked and name in wired}


def _check_thermometer(scene: Scene) -> None:
    thermometer = scene.bench.thermometer
    if thermometer is None:
        raise SceneError(
            f"{scene.name} records the temperature, but bench {scene.bench.name} has "
            "neither [thermometer] nor a scope channel with the signal temperature."
        )
    check_thermometer(thermometer)


def _check_wired(
    scene: Scene, streamed: Set[str], wired: Mapping[str, Channel]
) -> None:
    for name in sorted(streamed - set(wired)):
        raise SceneError(
            f"{scene.name} needs {name}, but bench {scene.bench.name} wires it to no "
            f"scope channel (wired: {', '.join(wired) or 'nothing'}). Add it to "
            "[[scope.channels]] or record less."
        )


def _as_the_scope_can(
    scene: Scene,
    channels: tuple[Channel, ...],
    seen: Expected,
    detect_on: str | None,
) -> tuple[tuple[Channel, ...], float, bool]:
    """Channels as they will be set; the rate the scope surely keeps, S/s; gapless."""
    scope = scene.bench.scope
    if scope is None or not channels:
        return channels, float("inf"), True
    capability = scope_capability(scope)
    ranges = capability.ranges
    if scene.protocol.moves_probes:
        channels = tuple(widened(c, scene.circuit.V_S, ranges) for c in channels)
    channels = tuple(fitted(c, seen, ranges) for c in channels)
    rate = check_scope(scope, channels, scene.record.sample_rate)
    if detect_on is not None and not capability.gapless:
        raise SceneError(
            f"{scene.name} looks for spikes on {detect_on}, but scope "
            f"{scope.driver} of bench {scene.bench.name} has gaps between its "
            "records and would miss some. Use a streaming scope or record "
            "neither spikes nor rate."
        )
    return channels, rate, capability.gapless


def _check_threshold(scene: Scene, channel: Channel) -> None:
    threshold, hysteresis = scene.detect.threshold, scene.detect.hysteresis
    if isinstance(threshold, str) or isinstance(hysteresis, str):
        return
    bottom, top = channel.span
    if threshold >= top or threshold - hysteresis <= bottom:
        raise SceneError(
            f"[detect] threshold {threshold:g} V less hysteresis "
            f"{hysteresis:g} V lies outside what the V_K channel sees, "
            f"{bottom:g} V to {top:g} V. Lower it, or take a larger range."
        )
