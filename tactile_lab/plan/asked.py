"""The root of the closure: what a scene and its protocol ask for."""

from __future__ import annotations

from tactile_lab.scene.scene import Scene


def asked_signals(scene: Scene) -> frozenset[str]:
    """What the scene records and what its protocol looks at."""
    return frozenset(scene.record.signals) | frozenset(scene.protocol.needs)
