"""Do source, shunt and teslameter tell of the current asked for? At a trial's end.

A source that is late again and again, or its computer, climbs so slowly that a hold may
be over before its current is reached, and one that is set or switched off at its panel
is not switched off by the driver within a second: the run would hold a force of another
name.
The source's own read-back cannot know what its current does: a magnet that has moved,
an unplugged winding of two, a probe that has slipped or a dead shunt change the force,
or what is recorded of it, and nothing else. What is not measured is not compared. Where
the current changes in a hold, as in a vibration, means are: from the first current to
the last, where a lag counts little; of the field over all such trials so far.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable

import numpy as np

from tactile_lab.acquisition.asked_field import NOTABLE
from tactile_lab.analysis.wiring import shunt_agrees
from tactile_lab.arrays import FloatArray
from tactile_lab.bench import Reading
from tactile_lab.magnetics import ROUGH
from tactile_lab.quantity import show
from tactile_lab.trial import Trial
from tactile_lab.waveform import Waveform

SETTLING = 0.3
"""Time after the start of a hold from which field and current must agree, s."""

REACHED = 0.15
"""Time after the start of a hold, or after its current should be there, from which that
must flow, s; a source is read back 0.25 s after its last set-point."""

STEADY = 0.02
"""Change of the current during a hold, as a part of it, up to which it is steady."""

LAGS = np.linspace(0.0, 0.1, 6)
"""By how much a reading of the field may lag behind the current, s."""

CALIBRATED = 0.1
"""Part of a calibrated field by which a reading may differ."""

NOTHING = 5e-3
"""Current below which none flows, A."""

GRID = 200
"""Times at which a current is looked at for its mean over a hold."""

Shunt = Callable[[float, float], tuple[float, float] | None]
"""Between two times of a trial, s: from when on the scope's channel of the current is
still known, s, and its mean since, A; None where there is none."""


class DriveCheck:
    """Compares them, and says once of each what does not fit.

    Args:
        expected: field, T, at a current, A.
        calibrated: it was measured; else it is what the bench file supposes, which may
            be wrong by a third.
    """

    def __init__(self, expected: Callable[[float], float], *, calibrated: bool) -> None:
        self._expected = expected
        self._calibrated = calibrated
        self._told: set[str] = set()
        self._changing: list[tuple[FloatArray, float]] = []

    def doubts(
        self,
        trial: Trial,
        asked: Waveform | None,
        current: FloatArray,
        shunt: Shunt,
        readings: Iterable[Reading],
    ) -> list[str]:
        """What does not fit in a trial that has ended; [] also where nothing is known.

        Args:
            trial: that was played.
            asked: current that it asks for, A against s from its start; None where
                no coil plays it.
            current: as read back, shape (n, 2), s from its start and A.
            shunt: what the scope saw of the current.
            readings: of the field, times from the trial's start.
        """
        if trial.hold is None:
            return []
        come = max(trial.hold[0], float(current[0, 0])) if len(current) else math.inf
        begin, end = come + SETTLING, trial.hold[1]
        found = []
        if asked is not None:
            found.append(("asked", _held(asked, current, trial.hold)))
        # what flows as it begins was set before: a slow source may set it only then
        first = max(int(np.searchsorted(current[:, 0], begin, side="right")) - 1, 0)
        held = current[first : np.searchsorted(current[:, 0], end, side="right")]
        steady = begin < end and _steady(held[:, 1])
        if not steady:
            begin, end = _moving(current, trial.length)
            held = current[(current[:, 0] >= begin) & (current[:, 0] <= end)]
        if held.size:
            found += self._beside(trial, held, (begin, end), steady, shunt, readings)
        new = [(what, text) for what, text in found if text and what not in self._told]
        self._told.update(what for what, _ in new)
        return [f"{trial.label}: {text}" for _, text in new]

    def _beside(
        self,
        trial: Trial,
        held: FloatArray,
        window: tuple[float, float],
        steady: bool,
        shunt: Shunt,
        readings: Iterable[Reading],
    ) -> list[tuple[str, str]]:
        """What to say of field and shunt beside the current of that window, s."""
        begin, end = window
        found = []
        pairs = [
            (np.interp(one.time - LAGS, *held.T), one.value)
            for one in readings
            if begin <= one.time <= end
        ]
        if not steady:
            self._changing += pairs
            pairs = self._changing
        # what calibrates the field is not compared with it
        if pairs and trial.current is None:
            found.append(("field", self._field(pairs)))
        seen = shunt(begin, end)
        if seen is not None:
            since, mean = seen
            # as set until the next: between two far apart flows no straight line
            set_to = Waveform.stairs(held, end).mean(np.array([since]), end - since)
            found.append(("shunt", _shunt(float(set_to[0]), mean)))
        return found

    def _field(self, pairs: list[tuple[FloatArray, float]]) -> str:
        """What to say of readings, T, beside the current at each of `LAGS`, A."""
        flowed = np.array([currents for currents, _ in pairs])
        believed = np.vectorize(self._expected)(flowed).mean(axis=0)
        tesla = float(np.mean([value for _, value in pairs]))
        nearest = int(np.argmin(np.abs(believed - tesla)))
        expected, amperes = float(believed[nearest]), float(flowed[:, nearest].mean())
        part = CALIBRATED if self._calibrated else ROUGH - 1
        if abs(tesla - expected) <= part * abs(expected) + NOTABLE:
            return ""
        by = "calibration" if self._calibrated else "bench file's [magnet]"
        return (
            f"the teslameter reads {show(tesla, 'T')} at {show(amperes, 'A')}, where "
            f"the {by} has {show(expected, 'T')}: the forces of this run are not what "
            "they are called. Check probe, sign and range of the teslameter, coil and "
            "calibration."
        )


def _steady(amperes: FloatArray) -> bool:
    """Whether a current, shape (n,), hardly changes; not where nothing is known."""
    return bool(amperes.size and np.ptp(amperes) <= STEADY * np.abs(amperes).max())


def _held(asked: Waveform, current: FloatArray, hold: tuple[float, float]) -> str:
    """What to say of a steady current that was not given all through a hold, s."""
    # a current that its slew limit holds back, as planned, comes later than the hold
    come = asked.arrival((hold[0] + hold[1]) / 2, 0.0)
    begin, end = max(hold[0], come) + REACHED, hold[1]
    if begin >= end:
        return ""
    wanted = asked.at(np.linspace(begin, end, GRID))
    first = max(int(np.searchsorted(current[:, 0], begin, side="right")) - 1, 0)
    given = current[first : np.searchsorted(current[:, 0], end, side="right"), 1]
    if not _steady(wanted) or given.size == 0:
        return ""
    level = float(wanted.mean())
    farthest = float(given[np.argmax(np.abs(given - level))])
    if shunt_agrees(farthest, level):
        return ""
    return (
        f"it asks for {show(level, 'A')} in its hold, and the source gave "
        f"{show(farthest, 'A')} in a part of it: the force is not what it is called. "
        "Set-points came too late to climb in time, the source was set or switched off "
        "by hand, or the circuit is open. Check link, front panel and leads."
    )


def _moving(current: FloatArray, length: float) -> tuple[float, float]:
    """From the first current that flows until field and shunt are at rest again, s.

    Nothing is known of what comes after a trial of that length.
    """
    flows = np.flatnonzero(np.abs(current[:, 1]) > NOTHING)
    if flows.size == 0:
        return 0.0, -1.0
    last = float(current[flows[-1], 0]) + SETTLING
    return float(current[flows[0], 0]), min(last, length)


def _shunt(amperes: float, seen: float) -> str:
    if shunt_agrees(seen, amperes):
        return ""
    return (
        f"the shunt shows {show(seen, 'A')} where the source reads back "
        f"{show(amperes, 'A')}: the recorded coil current is not what flowed. Check "
        "the shunt's wiring, its resistance in the bench file and its channel."
    )
