"""Background threads."""

from __future__ import annotations

import threading
from collections.abc import Callable


def start(work: Callable[[], None], name: str) -> threading.Thread:
    """Start a background thread."""
    thread = threading.Thread(target=work, name=name, daemon=True)
    thread.start()
    return thread
