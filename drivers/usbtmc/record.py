"""Reading one finished record out of a USBTMC oscilloscope, checked and centred."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivers.usbtmc.link import UsbtmcLink
from tactile_lab.errors import BadReplyError
from tactile_lab.instruments.scope_dialect import ScopeDialect
from tactile_lab.scope import Channel, Stream

SHIFT = 8
"""Low bits of every code that are 0: bytes are put in the high half."""

_MOST_CODE = 127
_MOST_BYTE = 255
_LARGEST = 1e30
"""What is larger stands for something else: SCPI writes NaN as 9.91E37."""


class RecordReader:
    """Asks for the samples of a record."""

    def __init__(self, link: UsbtmcLink, dialect: ScopeDialect) -> None:
        self._link = link
        self._dialect = dialect

    def read(
        self, channel: Channel, stream: Stream, depth: int
    ) -> tuple[NDArray[np.int16], bool, float]:
        """Read one input of the finished record.

        Returns:
            Its codes, shape (depth,); whether it left its range; time of the first
            sample against the trigger, s.

        Raises:
            BadReplyError: not what was asked for, or the scope was set otherwise.
        """
        row, say = self._dialect, self._dialect.commands
        tell(self._link, say.select, input=channel.input)
        reference, origin = self._reference(channel, stream)
        parts = []
        for first in range(1, depth + 1, row.read_at_once):
            last = min(depth, first + row.read_at_once - 1)
            tell(self._link, say.bounds, first=first, last=last)
            part = self._link.ask_block(say.data)
            if len(part) != last - first + 1:
                raise BadReplyError(
                    f"{len(part)} samples of {channel.signal} came instead of "
                    f"{last - first + 1}."
                )
            parts.append(part)
        raw = np.frombuffer(b"".join(parts), dtype=np.uint8).astype(np.int16)
        level = raw - np.int16(reference)
        left = bool(np.max(np.abs(level)) >= _MOST_CODE)
        return np.clip(level, -_MOST_CODE, _MOST_CODE) << SHIFT, left, origin

    def _reference(self, channel: Channel, stream: Stream) -> tuple[int, float]:
        """Byte at mid-screen and start against trigger (s), scaling checked."""
        row, question = self._dialect, self._dialect.commands.preamble
        answer = self._link.ask(question).split(",")
        if len(answer) != 10:
            raise BadReplyError(f"{question} gave {len(answer)} numbers, not 10.")
        interval, origin, step, moved = (
            number(answer[k], question) for k in (4, 5, 7, 8)
        )
        reference = number(answer[9], question, 0, _MOST_BYTE)
        wanted = channel.range / (row.divisions_high * row.codes_per_division)
        apart = stream.interval
        for what, got, set_to, within, unit in (
            ("V a code", step, wanted, 0.01 * wanted, "V"),
            ("offset", moved * step, channel.offset, wanted, "V"),
            ("time between samples", interval, apart, 0.01 * apart, "s"),
        ):
            if abs(got - set_to) > within:
                raise BadReplyError(
                    f"{channel.signal} came with {what} {got:g} {unit} instead of "
                    f"{set_to:g} {unit}: it was changed on the scope. Leave its knobs "
                    "alone and start again."
                )
        return round(reference), origin


def tell(link: UsbtmcLink, lines: Sequence[str], **values: object) -> None:
    """Send lines with their names filled in."""
    for line in lines:
        link.write(line.format(**values))


def number(
    text: str, question: str, least: float = -_LARGEST, most: float = _LARGEST
) -> float:
    """The number in an answer.

    Raises:
        BadReplyError: it is none, or not within `least` and `most`.
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise BadReplyError(
            f"{question} gave {text!r}, not a number from {least:g} to {most:g}. "
            "Switch the scope off and on; if it says so again, compare its dialect row "
            "with its manual."
        )
    return value
