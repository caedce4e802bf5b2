"""What a simulated scope samples: the seam between scope electronics and plant."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int16]
Voltage = Callable[[NDArray[np.float64]], NDArray[np.float64]]


@dataclass(frozen=True)
class Input:
    """One enabled input as it is set.

    Attributes:
        name: "A", "B", ...
        range: full scale, V.
        offset: analogue offset added before digitising, V.
        coupling: "DC" or "AC".
    """

    name: str
    range: float
    offset: float = 0.0
    coupling: str = "DC"


@dataclass(frozen=True)
class Acquisition:
    """One acquisition of the scope; sample k is taken at ``started + k * interval``.

    Attributes:
        inputs: enabled inputs, the rows of the codes.
        interval: s.
        started: clock time of sample 0, s.
        full_scale: code at the end of the range.
        shift: low bits of every code that are always 0.
    """

    inputs: tuple[Input, ...]
    interval: float
    started: float
    full_scale: int
    shift: int


class SampleSource(Protocol):
    """Digitises what lies at the scope's inputs."""

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        """Samples `first` to ``first + samples`` of all inputs.

        A stream asks for each sample at most once, in order; after a starvation it
        skips some.

        Returns:
            Codes of shape (inputs, samples), saturated at the full scale, and one
            over-range flag per input.
        """
        ...


class Voltages:
    """A source that digitises functions of time without noise.

    Args:
        voltage: V at the input against s on the clock, by input name; others read 0 V.
    """

    def __init__(self, voltage: Mapping[str, Voltage]) -> None:
        self._voltage = dict(voltage)

    def render(
        self, acquisition: Acquisition, first: int, samples: int
    ) -> tuple[Codes, tuple[bool, ...]]:
        """Codes and over-range flags of the functions."""
        count = np.arange(first, first + samples, dtype=np.float64)
        time = acquisition.started + count * acquisition.interval
        codes = np.zeros((len(acquisition.inputs), samples), dtype=np.int16)
        over = []
        for row, setting in enumerate(acquisition.inputs):
            voltage = self._voltage.get(setting.name)
            volts = np.zeros(samples) if voltage is None else voltage(time)
            codes[row], left = digitise(volts, setting, acquisition)
            over.append(left)
        return codes, tuple(over)


def digitise(
    volts: NDArray[np.float64], setting: Input, acquisition: Acquisition
) -> tuple[Codes, bool]:
    """Codes of `volts` and whether the input left its range."""
    step = 1 << acquisition.shift
    steps = acquisition.full_scale // step
    level = np.rint((volts + setting.offset) / setting.range * steps)
    inside = np.clip(level, -steps, steps)
    return (inside * step).astype(np.int16), bool(np.any(level != inside))
