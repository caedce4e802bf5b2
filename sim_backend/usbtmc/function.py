"""The USBTMC side of a simulated instrument: headers, requests, aborts, clears."""

from __future__ import annotations

import struct
from collections import deque
from typing import Protocol

from sim_backend.usbtmc.device import BULK_IN, BULK_OUT
from sim_backend.usbtmc.faults import UsbFault

INTERFACE = (0xFE, 0x03, 0x01)
"""Application class, test and measurement, USB488."""

_SUCCESS, _NOTHING_IN_PROGRESS = b"\x01", b"\x81"


class Instrument(Protocol):
    """Answers program messages."""

    def line(self, line: bytes) -> bytes | None:
        """The answer to one message without terminators, or None."""
        ...


class UsbtmcFunction:
    """USBTMC 1.0 in front of an instrument.

    Args:
        instrument: what answers.
        header_once: as old Rigol firmware: a data block goes out under one header that
            states at most 500 bytes.
        pending_checks: how often a status check answers "pending".
        longest: most message bytes of one bulk-in transfer; None for no limit.
    """

    def __init__(
        self,
        instrument: Instrument,
        *,
        header_once: bool = False,
        pending_checks: int = 0,
        longest: int | None = None,
    ) -> None:
        self.protocol_errors: list[str] = []
        self.requests: list[int] = []
        self._instrument = instrument
        self._header_once = header_once
        self._pending_checks = pending_checks
        self._longest = longest
        self._checks = 0
        self._message = b""
        self._answer = b""
        self._ready: deque[bytes] = deque()
        self._fault: UsbFault | None = None

    def spoil(self, fault: UsbFault) -> None:
        """Let the next answer suffer `fault`."""
        self._fault = fault

    def received(self, data: bytes) -> None:
        """A bulk-out transfer: a message, or the request for an answer."""
        if len(data) < 12 or len(data) % 4:
            self.protocol_errors.append(f"transfer of {len(data)} bytes")
            return
        message, tag, inverse, size, attributes = struct.unpack_from("<BBBxIB3x", data)
        if tag == 0 or tag ^ inverse != 0xFF:
            self.protocol_errors.append(f"bTag {tag} with {inverse}")
        elif message == 1:
            if not size or 12 + size + -size % 4 != len(data):
                self.protocol_errors.append(f"{size} bytes in {len(data)}")
            self._message += data[12 : 12 + size]
            if attributes & 1:
                self._execute()
        elif message == 2:
            self._request(tag, size)
        else:
            self.protocol_errors.append(f"MsgID {message}")

    def _execute(self) -> None:
        line, self._message = self._message.rstrip(b"\r\n"), b""
        if self._answer:
            # USB488: a new message discards an answer that was not read
            self.protocol_errors.append("answer not read")
        answer = self._instrument.line(line)
        self._answer = b"" if answer is None else answer + b"\n"

    def _request(self, tag: int, size: int) -> None:
        fault, self._fault = self._fault, None
        if not self._answer:
            return
        whole = self._header_once and self._answer.startswith(b"#")
        most = len(self._answer) if whole else min(size, self._longest or size)
        part, self._answer = self._answer[:most], self._answer[most:]
        if fault is not None and fault.kind == "silent":
            self._answer = b""
            return
        stated = min(len(part), 500) if whole else len(part)
        if fault is not None and fault.kind == "wrong_tag":
            tag = tag % 255 + 1
        inverse = ~tag & 0xFF
        if fault is not None and fault.kind == "garbled":
            inverse ^= 0x55
        header = struct.pack(
            "<BBBxIB3x", 2, tag, inverse, stated, int(not self._answer)
        )
        self._ready.append(header + part + bytes(-len(part) % 4))

    def pending(self) -> bytes | None:
        """The next answer on its way."""
        return self._ready.popleft() if self._ready else None

    def control(self, kind: int, request: int, value: int, index: int) -> bytes | None:
        """Class requests of USBTMC 1.0, s. 4.2.1; others halt."""
        self.requests.append(request)
        if kind == 0xA2 and request == 1 and index == BULK_OUT:
            self._message, self._checks = b"", self._pending_checks
            return _SUCCESS + bytes([value & 0xFF])
        if kind == 0xA2 and request == 3 and index == BULK_IN:
            if not self._ready and not self._answer:
                return _NOTHING_IN_PROGRESS + bytes([value & 0xFF])
            self._forget_answer()
            return _SUCCESS + bytes([value & 0xFF])
        if kind == 0xA2 and request in (2, 4):
            return self._check() + bytes(7)
        if kind == 0xA1 and request == 5:
            self._message = b""
            self._forget_answer()
            return _SUCCESS
        if kind == 0xA1 and request == 6:
            return self._check() + b"\0"
        if kind == 0xA1 and request == 7:
            return b"\x01\x00\x00\x01\x00\x00" + bytes(18)
        return None

    def _forget_answer(self) -> None:
        self._answer, self._checks = b"", self._pending_checks
        self._ready.clear()

    def _check(self) -> bytes:
        if self._checks > 0:
            self._checks -= 1
            return b"\x02"
        return _SUCCESS
