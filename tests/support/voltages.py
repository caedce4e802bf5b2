"""Functions of time at the inputs of a simulated scope, for tests without a plant."""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from sim_backend.plant.scope_source import Acquisition, Codes, Input

Voltage = Callable[[NDArray[np.float64]], NDArray[np.float64]]


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
