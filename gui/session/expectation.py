"""What is expected of a scene, as the window gets it: light to load."""

from __future__ import annotations

from dataclasses import dataclass

from gui.lanes.expected import Preview
from tactile_lab.planning.estimate import Estimate
from tactile_lab.planning.needs import Needs
from tactile_lab.scene.tables import Record


@dataclass(frozen=True, eq=False)
class Expectation:
    """A scene that can be run, and what it will do.

    Attributes:
        record: what is asked for.
        needs: what it opens and keeps.
        estimate: its cost.
        preview: what the model expects.
        warnings: where the bench cannot deliver what is asked.
        leaves_out: (what, why).
        assumptions: what the numbers rest on.
    """

    record: Record
    needs: Needs
    estimate: Estimate
    preview: Preview
    warnings: tuple[str, ...]
    leaves_out: tuple[tuple[str, str], ...]
    assumptions: tuple[str, ...]
