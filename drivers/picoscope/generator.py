"""The arbitrary waveform generator of a PicoScope 3000D: a voltage by its own clock.

It steps through its memory by a phase that grows with each tick of its converter's
clock, so the time of a sample is a whole part of the slowest. A waveform waits for the
software's trigger, is played once, and rests on its ends, which are 0 V.
"""

from __future__ import annotations

import ctypes

import numpy as np

from drivers.picoscope.unit import ScopeUnit
from tactile_lab.arrays import FloatArray
from tactile_lab.errors import LimitError
from tactile_lab.generator import GeneratorCapability
from tactile_lab.quantity import show

CAPABILITY = GeneratorCapability(
    amplitude=2.0,
    step=1e-3,  # 12 bits
    samples=1 << 15,
    slowest=2.0**17 / 20e6,  # a phase of 32 bits for 2^15 samples, at 20 MHz
    load=0.05,
)
"""As the data sheet has it; `load` asks the unit itself."""

LARGEST_CODE = 32767
DC_VOLTAGE = 8
"""PS3000A_WAVE_TYPE."""
RISING, NO_TRIGGER, SOFTWARE = 0, 0, 4
"""PS3000A_SIGGEN_TRIG_TYPE and two of PS3000A_SIGGEN_TRIG_SOURCE."""
KNOWN = 1000.0
"""Repetitions a second for which the unit is asked its phase, Hz."""
SAME = 1e-4
"""Relative difference of a sample's time that counts as none."""


class PicoGenerator:
    """The generator of one opened unit.

    Args:
        unit: whose; its thread alone may use this.
    """

    def __init__(self, unit: ScopeUnit) -> None:
        self._unit = unit

    @property
    def step(self) -> float:
        """Step of its converter, V."""
        return CAPABILITY.step

    def hold(self, volts: float) -> None:
        """Give `volts` V from now on; no stream may run.

        Raises:
            LimitError: beyond the generator's range.
            TactileLabError: any status but OK.
        """
        _check(np.array([volts]))
        self._unit.do(
            f"Setting the generator to {show(volts, 'V')}", "ps3000aSetSigGenBuiltIn",
            round(volts * 1e6), 0, DC_VOLTAGE, 0.0, 0.0, 0.0, 0.0, 0, 0, 0, 0, RISING,
            NO_TRIGGER, 0,
        )  # fmt: skip

    def load(self, volts: FloatArray, each: float) -> None:
        """Take a waveform, to be played once; no stream may run.

        Args:
            volts: shape (n,), V; begins and ends at 0 V.
            each: time of one sample, s.

        Raises:
            LimitError: too many samples, too large, or of a time that this unit cannot
                keep.
            TactileLabError: any status but OK.
        """
        _check(volts)
        if volts[0] != 0 or volts[-1] != 0:
            raise LimitError("A waveform of the generator must begin and end at 0 V.")
        phase = self._phase(volts.size, each)
        peak = max(float(np.abs(volts).max()), 1e-3)
        codes = np.round(volts / peak * LARGEST_CODE).astype(np.int16)
        self._unit.do(
            f"Loading the generator with {volts.size} samples",
            "ps3000aSetSigGenArbitrary",
            0, round(2e6 * peak), phase, phase, 0, 0,
            codes.ctypes.data_as(ctypes.POINTER(ctypes.c_int16)), codes.size,
            0, 0, 0, 1, 0, RISING, SOFTWARE, 0,
        )  # fmt: skip

    def start(self) -> None:
        """Play the waveform loaded last once, from now on; a stream may run.

        Raises:
            TactileLabError: any status but OK.
        """
        self._unit.do("Starting the generator", "ps3000aSigGenSoftwareControl", 1)

    def _phase(self, samples: int, each: float) -> int:
        """Growth of the phase for samples of `each` s.

        Raises:
            LimitError: too many samples, or a time that this unit cannot keep.
        """
        low, high = ctypes.c_int16(), ctypes.c_int16()
        least, most = ctypes.c_uint32(), ctypes.c_uint32()
        self._unit.do(
            "Asking for the generator's memory", "ps3000aSigGenArbitraryMinMaxValues",
            ctypes.byref(low), ctypes.byref(high), ctypes.byref(least),
            ctypes.byref(most),
        )  # fmt: skip
        if not least.value <= samples <= most.value:
            raise LimitError(
                f"A waveform of {samples} samples does not fit this scope's generator, "
                f"which takes {least.value} to {most.value}; an A model has none. "
                "Leave [coil.generator] out of the bench file."
            )
        known = ctypes.c_uint32()
        self._unit.do(
            "Asking for the generator's clock", "ps3000aSigGenFrequencyToPhase",
            KNOWN, 0, most.value, ctypes.byref(known),
        )  # fmt: skip
        slowest = known.value / (KNOWN * most.value)
        phase = max(1, round(slowest / each))
        if abs(slowest / phase - each) > SAME * each:
            raise LimitError(
                f"This scope's generator keeps samples of {show(slowest, 's', 5)} and "
                f"whole parts of that; {show(each, 's', 5)} is none."
            )
        return phase


def _check(volts: FloatArray) -> None:
    most = CAPABILITY.amplitude
    if not np.all(np.abs(volts) <= most * (1 + 1e-9)):
        raise LimitError(
            f"The generator gives up to {show(most, 'V')}, less than the "
            f"{show(float(np.abs(volts).max()), 'V')} asked for."
        )
