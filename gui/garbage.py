"""Python's collector of reference circles, called in the window's own thread alone.

Of its own accord it works in whatever thread makes the next object, and what it ends
there may be Qt's, which no other thread than the window's may touch: two whole test
suites crashed by it.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

from PySide6.QtCore import QTimer

EVERY = 1000
"""Milliseconds between two looks at whether something is to be collected."""


@contextmanager
def collected_here(every: int = EVERY) -> Iterator[None]:
    """Collect in this thread alone, between two events of it.

    What is there already is taken to stay and is not looked through again and again:
    that of a whole window takes longer than a frame. In the end all of it is as it was
    found.

    Args:
        every: time between two looks, ms.
    """
    automatic = gc.isenabled()
    gc.disable()
    gc.freeze()
    timer = QTimer()
    timer.timeout.connect(_collect_due)
    timer.start(every)
    try:
        yield
    finally:
        timer.stop()
        gc.collect()
        gc.unfreeze()
        if automatic:
            gc.enable()


def _collect_due() -> None:
    """Collect the generations that Python's own thresholds call for."""
    grown = zip(gc.get_count(), gc.get_threshold(), strict=True)
    due = [number for number, (count, most) in enumerate(grown) if count > most]
    if due:
        gc.collect(due[-1])
