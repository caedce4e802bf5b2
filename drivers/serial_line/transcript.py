r"""Transcripts: every byte of a conversation with an instrument, one line each.

A line is the clock's time in seconds, `>` for sent or `<` for received, and the bytes
as a JSON string (characters stand for bytes, Latin-1)::

    0.012345 > "CURR 0.10000;:SYST:ERR?\\n"
    0.041718 < "0,\\"No error\\"\\r\\n"

Lines that start with `#` are comments. `tests/support/replay.py` answers from
a transcript.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TextIO

from tactile_lab.errors import SceneError
from tactile_lab.whole_file import failing_as


class Transcript:
    """Writes a transcript; give it to a driver as its `spy`.

    Args:
        path: file to write.
        about: comment in its first line.

    Raises:
        SceneError: the file cannot be written.
    """

    def __init__(self, path: Path, about: str = "") -> None:
        with failing_as(f"Transcript {path} cannot be written", kind=SceneError):
            self._file: TextIO | None = path.open("w", encoding="utf-8")
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
