"""A plan as text for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from tactile_lab.planning.plan import Plan
from tactile_lab.quantity import show
from tactile_lab.signals import SIGNALS


def text(plan: Plan) -> str:
    """All of `plan` but its warnings."""
    return "\n".join(_lines(plan))


def _lines(plan: Plan) -> Iterator[str]:
    scene, cost = plan.scene, plan.estimate
    kind = "simulated" if scene.bench.simulated else "REAL INSTRUMENTS"
    yield f"{scene.name}: {scene.protocol.title} on {scene.bench.name} ({kind})"
    yield ""
    yield "needs"
    yield from _table(plan.uses)
    yield "leaves out"
    yield from _grouped(plan.leaves_out)
    yield "takes"
    yield from _table(_costs(plan))
    yield "resolution, one code"
    yield from _table(
        (name, show(value, SIGNALS[name].unit))
        for name, value in cost.resolution.items()
    )
    yield "rests on"
    for line in plan.assumptions:
        yield f"  {line}"


def _costs(plan: Plan) -> Iterator[tuple[str, str]]:
    cost = plan.estimate
    pauses = cost.duration - cost.streamed
    paused = f", {_time(pauses)} of it pauses" if pauses > 0 else ""
    yield "duration", f"{_time(cost.duration)}, {_count(cost.trials, 'trial')}{paused}"
    channels = len(plan.needs.channels)
    yield (
        "samples",
        f"{cost.samples_per_channel:,} on {_count(channels, 'channel')} at "
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


def _table(rows: Iterable[tuple[str, str]]) -> Iterator[str]:
    rows = list(rows)
    width = min(max((len(what) for what, _ in rows), default=0), 24)
    for what, why in rows:
        yield f"  {what:<{width}}  {why}"
    yield ""


def _grouped(rows: Iterable[tuple[str, str]]) -> Iterator[str]:
    """What shares a reason on one line."""
    found: dict[str, list[str]] = {}
    for what, why in rows:
        found.setdefault(why, []).append(what)
    for why, names in found.items():
        yield f"  {', '.join(names)} ({why})"
    yield ""


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


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
