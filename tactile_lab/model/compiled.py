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
from pickle import UnpicklingError
from typing import Any, TypeVar, cast

from numba import njit
from numba.core import event
from numba.core.caching import FunctionCache

F = TypeVar("F", bound=Callable[..., Any])
COMPILED = (
    "compiled.py", "tableau.py", "node_a.py", "integrator.py", "spiking.py",
    "kernel.py", "sampling.py", "transistor.py", "pair.py", "coupled.py",
    "rest_pair.py", "truncation.py", "threshold.py", "ellipse.py", "derived.py",
    "packed.py", "batch.py", "taylor.py",
)  # fmt: skip
"""Every file that machine code is made from."""
# wrappers for calls from Python or C would double the time to compile
_INNER: dict[str, Any] = {
    "error_model": "numpy",
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


class _FirstUse(event.Listener):
    """Says that code is compiled, once, and only where the disk has none of it."""

    KIND = "numba:compile"

    def on_start(self, _: Any) -> None:
        """Compiling begins."""
        event.unregister(self.KIND, self)  # type: ignore[no-untyped-call]
        logging.getLogger(__name__).warning(
            "Compiling for this computer, about 20 s; kept for every later run."
        )

    def on_end(self, _: Any) -> None:
        """Nothing to say."""


@cache
def _say_unkept() -> None:
    """Say, once, that compiled code cannot be kept."""
    logging.getLogger(__name__).warning(
        "Compiled code cannot be kept: neither this installation nor your home can be "
        "written. Name a folder in the environment variable NUMBA_CACHE_DIR."
    )


class _CodeOnDisk(FunctionCache):  # type: ignore[misc]
    """numba's cache, where a file that was cut short is as good as none."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Machine code for a signature; None where it has to be compiled."""
        try:
            return super().load_overload(sig, target_context)
        except (EOFError, UnpicklingError, ValueError, IndexError):
            self.flush()
            return None


event.register(_FirstUse.KIND, _FirstUse())  # type: ignore[no-untyped-call]


def inner(function: F) -> F:
    """Compile as part of whichever entry point calls it."""
    return cast(F, njit(**_INNER)(function))


def entry(function: F) -> F:
    """Compile on the first call, keep on disk, run without the interpreter's lock.

    Where no folder can be written it is compiled in every process, which is said.
    """
    compiled = njit(error_model="numpy", nogil=True)(function)
    try:
        compiled._cache = _CodeOnDisk(function)  # noqa: SLF001  as numba does itself
    except RuntimeError:  # numba finds no folder that it may write
        _say_unkept()
    return cast(F, compiled)


def source_stamp(*more: Path) -> int:
    """A number that changes with any of the files above, or of `more`."""
    stamp = 0
    for file in (*(Path(__file__).with_name(name) for name in COMPILED), *more):
        stamp = zlib.crc32(file.read_bytes(), stamp)
    return stamp
