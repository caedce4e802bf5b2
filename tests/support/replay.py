"""An instrument that answers from a transcript, and insists on every word of it."""

from __future__ import annotations

import json
from collections import deque
from dataclasses import dataclass
from pathlib import Path

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


class Replay:
    """Answers as a recorded instrument did, as long as it is asked the same.

    It stands where a simulated instrument stands: give it to
    `sim_backend.serial_line.wires.plug_in`.

    Args:
        path: the transcript.
    """

    reply_end = b""
    clearing = b""
    gap = 0.0

    def __init__(self, path: Path) -> None:
        self._path = path
        self._left = deque(_turns(read_transcript(path)))

    def line(self, line: bytes) -> bytes | None:
        """The recorded answer, terminator included, or None.

        Raises:
            AssertionError: the transcript has another line here, or is at its end.
        """
        if not self._left:
            raise AssertionError(f"{self._path} is at its end; {line!r} was sent.")
        asked, answer = self._left.popleft()
        if asked != line:
            raise AssertionError(f"{self._path} has {asked!r}; {line!r} was sent.")
        return answer or None

    def finish(self) -> None:
        """Make sure that nothing of the transcript was left unsaid.

        Raises:
            AssertionError: lines are left.
        """
        if self._left:
            raise AssertionError(
                f"{len(self._left)} lines of {self._path} were not sent, the first "
                f"is {self._left[0][0]!r}."
            )


def _turns(said: list[Utterance]) -> list[tuple[bytes, bytes]]:
    """Each line sent with all that came back before the next one."""
    turns: list[tuple[bytes, bytes]] = []
    for one in said:
        if one.sent:
            lines = [
                part for part in one.data.replace(b"\r", b"\n").split(b"\n") if part
            ]
            turns += [(part, b"") for part in lines]
        elif turns:
            turns[-1] = (turns[-1][0], turns[-1][1] + one.data)
    return turns


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
