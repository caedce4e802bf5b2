"""Which PicoScopes are attached and free, for `devices` and `doctor`."""

from __future__ import annotations

import ctypes
import re
from dataclasses import dataclass
from typing import Any

from drivers.picoscope import status
from drivers.picoscope.sdk import bind, load

_UNIT = re.compile(r"\s*(?P<serial>[^\[\],]+?)\s*(?:\[(?P<variant>[^\]]*)\])?\s*$")


@dataclass(frozen=True)
class Attached:
    """One free unit.

    Attributes:
        serial: batch and serial number.
        variant: model, "" where the library does not tell.
    """

    serial: str
    variant: str


def attached(library: str | Any | None = None) -> tuple[Attached, ...]:
    """Free ps3000a units; units that a program has open are not seen.

    Args:
        library: the library's file or folder, a loaded library, or None to search.

    Raises:
        NotFoundError: no library.
        TactileLabError: the library could not look, for example because it is busy.
    """
    found = library is None or isinstance(library, str)
    bound = load(library) if found else bind(library)
    # a buffer that begins with -v asks for the variants too
    text = (ctypes.c_int8 * 1024)(*b"-v")
    count, length = ctypes.c_int16(), ctypes.c_int16(len(text))
    code = bound.ps3000aEnumerateUnits(ctypes.byref(count), text, ctypes.byref(length))
    if code not in (status.OK, status.NOT_FOUND):
        raise status.failure(code, "Looking for PicoScopes")
    if count.value == 0:
        return ()
    listed = bytes(text).split(b"\0", 1)[0].decode("ascii", "replace")
    units = []
    for part in listed.split(","):
        match = _UNIT.match(part)
        if match is not None:
            units.append(Attached(match["serial"], match["variant"] or ""))
    return tuple(units)
