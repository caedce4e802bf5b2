"""Many numbers as lines of text, quickly: a run of seconds has millions of rows.

Text is kept as rows of bytes, all as wide as the widest; 0 bytes in it are no text.
Python alone formats a million numbers a second, and there are hundreds of them; but a
converter has few codes, and what is derived changes rarely.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.arrays import FloatArray
from tactile_lab.store.signal import StoredSignal

Text = NDArray[np.uint8]

NUMBER = "%.12g"
"""Twelve digits: far below one code, and no noise of binary fractions."""

NANO = 1_000_000_000


class CodeText:
    """Text of a signal's samples, looked up by their code."""

    def __init__(self, signal: StoredSignal) -> None:
        self._gain, self._offset = signal.gain, signal.offset
        limits = np.iinfo(signal.codes.dtype)
        self._least = int(limits.min)
        codes = np.arange(limits.min, limits.max + 1, dtype=np.float64)
        self._texts = written(codes * self._gain + self._offset)

    def __call__(self, values: FloatArray) -> Text:
        """Text of SI values that are codes times gain plus offset."""
        codes = np.rint((values - self._offset) / self._gain).astype(np.int64)
        # a sixth of the time of indexing by an array
        return self._texts.take(codes - self._least, axis=0)


def written(values: NDArray[Any]) -> Text:
    """Text of each value; nothing for NaN, which CSV leaves empty."""
    texts = [b"" if v != v else (NUMBER % v).encode() for v in values.tolist()]
    wide = max(map(len, texts), default=0) or 1
    joined = b"".join(text.ljust(wide, b"\0") for text in texts)
    return np.frombuffer(joined, np.uint8).reshape(-1, wide)


def steps(values: FloatArray) -> Text:
    """Text of values of which many neighbours are alike."""
    unknown = np.isnan(values)
    alike = (values[1:] == values[:-1]) | (unknown[1:] & unknown[:-1])
    first = np.append(0, np.flatnonzero(~alike) + 1)[: values.size]
    return np.repeat(written(values[first]), np.diff(first, append=values.size), axis=0)


def fixed(values: FloatArray) -> Text:
    """Text of values that all differ, with nine decimals; nothing for NaN."""
    known = np.isfinite(values)
    nano = np.rint(np.abs(np.where(known, values, 0.0)) * NANO).astype(np.int64)
    whole, part = np.divmod(nano, NANO)
    digits = np.empty((values.size, 10), np.uint8)
    digits[:, 0] = ord(".")
    rest = part.astype(np.uint32)
    for place in range(9, 0, -1):
        tens = rest // 10
        digits[:, place] = rest - 10 * tens + ord("0")
        rest = tens
    sign = np.where((values < 0) & (nano > 0), np.uint8(ord("-")), np.uint8(0))
    text = np.concatenate([sign[:, None], steps(whole.astype(float)), digits], axis=1)
    text[~known] = 0
    return text


def lines(columns: Iterable[Text]) -> bytes:
    """Columns with commas between, a line for each row."""
    parts: list[Text] = []
    for column in columns:
        parts += [column, np.full((len(column), 1), ord(","), np.uint8)]
    parts[-1][:] = ord("\n")
    joined = np.concatenate(parts, axis=1).ravel()
    return bytes(joined[joined != 0])
