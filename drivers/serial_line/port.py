"""Opening a serial port with pyserial, and saying why it cannot be opened."""

from __future__ import annotations

import errno
import os
from contextlib import suppress
from typing import Any

import serial
from serial.urlhandler import protocol_socket

from drivers.serial_line.failures import system_number
from tactile_lab.errors import InstrumentError, NotFoundError
from tactile_lab.instruments.serial_dialect import SerialSettings

TermiosError: type[Exception] = OSError
with suppress(ImportError):  # Windows has no termios
    import termios

    TermiosError = termios.error

PORT_ERRORS = (serial.SerialException, OSError, TermiosError)
"""What pyserial raises when a port fails; `termios.error` is not an `OSError`."""


CONNECT = 0.25
"""Longest wait for a network port to accept, s; the guard takes twice that for a hang.
pyserial's own is twenty times that."""


HEARTBEAT = 0.2
"""Longest wait for bytes at once, s: in between the guard is told that we are alive."""


def port_settings(port: str, wire: SerialSettings) -> dict[str, Any]:
    """Arguments with which pyserial opens `port`; a write timeout is always set."""
    is_url = "://" in port
    # a pseudo-terminal has no frame format; Linux refuses to be asked for one twice
    framed = is_url or not os.path.realpath(port).startswith("/dev/pts/")
    return {
        "baudrate": wire.baud,
        "bytesize": wire.bytesize if framed else 8,
        "parity": wire.parity if framed else "N",
        "stopbits": wire.stopbits,
        "xonxoff": wire.xonxoff,
        "rtscts": wire.rtscts,
        "dsrdtr": wire.dsrdtr,
        "timeout": wire.timeout,
        "write_timeout": wire.timeout,
        "exclusive": None if is_url else True,
    }


def open_port(port: str, wire: SerialSettings, what: str) -> serial.Serial:
    """The port at `port` (any address pyserial takes), held by this program alone.

    Args:
        port: `/dev/ttyUSB0`, `COM3`, `socket://host:port`, `sim://...`.
        wire: settings.
        what: the instrument's role, for messages.

    Raises:
        NotFoundError: no such port, or no right to use it.
        InstrumentError: another program holds it.
    """
    protocol_socket.POLL_TIMEOUT = CONNECT
    try:
        opened: serial.Serial = serial.serial_for_url(
            port, do_not_open=True, **port_settings(port, wire)
        )
        opened.timeout = min(wire.timeout, HEARTBEAT)
        if wire.dtr is not None:
            opened.dtr = wire.dtr
        opened.open()
    except (*PORT_ERRORS, ValueError) as reason:
        raise _told(port, what, reason) from reason
    return opened


def send_on(port: serial.SerialBase) -> None:
    """Have a port send that its far end has stopped by XOFF; others are left alone."""
    switch = getattr(port, "set_output_flow_control", None)
    if switch is not None:  # a network port has none
        switch(False)  # Linux resumes only what it has stopped itself
        switch(True)


def release(port: serial.Serial, *, unsent: bool = False) -> None:
    """Close a port, also one whose far end is gone.

    Args:
        port: to close; idempotent.
        unsent: drop what could not be sent yet: Linux would wait for it for 30 s.
    """
    # pyserial's socket:// forgets to close a socket whose peer is gone
    left_open = getattr(port, "_socket", None)
    try:
        if unsent and port.is_open:
            port.reset_output_buffer()
    except PORT_ERRORS:
        pass  # nothing can be dropped on a port that is gone
    try:
        port.close()
        if left_open is not None:
            left_open.close()
    except PORT_ERRORS:
        return  # an unplugged port has nothing left to close


def _told(port: str, what: str, reason: Exception) -> InstrumentError:
    number = system_number(reason)
    # with a number pyserial tells port and reason twice
    why = str(reason) if number is None else os.strerror(number)
    start = f"The {what} at {port} cannot be opened ({why})."
    if number in (errno.EAGAIN, errno.EBUSY):
        return InstrumentError(f"{start} Another program holds the port; close it.")
    if number in (errno.EACCES, errno.EPERM):
        return NotFoundError(
            f"{start} You may not use the port; on Linux join the group dialout "
            "(sudo usermod -aG dialout $USER) and log in again."
        )
    if port.startswith("socket:"):
        return NotFoundError(
            f"{start} Check that it is switched on and in this network, and that the "
            "bench file names its address and the port of its text commands."
        )
    return NotFoundError(
        f"{start} Check that it is plugged in and that the bench file names its "
        f"port{_there(port)}; `tactile-lab devices` lists what is there."
    )


def _there(port: str) -> str:
    """USB serial ports there are, for a message: a name changes when cables are."""
    if "://" in port:
        return ""
    from serial.tools import list_ports

    names = [one.device for one in list_ports.comports() if one.vid is not None]
    return f" (there now: {', '.join(sorted(names))})" if names else ""
