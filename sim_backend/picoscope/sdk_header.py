"""How a Python method is published as a C function of the simulated ps3000a library."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Iterator
from ctypes import c_int16, c_int32, c_uint32, c_void_p
from typing import Any, TypeVar

if sys.platform == "win32":
    convention = ctypes.WINFUNCTYPE
else:
    convention = ctypes.CFUNCTYPE

# typedef void (*ps3000aStreamingReady)(...), (*ps3000aBlockReady)(...)
StreamingReady = convention(
    None, c_int16, c_int32, c_uint32, c_int16, c_uint32, c_int16, c_int16, c_void_p
)
BlockReady = convention(None, c_int16, c_uint32, c_void_p)

_Method = TypeVar("_Method", bound=Callable[..., int])


def header(*argtypes: Any) -> Callable[[_Method], _Method]:
    """Mark a method ``_do_it`` as the C function ``ps3000aDoIt`` with these arguments.

    A first argument of int16_t is the handle, which the method does not get.
    """

    def mark(method: _Method) -> _Method:
        method.argtypes = argtypes  # type: ignore[attr-defined]
        return method

    return mark


def marked(kind: type) -> Iterator[tuple[str, Any, tuple[Any, ...]]]:
    """Name without "ps3000a", method and argument types of all marked methods."""
    for attribute in dir(kind):
        method = getattr(kind, attribute)
        argtypes = getattr(method, "argtypes", None)
        if attribute.startswith("_") and isinstance(argtypes, tuple):
            name = "".join(word.title() for word in attribute.split("_"))
            yield name, method, argtypes
