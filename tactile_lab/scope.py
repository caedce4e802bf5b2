"""A scope as the rest of the program sees it: its inputs, its stream, its blocks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from tactile_lab.generator import GeneratorCapability
from tactile_lab.quantity import Unit
from tactile_lab.table import SceneTable

CLOCK_ERROR = 1e-4
"""Largest relative difference of the scope's sample clock and this computer's."""


@dataclass(frozen=True, kw_only=True)
class Channel(SceneTable):
    """One scope input and what is wired to it: an entry of ``[[scope.channels]]``.

    Attributes:
        signal: what it measures; such as `V_C1`, `V_K` or `coil_current`.
        input: the scope's name for the input, such as "A".
        range: full scale, V: the input takes -range to +range around -offset.
        offset: analogue offset added before digitising, V.
        coupling: "DC" or "AC".
        scale: signal unit per volt at the input: 10 for a 10:1 probe; what follows
            from `shunt`, `tesla_per_volt` or `kelvin_per_volt` where one is given.
        shunt: of coil_current: the shunt's resistance, Ohm.
        tesla_per_volt: of field: what the analogue output of a teslameter means, T/V.
        kelvin_per_volt: of temperature: what a sensor's output means, K/V.
        zero_at: of temperature: what 0 V means, K; 273.15 K where it is 0 °C.
        zero: what lies at the input where the signal is 0, V.
        auto_range: of V_C1 and V_C2: whether a run may take a wider range where the
            model expects more than this one sees.

    Raises:
        ValueError: keys contradict each other.
    """

    signal: str
    input: str
    range: Annotated[float, Unit("V", above=0.0)] = 5.0
    offset: Annotated[float, Unit("V")] = 0.0
    coupling: Literal["DC", "AC"] = "DC"
    scale: float = 1.0
    shunt: Annotated[float, Unit("Ohm", above=0.0)] | None = None
    tesla_per_volt: Annotated[float, Unit("T/V")] | None = None
    kelvin_per_volt: Annotated[float, Unit("K/V")] | None = None
    zero_at: Annotated[float, Unit("K", least=0.0)] | None = None
    zero: Annotated[float, Unit("V")] = 0.0
    auto_range: bool = False

    def __post_init__(self) -> None:
        for key, belongs_to, given, scale in (
            ("shunt", "coil_current", self.shunt, 1 / (self.shunt or 1.0)),
            ("tesla_per_volt", "field", self.tesla_per_volt, self.tesla_per_volt),
            (
                "kelvin_per_volt",
                "temperature",
                self.kelvin_per_volt,
                self.kelvin_per_volt,
            ),
        ):
            if not given or not scale:
                continue
            if self.signal != belongs_to:
                raise ValueError(f"{key} belongs to the signal {belongs_to}")
            if self.scale not in (1.0, scale):
                raise ValueError(f"give either {key} or scale, not both")
            object.__setattr__(self, "scale", scale)
        if self.zero_at is not None:
            zero = -self.zero_at / self.scale
            if self.signal != "temperature" or self.zero not in (0.0, zero):
                raise ValueError("zero_at belongs to temperature, instead of zero")
            object.__setattr__(self, "zero", zero)
        if self.scale == 0:
            raise ValueError("scale must not be 0")

    @property
    def span(self) -> tuple[float, float]:
        """Lowest and highest value the input can see, in the signal's unit."""
        ends = (
            (end - self.offset - self.zero) * self.scale
            for end in (-self.range, self.range)
        )
        low, high = sorted(ends)
        return low, high


@dataclass(frozen=True, kw_only=True)
class ScopeCapability:
    """What a scope can do.

    Attributes:
        gapless: streams without gaps (block-only scopes do not).
        inputs: names of its inputs.
        ranges: full-scale ranges, V.
        bits: resolution of its converter.
        steps: of it from 0 to full scale, where that is not all it has, as where full
            scale is the edge of a screen.
        record: how long one lasts, s, and its samples of a channel, at a wanted
            interval in s and with so many inputs; None for a stream without gaps.
        fastest: highest streaming rate for 1, 2, ... enabled channels, S/s.
        offsets: largest analogue offset at each of `ranges`, V, either sign; empty
            where only the open scope tells.
        generator: what its waveform generator can, or None.
    """

    gapless: bool
    inputs: tuple[str, ...]
    ranges: tuple[float, ...]
    bits: int
    fastest: tuple[float, ...]
    offsets: tuple[float, ...] = ()
    generator: GeneratorCapability | None = None
    steps: int | None = None
    record: Callable[[float, int], tuple[float, int]] | None = None

    @property
    def codes(self) -> int:
        """From 0 to full scale."""
        return self.steps or 2 ** (self.bits - 1) - 1


@dataclass(frozen=True, kw_only=True)
class Stream:
    """How a running stream is scaled.

    A code c of channel k means
    ``(c / full_scale * range_k - offset_k - zero_k) * scale_k``.

    Attributes:
        channels: in the order of the rows of each block.
        interval: actual sample interval as the scope reported it, s.
        full_scale: code at the end of the range (32512 for 8-bit PicoScopes).
        shift: low bits of every code that are always 0 (8 for 8-bit PicoScopes).
        started: clock time at which the stream was started, s.
        uncertainty: of `started` against the first sample, s.
        record: samples per channel that are taken at a time by a scope that is blind
            between its records; None for a stream without gaps.
    """

    channels: tuple[Channel, ...]
    interval: float
    full_scale: int
    shift: int
    started: float
    uncertainty: float
    record: int | None = None

    @property
    def gapless(self) -> bool:
        """Whether a missing sample is a lost sample."""
        return self.record is None

    def volts_per_code(self, row: int) -> tuple[float, float]:
        """(gain, offset) with signal = gain * code + offset, in the signal's unit."""
        channel = self.channels[row]
        gain = channel.range / self.full_scale * channel.scale
        return gain, -(channel.offset + channel.zero) * channel.scale


@dataclass(frozen=True, eq=False)
class Block:
    """Consecutive samples of all enabled channels.

    Attributes:
        first: index of the first sample since the stream was started.
        codes: shape (channels, samples), int16, C-contiguous, owned by the block.
        overrange: one flag per channel, true if the input left its range.
        received: clock time of arrival, s.
    """

    first: int
    codes: NDArray[np.int16]
    overrange: tuple[bool, ...]
    received: float

    @property
    def samples(self) -> int:
        """Samples per channel."""
        return int(self.codes.shape[1])


class Scope(Protocol):
    """A digitiser that streams all enabled channels at one rate."""

    @property
    def identity(self) -> str:
        """Maker, model and serial number."""
        ...

    @property
    def capability(self) -> ScopeCapability:
        """What this scope can do; known once open."""
        ...

    def open(self) -> None:
        """Connect and identify."""
        ...

    def start(self, channels: Sequence[Channel], interval: float) -> Stream:
        """Configure and start streaming; the stream tells the actual interval."""
        ...

    def poll(self) -> Block | None:
        """All samples since the last poll, or None if there are none yet.

        Raises:
            LinkLostError: unplugged, or no data for longer than the watchdog allows.
            SamplesLostError: the scope or driver reported a gap.
        """
        ...

    @property
    def poll_interval(self) -> float:
        """How often to poll while streaming, s."""
        ...

    def stop(self) -> None:
        """Stop streaming; idempotent."""
        ...

    def settings(self) -> dict[str, str]:
        """Settings in force, for the run's record."""
        ...

    def close(self) -> None:
        """Stop and let go of the scope; idempotent."""
        ...
