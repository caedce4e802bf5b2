"""A plan as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from tactile_lab.notebook import facts
from tactile_lab.planning.plan import Plan
from tactile_lab.quantity import count, show
from tactile_lab.signals import SIGNALS


def text(plan: Plan) -> str:
    """All of `plan` but its warnings."""
    lines = [title(plan)]
    for heading, rows in sections(plan):
        width = min(max(len(what) for what, _ in rows), 24)
        lines += ["", heading]
        lines += [f"  {what:<{width}}  {why}".rstrip() for what, why in rows]
    return "\n".join(lines)


def html(plan: Plan) -> str:
    """The same, and its warnings, for a notebook."""
    parts = [facts(heading, rows) for heading, rows in sections(plan)]
    if plan.warnings:
        parts.append(facts("warnings", [(line, "") for line in plan.warnings]))
    return facts(title(plan), ()) + "".join(parts)


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
        (
            "resolution, one code",
            [(name, show(value, SIGNALS[name].unit)) for name, value in steps],
        ),
        ("rests on", [(line, "") for line in plan.assumptions]),
    ]
    return [(heading, rows) for heading, rows in found if rows]


def _costs(plan: Plan) -> Iterator[tuple[str, str]]:
    cost = plan.estimate
    pauses = cost.duration - cost.streamed
    paused = f", {_time(pauses)} of it pauses" if pauses > 0 else ""
    yield "duration", f"{_time(cost.duration)}, {count(cost.trials, 'trial')}{paused}"
    channels = len(plan.needs.channels)
    yield (
        "samples",
        f"{cost.samples_per_channel:,} on {count(channels, 'channel')} at "
        f"{show(plan.scene.record.sample_rate, 'S/s')}; {cost.samples_stored:,} stored",
    )
    yield "disk", f"{_bytes(cost.disk)} compressed, {_bytes(cost.disk_raw)} raw"
    yield (
        "coil",
        f"peak {show(cost.peak_current, 'A')} for {show(cost.peak_force, 'N')}, heat "
        f"{cost.heat:.2g} of {cost.heat_budget:g} A² s",
    )
    if cost.update_interval is not None:
        yield (
            "set-points",
            f"{1 / cost.update_interval:.3g} a second (one each "
            f"{show(cost.update_interval, 's', 3)}), steps up to "
            f"{show(cost.step_current, 'A', 3)} or {show(cost.step_force, 'N', 3)}",
        )
    if plan.preview is not None and plan.preview.spike_times is not None:
        yield "spikes", f"{plan.preview.spike_times.size} by the model"


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


def _bytes(count: float) -> str:
    units = iter(("B", "kB", "MB", "GB", "TB", "PB"))
    unit = next(units)
    while count >= 999.5 and (larger := next(units, None)) is not None:
        count, unit = count / 1000, larger
    return f"{count:.3g} {unit}"
