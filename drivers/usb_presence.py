"""What hangs on the USB: presence, hot-plugging and link speed, without opening ports.

PicoScopes cannot be driven through pyusb, but seen: port speed, coming and going.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import usb.core
import usb.util

from drivers.usbtmc.errors import UDEV, is_gone, translating

PICO = 0x0CE9
"""Vendor id of Pico Technology; product ids are not relied on."""

SPEEDS = {
    1: "1.5 Mbit/s (USB 1, low)",
    2: "12 Mbit/s (USB 1, full)",
    3: "480 Mbit/s (USB 2)",
    4: "5 Gbit/s (USB 3)",
    5: "10 Gbit/s (USB 3.1)",
}
_SUPER = 4
_GET_STATUS = 0
_USBTMC = (0xFE, 0x03)


@dataclass(frozen=True, kw_only=True)
class Present:
    """One attached device.

    Attributes:
        vendor, product: ids.
        bus, address: where it is; new after each plugging in.
        speed: link speed as libusb counts, 0 if unknown.
        title: maker's and product's name, "" where they may not be read.
        serial: serial number, "" if it has none or it may not be read.
        usbtmc: it has a USBTMC interface.
        readable: this user may open it.
    """

    vendor: int
    product: int
    bus: int
    address: int
    speed: int
    title: str
    serial: str
    usbtmc: bool
    readable: bool

    @property
    def is_picoscope(self) -> bool:
        """Made by Pico Technology."""
        return self.vendor == PICO

    @property
    def link(self) -> str:
        """Link speed for a person."""
        return SPEEDS.get(self.speed, "unknown speed")

    @property
    def problem(self) -> str | None:
        """What stands in its way, and the remedy; None if nothing does."""
        name = self.title or f"{self.vendor:04x}:{self.product:04x}"
        if not self.readable and (self.is_picoscope or self.usbtmc):
            return (
                f"{name} may not be opened by this user. On Linux put this line in "
                "/etc/udev/rules.d/70-tactile-lab.rules and plug it in anew: "
                + UDEV.format(vendor=self.vendor)
            )
        if self.is_picoscope and 0 < self.speed < _SUPER:
            return (
                f"{name} runs at {self.link}. On a USB 3 port and cable it has four "
                "times the rate; to go on like this set scope.allow_usb2 = true."
            )
        return None


def present(backend: Any = None, *, vendor: int | None = None) -> tuple[Present, ...]:
    """All attached devices, in the order of bus and address.

    A device that vanishes while it is looked at is left out.

    Args:
        backend: pyusb backend; None for libusb.
        vendor: only this maker's.

    Raises:
        NotFoundError: libusb is not installed.
    """
    wanted = {} if vendor is None else {"idVendor": vendor}
    with translating("The USB", vendor or 0):
        devices: Iterable[Any] = usb.core.find(find_all=True, backend=backend, **wanted)
        seen = [found for device in devices if (found := _seen(device)) is not None]
    return tuple(sorted(seen, key=lambda one: (one.bus, one.address)))


def _seen(device: Any) -> Present | None:
    try:
        title, serial, readable = _strings(device)
        interfaces = _interfaces(device)
    except usb.core.USBError as error:
        if is_gone(error):
            return None
        raise
    finally:
        usb.util.dispose_resources(device)
    return Present(
        vendor=device.idVendor,
        product=device.idProduct,
        bus=device.bus or 0,
        address=device.address or 0,
        speed=device.speed or 0,
        title=title,
        serial=serial,
        usbtmc=_USBTMC in interfaces,
        readable=readable,
    )


def _strings(device: Any) -> tuple[str, str, bool]:
    """Title, serial number, and whether they could be read."""
    try:
        try:
            texts = [device.manufacturer, device.product, device.serial_number]
        except ValueError:
            # pyusb says this of any failure: ask for the status to learn which
            device.ctrl_transfer(0x80, _GET_STATUS, 0, 0, 2)
            return "", "", True
    except usb.core.USBError as error:
        if is_gone(error):
            raise
        return "", "", False
    maker, product, serial = (text or "" for text in texts)
    return f"{maker} {product}".strip(), serial, True


def _interfaces(device: Any) -> set[tuple[int, int]]:
    return {
        (interface.bInterfaceClass, interface.bInterfaceSubClass)
        for configuration in device
        for interface in configuration
    }
