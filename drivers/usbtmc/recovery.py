"""Getting a USBTMC instrument back in step: abort, clear, un-halt (s. 4.2.1)."""

from __future__ import annotations

from typing import Any

import usb.core

from drivers.usbtmc.errors import is_stall, is_timeout
from tactile_lab.errors import NoReplyError

_INITIATE_ABORT_BULK_OUT, _CHECK_ABORT_BULK_OUT = 1, 2
_INITIATE_ABORT_BULK_IN, _CHECK_ABORT_BULK_IN = 3, 4
_INITIATE_CLEAR, _CHECK_CLEAR = 5, 6
_SUCCESS, _PENDING = 0x01, 0x02
_TO_INTERFACE, _TO_ENDPOINT = 0xA1, 0xA2
_MOST_CHECKS = 100
_FLUSH = 1 << 16
_FLUSH_MILLISECONDS = 100


class Recovery:
    """Control requests and endpoints of one claimed USBTMC interface.

    Args:
        device: pyusb device.
        interface: its number.
        endpoints: bulk-out and bulk-in.
        milliseconds: longest wait for one request.
    """

    def __init__(
        self,
        device: Any,
        interface: int,
        endpoints: tuple[Any, Any],
        milliseconds: int,
    ) -> None:
        self._device = device
        self._interface = interface
        self._milliseconds = milliseconds
        self.bulk_out = int(endpoints[0].bEndpointAddress)
        self.bulk_in = int(endpoints[1].bEndpointAddress)
        self.packet = int(endpoints[1].wMaxPacketSize)

    def abort_out(self, tag: int) -> None:
        """Abort what is being sent; clear everything where that is refused."""
        self._abort(_INITIATE_ABORT_BULK_OUT, _CHECK_ABORT_BULK_OUT, self.bulk_out, tag)
        self._device.clear_halt(self.bulk_out)

    def abort_in(self, tag: int) -> None:
        """Abort what is being answered; clear everything where that is refused."""
        self._abort(_INITIATE_ABORT_BULK_IN, _CHECK_ABORT_BULK_IN, self.bulk_in, tag)

    def _abort(self, initiate: int, check: int, endpoint: int, tag: int) -> None:
        inwards = endpoint == self.bulk_in
        try:
            if self._control(_TO_ENDPOINT, initiate, tag, endpoint, 2)[0] == _SUCCESS:
                if inwards:
                    self._flush()
                self._until_done(_TO_ENDPOINT, check, endpoint, 8, flush=inwards)
                return
        except usb.core.USBError as error:
            if not is_stall(error):
                raise
        # nothing in progress, or aborting is not known: start afresh
        self.clear()

    def clear(self) -> None:
        """Empty both directions and un-halt.

        Raises:
            NoReplyError: the instrument stays busy clearing.
        """
        number = self._interface
        try:
            self._control(_TO_INTERFACE, _INITIATE_CLEAR, 0, number, 1)
            self._until_done(_TO_INTERFACE, _CHECK_CLEAR, number, 2, flush=True)
        except usb.core.USBError as error:
            if not is_stall(error):
                raise
        self._device.clear_halt(self.bulk_out)
        self._device.clear_halt(self.bulk_in)

    def _until_done(
        self, kind: int, check: int, index: int, length: int, *, flush: bool
    ) -> None:
        for _ in range(_MOST_CHECKS):
            reply = self._control(kind, check, 0, index, length)
            if reply[0] != _PENDING:
                return
            if flush and reply[1] & 1:
                self._flush()
        raise NoReplyError(
            "The USB instrument stays busy aborting a transfer; switch it off and on."
        )

    def _flush(self) -> None:
        """Read the bulk-in endpoint until a packet is short."""
        size = -(-_FLUSH // self.packet) * self.packet
        try:
            while (
                len(self._device.read(self.bulk_in, size, _FLUSH_MILLISECONDS)) == size
            ):
                pass
        except usb.core.USBError as error:
            if not (is_timeout(error) or is_stall(error)):
                raise

    def _control(
        self, kind: int, request: int, value: int, index: int, length: int
    ) -> bytes:
        reply = self._device.ctrl_transfer(
            kind, request, value, index, length, self._milliseconds
        )
        return bytes(reply) or b"\0"
