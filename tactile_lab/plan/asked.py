"""The root of the closure: what a scene and its protocol ask for."""

from __future__ import annotations

from tactile_lab.scene.scene import Scene


def asked_signals(scene: Scene) -> frozenset[str]:
    """What the scene records and what its protocol looks at."""
    wished = {name for name in scene.protocol.wishes() if _at_hand(scene, name)}
    return frozenset(scene.record.signals) | frozenset(scene.protocol.needs) | wished


def _at_hand(scene: Scene, signal: str) -> bool:
    """Whether the bench measures that signal without being asked twice."""
    bench = scene.bench
    wired = bench.scope is not None and signal in {
        channel.signal for channel in bench.scope.channels
    }
    meter = bench.field_meter
    by_itself = meter is not None and meter.driver != "manual"
    return wired or (signal == "field" and by_itself)
