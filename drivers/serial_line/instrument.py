"""What all instruments behind a serial port can: be named, looked at and recorded.

A source of current, a source of voltage and a teslameter differ in what they say over
the wire, not in how the wire is opened, written down and let go of.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Generic, TypeVar

from drivers.serial_line.conversation import Conversation

W = TypeVar("W", bound=Conversation[Any])


class SerialInstrument(Generic[W]):
    """An instrument spoken to over one serial port."""

    def __init__(self, wire: W) -> None:
        self._wire = wire

    @property
    def identity(self) -> str:
        """What it answered when asked who it is."""
        return self._wire.link.identity or "not connected"

    def record(self, path: Path) -> None:
        """Write every byte to a transcript at `path`, until closed; before `open`.

        Raises:
            SceneError: the file cannot be written.
        """
        self._wire.link.record(path)

    @property
    def _known(self) -> dict[str, str]:
        """Who it is and how it is reached, with which its settings begin."""
        link, dialect = self._wire.link, self._wire.dialect
        known = {
            "identity": self.identity,
            "dialect": dialect.id,
            "port": link.port,
            "baud": str(link.wire.baud),
        }
        return known | ({"moved": link.moved} if link.moved else {})

    @contextmanager
    def _met(self) -> Iterator[W]:
        """Connected for a look, in which nothing is set, and closed after it."""
        try:
            self._wire.meet()
            yield self._wire
        finally:
            self._wire.link.close()

    def _let_go(self) -> None:
        """Leave it to whoever comes next and close the port; idempotent."""
        if self._wire.link.is_open:
            self._wire.offer(self._wire.dialect.release)
            self._wire.link.close()
        self._wire.link.end_record()
