"""What a run costs this computer: processor time and memory, by part.

Each part is so many seconds per million samples, set-points or trials, as measured on
one computer (docs/plan-figures.md shows how near that comes over all scenes that ship),
times how much slower this one is. That is told by a few milliseconds of plain Python,
which is most of what a run does; how fast an array is sorted tells of a processor's
widest registers.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from tactile_lab.deviation import Deviation
from tactile_lab.planning.estimate import Cost
from tactile_lab.planning.needs import Needs, compared
from tactile_lab.planning.outcome import Step
from tactile_lab.planning.timeline import Timeline
from tactile_lab.scene.scene import Scene

REFERENCE = 0.62e-3
"""What one round of the work takes where the seconds below hold, s: what the shipped
scenes took in the mean, nothing else running, sets it. The seconds are fitted to what
each scene took, and to what the demo took less without the model beside it."""
ROUNDS = 60

START, FITTED = 3.0, 0.9
"""Imports, opening of all instruments, figures and report; and what the lanes of spikes
and the fits to them add where any are expected, s."""
PER_TRIAL = 0.0054
"""Played, judged and drawn, s."""
PER_CHANNEL_SECOND, DRIVEN, SET = 6.0e-3, 3.4e-3, 1.55e-3
"""Of one channel's blocks that are handed on, at any rate; of a source that rests and
is read back; and of each set-point while it does not, s."""
PER_HELD_SECOND = 6.4e-3
"""Of one source meter, which is read back in pauses too, s."""
LANE, STORED, DETECTED = 0.07, 0.0065, 0.0065
"""Of a stored channel's file and lane; per million samples of one channel: rendered,
compressed, read again and drawn; and of the one on which spikes are looked for, s."""
COMPARED, COMPARED_TRIAL = 0.17, 0.0125
COMPARED_POINT, COMPARED_SPIKE = 1.2e-3, 1.0e-3
"""Of the model beside the run, which is solved once as it is believed and once for each
cause of uncertainty: with its figure, per trial, per set-point or point of a list, and
per spike that counts, s."""
RESIDUAL, RESIDUAL_TRIAL = 0.08, 0.0125
"""Of V_C1 less the model's, which is sampled for it, and per trial, s."""
SEARCHED, SEARCHED_SPIKE = 1.4, 0.035
"""Of the search for what explains a misfit, and per spike, s. It can be foreseen only
where the scene itself has the simulated bench deviate."""

BASE = 270e6
"""Memory of the program with its instruments and figures, bytes."""
MEMORY_CHANNEL = 6e6
"""What is kept of a channel's stream, bytes."""
MEMORY_MILLION = 15e3
"""Per million samples of one channel: of pyramids, live and stored, bytes."""
MEMORY_COMPARED, MEMORY_POINT = 62e6, 25e3
"""Of the model beside the run, and per set-point or point of a list of the trial that
has most of them: the force they make, behind the lags, bytes."""


@dataclass(frozen=True, kw_only=True)
class Computing:
    """What one scene costs this computer.

    Attributes:
        time: processor time by part, s.
        memory: largest, bytes.
    """

    time: dict[str, float]
    memory: float

    @property
    def seconds(self) -> float:
        """Processor time of the whole run with its report, s."""
        return sum(self.time.values())


@dataclass(frozen=True)
class Saving:
    """What leaving something out saves.

    Attributes:
        what: is left out.
        how: the key that does it.
        disk: compressed, bytes.
        seconds: processor time, s.
    """

    what: str
    how: str
    disk: float
    seconds: float


@cache
def slowness() -> float:
    """How many times longer this computer takes than the reference; some 40 ms.

    The median of some rounds: for a moment a processor is faster than for a run.
    """
    took = []
    for _ in range(ROUNDS):
        began = time.thread_time()
        total = 0
        for i in range(10_000):
            total += i * i
        took.append(time.thread_time() - began)
    return float(np.median(took)) / REFERENCE


def computing(
    scene: Scene, needed: Needs, drive: Timeline, spikes: int, cost: Cost
) -> Computing:
    """What running `scene` on the simulated bench costs; a real bench costs no more.

    Args:
        scene: with what it compares.
        needed: channels and what is stored of them.
        drive: its trials.
        spikes: expected to count.
        cost: samples, and the time between two set-points of the coil.
    """
    slow = slowness()
    millions = cost.samples_per_channel / 1e6
    points = [set_points(step, cost.update_interval) for step in drive.steps]
    listed = sum(step.listed for step in drive.steps)
    told = {
        "start and report": (
            START + (FITTED if spikes else 0.0) + PER_TRIAL * len(drive.steps)
        ),
        "streaming": PER_CHANNEL_SECOND * len(needed.channels) * drive.streamed,
        "coil source": (
            DRIVEN * needed.coil * drive.streamed + SET * (sum(points) - listed)
        ),
        "source meters": PER_HELD_SECOND * drive.duration * len(needed.voltages),
        "stored lanes": LANE * len(needed.stored),
        "storing": STORED * millions * len(needed.stored),
    }
    if needed.detect_on is not None:
        told["detection"] = DETECTED * millions
    memory = BASE + MEMORY_CHANNEL * len(needed.channels)
    memory += MEMORY_MILLION * millions * len(needed.channels)
    if compared(scene, needed):
        told["model beside the run"] = (
            COMPARED
            + COMPARED_TRIAL * len(drive.steps)
            + COMPARED_POINT * sum(points)
            + COMPARED_SPIKE * spikes
        )
        if "V_C1" in needed.stored:
            told["residual of V_C1"] = RESIDUAL + RESIDUAL_TRIAL * len(drive.steps)
        memory += MEMORY_COMPARED + MEMORY_POINT * max(points, default=0.0)
        if not scene.circuit.saturation and _surprises(scene):
            told["search for a cause"] = SEARCHED + SEARCHED_SPIKE * spikes
    time_ = {part: slow * seconds for part, seconds in told.items() if seconds}
    return Computing(time=time_, memory=memory)


def _surprises(scene: Scene) -> bool:
    """Whether a simulated bench is other than the model beside it believes."""
    world = scene.simulated
    other = world.specimen, world.hysteresis, world.attraction, world.warming
    return scene.bench.simulated and (any(other) or world.deviation != Deviation())


def set_points(step: Step, interval: float | None) -> float:
    """Points of a list, or set-points while the current changes: each moves the force.

    Args:
        step: a trial of a run.
        interval: between two set-points, s; None without a coil.
    """
    if step.listed:
        return step.listed
    if step.current is None or not interval:
        return 0.0
    moving = np.diff(step.current.value) != 0
    return float(np.diff(step.current.time)[moving].sum()) / interval


def savings(
    scene: Scene, needed: Needs, cost: Computing, packed: Mapping[str, float]
) -> Iterator[Saving]:
    """What each thing saves that the scene could leave out and still run.

    Args:
        scene: planned.
        needed: what is opened and stored.
        cost: of the whole.
        packed: bytes of each stored channel, compressed.
    """
    number = len(needed.stored)
    stored = cost.time.get("storing", 0.0) + cost.time.get("stored lanes", 0.0)
    stored /= max(number, 1)
    streamed = cost.time.get("streaming", 0.0) / max(len(needed.channels), 1)
    wired = {channel.signal for channel in needed.channels}
    for signal in needed.stored if number > 1 else ():
        names = [signal] if signal in scene.record.signals else []
        if signal == "V_C1" and "I_DS" in scene.record.signals and "I_DS" not in wired:
            names.append("I_DS")
        what = " and ".join(names)
        how = "without {} in record.signals".format(
            " and ".join(f'"{n}"' for n in names)
        )
        left_out = signal != needed.detect_on  # else it is streamed all the same
        seconds = stored + left_out * streamed
        if signal == "V_C1":
            seconds += cost.time.get("residual of V_C1", 0.0)
        yield Saving(what, how, packed[signal], seconds)
    beside = cost.time.get("model beside the run")
    if beside is not None:
        beside += cost.time.get("residual of V_C1", 0.0)
        beside += cost.time.get("search for a cause", 0.0)
        yield Saving("model beside the run", "record.compare = false", 0.0, beside)
