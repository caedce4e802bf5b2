"""Instruments as context managers: opened on the way in, closed on every way out."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Self


class Opened(ABC):
    """What can be opened and closed, for `with`."""

    @abstractmethod
    def open(self) -> None:
        """Connect and identify."""

    @abstractmethod
    def close(self) -> None:
        """Let go; idempotent."""

    def __enter__(self) -> Self:
        self.open()
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
