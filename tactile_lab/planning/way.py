"""By which way the coil gives a trial's force: one rule, for the plan and for the run.

The scope's generator, where it is wired to the source's analogue input, has short
steps and loads at once. Set-points need nothing but a slow line, and the force goes in
stairs. A list that the source plays by its own clock has steps as short as its dwell,
and takes time to load.
The first of these whose force is as near as the scene wants is taken, else the nearest.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from tactile_lab.bench import CoilLimits
from tactile_lab.current_list import ListCapability
from tactile_lab.drive import Drive
from tactile_lab.errors import LimitError, SceneError
from tactile_lab.generator import GeneratedCurrent
from tactile_lab.instruments.registry import (
    BY_PERSON,
    coil_capability,
    scope_capability,
)
from tactile_lab.instruments.serial_dialect import MARGIN
from tactile_lab.lag import FINE, Lag
from tactile_lab.magnetics import Magnet
from tactile_lab.planning.current import cut, limited, slewed, wanted_current
from tactile_lab.quantity import show
from tactile_lab.scene.bench_file import CoilSpec
from tactile_lab.scene.scene import Scene
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform

AT_ZERO = 1e-5
"""Current that counts as none, A."""

SAMPLED = frozenset({"V_C1", "V_C2", "V_K", "coil_current", "I_DS", "spikes", "rate"})
"""Signals for which the scope is opened."""

MOST_MOVING, MOST_SET_POINTS = 500_000, 4_000_000
"""Set-points of one trial while its current changes, and all of them: 6 hours and two
days of a Kepco. Each one that differs is a step that the plan computes."""

LEADS = 3
"""Times a current is led by what the one before left behind."""


def drive_for(
    trial: Trial, scene: Scene, before: float, update_interval: float | None = None
) -> Drive:
    """How the coil gives `trial`.

    Args:
        trial: its force, or its current where it asks for one.
        scene: bench, and how near the force must be.
        before: current just before the trial, A.
        update_interval: time between two set-points, s; what the source promises
            unless given.

    Raises:
        LimitError: beyond the coil's limit, the calibration, or a source that gives
            current of one sign.
        SceneError: there is no such source, or not the way that the scene names.
    """
    coil, magnet = scene.bench.coil, scene.bench.magnet
    if coil is None:
        raise SceneError(f"bench {scene.bench.name} has no [coil].")
    wanted = wanted_current(trial, magnet, coil)
    asked = None if trial.current is not None else cut(trial.force, trial.length)
    promised = coil_capability(coil).update_interval
    interval = max(update_interval or promised, _finest(wanted, promised))
    steps = _set_points(wanted, asked, magnet, coil, before, interval)
    way, enough = scene.coil.way, scene.force_accuracy
    if asked is None or asked.peak == 0 or way == "set-points":
        return steps
    # as far as straight pieces tell an answer to a step
    near = (1 + FINE) * enough * float(np.ptp(np.append(asked.value, 0.0)))
    found, reasons = [steps], []
    for name, can in (("generator", _generated), ("list", _lists)):
        if way not in ("auto", name):
            continue
        if way == "auto" and name == "generator" and coil.generator is None:
            continue
        if way == "auto" and name == "list" and _error(steps) <= near:
            break  # loading one takes longer than its trial
        try:
            drive = _timed(trial, scene, coil, wanted, asked, before, can(scene, coil))
        except LimitError as reason:
            if way == name:
                raise SceneError(
                    f'trial "{trial.label}" cannot be played by way of "{name}": '
                    f'{reason} Leave [coil] way = "{name}" out.'
                ) from reason
            reasons.append(f"No {name}: {reason}")
            continue
        if way == "auto" and _error(drive) <= near:
            return drive
        found.append(drive)
    nearest = min(found, key=_error)
    if nearest is steps and reasons:
        return replace(steps, why=". ".join((steps.why, *reasons)))
    return nearest


def _error(drive: Drive) -> float:
    return math.inf if drive.error is None else drive.error


def _set_points(
    wanted: Waveform,
    asked: Waveform | None,
    magnet: Magnet,
    coil: CoilSpec,
    before: float,
    interval: float,
) -> Drive:
    """Played by set-points, one each `interval` s."""
    played, warning = limited(wanted, coil.limits.slew, interval, before)
    played = cut(played, wanted.end)
    starts = np.arange(0.0, wanted.end, interval)
    # a value is of the time at which it is sent, and the source acts on it later
    acts = starts + interval / MARGIN
    steps = np.column_stack([acts, played.at(starts)])
    steps = np.concatenate([[[0.0, before]], steps])
    new = np.abs(np.diff(steps[:, 1], prepend=np.inf)) > 0
    stairs = cut(Waveform.stairs(steps[new], wanted.end), wanted.end)
    why = f"one each {show(interval, 's', 3)}"
    drive = Drive(played, stairs=stairs, why=why, warning=warning)
    if asked is None:
        return drive
    given, _ = magnet.lagged_force(stairs, (before, before))
    return replace(drive, error=_difference(asked, given))


def _finest(wanted: Waveform, promised: float) -> float:
    """Least time between two set-points, s: a link may be faster than it promises.

    Raises:
        LimitError: there are too many even at what it promises, s.
    """
    changes = np.diff(wanted.value) != 0
    moving = float(np.diff(wanted.time)[changes].sum())
    for seconds, most, what in (
        (moving, MOST_MOVING, "changes its force"),
        (wanted.end, MOST_SET_POINTS, "lasts"),
    ):
        if seconds > most * promised:
            raise LimitError(
                f"A trial {what} for {show(seconds, 's')}; at one set-point each "
                f"{show(promised, 's', 3)}, {show(most * promised, 's', 2)} is the "
                "most. Ask for a shorter ramp, hold or rest, or for more trials."
            )
    return max(moving / MOST_MOVING, wanted.end / MOST_SET_POINTS)


def _lists(_: Scene, coil: CoilSpec) -> ListCapability:
    """What lists the source plays."""
    source = coil_capability(coil)
    if source.lists is None:
        raise LimitError(f"{source.title} plays none.")
    return source.lists


def _generated(scene: Scene, coil: CoilSpec) -> GeneratedCurrent:
    """What currents the scope's generator gives through the source."""
    scope, analogue = scene.bench.scope, coil_capability(coil).analogue
    if analogue is None:
        raise LimitError(
            "the bench wires none to the source's analogue input ([coil.generator])."
        )
    generator = None if scope is None else scope_capability(scope).generator
    if generator is None:
        raise LimitError("the bench's scope has none.")
    if not scene.asked & SAMPLED:
        raise LimitError("nothing is sampled, so the scope is not opened.")
    return GeneratedCurrent(generator=generator, input=analogue)


def _timed(
    trial: Trial,
    scene: Scene,
    coil: CoilSpec,
    wanted: Waveform,
    asked: Waveform,
    before: float,
    can: ListCapability | GeneratedCurrent,
) -> Drive:
    """Played by the clock of source or generator, ahead of the lags that are known."""
    magnet, meter = scene.bench.magnet, scene.bench.field_meter
    if trial.pause:
        raise LimitError("in a pause nothing is recorded.")
    if meter is not None and meter.driver == BY_PERSON and trial.hold is not None:
        raise LimitError("a person reads the field, for which it would not wait.")
    for current in (before, float(wanted.value[-1])):
        if abs(current) > AT_ZERO:
            raise LimitError(
                "it begins and ends at 0 A, and this trial does not "
                f"({show(current, 'A')})."
            )
    bipolar = coil_capability(coil).bipolar
    drive = _nearest(wanted, asked, magnet, coil.limits, bipolar, can)
    if isinstance(can, GeneratedCurrent) and drive.error is not None:
        converter = abs(float(magnet.force(can.step / 2)))  # its codes lie anywhere
        blurred = _blurred(asked, can.input.lag)
        return replace(drive, error=drive.error + blurred + converter)
    return drive


def _blurred(force: Waveform, lag: float) -> float:
    """Largest difference that a short lag makes of a force beside a delay by it, N."""
    late, _ = Lag(lag).follow(force)
    return _difference(force, late.shifted(-lag))


@lru_cache(maxsize=64)  # protocols repeat their presentations
def _nearest(
    wanted: Waveform,
    asked: Waveform,
    magnet: Magnet,
    limits: CoilLimits,
    bipolar: bool,
    can: ListCapability | GeneratedCurrent,
) -> Drive:
    """The points whose force, behind the lags that the bench knows, is nearest."""
    found, _ = _listed(wanted, asked, magnet, limits, can)
    if magnet.lag == Lag():
        return found
    ahead, late = Waveform.constant(0.0), wanted
    for _ in range(LEADS):
        lead = ahead.plus(magnet.lag.led(late, can.shortest))
        ahead = _within(lead, limits, bipolar, can)
        drive, field = _listed(ahead, asked, magnet, limits, can)
        if (drive.error or 0.0) < (found.error or 0.0):
            found = drive
        late = wanted.plus(field.scaled(-1.0))
    return found


def _within(
    current: Waveform,
    limits: CoilLimits,
    bipolar: bool,
    can: ListCapability | GeneratedCurrent,
) -> Waveform:
    """What source and coil can of a current that runs ahead of the lags, A."""
    most = limits.current
    if isinstance(can, GeneratedCurrent):
        most = min(most, can.most)
    if limits.resistance is not None:
        most = min(most, limits.compliance / limits.resistance)
    least = -most if bipolar else 0.0
    return Waveform(current.time, np.clip(current.value, least, most))


def _listed(
    wave: Waveform,
    asked: Waveform,
    magnet: Magnet,
    limits: CoilLimits,
    can: ListCapability | GeneratedCurrent,
) -> tuple[Drive, Waveform]:
    """The points nearest to `wave` A within the slew that they may have.

    Beside it the field of these points, as the current that would hold it, A.
    """
    slew, steepest, warning = limits.fastest, wave.steepest, None
    if steepest > slew * (1 + 1e-9):
        wave = cut(slewed(wave, slew, 0.0), wave.end)
        asks = "a jump" if math.isinf(steepest) else show(steepest, "A/s")
        warning = f"{asks} needed, {show(slew, 'A/s')} is the slew limit of lists"
    ends = wave.value.copy()
    ends[[0, -1]] = 0.0
    wave = Waveform(wave.time, ends)
    points = can.following(wave)
    load = can.load_time(len(points))
    shortest = show(float(points.dwells[:-1].min()), "s", 3)
    each = f"{shortest} and more"
    if isinstance(can, GeneratedCurrent):
        each = f"{shortest} by the scope's generator ({show(can.input.gain, 'A/V')})"
    why = f"{len(points)} points of {each}, loaded in {show(load, 's', 2)}"
    gain = can.input.gain if isinstance(can, GeneratedCurrent) else None
    drive = Drive(wave, points, gain, error=0.0, why=why, warning=warning, load=load)
    held = cut(
        Waveform.stairs(np.column_stack([points.starts, points.currents]), wave.end),
        wave.end,
    )
    field, _ = magnet.lag.follow(held, (0.0, 0.0))
    force = magnet.force_for(field, beyond="hold")
    error = _difference(asked, force)
    # what it is between two points of the list matters to nobody
    time = np.union1d(asked.time, points.starts[points.starts < asked.end])
    return replace(drive, force=Waveform(time, force.at(time)), error=error), field


def _difference(asked: Waveform, given: Waveform) -> float:
    """Largest difference of two forces, N.

    Both are straight between their points, so one of these has it.
    """
    time = np.concatenate([asked.time, given.time])
    left = np.nextafter(time, -np.inf)
    both = np.concatenate([time, left[left >= 0]])
    return float(np.abs(asked.at(both) - given.at(both)).max())
