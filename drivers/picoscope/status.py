"""PICO_STATUS codes: what they mean for us and which error they become."""

from __future__ import annotations

from dataclasses import dataclass

from tactile_lab.errors import (
    InstrumentError,
    LimitError,
    LinkLostError,
    NotFoundError,
    RefusedError,
    SamplesLostError,
    TactileLabError,
)

OK = 0x00
NOT_FOUND = 0x03
NOT_RESPONDING = 0x07
INVALID_HANDLE = 0x0C
STREAMING_FAILED = 0x14
BUSY = 0x27
DRIVER_FUNCTION = 0x43
SUPPLY_CONNECTED = 0x119
SUPPLY_NOT_CONNECTED = 0x11A
UNDERVOLTAGE = 0x11C
USB3_ON_USB2_PORT = 0x11E
CHANNEL_NEEDS_SUPPLY = 0x122

POWER = frozenset({SUPPLY_CONNECTED, SUPPLY_NOT_CONNECTED, USB3_ON_USB2_PORT})
"""Codes that `ps3000aChangePowerSource` acknowledges."""

AGAIN = frozenset({BUSY, DRIVER_FUNCTION})
"""Codes from a streaming poll that mean: nothing yet, ask again."""

DEAD = frozenset({NOT_FOUND, NOT_RESPONDING, INVALID_HANDLE})
"""Codes after which the handle is of no use."""


@dataclass(frozen=True)
class Meaning:
    """One status code.

    Attributes:
        name: as in the vendor's header, without PICO_.
        text: what it means here, and what to do.
        error: what it is raised as.
    """

    name: str
    text: str
    error: type[TactileLabError] = RefusedError


MEANINGS: dict[int, Meaning] = {
    OK: Meaning("OK", "no error"),
    0x01: Meaning(
        "MAX_UNITS_OPENED",
        "too many scopes are open; close other programs that use them",
    ),
    0x02: Meaning(
        "MEMORY_FAIL", "the library found no memory; close other programs", RefusedError
    ),
    NOT_FOUND: Meaning(
        "NOT_FOUND",
        "no scope found; check the USB cable and the serial number, close other "
        "programs that use the scope, and on Linux check the udev rule for 0ce9",
        NotFoundError,
    ),
    0x04: Meaning(
        "FW_FAIL", "the scope's firmware did not load; plug the scope in anew"
    ),
    0x05: Meaning(
        "OPEN_OPERATION_IN_PROGRESS",
        "another program is opening the scope; wait a moment and try again",
    ),
    0x06: Meaning("OPERATION_FAILED", "the operation failed; plug the scope in anew"),
    NOT_RESPONDING: Meaning(
        "NOT_RESPONDING",
        "the scope does not answer: unplugged or without power; check cable and power, "
        "then start again",
        LinkLostError,
    ),
    0x08: Meaning(
        "CONFIG_FAIL", "the scope's settings memory is damaged; ask its maker"
    ),
    0x0B: Meaning(
        "OS_NOT_SUPPORTED", "the library does not support this operating system"
    ),
    INVALID_HANDLE: Meaning(
        "INVALID_HANDLE", "the scope is no longer open; open it again", LinkLostError
    ),
    0x0D: Meaning("INVALID_PARAMETER", "a parameter is out of range"),
    0x0F: Meaning(
        "INVALID_VOLTAGE_RANGE", "the scope does not have this range", LimitError
    ),
    0x10: Meaning("INVALID_CHANNEL", "the scope does not have this input", LimitError),
    STREAMING_FAILED: Meaning(
        "STREAMING_FAILED", "streaming stopped by itself", SamplesLostError
    ),
    0x16: Meaning("NULL_PARAMETER", "a pointer was empty"),
    0x1C: Meaning(
        "BUFFER_STALL",
        "unread data would have been overwritten; lower the sample rate or relieve the "
        "computer",
        SamplesLostError,
    ),
    0x1D: Meaning(
        "TOO_MANY_SAMPLES", "more samples than the scope has memory for", LimitError
    ),
    0x23: Meaning("USER_CALLBACK", "the library was called from within its callback"),
    0x24: Meaning("DEVICE_SAMPLING", "the scope is still sampling; stop it first"),
    BUSY: Meaning("BUSY", "busy"),
    0x2B: Meaning(
        "INVALID_SAMPLE_INTERVAL",
        "this sample rate is impossible with so many inputs on this USB port; lower "
        "record.sample_rate or use fewer inputs",
        LimitError,
    ),
    0x2E: Meaning(
        "SIG_GEN_PARAM", "the generator cannot do this; an A model has none", LimitError
    ),
    0x30: Meaning(
        "SIGGEN_TRIGGER_SOURCE", "the generator holds no waveform that waits for this"
    ),
    0x38: Meaning(
        "SIGGEN_OFFSET_VOLTAGE", "beyond the generator's voltage", LimitError
    ),
    0x39: Meaning("SIGGEN_PK_TO_PK", "beyond the generator's voltage", LimitError),
    0x3A: Meaning("CANCELLED", "the operation was cancelled; start again"),
    0x3C: Meaning("INVALID_CALL", "this call is not possible now; start again"),
    DRIVER_FUNCTION: Meaning(
        "DRIVER_FUNCTION", "two calls at once; one thread only may use the scope"
    ),
    0x45: Meaning("INVALID_COUPLING", 'coupling must be "DC" or "AC"', LimitError),
    0x46: Meaning("BUFFERS_NOT_SET", "no data buffers were registered"),
    0x4C: Meaning("POWER_FAILED", "the scope's power failed; check its supply"),
    0x50: Meaning(
        "INVALID_ANALOGUE_OFFSET",
        "the scope does not have this offset at this range",
        LimitError,
    ),
    SUPPLY_CONNECTED: Meaning(
        "POWER_SUPPLY_CONNECTED",
        "the mains adapter was plugged in, which aborts streaming; start again",
    ),
    SUPPLY_NOT_CONNECTED: Meaning(
        "POWER_SUPPLY_NOT_CONNECTED",
        "the mains adapter is not connected; plug it in, or set "
        "scope.allow_usb_power = true in the bench file",
    ),
    0x11B: Meaning(
        "POWER_SUPPLY_REQUEST_INVALID", "the power source is not the one acknowledged"
    ),
    UNDERVOLTAGE: Meaning(
        "POWER_SUPPLY_UNDERVOLTAGE",
        "this USB port cannot feed the scope; use the mains adapter or another port",
    ),
    USB3_ON_USB2_PORT: Meaning(
        "USB3_0_DEVICE_NON_USB3_0_PORT",
        "a USB 3 scope on a USB 2 port or cable, which quarters its rate; use a USB 3 "
        "port, or set scope.allow_usb2 = true in the bench file",
    ),
    CHANNEL_NEEDS_SUPPLY: Meaning(
        "CHANNEL_DISABLED_DUE_TO_USB_POWERED",
        "this input is off while the scope runs from USB; connect the mains adapter",
    ),
}


def describe(status: int) -> str:
    """Name, code and meaning for a person; unknown codes as a number."""
    meaning = MEANINGS.get(status)
    if meaning is None:
        return f"PICO_STATUS 0x{status:X}, unknown to this program (see PicoStatus.h)"
    return f"{meaning.text} (PICO_{meaning.name}, 0x{status:X})"


def failure(status: int, doing: str) -> TactileLabError:
    """The error that `status` stands for; `doing` says what was tried."""
    meaning = MEANINGS.get(status)
    error = InstrumentError if meaning is None else meaning.error
    return error(f"{doing}: {describe(status)}.")
