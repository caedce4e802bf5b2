"""What a process that lives for days has freed goes back to the system.

glibc gives each thread a heap of its own, and keeps what is freed between two things
that are still used; runs hold arrays in cycles of few objects, which Python's collector
therefore comes to late. Together they made an engine grow by tens of MB a run. Where
the C library is another, only the collector is called.

Code that was only used to load, as that of numba's compiler, stayed mapped, too: 70 MB.
"""

from __future__ import annotations

import ctypes
import gc
import mmap
import re
import sys
from pathlib import Path

GLIBC = ctypes.CDLL(None) if sys.platform == "linux" else None

ARENA_MAX, MMAP_THRESHOLD = -8, -3
"""`M_ARENA_MAX` and `M_MMAP_THRESHOLD` of glibc's malloc.h: how many heaps threads
share, and the size, bytes, from which on memory is mapped alone."""

LARGE = 1 << 18
"""Such a size, bytes: of the pyramids of a run of some seconds and longer. Half of it
makes frames 1.05 times as long, four times as much a window 5 MB larger."""

UNCHANGED = re.compile(
    r"^([0-9a-f]+)-([0-9a-f]+) r-[x-]p .*[.]so[.0-9]*\n"
    r"(?:(?!Anonymous:).*\n)*?Anonymous: +0 kB$",
    re.MULTILINE,
)
"""Code or constants of a library in `smaps`, as they are in its file: where memory was
written to, as by the loader that put addresses in, some of it is anonymous."""


def share_heap() -> None:
    """Have all threads that are started from now on use one heap."""
    mallopt = getattr(GLIBC, "mallopt", None)
    if mallopt is not None:
        mallopt(ARENA_MAX, 1)


def map_large() -> None:
    """Have what is large come and go alone: it left the heap full of holes.

    glibc does so until the first of that size is freed. Not for whoever streams: each
    block would cost the faults of its pages.
    """
    mallopt = getattr(GLIBC, "mallopt", None)
    if mallopt is not None:
        mallopt(MMAP_THRESHOLD, LARGE)


def give_back() -> None:
    """Collect what nothing refers to, and return free memory; takes some 0.1 s."""
    gc.collect()
    trim()


def trim() -> None:
    """Return what is free already, and library code; takes some 40 ms."""
    malloc_trim = getattr(GLIBC, "malloc_trim", None)
    if malloc_trim is not None:
        malloc_trim(0)
    forget_code()


def forget_code() -> None:
    """Unmap the code of libraries; what runs again comes from the system's file cache.

    To load is most of what a compiler's or a toolkit's code is ever used for, and it
    would stay mapped for days. What differs from its file is left alone, and so is what
    another thread is just loading, which looks alike until it is put into its place.
    """
    maps = Path("/proc/self/smaps")
    if GLIBC is None or not maps.exists():
        return
    before = set(UNCHANGED.findall(maps.read_text()))
    ctypes.CDLL(None)  # waits until no other thread is loading
    for mapped in before.intersection(UNCHANGED.findall(maps.read_text())):
        start, end = (int(one, 16) for one in mapped)
        size = ctypes.c_size_t(end - start)
        GLIBC.madvise(ctypes.c_void_p(start), size, mmap.MADV_DONTNEED)
