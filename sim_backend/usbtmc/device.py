"""One simulated USB device: what it is, its endpoints, and its faults."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from typing import Any, Protocol

import usb.util

from sim_backend.usbtmc.faults import (
    UsbFault,
    babble,
    failed,
    forbidden,
    gone,
    in_use,
)

BULK_OUT, BULK_IN = 0x01, 0x82


class Function(Protocol):
    """What a device does with transfers."""

    def received(self, data: bytes) -> None:
        """A bulk-out transfer."""
        ...

    def pending(self) -> bytes | None:
        """The bulk-in transfer that is ready, or None."""
        ...

    def control(self, kind: int, request: int, value: int, index: int) -> bytes | None:
        """The answer to a class request; None halts."""
        ...

    def spoil(self, fault: UsbFault) -> None:
        """Let the next answer suffer a fault of its own kind."""
        ...


class SimulatedDevice:
    """One device on the bus.

    Args:
        vendor, product: ids.
        serial: serial number, "" for none.
        maker, title: strings.
        function: what it does; None for a device that only is there.
        interface: class, subclass and protocol of its one interface.
        packet: largest bulk packet: 64 at full, 512 at high speed.
        speed: 1 to 5, as libusb counts.
        kernel_driver: a kernel driver is bound to the interface.
        faults: what goes wrong, and when.
    """

    def __init__(
        self,
        *,
        vendor: int,
        product: int,
        serial: str = "",
        maker: str = "",
        title: str = "",
        function: Function | None = None,
        interface: tuple[int, int, int] = (0xFF, 0, 0),
        packet: int = 512,
        speed: int = usb.util.SPEED_HIGH,
        kernel_driver: bool = False,
        faults: Iterable[UsbFault] = (),
    ) -> None:
        self.vendor, self.product, self.speed = vendor, product, speed
        self.strings = [maker, title, serial]
        self.function = function
        self.interface = interface
        self.packet = packet
        self.kernel_driver = kernel_driver
        self.faults = list(faults)
        self.present = True
        self.hung = False
        self.opened = 0
        self.claimed = False
        self.address = 0
        self.halted: set[int] = set()
        self._calls: dict[str, int] = {}
        self._transfer: bytes | None = None

    def strike(self, call: str) -> UsbFault | None:
        """Count a call; raise or return the fault that strikes at it.

        Raises:
            USBError: as the fault says, or the device is gone.
        """
        if not self.present:
            raise gone()
        count = self._calls[call] = self._calls.get(call, 0) + 1
        fault = next(
            (
                f
                for f in self.faults
                if f.call == call and f.nth <= count < f.nth + f.times
            ),
            None,
        )
        if fault is None:
            return None
        if fault.kind == "unplug":
            self.present = False
            raise gone()
        errors = {"io": failed, "busy": in_use, "access": forbidden}
        if fault.kind in errors:
            raise errors[fault.kind]()
        if fault.kind == "hang":
            self.hung = True
        return fault

    def unplug(self) -> None:
        """Pull the plug."""
        self.present = False

    def replug(self) -> None:
        """Plug it in again, as new."""
        self.present, self.hung, self.opened, self.claimed = True, False, 0, False
        self.halted.clear()
        self._transfer = None

    def read(self, buffer: Any) -> int:
        """Fill `buffer` from the transfer under way; bytes filled, -1 for nothing."""
        if self._transfer is None and self.function is not None:
            self._transfer = self.function.pending()
        if self._transfer is None:
            return -1
        rest, size = self._transfer, len(buffer)
        if len(rest) > size and size % self.packet:
            self._transfer = None
            raise babble()
        part = rest[:size]
        buffer[: len(part)] = array("B", part)
        # a transfer ends with a packet that is not full, if need be an empty one
        over = len(part) < size or len(part) % self.packet != 0
        self._transfer = None if over else rest[size:]
        return len(part)

    def cut(self, buffer: Any, amount: int) -> int:
        """End the transfer under way after `amount` bytes."""
        filled = min(max(self.read(buffer), 0), amount)
        self._transfer = None
        return filled

    def end_transfer(self) -> bool:
        """End the bulk-in transfer under way with one packet; whether there was one."""
        if self._transfer is None and self.function is not None:
            self._transfer = self.function.pending()
        if self._transfer is None:
            return False
        self._transfer = self._transfer[: self.packet // 2]
        return True

    def forget(self) -> None:
        """Drop the bulk-in transfer under way."""
        self._transfer = None
