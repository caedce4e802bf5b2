"""The root of the closure: what a scene and its protocol ask for."""

from __future__ import annotations

from tactile_lab.scene.scene import Scene


def asked_signals(scene: Scene) -> frozenset[str]:
    """What the scene records and what its protocol looks at."""
    wished = {name for name in scene.protocol.wishes() if scene.bench.measures(name)}
    return frozenset(scene.record.signals) | frozenset(scene.protocol.needs) | wished
