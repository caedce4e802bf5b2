"""What a process that lives for days has freed goes back to the system.

glibc gives each thread a heap of its own, and keeps what is freed between two things
that are still used; runs hold arrays in cycles of few objects, which Python's collector
therefore comes to late. Together they made an engine grow by tens of MB a run. Where
the C library is another, only the collector is called.
"""

from __future__ import annotations

import ctypes
import gc
import sys

GLIBC = ctypes.CDLL(None) if sys.platform == "linux" else None

ARENA_MAX = -8
"""`M_ARENA_MAX` of glibc's malloc.h: how many heaps threads share."""


def share_heap() -> None:
    """Have all threads that are started from now on use one heap."""
    mallopt = getattr(GLIBC, "mallopt", None)
    if mallopt is not None:
        mallopt(ARENA_MAX, 1)


def give_back() -> None:
    """Collect what nothing refers to, and return free memory; takes some 0.1 s."""
    gc.collect()
    trim()


def trim() -> None:
    """Return what is free already; takes some 10 ms."""
    malloc_trim = getattr(GLIBC, "malloc_trim", None)
    if malloc_trim is not None:
        malloc_trim(0)
