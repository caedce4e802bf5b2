"""The functions of Pico Technology's ps3000a library that we use, and where it lies.

Argument types follow the ps3000a Programmer's Guide (s. "API functions"). Pointers are
typed, so that ctypes refuses a wrong width instead of corrupting memory.
"""

from __future__ import annotations

import ctypes
import os
import struct
import sys
from collections.abc import Iterable, Mapping
from ctypes import (
    POINTER,
    c_double,
    c_float,
    c_int8,
    c_int16,
    c_int32,
    c_uint32,
    c_void_p,
)
from pathlib import Path
from typing import Any

from tactile_lab.errors import NotFoundError

ENVIRONMENT = "TACTILE_LAB_PS3000A"
"""Environment variable that names the library's file or its folder."""

if sys.platform == "win32":
    _function = ctypes.WINFUNCTYPE
else:
    _function = ctypes.CFUNCTYPE

STREAMING_READY = _function(
    None, c_int16, c_int32, c_uint32, c_int16, c_uint32, c_int16, c_int16, c_void_p
)
"""Handle, samples, start index, overflow bits, trigger at, triggered, auto stop, p."""

_enum = c_int32
_text = POINTER(c_int8)
_int16s = POINTER(c_int16)
_uint32s = POINTER(c_uint32)
_floats = POINTER(c_float)

ENUMERATE = "ps3000aEnumerateUnits"

PROTOTYPES: dict[str, tuple[Any, ...]] = {
    "ps3000aOpenUnit": (_int16s, _text),
    "ps3000aCloseUnit": (c_int16,),
    ENUMERATE: (_int16s, _text, _int16s),
    "ps3000aGetUnitInfo": (c_int16, _text, c_int16, _int16s, c_uint32),
    "ps3000aPingUnit": (c_int16,),
    "ps3000aChangePowerSource": (c_int16, c_uint32),
    "ps3000aMaximumValue": (c_int16, _int16s),
    "ps3000aGetAnalogueOffset": (c_int16, _enum, _enum, _floats, _floats),
    "ps3000aSetChannel": (c_int16, _enum, c_int16, _enum, _enum, c_float),
    "ps3000aSetSimpleTrigger": (
        c_int16, c_int16, _enum, c_int16, _enum, c_uint32, c_int16,
    ),
    "ps3000aSetDataBuffer": (c_int16, _enum, _int16s, c_int32, c_uint32, _enum),
    "ps3000aRunStreaming": (
        c_int16, _uint32s, _enum, c_uint32, c_uint32, c_int16, c_uint32, _enum,
        c_uint32,
    ),
    "ps3000aGetStreamingLatestValues": (c_int16, STREAMING_READY, c_void_p),
    "ps3000aStop": (c_int16,),
    "ps3000aSetSigGenBuiltIn": (
        c_int16, c_int32, c_uint32, c_int16, c_float, c_float, c_float, c_float, _enum,
        _enum, c_uint32, c_uint32, _enum, _enum, c_int16,
    ),
    "ps3000aSetSigGenArbitrary": (
        c_int16, c_int32, c_uint32, c_uint32, c_uint32, c_uint32, c_uint32, _int16s,
        c_int32, _enum, _enum, _enum, c_uint32, c_uint32, _enum, _enum, c_int16,
    ),
    "ps3000aSigGenArbitraryMinMaxValues": (
        c_int16, _int16s, _int16s, _uint32s, _uint32s,
    ),
    "ps3000aSigGenFrequencyToPhase": (c_int16, c_double, _enum, c_uint32, _uint32s),
    "ps3000aSigGenSoftwareControl": (c_int16, c_int16),
}  # fmt: skip
"""Argument types by function; all return PICO_STATUS, an unsigned 32-bit integer."""

INPUTS = ("A", "B", "C", "D")
"""Input names in the order of PS3000A_CHANNEL, from 0."""

COUPLINGS = {"AC": 0, "DC": 1}

RANGES = {
    0.02: 1, 0.05: 2, 0.1: 3, 0.2: 4, 0.5: 5, 1.0: 6, 2.0: 7, 5.0: 8, 10.0: 9, 20.0: 10,
}  # fmt: skip
"""Full scale, V, to PS3000A_RANGE for 3000D models."""

OFFSETS = (0.25,) * 4 + (2.5,) * 3 + (20.0,) * 3
"""Largest analogue offset at each of `RANGES`, V, as ps3000aApi.h has it."""

TIME_UNITS = {1e9: 2, 1e6: 3, 1e3: 4}
"""Number of a unit in one second (ns, us, ms) to PS3000A_TIME_UNITS."""

INFORMATION = {
    "driver": 0, "usb": 1, "hardware": 2, "variant": 3, "serial": 4, "calibrated": 5,
}  # fmt: skip
"""Items of ps3000aGetUnitInfo."""

BITS = struct.calcsize("P") * 8
"""Bitness of this Python; the library must have the same."""


def bind(library: Any) -> Any:
    """Give `library`'s functions their C types and return it.

    Args:
        library: a loaded shared library, or any object with C function pointers.

    Raises:
        NotFoundError: a function is missing, with its name.
    """
    missing = []
    for name, argtypes in PROTOTYPES.items():
        try:
            function = getattr(library, name)
        except AttributeError:
            if name != ENUMERATE:  # it only tells which scopes there are besides
                missing.append(name)
            continue
        function.argtypes = argtypes
        function.restype = c_uint32
    if missing:
        raise NotFoundError(
            f"The library {getattr(library, '_name', library)!r} lacks "
            f"{', '.join(missing)}: it is not ps3000a, or too old. "
            "Install the current PicoSDK."
        )
    return library


def candidates(
    path: str | None = None,
    environ: Mapping[str, str] = os.environ,
    platform: str = sys.platform,
) -> list[str]:
    """Files and loader names to try, in order.

    An explicit path, else one in the environment, is tried alone: a typing error must
    not fall back to another library unnoticed. A folder stands for the library in it.
    """
    names = {
        "win32": ["ps3000a.dll"],
        "darwin": ["libps3000a.dylib"],
    }.get(platform, ["libps3000a.so.2", "libps3000a.so"])
    wished = path or environ.get(ENVIRONMENT)
    if wished:
        place = Path(wished).expanduser()
        return [str(place / name) for name in names] if place.is_dir() else [str(place)]
    return [str(Path(folder) / name) for folder in _folders(platform, environ)
            for name in names] + names  # fmt: skip


def _folders(platform: str, environ: Mapping[str, str]) -> list[str]:
    if platform == "win32":
        variable = "ProgramFiles" if BITS == 64 else "ProgramFiles(x86)"
        programs = environ.get(variable, r"C:\Program Files")
        return [rf"{programs}\Pico Technology\SDK\lib"]
    if platform == "darwin":
        frameworks = "/Library/Frameworks/PicoSDK.framework/Libraries/libps3000a"
        apps = (
            "PicoScope 7 T&M.app",
            "PicoScope 7 T&M Early Access.app",
            "PicoScope.app",
        )
        return [
            frameworks,
            *(f"/Applications/{app}/Contents/Resources" for app in apps),
        ]
    return ["/opt/picoscope/lib"]


def load(path: str | None = None, environ: Mapping[str, str] = os.environ) -> Any:
    """Load and bind the ps3000a library.

    Args:
        path: the library's file or folder; None for the environment variable
            `TACTILE_LAB_PS3000A`, else the places where PicoSDK installs it.
        environ: where to look the variable up.

    Raises:
        NotFoundError: not found, of the wrong bitness, or incomplete; the message lists
            every place that was tried and why it failed.
    """
    failures = []
    for candidate in candidates(path, environ):
        try:
            return bind(_open(candidate))
        except OSError as error:
            if isinstance(error, NotFoundError):
                raise
            failures.append((candidate, error))
    raise NotFoundError(_not_found(failures))


def _open(candidate: str) -> Any:
    if sys.platform == "win32":
        folder = Path(candidate).parent
        if folder.is_absolute() and folder.is_dir():
            # dependent DLLs are not searched for on PATH
            os.add_dll_directory(str(folder))
        return ctypes.WinDLL(candidate)
    return ctypes.CDLL(candidate)


def _not_found(failures: Iterable[tuple[str, OSError]]) -> str:
    lines = ["The ps3000a library of PicoSDK was not found. Tried:"]
    wrong_bits = False
    for candidate, error in failures:
        text = str(error)
        bits = getattr(error, "winerror", None) == 193 or any(
            sign in text for sign in ("wrong ELF class", "incompatible architecture")
        )
        wrong_bits = wrong_bits or bits
        reason = f"built for another bitness or processor ({text})" if bits else text
        lines.append(f"  {candidate}: {reason}")
    if wrong_bits:
        lines.append(
            f"This Python has {BITS} bits; install the PicoSDK of {BITS} bits."
        )
    else:
        lines.append(
            'Install PicoSDK, or name the file with library = "..." in the bench file '
            f"or in the environment variable {ENVIRONMENT}."
        )
    return "\n".join(lines)
