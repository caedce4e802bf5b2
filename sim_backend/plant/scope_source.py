"""What a simulated scope samples: the seam between scope electronics and plant."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Codes = NDArray[np.int16]


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
