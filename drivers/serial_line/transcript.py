r"""Transcripts: every byte of a conversation with an instrument, one line each.

A line is the clock's time in seconds, `>` for sent or `<` for received, and the bytes
as a JSON string (characters stand for bytes, Latin-1)::

    0.012345 > "CURR 0.10000;:SYST:ERR?\\n"
    0.041718 < "0,\\"No error\\"\\r\\n"

Lines that start with `#` are comments. `sim_backend.serial_line.replay` answers from
a transcript.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TextIO

from tactile_lab.errors import SceneError


@dataclass(frozen=True)
class Utterance:
    """Bytes that went one way.

    Attributes:
        time: clock time, s.
        sent: from us to the instrument.
        data: the bytes.
    """

    time: float
    sent: bool
    data: bytes


class Transcript:
    """Writes a transcript; give it to a driver as its `spy`.

    Args:
        path: file to write.
        about: comment in its first line.

    Raises:
        SceneError: the file cannot be written.
    """

    def __init__(self, path: Path, about: str = "") -> None:
        try:
            self._file: TextIO | None = path.open("w", encoding="utf-8")
        except OSError as reason:
            raise SceneError(
                f"Transcript {path} cannot be written: {reason}"
            ) from reason
        if about:
            self._file.write(f"# {about}\n")

    def __call__(self, direction: str, data: bytes, time: float) -> None:
        """Note bytes that went `>` out or `<` in at `time` s; flushed at once."""
        if self._file is not None:
            text = json.dumps(data.decode("latin-1"))
            self._file.write(f"{time:.6f} {direction} {text}\n")
            self._file.flush()

    def close(self) -> None:
        """Close the file; idempotent."""
        if self._file is not None:
            self._file.close()
            self._file = None


def read_transcript(path: Path) -> list[Utterance]:
    """What was said, in order.

    Raises:
        SceneError: the file cannot be read or is no transcript.
    """
    said = []
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as reason:
        raise SceneError(f"Transcript {path} cannot be read: {reason}") from reason
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.startswith("#"):
            continue
        try:
            time, direction, text = line.split(" ", 2)
            data = json.loads(text).encode("latin-1")
            if direction not in "<>":
                raise ValueError(f"{direction!r} is neither > nor <")
            said.append(Utterance(float(time), direction == ">", data))
        except (ValueError, AttributeError) as reason:
            raise SceneError(
                f"Transcript {path}, line {number}: {line!r} is not "
                f'"seconds > text" or "seconds < text" ({reason}).'
            ) from reason
    return said
