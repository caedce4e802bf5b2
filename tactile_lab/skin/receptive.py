"""The receptive field of a taxel: what it answers where the load lies beside it."""

from __future__ import annotations

import numpy as np

from tactile_lab.arrays import FloatArray
from tactile_lab.model.batch import records
from tactile_lab.plot import Mark, Panel, Plot, Series
from tactile_lab.skin.blocks import solved
from tactile_lab.skin.events import Events
from tactile_lab.skin.forces import Loads
from tactile_lab.skin.skin import Skin

PLACES = 81
"""At which the load is put along each axis."""
REACH = 6.0
"""To either side at least so many depths, and half the array."""


def receptive_field(
    skin: Skin, taxel: int, axis: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """One taxel's answer with all stimuli moved along an axis, all else as it is.

    Args:
        skin: with stimuli; forces from files do not move and are left aside.
        taxel: the one that answers, with its own circuit.
        axis: 0: x, 1: y.

    Returns:
        By how much the stimuli are moved, m, ascending; spikes; largest force, N; each
        of shape (PLACES,).

    Raises:
        ParameterError: there is no such taxel.
    """
    array = skin.array
    reach = max(REACH * array.depth, float(np.ptp(array.places, axis=0).max()) / 2)
    moved = np.linspace(-reach, reach, PLACES)
    places = np.repeat(array.places[[taxel]], PLACES, axis=0)
    places[:, axis] -= moved
    loads = Loads(skin)
    many = np.repeat(records(skin.circuit_of(taxel), {}), PLACES)
    framed = np.zeros((PLACES, loads.time.size))
    role = np.zeros(PLACES, np.uint8)
    unknown = np.full(PLACES, np.inf)
    count, _, force, _, _ = solved(skin, loads, many, places, framed, role, unknown)
    return moved, count.astype(float), force


def receptive_plot(skin: Skin, events: Events) -> Plot | None:
    """Of the taxel that fires most of those that are not stuck; None if none fires."""
    counts = np.where(skin.array.named(skin.array.stuck), -1, events.count)
    taxel = int(counts.argmax())
    if not skin.stimuli or counts[taxel] < 1:
        return None
    fields = [receptive_field(skin, taxel, axis) for axis in (0, 1)]
    looks: tuple[tuple[str, str, Mark], ...] = (
        ("along x", "rate", "line"),
        ("along y", "V_C2", "dashed"),
    )

    def lines(column: int) -> tuple[Series, ...]:
        return tuple(
            Series(x=field[0], y=field[column], name=name, colour=colour, mark=mark)
            for field, (name, colour, mark) in zip(fields, looks, strict=True)
        )

    return Plot(
        name="receptive",
        caption=f"Receptive field of taxel {taxel}, which fired most: its spikes, and "
        "the largest force on it, with all stimuli moved by so much along x or y and "
        f"all else as it was; computed at {PLACES} places of each, as exact as the "
        "array.",
        title="Receptive field",
        x_label="Stimuli moved by",
        x_unit="m",
        panels=(
            Panel(label="Spikes", series=lines(1), limits=(0.0, None)),
            Panel(label="Largest force", unit="N", series=lines(2)),
        ),
        letters=True,
    )
