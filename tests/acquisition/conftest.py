"""Whole short runs."""

from short_runs import run_scene, short

__all__ = ["run_scene", "short"]
