"""How far long work on a run has come, told to whoever waits for it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import TypeVar

Progress = Callable[[float], None]
"""Told the part that is done, 0 to 1."""

T = TypeVar("T")


def nothing(part: float) -> None:
    """For whom progress is of no interest."""


def share(progress: Progress, begin: float, end: float) -> Progress:
    """For a piece of the work that takes it from `begin` to `end`, each 0 to 1."""
    return lambda part: progress(begin + part * (end - begin))


def each(
    items: Sequence[T], progress: Progress, more: int = 0
) -> Iterator[tuple[T, Progress]]:
    """Each item with the progress of its own work; `more` pieces as long follow."""
    pieces = len(items) + more
    for number, item in enumerate(items):
        yield item, share(progress, number / pieces, (number + 1) / pieces)
        progress((number + 1) / pieces)


def counted(items: Iterable[T], count: int, progress: Progress) -> Iterator[T]:
    """The items, and after each how many of `count` are done."""
    for number, item in enumerate(items, 1):
        yield item
        progress(number / max(count, 1))
