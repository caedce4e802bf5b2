"""A simulated USB bus as a pyusb backend: enumeration, transfers, halts, unplugging."""

from __future__ import annotations

from array import array
from collections.abc import Iterable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import usb.backend
import usb.util

from sim_backend.usbtmc.device import BULK_IN, BULK_OUT, SimulatedDevice
from sim_backend.usbtmc.faults import UsbFault, gone, halted, in_use, timed_out
from tactile_lab.clock import Clock

_ABORT_BULK_IN, _CLEAR, _SUCCESS = 3, 5, 1


@dataclass(frozen=True)
class Wire:
    """How long bulk transfers take: each waits for a frame, then has it to itself.

    Attributes:
        frame: time between two frames, in which the host begins transfers, s.
        rate: most that bulk transfers carry, B/s.
    """

    frame: float
    rate: float

    def time(self, size: int) -> float:
        """Duration of a transfer of `size` bytes, s."""
        return self.frame + size / self.rate


WIRES = {
    usb.util.SPEED_FULL: Wire(1e-3, 1_216_000.0),
    usb.util.SPEED_HIGH: Wire(125e-6, 53_248_000.0),
}
"""USB 2.0, s. 5.8.4: at full speed 19 packets of 64 bytes fit a frame (table 5-9), at
high speed 13 packets of 512 bytes fit a microframe (table 5-10)."""


class SimulatedBus(usb.backend.IBackend):  # type: ignore[misc]
    """A pyusb backend with simulated devices: ``usb.core.find(backend=bus)``.

    Args:
        devices: what is plugged in.
        clock: time that transfers take (`WIRES`) and time out in; None passes none.
    """

    def __init__(
        self, devices: Iterable[SimulatedDevice] = (), clock: Clock | None = None
    ) -> None:
        super().__init__()
        self.devices: list[SimulatedDevice] = []
        self._clock = clock
        for device in devices:
            self.plug(device)

    def plug(self, device: SimulatedDevice) -> None:
        """Plug a device in."""
        device.address = len(self.devices) + 1
        self.devices.append(device)

    def enumerate_devices(self) -> list[SimulatedDevice]:
        """Devices that are plugged in."""
        return [device for device in self.devices if device.present]

    def get_parent(self, dev: SimulatedDevice) -> None:
        """No hubs."""

    def get_device_descriptor(self, dev: SimulatedDevice) -> SimpleNamespace:
        """USB 2.0, table 9-8."""
        numbers = [n + 1 if text else 0 for n, text in enumerate(dev.strings)]
        return SimpleNamespace(
            bLength=18, bDescriptorType=1, bcdUSB=0x0200, bDeviceClass=0,
            bDeviceSubClass=0, bDeviceProtocol=0, bMaxPacketSize0=64,
            idVendor=dev.vendor, idProduct=dev.product, bcdDevice=0x0100,
            iManufacturer=numbers[0], iProduct=numbers[1], iSerialNumber=numbers[2],
            bNumConfigurations=1, bus=1, address=dev.address, port_number=dev.address,
            port_numbers=(dev.address,), speed=dev.speed,
        )  # fmt: skip

    def get_configuration_descriptor(
        self, dev: SimulatedDevice, config: int
    ) -> SimpleNamespace:
        """USB 2.0, table 9-10."""
        if config != 0:
            raise IndexError(config)
        return SimpleNamespace(
            bLength=9, bDescriptorType=2, wTotalLength=32, bNumInterfaces=1,
            bConfigurationValue=1, iConfiguration=0, bmAttributes=0xC0, bMaxPower=50,
            extra_descriptors=[],
        )  # fmt: skip

    def get_interface_descriptor(
        self, dev: SimulatedDevice, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        """USB 2.0, table 9-12."""
        if (intf, alt, config) != (0, 0, 0):
            raise IndexError(intf)
        kind, subkind, protocol = dev.interface
        return SimpleNamespace(
            bLength=9, bDescriptorType=4, bInterfaceNumber=0, bAlternateSetting=0,
            bNumEndpoints=2, bInterfaceClass=kind, bInterfaceSubClass=subkind,
            bInterfaceProtocol=protocol, iInterface=0, extra_descriptors=[],
        )  # fmt: skip

    def get_endpoint_descriptor(
        self, dev: SimulatedDevice, ep: int, intf: int, alt: int, config: int
    ) -> SimpleNamespace:
        """USB 2.0, table 9-13."""
        address = (BULK_OUT, BULK_IN)[ep]
        return SimpleNamespace(
            bLength=7, bDescriptorType=5, bEndpointAddress=address, bmAttributes=2,
            wMaxPacketSize=dev.packet, bInterval=0, bRefresh=0, bSynchAddress=0,
            extra_descriptors=[],
        )  # fmt: skip

    def open_device(self, dev: SimulatedDevice) -> SimulatedDevice:
        """The device is its own handle."""
        dev.strike("open")
        dev.opened += 1
        return dev

    def close_device(self, dev_handle: SimulatedDevice) -> None:
        """Close."""
        dev_handle.opened -= 1

    def get_configuration(self, dev_handle: SimulatedDevice) -> int:
        """Always configured."""
        return 1

    def set_configuration(self, dev_handle: SimulatedDevice, config_value: int) -> None:
        """Always configured."""

    def set_interface_altsetting(
        self, dev_handle: SimulatedDevice, intf: int, altsetting: int
    ) -> None:
        """There is one setting."""

    def claim_interface(self, dev_handle: SimulatedDevice, intf: int) -> None:
        """Claim; busy while a kernel driver has it."""
        dev_handle.strike("claim")
        if dev_handle.kernel_driver or dev_handle.claimed:
            raise in_use()
        dev_handle.claimed = True

    def release_interface(self, dev_handle: SimulatedDevice, intf: int) -> None:
        """Release."""
        if not dev_handle.present:
            raise gone()
        dev_handle.claimed = False

    def is_kernel_driver_active(self, dev_handle: SimulatedDevice, intf: int) -> bool:
        """Whether a kernel driver is bound."""
        return dev_handle.kernel_driver

    def detach_kernel_driver(self, dev_handle: SimulatedDevice, intf: int) -> None:
        """Unbind the kernel driver."""
        dev_handle.kernel_driver = False

    def attach_kernel_driver(self, dev_handle: SimulatedDevice, intf: int) -> None:
        """Bind the kernel driver again."""
        dev_handle.kernel_driver = True

    def bulk_write(
        self, dev_handle: SimulatedDevice, ep: int, intf: int, data: Any, timeout: int
    ) -> int:
        """One bulk-out transfer."""
        fault = self._transfer(dev_handle, "write", ep, timeout)
        if fault is not None and fault.kind == "timeout":
            self._time_out(timeout)
        if dev_handle.function is not None:
            if fault is not None:
                dev_handle.function.spoil(fault)
            self._pass(dev_handle, len(data))
            dev_handle.function.received(bytes(data))
        return len(data)

    def bulk_read(
        self, dev_handle: SimulatedDevice, ep: int, intf: int, buff: Any, timeout: int
    ) -> int:
        """One bulk-in transfer or the part of it that fits."""
        fault = self._transfer(dev_handle, "read", ep, timeout)
        if fault is not None and fault.kind == "timeout":
            self._time_out(timeout)
        if fault is not None and fault.kind == "short":
            return dev_handle.cut(buff, fault.amount)
        filled = dev_handle.read(buff)
        if filled < 0:
            self._time_out(timeout)
        self._pass(dev_handle, filled)
        return filled

    def ctrl_transfer(
        self,
        dev_handle: SimulatedDevice,
        bmRequestType: int,  # noqa: N803  pyusb's names
        bRequest: int,  # noqa: N803
        wValue: int,  # noqa: N803
        wIndex: int,  # noqa: N803
        data: Any,
        timeout: int,
    ) -> int:
        """A control request; the count of bytes answered."""
        fault = dev_handle.strike("control")
        if dev_handle.hung or (fault is not None and fault.kind == "timeout"):
            self._time_out(timeout)
        answer = self._control(dev_handle, bmRequestType, bRequest, wValue, wIndex)
        if answer is None:
            raise halted()
        count = min(len(answer), len(data))
        data[:count] = array("B", answer[:count])
        return count

    def clear_halt(self, dev_handle: SimulatedDevice, ep: int) -> None:
        """Let a halted endpoint go on."""
        if not dev_handle.present:
            raise gone()
        dev_handle.halted.discard(ep)

    def reset_device(self, dev_handle: SimulatedDevice) -> None:
        """A port reset."""
        dev_handle.halted.clear()

    def _transfer(
        self, device: SimulatedDevice, call: str, endpoint: int, timeout: int
    ) -> UsbFault | None:
        fault = device.strike(call)
        if fault is not None and fault.kind == "stall":
            device.halted.add(endpoint)
        if endpoint in device.halted:
            raise halted()
        if device.hung:
            self._time_out(timeout)
        return fault

    def _pass(self, device: SimulatedDevice, size: int) -> None:
        """Let the time pass that a transfer of `size` bytes takes."""
        if self._clock is not None:
            self._clock.sleep_until(self._clock.now() + WIRES[device.speed].time(size))

    def _time_out(self, milliseconds: int) -> None:
        if self._clock is not None:
            self._clock.sleep_until(self._clock.now() + milliseconds / 1e3)
        raise timed_out()

    def _control(
        self, device: SimulatedDevice, kind: int, request: int, value: int, index: int
    ) -> bytes | None:
        if (kind, request) == (0x80, 0):
            return b"\0\0"
        if (kind, request) == (0x80, 6) and value >> 8 == 3:
            return _string(device.strings, value & 0xFF)
        if device.function is None:
            return None
        if (kind, request) == (0xA1, _CLEAR):
            device.forget()
        ended = (kind, request) == (0xA2, _ABORT_BULK_IN) and device.end_transfer()
        answer = device.function.control(kind, request, value, index)
        return bytes([_SUCCESS, value & 0xFF]) if ended else answer


def _string(strings: list[str], index: int) -> bytes | None:
    if index == 0:
        return b"\x04\x03\x09\x04"
    if index > len(strings):
        return None
    text = strings[index - 1].encode("utf-16-le")
    return bytes([len(text) + 2, 3]) + text
