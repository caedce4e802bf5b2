"""One opened PicoScope: its handle, who it is, and calls that raise."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivers.picoscope import status
from drivers.picoscope.sdk import ENUMERATE, INFORMATION, INPUTS, bind, load
from drivers.picoscope.sdk_calls import LibraryCalls
from tactile_lab.errors import LimitError, NotFoundError, RefusedError
from tactile_lab.scope import Channel

_MOST_ACKNOWLEDGEMENTS = 4

MOST_TEXT = 1024
"""Characters of a list of serial numbers."""


class ScopeUnit:
    """A PicoScope's handle.

    Args:
        library: the library's file or folder, a loaded library (any object with the C
            functions), or None to search the usual places.
        serial: the unit's serial number; None for the first free one.
        allow_usb2: accept a USB 3 scope on a USB 2 port.
        allow_usb_power: accept a missing mains adapter.
    """

    def __init__(
        self,
        library: str | Any | None,
        serial: str | None,
        *,
        allow_usb2: bool,
        allow_usb_power: bool,
    ) -> None:
        self.information: dict[str, str] = {}
        self.accepted: tuple[str, ...] = ()
        """Names of power states acknowledged when the unit was opened or restarted."""
        self.full_scale = 0
        self._library = library
        self._serial = serial
        self._allowed = {
            status.SUPPLY_CONNECTED: True,
            status.SUPPLY_NOT_CONNECTED: allow_usb_power,
            status.USB3_ON_USB2_PORT: allow_usb2,
        }
        self._calls: LibraryCalls | None = None
        self._handle = 0
        self._power = status.OK
        self._memory: dict[int, NDArray[np.int16]] = {}

    @property
    def is_open(self) -> bool:
        """Whether there is a handle."""
        return self._handle != 0

    @property
    def shift(self) -> int:
        """Low bits of every code that are always 0."""
        return (self.full_scale & -self.full_scale).bit_length() - 1

    def open(self) -> None:
        """Load the library, open the unit, read who it is.

        Raises:
            NotFoundError: no library, or no free scope.
            LimitError: it is powered or connected in a way that was not allowed.
        """
        if self._calls is None:
            found = self._library is None or isinstance(self._library, str)
            library = load(self._library) if found else bind(self._library)
            self._calls = LibraryCalls(library)
        handle = ctypes.c_int16(0)
        text = None if self._serial is None else _text(self._serial)
        code = self._calls("ps3000aOpenUnit", ctypes.byref(handle), text)
        self._handle, self._power = max(handle.value, 0), status.OK
        which = "the scope" if self._serial is None else f"scope {self._serial}"
        try:
            if code == status.NOT_FOUND and self._serial is not None:
                attached = units(self._calls)
                if attached and self._serial not in attached:
                    raise NotFoundError(
                        f"Scope {self._serial} is not attached, but "
                        f"{' and '.join(attached)}. Plug it in, or correct serial in "
                        "[scope] of the bench file."
                    )
            self.accepted = self._acknowledged(code, f"Opening {which}")
            self.information = {name: self._read(name) for name in INFORMATION}
            if self._serial is None:
                self._tell_others()
            elif (opened := self.information["serial"]) != self._serial:
                raise NotFoundError(
                    f"Asked for scope {self._serial}, the library opened {opened}. "
                    "Correct serial in [scope] of the bench file, or unplug the other."
                )
            most = ctypes.c_int16()
            self.do("Reading full scale", "ps3000aMaximumValue", ctypes.byref(most))
            self.full_scale = most.value
        except Exception:
            self.close()
            raise

    def _tell_others(self) -> None:
        """Note which other scopes could have been meant."""
        own = self.information["serial"]
        found = [] if self._calls is None else units(self._calls)
        if others := [one for one in found if one != own]:
            self.information["others"] = ", ".join(others)

    def call(self, name: str, *arguments: Any) -> int:
        """Call a function with this handle and return its status.

        Raises:
            RefusedError: not open.
        """
        if self._calls is None or not self._handle:
            raise RefusedError("The scope is not open; open it first.")
        code = self._calls(name, self._handle, *arguments)
        if code in status.POWER:
            self._power = code
        return code

    def do(self, doing: str, name: str, *arguments: Any) -> None:
        """Call a function with this handle.

        Raises:
            TactileLabError: any status but OK, with `doing` in the message.
        """
        code = self.call(name, *arguments)
        if code != status.OK:
            raise status.failure(code, doing)

    def register(self, channel: Channel, memory: NDArray[np.int16]) -> None:
        """Have the library write an input's samples to `memory`.

        The memory is kept until replaced, because the library holds a pointer to it.

        Raises:
            TactileLabError: any status but OK.
        """
        number = INPUTS.index(channel.input)
        assert memory.dtype == np.int16 and memory.flags.c_contiguous
        self._memory[number] = memory
        pointer = memory.ctypes.data_as(ctypes.POINTER(ctypes.c_int16))
        self.do(
            f"Registering memory for input {channel.input}", "ps3000aSetDataBuffer",
            number, pointer, memory.size, 0, 0,
        )  # fmt: skip

    def restore_power(self) -> None:
        """Acknowledge a change of power since the last time, where allowed.

        Raises:
            LimitError: a power state that was not allowed.
        """
        if self._power != status.OK:
            code, self._power = self._power, status.OK
            self.accepted += self._acknowledged(code, "Starting again")

    def answers(self) -> bool:
        """Ping the scope: whether it is still there."""
        return self.call("ps3000aPingUnit") not in status.DEAD

    def close(self) -> None:
        """Let go of the handle; idempotent.

        Raises:
            RefusedError: the unit is there but could not be closed.
        """
        if self._calls is None or not self._handle:
            return
        code = self._calls("ps3000aCloseUnit", self._handle)
        self._handle = 0
        self._memory.clear()
        self._calls.released()
        if code not in status.DEAD | {status.OK}:
            raise RefusedError(
                f"The scope was not let go of: {status.describe(code)}. What it had "
                "delivered is kept. If it cannot be opened again, pull its USB cable "
                "and put it back."
            )

    def _acknowledged(self, code: int, doing: str) -> tuple[str, ...]:
        """Answer power states, of which one may follow another, until it is ready."""
        accepted: list[str] = []
        for _ in range(_MOST_ACKNOWLEDGEMENTS):
            if code not in self._allowed or self._calls is None:
                break
            if not self._allowed[code]:
                raise LimitError(f"{doing}: {status.describe(code)}.")
            accepted.append(status.MEANINGS[code].name)
            code = self._calls("ps3000aChangePowerSource", self._handle, code)
        if code != status.OK:
            raise status.failure(code, doing)
        return tuple(accepted)

    def _read(self, item: str) -> str:
        text = (ctypes.c_int8 * 64)()
        needed = ctypes.c_int16()
        self.do(
            f"Reading the scope's {item}", "ps3000aGetUnitInfo",
            text, len(text), ctypes.byref(needed), INFORMATION[item],
        )  # fmt: skip
        return bytes(text).split(b"\0", 1)[0].decode("ascii", "replace")


def units(calls: Callable[..., int]) -> list[str]:
    """Serial numbers of the units that are attached; none where that is not told.

    Args:
        calls: calls a function of the library by its name.
    """
    count, length = ctypes.c_int16(0), ctypes.c_int16(MOST_TEXT)
    text = (ctypes.c_int8 * MOST_TEXT)()
    told = ctypes.byref(count), text, ctypes.byref(length)
    try:
        code = calls(ENUMERATE, *told)
    except AttributeError:
        return []  # a library that has no such function
    if code != status.OK or count.value < 1:
        return []
    names = bytes(text).split(b"\0", 1)[0].decode("ascii", "replace").split(",")
    return [one.strip() for one in names if one.strip()]


def _text(serial: str) -> ctypes.Array[ctypes.c_int8]:
    raw = serial.encode("ascii", "replace") + b"\0"
    return (ctypes.c_int8 * len(raw)).from_buffer_copy(raw)
