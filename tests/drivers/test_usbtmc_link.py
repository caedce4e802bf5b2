"""The USBTMC link through pyusb on a simulated bus, and every fault of the wire."""

from __future__ import annotations

import pytest

from drivers.usbtmc.link import UsbtmcLink
from sim_backend.usbtmc.bus import SimulatedBus
from sim_backend.usbtmc.device import SimulatedDevice
from sim_backend.usbtmc.faults import UsbFault
from sim_backend.usbtmc.function import INTERFACE, UsbtmcFunction
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import (
    BadReplyError,
    InstrumentError,
    LinkLostError,
    NoReplyError,
    NotFoundError,
    RefusedError,
)


class Echo:
    """Answers `N?` with N bytes of a block, `say X` with X, and nothing else."""

    def line(self, line: bytes) -> bytes | None:
        if line.endswith(b"?"):
            size = int(line[:-1])
            return b"#9%09d" % size + expected(size)
        return line[4:] if line.startswith(b"say ") else None


class Wire:
    def __init__(self, *faults: UsbFault, packet: int = 64, **function: object) -> None:
        self.clock = SimulatedClock()
        self.function = UsbtmcFunction(Echo(), **function)  # type: ignore[arg-type]
        self.device = SimulatedDevice(
            vendor=0x1AB1, product=0x04CE, serial="S1", maker="M", title="T",
            function=self.function, interface=INTERFACE, packet=packet, faults=faults,
        )  # fmt: skip
        self.bus = SimulatedBus([self.device])
        self.link = UsbtmcLink(
            vendor=0x1AB1, product=0x04CE, serial="S1", backend=self.bus,
            header_once=bool(function.get("header_once")),
        )  # fmt: skip


def expected(size: int) -> bytes:
    return (bytes(range(251)) * (size // 251 + 1))[:size]


@pytest.mark.parametrize("packet", [64, 512])
@pytest.mark.parametrize("header_once", [False, True])
# 41 and 489 bytes fill packets exactly, so that an empty packet ends the transfer
@pytest.mark.parametrize("size", [0, 1, 41, 489, 1000, 250_000, 1_100_000])
def test_blocks_of_any_size(packet: int, header_once: bool, size: int) -> None:
    wire = Wire(packet=packet, header_once=header_once)
    wire.link.open()
    for _ in range(3):
        assert wire.link.ask_block(f"{size}?") == expected(size)
        assert wire.link.ask("say hello") == "hello"
    assert wire.function.protocol_errors == []
    wire.link.close()
    wire.link.close()


def test_a_message_in_several_transfers() -> None:
    wire = Wire(longest=100)
    wire.link.open()
    assert wire.link.ask_block("1234?") == expected(1234)


def test_tags_wrap_without_harm() -> None:
    wire = Wire()
    wire.link.open()
    for k in range(300):
        assert wire.link.ask(f"say {k}") == str(k)
    assert wire.function.protocol_errors == []


def test_a_late_answer_is_not_taken_for_the_next() -> None:
    # the request goes through, the read times out, the answer is then ready
    wire = Wire(UsbFault(kind="timeout", call="read", nth=2))
    wire.link.open()
    assert wire.link.ask("say one") == "one"
    with pytest.raises(NoReplyError, match="did not answer in time"):
        wire.link.ask("say two")
    assert wire.link.ask("say three") == "three"


def test_a_question_nobody_answers() -> None:
    wire = Wire()
    wire.link.open()
    with pytest.raises(NoReplyError):
        wire.link.ask("nonsense")
    assert wire.link.ask("say again") == "again"


@pytest.mark.parametrize("pending", [0, 3])
def test_a_write_that_times_out(pending: int) -> None:
    wire = Wire(UsbFault(kind="timeout", call="write", nth=3), pending_checks=pending)
    wire.link.open()
    assert wire.link.ask("say one") == "one"
    with pytest.raises(NoReplyError):
        wire.link.ask("say two")
    assert wire.link.ask("say three") == "three"


def test_clearing_that_never_ends() -> None:
    wire = Wire(pending_checks=10**6)
    with pytest.raises(NoReplyError, match="stays busy"):
        wire.link.open()
    assert wire.device.opened == 0


@pytest.mark.parametrize("call", ["write", "read"])
def test_a_halted_endpoint_is_cleared(call: str) -> None:
    wire = Wire(UsbFault(kind="stall", call=call, nth=3))  # type: ignore[arg-type]
    wire.link.open()
    with pytest.raises(RefusedError, match="halted"):
        for _ in range(3):
            wire.link.ask("say x")
    assert wire.device.halted == set()
    assert wire.link.ask("say y") == "y"


@pytest.mark.parametrize("kind", ["wrong_tag", "garbled"])
def test_a_wrong_header(kind: str) -> None:
    fault = UsbFault(kind=kind, call="write", nth=3)  # type: ignore[arg-type]
    wire = Wire(fault)
    wire.link.open()
    assert wire.link.ask("say one") == "one"
    with pytest.raises(BadReplyError, match=r"answered request|garbled"):
        wire.link.ask("say two")
    assert wire.link.ask("say three") == "three"


@pytest.mark.parametrize("kind", ["wrong_tag", "garbled"])
def test_the_rest_of_a_bad_answer_is_aborted(kind: str) -> None:
    fault = UsbFault(kind=kind, call="write", nth=3)  # type: ignore[arg-type]
    wire = Wire(fault, longest=4)
    wire.link.open()
    assert wire.link.ask("say one") == "one"
    with pytest.raises(BadReplyError):
        wire.link.ask("say two and much more")
    assert wire.link.ask("say three") == "three"
    assert wire.function.protocol_errors == []


def test_where_nothing_can_be_aborted_everything_is_cleared() -> None:
    wire = Wire()
    wire.link.open()
    wire.function.requests.clear()
    with pytest.raises(NoReplyError):
        wire.link.ask("nonsense")
    initiate_abort_bulk_in, initiate_clear, check_clear = 3, 5, 6
    assert wire.function.requests == [
        initiate_abort_bulk_in,
        initiate_clear,
        check_clear,
    ]


def test_a_short_answer() -> None:
    wire = Wire(UsbFault(kind="short", call="read", nth=2, amount=100))
    wire.link.open()
    assert wire.link.ask("say one") == "one"
    with pytest.raises(InstrumentError, match=r"after|in time|announced"):
        wire.link.ask_block("1000?")
    assert wire.link.ask("say three") == "three"


@pytest.mark.parametrize(
    ("call", "nth"),
    [(call, nth) for call in ("write", "read") for nth in (1, 2, 4)]
    # before these, strings are read to find the device
    + [("control", 3), ("control", 4), ("control", 5)],
)
def test_unplugged_at_any_transfer(call: str, nth: int) -> None:
    wire = Wire(UsbFault(kind="unplug", call=call, nth=nth))  # type: ignore[arg-type]
    with pytest.raises(LinkLostError, match="unplugged or switched off"):
        wire.link.open()
        for _ in range(6):
            wire.link.ask_block("2000?")
        wire.link.clear()
    wire.link.close()
    with pytest.raises(NotFoundError, match="not attached"):
        wire.link.open()
    wire.device.replug()
    wire.device.faults.clear()
    wire.link.open()
    assert wire.link.ask("say back") == "back"


def test_gone_between_finding_and_opening() -> None:
    wire = Wire(UsbFault(kind="unplug", call="open"))
    with pytest.raises((LinkLostError, NotFoundError)):
        wire.link.open()


@pytest.mark.parametrize(
    ("kind", "call", "text"),
    [
        ("access", "open", 'udev.*ATTR{idVendor}=="1ab1"'),
        ("busy", "claim", "in use by another program"),
        ("io", "read", "Check its cable"),
        ("io", "write", "Check its cable"),
    ],
)
def test_messages_say_what_to_do(kind: str, call: str, text: str) -> None:
    wire = Wire(UsbFault(kind=kind, call=call, times=9))  # type: ignore[arg-type]
    wire.link.serial = None if kind == "access" else "S1"
    with pytest.raises(InstrumentError, match=text):
        wire.link.open()
        wire.link.ask("say x")


def test_an_instrument_that_hangs() -> None:
    wire = Wire(UsbFault(kind="hang", call="write", nth=2))
    wire.link.open()
    with pytest.raises(NoReplyError):
        wire.link.ask("say x")


def test_a_kernel_driver_is_moved_aside_and_put_back() -> None:
    wire = Wire()
    wire.device.kernel_driver = True
    wire.link.open()
    assert not wire.device.kernel_driver
    wire.link.close()
    assert wire.device.kernel_driver
    assert not wire.device.claimed


def test_others_of_its_kind_are_told_where_none_is_named() -> None:
    """The first that was found was taken, unsaid."""
    wire = Wire()
    other = SimulatedDevice(vendor=0x1AB1, product=0x04CE, serial="S2")
    wire.bus.plug(other)
    wire.link.open()
    assert wire.link.others == ()
    wire.link.close()
    wire.link.serial = None
    wire.link.open()
    assert wire.link.others == ("S2",)


def test_another_serial_or_no_usbtmc() -> None:
    wire = Wire()
    wire.link.serial = "S2"
    with pytest.raises(NotFoundError, match="serial S2 is not attached"):
        wire.link.open()
    wire.link.serial = "S1"
    wire.device.interface = (0xFF, 0, 0)
    with pytest.raises(NotFoundError, match="no USBTMC interface"):
        wire.link.open()
    assert wire.device.opened == 0
