"""What the lanes are: names, units, decimals, heights."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

BAND = 0.05
"""Residual, V, up to which the model is in step with the run."""


@dataclass(frozen=True)
class Lane:
    """One lane.

    Attributes:
        key: unique name: of the signal it shows, or "residual".
        title: rich text.
        plain: the title for screen readers and files.
        unit: shown beside the value.
        scale: shown value per SI value.
        places: decimals of the live value.
        weight: share of the height.
        least: smallest value range shown, in shown units.
        averaged: draw the mean of each column over a tint of its extremes, so that
            codes and noise do not drown a slow signal; else draw the extremes.
        zero: the range has 0 in it.
        symmetric: 0 is in the middle, with a band around it.
        raster: bars at times, without values.
    """

    key: str
    title: str
    plain: str
    unit: str
    scale: float = 1.0
    places: int = 3
    weight: float = 1.0
    least: float = 0.02
    averaged: bool = False
    zero: bool = False
    symmetric: bool = False
    raster: bool = False

    @property
    def name(self) -> str:
        """The title as plain text, for menus."""
        return self.title.replace("<sub>", "_").replace("</sub>", "")

    @property
    def valued(self) -> bool:
        """Whether one value stands for it: on its card in large, and at its edge."""
        return not (self.raster or self.symmetric)


_LANES = (
    Lane("force", "Force", "Force", "mN", 1e3, 1, 0.95, 10.0, zero=True),
    Lane("V_C1", "V<sub>C1</sub>", "V_C1", "V", 1.0, 3, 1.25, 0.1, averaged=True),
    Lane(
        "residual",
        "Residual",
        "Measured V_C1 less the model's",
        "mV",
        1e3,
        0,
        0.62,
        100.0,
        symmetric=True,
    ),
    Lane("V_C2", "V<sub>C2</sub>", "V_C2", "V", 1.0, 3, 1.15, 0.2, averaged=True),
    Lane("V_K", "V<sub>K</sub>", "V_K", "V", 1.0, 2, 0.95, 0.5, averaged=True),
    Lane("I_DS", "I<sub>DS</sub>", "I_DS", "nA", 1e9, 2, 0.9, 1.0, averaged=True),
    Lane(
        "coil_current",
        "Coil current",
        "Coil current",
        "mA",
        1e3,
        0,
        0.8,
        50.0,
        averaged=True,
    ),
    Lane("field", "Field", "Field", "mT", 1e3, 2, 0.7, 1.0),
    Lane("temperature", "Temperature", "Temperature", "K", 1.0, 2, 0.7, 0.1),
    Lane("spikes", "Spikes", "Spikes", "", 1.0, 0, 0.66, raster=True),
    Lane("rate", "Rate", "Rate", "Hz", 1.0, 2, 1.0, 2.0, zero=True),
)


def lanes_for(signals: Iterable[str], *, twin: bool = True) -> tuple[Lane, ...]:
    """The lanes of a scene that records `signals`; what it leaves out has none.

    The rate's lane comes with the spikes, the residual's with a twin of V_C1.
    """
    wanted = set(signals)
    if "spikes" in wanted:
        wanted.add("rate")
    if twin and "V_C1" in wanted:
        wanted.add("residual")
    return tuple(lane for lane in _LANES if lane.key in wanted)


def title_of(signal: str) -> str:
    """A signal's name as its lane has it, rich text; what has no lane is as it is."""
    return next((lane.title for lane in _LANES if lane.key == signal), signal)
