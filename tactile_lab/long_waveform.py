"""A waveform of more points than are held at once: an hour of force has millions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np

from tactile_lab.waveform import Waveform


class LongWaveform:
    """Consecutive pieces of a waveform, made anew whenever they are gone through.

    Args:
        make: gives the pieces, at least one; each begins when, and with the value
            that, the one before ends with.
    """

    def __init__(self, make: Callable[[], Iterable[Waveform]]) -> None:
        self._make = make

    def pieces(self, points: int) -> Iterator[Waveform]:
        """As `Waveform.pieces`."""
        for piece in self._make():
            yield from piece.pieces(points)

    def each(self, change: Callable[[Waveform], Waveform]) -> LongWaveform:
        """The same with each piece changed, which must not part its ends."""
        return LongWaveform(lambda: map(change, self._make()))

    def scaled(self, by: float) -> LongWaveform:
        """As `Waveform.scaled`."""
        return self.each(lambda piece: piece.scaled(by))

    def shifted(self, by: float) -> LongWaveform:
        """As `Waveform.shifted`."""
        return self.each(lambda piece: piece.shifted(by))

    def since(self, start: float) -> LongWaveform:
        """As `Waveform.since`."""

        def later() -> Iterator[Waveform]:
            pieces = iter(self._make())
            begun = piece = next(pieces)
            while piece.end <= start and (after := next(pieces, None)):
                piece = after
            if piece.start < start:
                # its own first value is not that of the whole
                time = np.append(piece.start - 1.0, piece.time)
                piece = Waveform(time, np.append(begun.first, piece.value)).since(start)
            yield piece
            yield from pieces

        return LongWaveform(later)


AnyWaveform = Waveform | LongWaveform
"""Either, for who goes through its pieces."""
