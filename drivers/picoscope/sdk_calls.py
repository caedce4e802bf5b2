"""One thread at a time, and only one, in a vendor library that allows no more."""

from __future__ import annotations

import threading
from typing import Any

from tactile_lab.errors import RefusedError

_FROM_ANYWHERE = frozenset({"ps3000aStop", "ps3000aCloseUnit"})


class LibraryCalls:
    """Calls of a bound library, guarded.

    The first call makes its thread the owner. Another thread is refused, because the
    library answers overlapping calls with an error at best; only stopping and closing
    are allowed from elsewhere, while no call is under way.

    A library written in Python may have a method `raise_errors`, which raises what went
    wrong inside a C function; it is asked after each call that did not end well.
    """

    def __init__(self, library: Any) -> None:
        self._library = library
        self._raise_errors = getattr(library, "raise_errors", None)
        self._owner: int | None = None
        self._under_way = threading.Lock()

    def __call__(self, name: str, *arguments: Any) -> int:
        """Call `name` and return its PICO_STATUS.

        Raises:
            RefusedError: another thread owns the library, or a call is under way.
        """
        me = threading.get_ident()
        if self._owner is None:
            self._owner = me
        if me != self._owner and name not in _FROM_ANYWHERE:
            raise RefusedError(
                f"{name} was called from a second thread; the scope belongs to the "
                "thread that opened it."
            )
        if not self._under_way.acquire(blocking=False):
            raise RefusedError(
                f"{name} was called while another call to the scope was under way; "
                "one thread only may use the scope."
            )
        try:
            status = int(getattr(self._library, name)(*arguments))
        finally:
            self._under_way.release()
        if status != 0 and self._raise_errors is not None:
            self._raise_errors()
        return status

    def released(self) -> None:
        """Forget the owner: the next call may come from any thread."""
        self._owner = None
