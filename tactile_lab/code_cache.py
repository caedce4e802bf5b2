"""Machine code that numba makes, kept on disk as far as the disk allows."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from functools import cache
from pickle import UnpicklingError
from typing import Any

from numba import njit
from numba.core import event
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys


def kept(
    function: Callable[..., Any], signature: str | None = None, **options: Any
) -> Any:
    """Compile `function`, on its first call unless a signature is given; keep the code.

    Where no folder can be written it is compiled in every process, which is said.

    Args:
        function: what to compile.
        signature: of its arguments, as numba writes them: compile for these now.
        options: of numba's `njit`.
    """
    compiled = njit(**options)(function)
    try:
        code = _CodeOnDisk(function)  # type: ignore[no-untyped-call]
        compiled._cache = code  # noqa: SLF001  as numba does itself
    except RuntimeError:  # numba finds no folder that it may write
        _say_unkept()
    if signature is not None:
        compiled.compile(signature)
        compiled.disable_compile()
    return compiled


@cache
def _say_unkept() -> None:
    """Say, once, that compiled code cannot be kept."""
    logging.getLogger(__name__).warning(
        "Compiled code cannot be kept: neither this installation nor your home can be "
        "written. Name a folder in the environment variable NUMBA_CACHE_DIR."
    )


class _NotKept(BaseException):
    """Code would have to be compiled; what handles errors of an act is not for it."""


class _Refused(event.Listener):
    """No code is compiled as long as it listens."""

    def on_start(self, _: Any) -> None:
        """Compiling would begin."""
        raise _NotKept

    def on_end(self, _: Any) -> None:
        """Nothing to say."""


def compiled_apart(act: Callable[[], None]) -> None:
    """Do `act`, which may be begun twice; have a child compile what is not kept.

    A compiler that has worked holds 130 MB until its process ends, and so does each
    that is forked from it: too much for a process that is there for days. Where the
    disk takes no code, it is compiled here. Forks: call it while there is one thread.
    """
    try:
        with event.install_listener("numba:compile", _Refused()):
            act()
    except _NotKept:
        if not _say_unkept.cache_info().currsize:
            _in_child(act)
        act()


def _in_child(act: Callable[[], None]) -> None:
    """Do `act` in a process of its own, and wait for its end, however it ends."""
    child = os.fork()
    if child:
        os.waitpid(child, 0)
    else:
        try:
            act()
        finally:
            os._exit(0)


SPOILT = (
    EOFError,
    UnpicklingError,
    ValueError,
    IndexError,
    AttributeError,
    ImportError,
)
"""What a file of the cache raises that was cut short, or names a class or module of an
earlier version of the program."""


class _CodeOnDisk(FunctionCache):
    """numba's cache, where a file that cannot be read is as good as none.

    numba's own loads all that its compiler knows before it looks on the disk: 0.3 s and
    20 MB, scipy's linear algebra among it, in each process that finds its code there.
    What runs needs its memory allocator alone; the compiler loads the rest by itself.
    """

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Machine code for a signature; None where it has to be compiled."""
        rtsys.initialize(target_context)
        try:
            with self._guard_against_spurious_io_errors():
                return self._load_overload(sig, target_context)  # type: ignore[no-untyped-call]
        except SPOILT:
            self.flush()  # type: ignore[no-untyped-call]
            return None
