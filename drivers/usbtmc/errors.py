"""What libusb's errors mean for us."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager

import usb.core

from tactile_lab.errors import (
    InstrumentError,
    LinkLostError,
    NoReplyError,
    NotFoundError,
    RefusedError,
)

# libusb_error; errno numbers differ between operating systems
_IO, _ACCESS, _NO_DEVICE, _NOT_FOUND, _BUSY, _TIMEOUT, _OVERFLOW, _PIPE = (
    -1, -3, -4, -5, -6, -7, -8, -9,
)  # fmt: skip

UDEV = (
    'SUBSYSTEM=="usb", ATTR{{idVendor}}=="{vendor:04x}", MODE="0660", GROUP="plugdev", '
    'TAG+="uaccess"'
)
"""A udev rule that gives the logged-in user access to a maker's devices."""


def is_timeout(error: usb.core.USBError) -> bool:
    """Whether a transfer ran out of time."""
    return (
        isinstance(error, usb.core.USBTimeoutError)
        or error.backend_error_code == _TIMEOUT
    )


def is_stall(error: usb.core.USBError) -> bool:
    """Whether the endpoint has halted or the request is not known."""
    return bool(error.backend_error_code == _PIPE or error.errno == errno.EPIPE)


def is_gone(error: usb.core.USBError) -> bool:
    """Whether the device is no longer there."""
    return bool(error.backend_error_code == _NO_DEVICE or error.errno == errno.ENODEV)


def translated(error: usb.core.USBError, what: str, vendor: int) -> InstrumentError:
    """Our error for a USB error on device `what`."""
    code, number = error.backend_error_code, error.errno
    if is_timeout(error):
        return NoReplyError(f"{what} did not answer in time. Is it busy or hung?")
    if is_gone(error):
        return LinkLostError(
            f"{what} was unplugged or switched off. Check its cable and power, then "
            "start again."
        )
    if is_stall(error):
        return RefusedError(f"{what} refused a transfer (endpoint halted).")
    if code == _ACCESS or number in (errno.EACCES, errno.EPERM):
        rule = UDEV.format(vendor=vendor)
        return RefusedError(
            f"{what} may not be opened by this user. On Linux put this line in "
            f"/etc/udev/rules.d/70-tactile-lab.rules and plug it in anew: {rule}"
        )
    if code == _BUSY or number == errno.EBUSY:
        return RefusedError(
            f"{what} is in use by another program or kernel driver. Close it."
        )
    if code == _OVERFLOW or number == errno.EOVERFLOW:
        return RefusedError(f"{what} sent more than was asked for; plug it in anew.")
    if code == _NOT_FOUND:
        return NotFoundError(f"{what} vanished while it was opened. Plug it in anew.")
    return LinkLostError(
        f"The transfer with {what} failed ({error}). Check its cable; avoid hubs."
    )


@contextmanager
def translating(what: str, vendor: int) -> Iterator[None]:
    """Raise our errors for USB errors within the block.

    Raises:
        InstrumentError: whatever the USB error stands for.
    """
    try:
        yield
    except usb.core.NoBackendError as error:
        raise NotFoundError(
            "The libusb library was not found. Install libusb 1.0 (Debian: "
            "libusb-1.0-0; macOS: brew install libusb; Windows: WinUSB by Zadig and "
            "libusb-1.0.dll)."
        ) from error
    except usb.core.USBError as error:
        raise translated(error, what, vendor) from error
