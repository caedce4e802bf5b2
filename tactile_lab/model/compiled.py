"""Compile the solver's inner functions with numba, and keep the machine code on disk.

See docs/decisions/ for why. numba keys its disk cache on the one file that holds the
entry point; `source_stamp` makes the key cover every file of the solver, so that an
edit anywhere in it can never run old machine code.
"""

from __future__ import annotations

import logging
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

from numba import njit
from numba.core import event

from tactile_lab.code_cache import kept

F = TypeVar("F", bound=Callable[..., Any])
COMPILED = (
    "compiled.py", "tableau.py", "node_a.py", "integrator.py", "spiking.py", "train.py",
    "kernel.py", "sampling.py", "transistor.py", "pair.py", "coupled.py",
    "rest_pair.py", "truncation.py", "threshold.py", "ellipse.py", "derived.py",
    "packed.py", "batch.py", "taylor.py", "elementary.py", "matrix.py",
    "scratch.py", "need.py",
    "stretched_time.py", "magnus.py", "lanes.py", "power_series.py",
)  # fmt: skip
"""Every file that machine code is made from."""
# wrappers for calls from Python or C would double the time to compile
_INNER: dict[str, Any] = {
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}

_LENT = {"_nrt": False}
"""Without numba's counting of owners, which then refuses to make an array."""


@cache
def _say_compiling() -> None:
    """Say, once, that code is compiled."""
    logging.getLogger(__name__).warning(
        "Compiling for this computer, 20 s to a minute; kept for every later run."
    )


class _FirstUse(event.Listener):
    """Says that code is compiled, once, and only where the disk has none of it."""

    KIND = "numba:compile"

    def on_start(self, _: Any) -> None:
        """Compiling begins."""
        _say_compiling()

    def on_end(self, _: Any) -> None:
        """Nothing to say."""


event.register(_FirstUse.KIND, _FirstUse())  # type: ignore[no-untyped-call]


def inner(function: F) -> F:
    """Compile as part of whichever entry point calls it.

    Arrays are lent to it: it counts no owners and must neither make an array nor
    return one.
    """
    return cast(F, njit(**_INNER | _LENT)(function))


def inner_making_arrays(function: F) -> F:
    """The same for a function that makes arrays or returns one."""
    return cast(F, njit(**_INNER)(function))


def entry(function: F) -> F:
    """Compile on the first call, keep on disk, run without the interpreter's lock.

    Where no folder can be written it is compiled in every process, which is said.
    """
    return cast(F, kept(function, error_model="numpy", nogil=True))


def source_stamp(*more: Path) -> int:
    """A number that changes with any of the files above, or of `more`."""
    stamp = 0
    for file in (*(Path(__file__).with_name(name) for name in COMPILED), *more):
        stamp = zlib.crc32(file.read_bytes(), stamp)
    return stamp
