"""What the lanes are: names, units, decimals, heights."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum


class Kind(Enum):
    """How a lane is drawn."""

    TRACE = "trace"
    FORCE = "force"
    RESIDUAL = "residual"
    RASTER = "raster"
    RATE = "rate"


@dataclass(frozen=True)
class Lane:
    """One lane.

    Attributes:
        key: unique name.
        kind: how it is drawn.
        signal: what it shows.
        title: rich text.
        plain: the title for screen readers and files.
        unit: shown beside the value.
        scale: shown value per SI value.
        places: decimals of the live value.
        weight: share of the height.
        least: smallest value range shown, in shown units.
        averaged: draw the mean of each column over a tint of its extremes, so that
            codes and noise do not drown a slow signal; else draw the extremes.
    """

    key: str
    kind: Kind
    signal: str
    title: str
    plain: str
    unit: str
    scale: float = 1.0
    places: int = 3
    weight: float = 1.0
    least: float = 0.02
    averaged: bool = False


_LANES = (
    Lane("force", Kind.FORCE, "force", "Force", "Force", "mN", 1e3, 1, 0.95, 10.0),
    Lane(
        "V_C1", Kind.TRACE, "V_C1", "V<sub>C1</sub>", "V_C1", "V", 1.0, 3, 1.25, 0.1,
        averaged=True,
    ),
    Lane(
        "residual", Kind.RESIDUAL, "V_C1", "Residual", "Measured V_C1 less the model's",
        "mV", 1e3, 0, 0.62, 100.0,
    ),
    Lane(
        "V_C2", Kind.TRACE, "V_C2", "V<sub>C2</sub>", "V_C2", "V", 1.0, 3, 1.15, 0.2,
        averaged=True,
    ),
    Lane(
        "V_K", Kind.TRACE, "V_K", "V<sub>K</sub>", "V_K", "V", 1.0, 2, 0.95, 0.5,
        averaged=True,
    ),
    Lane(
        "I_DS", Kind.TRACE, "I_DS", "I<sub>DS</sub>", "I_DS", "nA", 1e9, 2, 0.9, 1.0,
        averaged=True,
    ),
    Lane(
        "coil_current", Kind.TRACE, "coil_current", "Coil current", "Coil current",
        "mA", 1e3, 0, 0.8, 50.0, averaged=True,
    ),
    Lane("field", Kind.TRACE, "field", "Field", "Field", "mT", 1e3, 2, 0.7, 1.0),
    Lane("spikes", Kind.RASTER, "spikes", "Spikes", "Spikes", "", 1.0, 0, 0.66),
    Lane("rate", Kind.RATE, "rate", "Rate", "Rate", "Hz", 1.0, 2, 1.0, 2.0),
)  # fmt: skip


def lanes_for(signals: Iterable[str], *, twin: bool = True) -> tuple[Lane, ...]:
    """The lanes of a scene that records `signals`; what it leaves out has none.

    The rate's lane comes with the spikes, the residual's with a twin of V_C1.
    """
    wanted = set(signals)
    if "spikes" in wanted:
        wanted.add("rate")
    chosen = []
    for lane in _LANES:
        if lane.kind is Kind.RESIDUAL:
            if twin and "V_C1" in wanted:
                chosen.append(lane)
        elif lane.signal in wanted:
            chosen.append(lane)
    return tuple(chosen)


def title_of(signal: str) -> str:
    """A signal's name as its lane has it, rich text."""
    return next(lane.title for lane in _LANES if lane.key == signal)
