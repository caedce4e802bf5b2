"""Background threads."""

from __future__ import annotations

import threading
from collections.abc import Callable


def start(
    work: Callable[[], None], name: str, *, finishes: bool = False
) -> threading.Thread:
    """Start a background thread.

    Args:
        work: what it does.
        name: of the thread.
        finishes: the program ends after it. What reads runs has to: cut off within
            HDF5, it keeps HDF5's lock, and the program's end waits for that for ever;
            cut off while it is imported, the program ends in a crash.
    """
    thread = threading.Thread(target=work, name=name, daemon=not finishes)
    thread.start()
    return thread
