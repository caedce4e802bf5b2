"""USBTMC over pyusb: lines and data blocks to and from one instrument."""

from __future__ import annotations

from array import array
from typing import Any

import usb.core
import usb.util

from drivers.usbtmc.errors import is_gone, is_timeout, translated, translating
from drivers.usbtmc.frames import (
    DEV_DEP_MSG_IN,
    HEADER,
    FrameHeader,
    block_payload,
    block_size,
    message_out,
    next_tag,
    request_in,
)
from drivers.usbtmc.recovery import Recovery
from tactile_lab.errors import BadReplyError, LinkLostError, NotFoundError

_CLASS, _SUBCLASS = 0xFE, 0x03
_MOST = 1 << 20


class UsbtmcLink:
    """One USBTMC instrument.

    After a timeout or a garbled reply the transfer is aborted as the standard says
    (s. 4.2.1), so that the next answer belongs to the next question.

    Args:
        vendor, product: USB ids.
        serial: serial number, where several are attached.
        timeout: longest wait for one transfer, s.
        header_once: the instrument sends one header for a whole block, whatever size
            that header states (Rigol DS1000Z firmware).
        backend: pyusb backend; None for libusb.
    """

    def __init__(
        self,
        *,
        vendor: int,
        product: int,
        serial: str | None = None,
        timeout: float = 2.0,
        header_once: bool = False,
        backend: Any = None,
    ) -> None:
        self.vendor, self.product, self.serial = vendor, product, serial
        self._milliseconds = max(1, round(timeout * 1e3))
        self._header_once = header_once
        self._backend = backend
        self.others: tuple[str, ...] = ()
        """Serial numbers of others of its kind, any of which could have been meant."""
        self._device: Any = None
        self._recovery: Recovery | None = None
        self._interface = 0
        self._tag = 0
        self._detached = False
        # whole packets, else an instrument that sends more overflows the buffer
        self._buffer = array("B", bytes(_MOST))

    @property
    def name(self) -> str:
        """The instrument's USB address for messages."""
        serial = "" if self.serial is None else f" serial {self.serial}"
        return f"USB instrument {self.vendor:04x}:{self.product:04x}{serial}"

    @property
    def is_open(self) -> bool:
        """Whether the interface is claimed."""
        return self._device is not None

    def open(self) -> None:
        """Find and claim the instrument and clear its buffers; idempotent.

        Raises:
            NotFoundError: not attached, not USBTMC, or no libusb.
            RefusedError: no permission, or in use.
        """
        if self._device is not None:
            return
        with translating(self.name, self.vendor):
            self._device = self._found()
            try:
                self._claim()
            except Exception:
                self.close()
                raise

    def _found(self) -> Any:
        def fits(device: Any) -> bool:
            return self.serial is None or _serial_of(device) == self.serial

        found = usb.core.find(
            find_all=True,
            idVendor=self.vendor,
            idProduct=self.product,
            custom_match=fits,
            backend=self._backend,
        )
        device, *rest = [*found] or [None]
        self.others = tuple(_serial_of(one) or "one without a number" for one in rest)
        if device is None:
            raise NotFoundError(
                f"{self.name} is not attached. Check its cable and power, and the "
                "serial number in the bench file."
            )
        return device

    def _claim(self) -> None:
        device = self._device
        configuration = device.get_active_configuration()
        interface = usb.util.find_descriptor(
            configuration, bInterfaceClass=_CLASS, bInterfaceSubClass=_SUBCLASS
        )
        if interface is None:
            raise NotFoundError(f"{self.name} has no USBTMC interface.")
        self._interface = interface.bInterfaceNumber
        try:
            if device.is_kernel_driver_active(self._interface):
                device.detach_kernel_driver(self._interface)
                self._detached = True
        except NotImplementedError:
            pass  # only Linux has kernel drivers that could be in the way
        usb.util.claim_interface(device, self._interface)
        self._recovery = Recovery(
            device, self._interface, _endpoints(interface), self._milliseconds
        )
        self._recovery.clear()

    def write(self, line: str) -> None:
        """Send one line.

        Raises:
            NoReplyError: not taken in time; aborted.
            LinkLostError: unplugged.
            RefusedError: the instrument halted.
        """
        recovery = self._opened()
        self._tag = next_tag(self._tag)
        frame = message_out(self._tag, line.encode("ascii") + b"\n")
        try:
            self._device.write(recovery.bulk_out, frame, self._milliseconds)
        except usb.core.USBError as error:
            self._recover(error, recovery.abort_out)
            raise translated(error, self.name, self.vendor) from error

    def read(self) -> bytes:
        """One whole message.

        Raises:
            NoReplyError: nothing came in time; aborted.
            BadReplyError: not a USBTMC answer to this request; aborted.
            LinkLostError: unplugged.
        """
        message, end = self._transfer()
        while not end:
            more, end = self._transfer()
            message += more
        return message

    def ask(self, line: str) -> str:
        """Send a line and return the answering line without its terminator."""
        self.write(line)
        raw = self.read()
        try:
            return raw.decode("ascii").rstrip("\r\n")
        except UnicodeDecodeError as error:
            raise BadReplyError(
                f"{self.name} answered {line!r} with bytes, not text: {raw[:24]!r}."
            ) from error

    def ask_block(self, line: str) -> bytes:
        """Send a line and return the data of the answering block."""
        self.write(line)
        message = self.read()
        if self._header_once:
            start, size = block_size(message)
            if len(message) < start + size:
                message += self._bulk_in(start + size - len(message))
        return block_payload(message)

    def clear(self) -> None:
        """Have the instrument forget what it was told and wanted to answer."""
        with translating(self.name, self.vendor):
            self._opened().clear()

    def close(self) -> None:
        """Let go of the instrument; idempotent, also when it is gone."""
        device, self._device, self._recovery = self._device, None, None
        if device is None:
            return
        try:
            usb.util.release_interface(device, self._interface)
            if self._detached:
                device.attach_kernel_driver(self._interface)
        except usb.core.USBError as error:
            if not is_gone(error):
                raise translated(error, self.name, self.vendor) from error
        finally:
            self._detached = False
            usb.util.dispose_resources(device)

    def _transfer(self) -> tuple[bytes, bool]:
        """Request and read one transfer: its message bytes and whether it ends it."""
        recovery = self._opened()
        tag = self._tag = next_tag(self._tag)
        try:
            self._device.write(
                recovery.bulk_out, request_in(tag, _MOST), self._milliseconds
            )
        except usb.core.USBError as error:
            self._recover(error, recovery.abort_out)
            raise translated(error, self.name, self.vendor) from error
        raw = self._bulk_in(HEADER)
        try:
            header = FrameHeader.unpack(raw)
            if header.message != DEV_DEP_MSG_IN or header.tag != tag:
                raise BadReplyError(
                    f"{self.name} answered request {tag} with message "
                    f"{header.message} of request {header.tag}."
                )
            if header.size > _MOST:
                raise BadReplyError(f"{self.name} announced {header.size} bytes.")
        except BadReplyError:
            self._abort_in(tag)
            raise
        missing = HEADER + header.size - len(raw)
        if missing > 0:
            raw += self._bulk_in(missing)
        # alignment bytes may follow; old Rigol firmware sends data there instead
        most = (
            len(raw) if self._header_once and raw[HEADER:][:1] == b"#" else header.size
        )
        return raw[HEADER : HEADER + most], header.end

    def _bulk_in(self, least: int) -> bytes:
        """At least `least` bytes from the bulk-in endpoint."""
        recovery = self._opened()
        data = bytearray()
        empty = 0
        while len(data) < least:
            try:
                count = self._device.read(
                    recovery.bulk_in, self._buffer, self._milliseconds
                )
            except usb.core.USBError as error:
                self._recover(error, recovery.abort_in)
                raise translated(error, self.name, self.vendor) from error
            # one empty packet may close the transfer before
            empty = 0 if count else empty + 1
            if empty > 1:
                self._abort_in(self._tag)
                raise BadReplyError(
                    f"{self.name} ended its answer after {len(data)} of {least} bytes."
                )
            data += memoryview(self._buffer)[:count]
        return bytes(data)

    def _recover(self, error: usb.core.USBError, abort: Any) -> None:
        """Bring the link back in step after a failed transfer, if it is still there."""
        with translating(self.name, self.vendor):
            if is_timeout(error):
                abort(self._tag)
            elif not is_gone(error):
                self._opened().clear()

    def _abort_in(self, tag: int) -> None:
        with translating(self.name, self.vendor):
            self._opened().abort_in(tag)

    def _opened(self) -> Recovery:
        if self._recovery is None:
            raise LinkLostError(f"{self.name} is not open; open it first.")
        return self._recovery


def _serial_of(device: Any) -> str | None:
    try:
        serial: str | None = device.serial_number
    except (usb.core.USBError, ValueError):
        return None  # it may not be read without permission: not the one we look for
    return serial


def _endpoints(interface: Any) -> tuple[Any, Any]:
    """Bulk-out and bulk-in endpoint of the interface."""
    found = {}
    for endpoint in interface:
        if usb.util.endpoint_type(endpoint.bmAttributes) == usb.util.ENDPOINT_TYPE_BULK:
            direction = usb.util.endpoint_direction(endpoint.bEndpointAddress)
            found[direction] = endpoint
    try:
        return found[usb.util.ENDPOINT_OUT], found[usb.util.ENDPOINT_IN]
    except KeyError as error:
        raise NotFoundError("The USBTMC interface lacks a bulk endpoint.") from error
