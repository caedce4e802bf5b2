"""What the deciding loop is given, and how it ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from tactile_lab.acquisition.asked_field import AskedField
from tactile_lab.acquisition.coil_thread import Warmth
from tactile_lab.acquisition.drift import Drift
from tactile_lab.acquisition.drive_check import DriveCheck
from tactile_lab.acquisition.person import Ask
from tactile_lab.acquisition.search import SpikeSearch
from tactile_lab.drive import Drive
from tactile_lab.scope import Channel
from tactile_lab.trial import Trial, Trials


@dataclass(frozen=True)
class Program:
    """All the loop must know of a scene.

    Attributes:
        trials: the protocol's generator, not started yet.
        fault: says what went wrong where the protocol or other code failed.
        channels: scope channels to enable, in row order.
        interval: sample interval asked for, s.
        search: how spikes are searched; None where they are not.
        drive_for: how the coil gives a trial's force within all limits, told the time
            between two set-points, s, and the last set-point, A.
        ask: asks a person to put the probes elsewhere; None where nobody is there.
        expected: run time expected, s; None if it depends on outcomes.
        doubts: told the opened instruments' settings, says what a person should know
            before the coil is switched on, or raises to prevent it.
        voltages: of the circuit, by name, V, that source meters hold from the begin.
        settling: time the circuit takes to settle after one was changed, s.
        coil_lag: by which the current follows the source, s.
        drift: judges V_C1 at rest before each trial; None where no trial pushes.
        drive_check: compares current, shunt and field of each trial; None where
            nothing drives the coil.
        heat: keeps how warm the coil is; None where nobody does.
        asked_field: has a person read the field; None where a meter does, or nobody.
    """

    trials: Callable[[], Trials]
    fault: Callable[[BaseException], str]
    channels: tuple[Channel, ...]
    interval: float
    search: SpikeSearch | None
    drive_for: Callable[[Trial, float, float], Drive]
    expected: float | None
    doubts: Callable[[Mapping[str, Mapping[str, str]]], tuple[str, ...]]
    voltages: Mapping[str, float] = field(default_factory=dict)
    settling: float = 0.0
    coil_lag: float = 0.0
    drift: Drift | None = None
    drive_check: DriveCheck | None = None
    heat: Warmth | None = None
    ask: Ask | None = None
    asked_field: AskedField | None = None
