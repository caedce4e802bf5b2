"""Numbers of the ps3000a interface, from PicoStatus.h and ps3000aApi.h."""

from __future__ import annotations

# PicoStatus.h
OK = 0x00
NOT_FOUND = 0x03
OPERATION_FAILED = 0x06
NOT_RESPONDING = 0x07
INVALID_HANDLE = 0x0C
INVALID_PARAMETER = 0x0D
INVALID_VOLTAGE_RANGE = 0x0F
INVALID_CHANNEL = 0x10
STREAMING_FAILED = 0x14
NULL_PARAMETER = 0x16
BUFFER_STALL = 0x1C
USER_CALLBACK = 0x23
BUSY = 0x27
INVALID_SAMPLE_INTERVAL = 0x2B
DRIVER_FUNCTION = 0x43
INVALID_COUPLING = 0x45
BUFFERS_NOT_SET = 0x46
SUPPLY_CONNECTED = 0x119
SUPPLY_NOT_CONNECTED = 0x11A
REQUEST_INVALID = 0x11B
UNDERVOLTAGE = 0x11C
CHANNEL_DISABLED = 0x122

# PS3000A_RANGE 1 to 10: 20 mV to 20 V
RANGE_VOLTS = {
    1: 0.02, 2: 0.05, 3: 0.1, 4: 0.2, 5: 0.5, 6: 1.0, 7: 2.0, 8: 5.0, 9: 10.0, 10: 20.0,
}  # fmt: skip
COUPLING_NAMES = {0: "AC", 1: "DC"}
INPUT_NAMES = "ABCD"
FULL_SCALE = 32512
SHIFT = 8
GRID = 8e-9


def offset_limit(scale: int) -> float:
    """Largest analogue offset of a PS3000A_RANGE, V."""
    volts = RANGE_VOLTS[scale]
    return 0.25 if volts <= 0.2 else 2.5 if volts <= 2 else 20.0
