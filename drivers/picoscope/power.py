"""Opening a PicoScope whatever it is powered from, and only if the user agrees."""

from __future__ import annotations

import ctypes

from drivers.picoscope import status
from drivers.picoscope.sdk_calls import LibraryCalls
from tactile_lab.errors import LimitError

_MOST_ACKNOWLEDGEMENTS = 4


def open_unit(
    calls: LibraryCalls, serial: str | None, *, allow_usb2: bool, allow_usb_power: bool
) -> tuple[int, tuple[str, ...]]:
    """Open a unit and acknowledge the power states that were allowed.

    Args:
        calls: the library.
        serial: the unit's serial number; None for the first free one.
        allow_usb2: accept a USB 2 port, at a quarter of the rate.
        allow_usb_power: accept a missing mains adapter.

    Returns:
        The handle, and what was accepted, for the run's record.

    Raises:
        LimitError: a power state that was not allowed.
        NotFoundError: no such unit, or another program has it.
        TactileLabError: any other status.
    """
    handle = ctypes.c_int16(0)
    text = None if serial is None else _text(serial)
    code = calls("ps3000aOpenUnit", ctypes.byref(handle), text)
    which = "the scope" if serial is None else f"scope {serial}"
    try:
        accepted = acknowledge(
            calls, handle.value, code, f"Opening {which}",
            allow_usb2=allow_usb2, allow_usb_power=allow_usb_power,
        )  # fmt: skip
    except Exception:
        if handle.value > 0:
            calls("ps3000aCloseUnit", handle.value)
        raise
    return handle.value, accepted


def acknowledge(
    calls: LibraryCalls,
    handle: int,
    code: int,
    doing: str,
    *,
    allow_usb2: bool,
    allow_usb_power: bool,
) -> tuple[str, ...]:
    """Answer power states, of which one may follow another, until the unit is ready.

    Raises:
        LimitError: a power state that was not allowed.
        TactileLabError: any other status than OK.
    """
    accepted: list[str] = []
    allowed = {
        status.SUPPLY_CONNECTED: True,
        status.SUPPLY_NOT_CONNECTED: allow_usb_power,
        status.USB3_ON_USB2_PORT: allow_usb2,
    }
    for _ in range(_MOST_ACKNOWLEDGEMENTS):
        if code not in allowed:
            break
        if not allowed[code]:
            raise LimitError(f"{doing}: {status.describe(code)}.")
        accepted.append(status.MEANINGS[code].name)
        code = calls("ps3000aChangePowerSource", handle, code)
    if code != status.OK:
        raise status.failure(code, doing)
    return tuple(accepted)


def _text(serial: str) -> ctypes.Array[ctypes.c_int8]:
    raw = serial.encode("ascii", "replace") + b"\0"
    return (ctypes.c_int8 * len(raw)).from_buffer_copy(raw)
