"""One input of the simulated scope: probe, range, offset, noise, hum and steps."""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass

from numpy import int16
from numpy.typing import NDArray

from sim_backend.plant.options import PlantOptions
from sim_backend.plant.pieces import Pieces
from tactile_lab.arrays import FloatArray
from tactile_lab.follower import Pulse
from tactile_lab.scope import Channel

BUFFERED = ("V_C1", "V_C2", "V_K")
"""Nodes of the circuit that are measured through a voltage follower."""
PLACED = ("none", "ground", "supply")
"""What a probe touches that is at no node: nothing, 0 V, V_S."""


@dataclass(frozen=True, kw_only=True)
class ScopeInput:
    """What one enabled input does to the signal at it, in converter steps.

    Attributes:
        signal: what really lies at the input.
        gain: steps per unit of the signal.
        level: steps at 0 of the signal.
        noise: standard deviation, steps.
        hum: amplitude, steps.
        mains: frequency of the hum, Hz.
        key: selects the sequence of noise.
        limit: largest step.
        shift: low bits of a code that are 0.
    """

    signal: str
    gain: float
    level: float
    noise: float
    hum: float
    mains: float
    key: int
    limit: int
    shift: int

    def digitise(
        self,
        codes: NDArray[int16],
        first: int,
        started: float,
        interval: float,
        noise: NDArray[int16],
        pieces: Pieces,
        pulses: tuple[Pulse, FloatArray] | None = None,
    ) -> bool:
        """Fill `codes` with samples `first`, `first` + 1, ...

        Args:
            codes: written.
            first: sample `first` is taken at ``started + first * interval``, s.
            started: s.
            interval: s.
            noise: table of `noise_table`.
            pieces: the signal, its unit.
            pulses: fast transients on top and when each begins, s.

        Returns:
            Whether the input left its range.
        """
        # compiled code, loaded where a scope samples
        from sim_backend.plant.render import NOISE_UNIT, add_pulses, digitise

        value, slope = pieces.value * self.gain + self.level, pieces.slope * self.gain
        # the kernels add two entries of the table
        unit = self.noise / (NOISE_UNIT * math.sqrt(2))
        common = (
            first, started, interval, pieces.start, value, slope, noise, self.key, unit,
            self.hum, self.mains, self.limit, self.shift,
        )  # fmt: skip
        highest = digitise(codes, *common)
        if pulses is not None and pulses[1].size:
            pulse, begins = pulses
            steps = pulse.value * self.gain
            pulsed = add_pulses(codes, *common, begins, steps, pulse.step)
            highest = max(highest, pulsed)
        return bool(highest > self.limit)


def scope_inputs(
    channels: Sequence[Channel],
    options: PlantOptions,
    seed: int,
    started: float,
    full_scale: int,
    shift: int,
) -> list[ScopeInput]:
    """The inputs as they really are, wiring faults included.

    Args:
        channels: what the bench file says lies where.
        options: noise, hum, offsets and faults.
        seed: of the noise.
        started: begin of the acquisition, s; each has noise of its own.
        full_scale: code at the end of the range.
        shift: low bits of a code that are 0.
    """
    scales = {channel.signal: channel.scale for channel in channels}
    inputs = []
    for channel in channels:
        loose = channel.input in options.open_inputs
        signal = channel.signal
        if signal not in PLACED:
            signal = options.wired.get(channel.input, signal)
        scale = channel.scale
        if loose:
            signal = "none"
        elif signal != channel.signal:
            # the other signal's shunt or gain comes with it
            scale = scales.get(signal, 1.0)
        scale *= options.attenuation.get(channel.input, 1.0)
        limit = full_scale >> shift
        steps = limit / channel.range
        # a coupling capacitor holds a follower's offset back
        buffered = signal in BUFFERED and channel.coupling == "DC"
        offset = options.offset if buffered else 0.0
        inputs.append(
            ScopeInput(
                signal=signal,
                gain=steps / scale,
                level=(offset / scale + channel.offset + channel.zero) * steps,
                noise=options.noise_at(signal) * steps,
                hum=(options.pickup if loose else options.hum) * steps,
                mains=options.mains,
                key=noise_key(seed, channel.input, started),
                limit=limit,
                shift=shift,
            )
        )
    return inputs


def noise_key(seed: int, name: str, started: float) -> int:
    """Which noise input `name` gets in the acquisition that began at `started` s."""
    text = f"{seed}/{name}/".encode() + struct.pack("<d", started)
    return (zlib.crc32(text) << 31) | (zlib.crc32(text[::-1]) >> 1)
