"""Faults of simulated USB devices, as libusb reports them."""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Literal

import usb.core

Kind = Literal[
    "unplug", "timeout", "stall", "io", "busy", "access",
    "short", "wrong_tag", "garbled", "silent", "hang",
]  # fmt: skip

Call = Literal["open", "claim", "write", "read", "control"]


@dataclass(frozen=True, kw_only=True)
class UsbFault:
    """One fault at a transfer of a device.

    Kinds:
        unplug: the device is gone, from this call on.
        timeout: the call times out once; what was under way comes late.
        stall: the endpoint halts until it is cleared.
        io: the transfer fails (bad cable).
        busy, access: opening or claiming is refused.
        short: a read ends after `amount` bytes; the rest of the transfer is lost.
        wrong_tag, garbled: the next answer's header is wrong.
        silent: the next answer never comes.
        hang: nothing is answered any more, control requests included.

    Attributes:
        call: at which kind of call.
        nth: which such call, from 1.
        times: how many calls in a row, for timeout and io.
        amount: bytes, for short.
    """

    kind: Kind
    call: Call = "read"
    nth: int = 1
    times: int = 1
    amount: int = 20


def gone() -> usb.core.USBError:
    """No such device."""
    return usb.core.USBError("No such device (it may have been disconnected)", -4,
                             errno.ENODEV)  # fmt: skip


def timed_out() -> usb.core.USBError:
    """A transfer took too long."""
    return usb.core.USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)


def halted() -> usb.core.USBError:
    """The endpoint halted or the request is unknown."""
    return usb.core.USBError("Pipe error", -9, errno.EPIPE)


def failed() -> usb.core.USBError:
    """The transfer failed."""
    return usb.core.USBError("Input/Output Error", -1, errno.EIO)


def in_use() -> usb.core.USBError:
    """Another program or driver has it."""
    return usb.core.USBError("Resource busy", -6, errno.EBUSY)


def forbidden() -> usb.core.USBError:
    """No permission."""
    return usb.core.USBError("Access denied (insufficient permissions)", -3,
                             errno.EACCES)  # fmt: skip


def babble() -> usb.core.USBError:
    """More came than the buffer takes."""
    return usb.core.USBError("Overflow", -8, errno.EOVERFLOW)
