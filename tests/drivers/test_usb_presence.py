"""Presence, hot-plugging and link speed on a simulated bus."""

from __future__ import annotations

import pytest
import usb.core
import usb.util

from drivers.usb_presence import PICO, present
from sim_backend.usbtmc.bus import SimulatedBus
from sim_backend.usbtmc.device import SimulatedDevice
from sim_backend.usbtmc.faults import UsbFault
from sim_backend.usbtmc.function import INTERFACE
from tactile_lab.errors import NotFoundError


def picoscope(*faults: UsbFault, speed: int = 4) -> SimulatedDevice:
    return SimulatedDevice(
        vendor=PICO, product=0x1213, serial="AB1/1", maker="Pico Technology",
        title="PicoScope 3000", speed=speed, faults=faults,
    )  # fmt: skip


def rigol() -> SimulatedDevice:
    return SimulatedDevice(
        vendor=0x1AB1, product=0x04CE, serial="DS1", maker="Rigol", title="DS1000Z",
        interface=INTERFACE, packet=64,
    )  # fmt: skip


def test_what_is_attached() -> None:
    pico, scope = present(SimulatedBus([picoscope(), rigol()]))
    assert pico.is_picoscope and not pico.usbtmc
    assert (pico.title, pico.serial) == ("Pico Technology PicoScope 3000", "AB1/1")
    assert pico.link == "5 Gbit/s (USB 3)"
    assert pico.problem is None
    assert scope.usbtmc and not scope.is_picoscope and scope.problem is None
    assert scope.link == "480 Mbit/s (USB 2)"


def test_one_maker_only() -> None:
    bus = SimulatedBus([picoscope(), rigol()])
    assert [one.vendor for one in present(bus, vendor=PICO)] == [PICO]
    assert present(SimulatedBus(), vendor=PICO) == ()


def test_a_usb2_port_is_a_problem_with_a_remedy() -> None:
    (pico,) = present(SimulatedBus([picoscope(speed=usb.util.SPEED_HIGH)]))
    assert pico.problem is not None
    assert "480 Mbit/s" in pico.problem and "allow_usb2 = true" in pico.problem


@pytest.mark.parametrize("call", ["open", "control"])
def test_no_permission_is_a_problem_with_a_remedy(call: str) -> None:
    fault = UsbFault(kind="access", call=call, times=99)  # type: ignore[arg-type]
    (pico,) = present(SimulatedBus([picoscope(fault)]))
    assert not pico.readable
    assert pico.problem is not None
    assert 'ATTR{idVendor}=="0ce9"' in pico.problem


def test_a_device_that_vanishes_meanwhile_is_left_out() -> None:
    bus = SimulatedBus([picoscope(UsbFault(kind="unplug", call="control")), rigol()])
    assert [one.vendor for one in present(bus)] == [0x1AB1]


def test_a_device_without_strings_is_no_problem() -> None:
    (bare,) = present(SimulatedBus([SimulatedDevice(vendor=PICO, product=1, speed=4)]))
    assert bare.readable and bare.problem is None and bare.title == ""


def test_nothing_is_left_open() -> None:
    devices = [picoscope(), rigol()]
    present(SimulatedBus(devices))
    assert [device.opened for device in devices] == [0, 0]


def test_without_libusb_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def nothing(**_: object) -> None:
        raise usb.core.NoBackendError("No backend available")

    monkeypatch.setattr(usb.core, "find", nothing)
    with pytest.raises(NotFoundError, match=r"Install libusb 1\.0"):
        present()
