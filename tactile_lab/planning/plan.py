"""The plan of a scene: all that can be said of a run before anything is opened."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from tactile_lab.analysis.carried_over import Begun, carried_over
from tactile_lab.planning.calibrated import check_calibration
from tactile_lab.planning.computing import Computing, Saving, computing, savings
from tactile_lab.planning.estimate import Cost, estimate
from tactile_lab.planning.needs import Needs, needs
from tactile_lab.planning.ranges import beyond
from tactile_lab.planning.reasons import Reasons, leaves_out, uses
from tactile_lab.planning.timeline import Timeline, timeline
from tactile_lab.planning.warn import assumptions, cheaper, misses_spikes, warnings
from tactile_lab.planning.ways import WayInstead, WayUsed, ways_instead, ways_used
from tactile_lab.quantity import bytes_text, count, rounded, show
from tactile_lab.scene.scene import Scene
from tactile_lab.signals import BENCH_ONLY, SIGNALS

if TYPE_CHECKING:
    from tactile_lab.model.simulate import Result


BY_WAY = {
    "set-points": "by set-points",
    "list": "by lists",
    "generator": "by the generator",
}
"""What the plan calls trials played so."""


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Plan:
    """What a run of a scene takes, needs, leaves out, and where it falls short.

    Attributes:
        scene: what is planned.
        timeline: its trials, as the coil will play them.
        needs: what is opened, enabled and stored.
        uses, leaves_out: (what, why).
        estimate: time, samples, disk, current, heat, resolution.
        assumptions: what the numbers rest on.
        warnings: where the scene cannot deliver.
        preview: the model under the planned force, only what is recorded; None where
            it was not asked for, or the protocol sets voltages from trial to trial.
    """

    scene: Scene
    timeline: Timeline
    needs: Needs
    uses: Reasons
    leaves_out: Reasons
    estimate: Cost
    assumptions: tuple[str, ...]
    warnings: tuple[str, ...]
    preview: Result | None

    @property
    def ways(self) -> tuple[WayUsed, ...]:
        """By which ways the coil plays the trials, and how near the force comes."""
        magnet = self.scene.bench.magnet
        return ways_used(self.timeline.steps, magnet.lag_uncertainty)

    @cached_property
    def ways_instead(self) -> tuple[WayInstead, ...]:
        """What the other ways would make of the trial that set-points follow worst."""
        return ways_instead(self.scene, self.timeline.steps)

    @cached_property
    def spikes(self) -> int | None:
        """Of the model in what is streamed of trials; None without a preview of any."""
        times = None if self.preview is None else self.preview.spike_times
        return None if times is None else int(self.timeline.streams_at(times).sum())

    @cached_property
    def computing(self) -> Computing:
        """Processor time and memory the run takes on this computer."""
        spikes = self.timeline.spikes if self.spikes is None else self.spikes
        return computing(
            self.scene,
            self.needs,
            self.timeline,
            0 if misses_spikes(self.scene, self.needs) else spikes,
            self.estimate,
        )

    @cached_property
    def carried_over(self) -> str | None:
        """What is said of trials that do not begin from rest; None where all do."""
        drive = self.timeline
        levels = [
            Begun(step.trial.label, step.start, step.trial.level)
            for step in drive.steps
            if step.trial.level
        ]
        return carried_over(self.scene.circuit, drive.force, levels)

    @property
    def savings(self) -> tuple[Saving, ...]:
        """What each thing saves that could be left out."""
        told = savings(self.scene, self.needs, self.computing, self.estimate.packed)
        return tuple(told)

    @property
    def suggestions(self) -> tuple[str, ...]:
        """Cheaper settings that give the same answer, one line each."""
        return tuple(cheaper(self.scene, self.needs, self.estimate, self.computing))

    def __repr__(self) -> str:
        cost = self.estimate
        return (
            f"<Plan of {self.scene.name}: {show(cost.duration, 's')}, "
            f"{count(cost.trials, 'trial')}, {count(len(self.warnings), 'warning')}>"
        )

    def _repr_html_(self) -> str:
        """The same, and its warnings, for a notebook."""
        from tactile_lab.notebook import facts

        parts = [facts(heading, rows) for heading, rows in sections(self)]
        if self.warnings:
            parts.append(facts("warnings", [(line, "") for line in self.warnings]))
        return facts(title(self), ()) + "".join(parts)

    def to_dict(self) -> dict[str, Any]:
        """The documented JSON object (docs/json.md)."""
        cost, scene = self.estimate, self.scene
        return {
            "scene": scene.name,
            "protocol": scene.protocol.name,
            "bench": {"name": scene.bench.name, "simulated": scene.bench.simulated},
            "needs": [{"what": what, "why": why} for what, why in self.uses],
            "leaves_out": [{"what": what, "why": why} for what, why in self.leaves_out],
            "channels": [channel.signal for channel in self.needs.channels],
            "stored": list(self.needs.stored),
            "duration_s": cost.duration,
            "streamed_s": cost.streamed,
            "trials": cost.trials,
            "samples": {
                "per_channel": cost.samples_per_channel,
                "stored": cost.samples_stored,
            },
            "disk_bytes": {"raw": cost.disk_raw, "compressed": cost.disk},
            "computing": {
                "processor_s": self.computing.seconds,
                "parts_s": dict(self.computing.time),
                "memory_bytes": self.computing.memory,
            },
            "savings": [
                {
                    "without": saving.what,
                    "how": saving.how,
                    "disk_bytes": saving.disk,
                    "processor_s": saving.seconds,
                }
                for saving in self.savings
            ],
            "suggestions": list(self.suggestions),
            "peak_force_N": cost.peak_force,
            "peak_current_A": cost.peak_current,
            "heat_A2s": {"used": cost.heat, "budget": cost.heat_budget},
            "coil_update": self._coil_update(),
            "ways": [used.to_dict() for used in self.ways],
            "ways_instead": [one.to_dict() for one in self.ways_instead],
            "resolution": dict(cost.resolution),
            "carried_over": self.carried_over,
            "preview": self._preview(),
            "assumptions": list(self.assumptions),
            "warnings": list(self.warnings),
        }

    def _coil_update(self) -> dict[str, float] | None:
        cost = self.estimate
        if cost.update_interval is None:
            return None
        return {
            "interval_s": cost.update_interval,
            "rate_Hz": 1 / cost.update_interval,
            "step_A": cost.step_current,
            "step_N": cost.step_force,
        }

    def _preview(self) -> dict[str, Any] | None:
        if self.preview is None:
            return None
        return {
            "spikes": self.spikes,
            "stages": dict(self.preview.stages),
            "left_out": list(self.preview.left_out),
            "error": {
                "spike_time_s": self.preview.error.spike_time,
                "V_C1_V": self.preview.error.V_C1,
            },
        }


def plan(scene: Scene, *, preview: bool = True) -> Plan:
    """The plan of `scene`; opens nothing and writes nothing.

    Args:
        scene: what to plan.
        preview: also compute the model under the planned force, where anything
            recorded needs it.

    Raises:
        SceneError: the scene cannot be run on its bench.
        LimitError: a force, the coil's heat or the sample rate lies beyond a limit.
    """
    drive = timeline(scene, through_coil=True)
    needed = needs(scene, drive)
    told = (
        *check_calibration(scene, drive),
        *warnings(scene, needed, drive),
        *beyond(needed.channels, needed.expected),
    )
    result = _model(scene, drive) if preview else None
    if result is not None:
        told = (*told, *result.warnings)
    return Plan(
        scene=scene,
        timeline=drive,
        needs=needed,
        uses=uses(scene, needed),
        leaves_out=leaves_out(scene, needed, drive),
        estimate=estimate(scene, needed, drive),
        assumptions=assumptions(scene, needed, drive),
        warnings=told,
        preview=result,
    )


def _model(scene: Scene, drive: Timeline) -> Result | None:
    if scene.protocol.sets or set(scene.record.signals) <= BENCH_ONLY:
        return None
    from tactile_lab.planning.preview import model, modelled

    return model(scene, drive.force, drive.duration, modelled(scene))


def text(plan: Plan) -> str:
    """All of `plan` but its warnings."""
    lines = [title(plan)]
    for heading, rows in sections(plan):
        width = min(max(len(what) for what, _ in rows), 24)
        lines += ["", heading]
        lines += [f"  {what:<{width}}  {why}".rstrip() for what, why in rows]
    return "\n".join(lines)


def title(plan: Plan) -> str:
    """What runs on which bench."""
    scene = plan.scene
    kind = "simulated" if scene.bench.simulated else "REAL INSTRUMENTS"
    return f"{scene.name}: {scene.protocol.title} on {scene.bench.name} ({kind})"


def sections(plan: Plan) -> list[tuple[str, list[tuple[str, str]]]]:
    """Headings and the rows below each; none is empty."""
    steps = plan.estimate.resolution.items()
    found = [
        ("needs", list(plan.uses)),
        ("leaves out", _grouped(plan.leaves_out)),
        ("takes", list(_costs(plan))),
        ("would save", [(f"no {s.what}", _saved(s)) for s in plan.savings]),
        ("gives the same for less", [(line, "") for line in plan.suggestions]),
        (
            "resolution, one code",
            [(name, show(value, SIGNALS[name].unit)) for name, value in steps],
        ),
        ("rests on", [(line, "") for line in plan.assumptions]),
    ]
    return [(heading, rows) for heading, rows in found if rows]


def _costs(plan: Plan) -> Iterator[tuple[str, str]]:
    cost = plan.estimate
    loading = plan.timeline.loading
    pauses = cost.duration - cost.streamed - loading
    paused = f", {_time(pauses)} of it pauses" if pauses > 1e-9 else ""
    if loading > 1e-9:
        paused += f", {_time(loading)} to load waveforms"
    yield "duration", f"{_time(cost.duration)}, {count(cost.trials, 'trial')}{paused}"
    channels = len(plan.needs.channels)
    about = "" if plan.needs.gapless else "about "
    yield (
        "samples",
        f"{about}{cost.samples_per_channel:,} on {count(channels, 'channel')} at "
        f"{show(plan.scene.record.sample_rate, 'S/s')}; {cost.samples_stored:,} stored",
    )
    least, most = (bytes_text(float(f"{n:.2g}")) for n in cost.disk_beside)
    yield (
        "disk",
        f"{bytes_text(cost.disk)} of samples compressed, "
        f"{bytes_text(cost.disk_raw)} raw; tables, figures and report "
        f"take {least} to {most} besides",
    )
    parts = ", ".join(
        f"{part} {_rounded(seconds)}" for part, seconds in plan.computing.time.items()
    )
    yield (
        "computing",
        f"about {_rounded(plan.computing.seconds)} of processor time ({parts}) and "
        f"{bytes_text(float(f'{plan.computing.memory:.2g}'))} of memory, with report",
    )
    yield (
        "coil",
        f"peak {show(cost.peak_current, 'A')} for {show(cost.peak_force, 'N')}, heat "
        f"{rounded(cost.heat)} of {cost.heat_budget:g} A² s"
        + (f", cold {show(cost.cool_down, 's')} later" if cost.cool_down else ""),
    )
    ways = {used.way for used in plan.ways}
    by_points = not ways or "set-points" in ways
    if cost.update_interval is not None and by_points:
        yield (
            "set-points",
            f"{1 / cost.update_interval:.3g} a second (one each "
            f"{show(cost.update_interval, 's', 3)}), steps up to "
            f"{show(cost.step_current, 'A', 3)} or {show(cost.step_force, 'N', 3)}",
        )
    for used in plan.ways:
        yield BY_WAY[used.way], str(used)
    for one in plan.ways_instead:
        yield f"{BY_WAY[one.way]} instead", str(one)
    if plan.preview is not None and plan.preview.spike_times is not None:
        others = plan.preview.spike_times.size - (plan.spikes or 0)
        unseen = f", {others} more while nothing is streamed" if others else ""
        yield (
            "spikes",
            f"{plan.spikes} by the model from the first trial on{unseen}",
        )
    if carried := plan.carried_over:
        yield "carried over", carried
    if plan.preview is not None:
        error, spikes = plan.preview.error, plan.preview.spike_times
        known = [
            f"{what} within {show(value, unit, 2)}"
            for what, value, unit in (
                ("spike times", error.spike_time, "s"),
                ("V_C1", error.V_C1, "V"),
            )
            if value is not None
            and (unit != "s" or (spikes is not None and spikes.size))
        ]
        if known:
            yield "numerics", f"{', '.join(known)}, by the solver's own estimate"


def _saved(saving: Saving) -> str:
    disk = f"{bytes_text(saving.disk)} of disk and " if saving.disk else ""
    return f"{disk}{_rounded(saving.seconds)} of processor time: {saving.how}"


def _rounded(seconds: float) -> str:
    """A time that is not known better than to two digits."""
    return show(seconds, "s", 2) if seconds < 100 else f"{rounded(seconds / 60)} min"


def _grouped(rows: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """What shares a reason in one row."""
    found: dict[str, list[str]] = {}
    for what, why in rows:
        found.setdefault(why, []).append(what)
    return [(f"{', '.join(names)} ({why})", "") for why, names in found.items()]


def _time(seconds: float) -> str:
    if seconds < 120:
        return show(seconds, "s")
    if seconds < 7200:
        return f"{seconds / 60:.4g} min"
    return f"{seconds / 3600:.4g} h"
