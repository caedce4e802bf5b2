"""Faults of serial wires and instruments, on a schedule.

Each kind is something seen on real wires; what pyserial raises for each is written
down here as it was observed, not as it should be.
"""

from __future__ import annotations

import errno
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import serial

from drivers.serial_line.port import TermiosError

Kind = Literal[
    "late",
    "missing",
    "partial",
    "garbled",
    "echo",
    "no_terminator",
    "carriage_return",
    "flow_control",
    "noise",
    "refused",
    "deaf",
    "stuck",
    "xoff",
    "unplug",
]

Form = Literal["usb", "windows", "closed", "reset", "half"]

Call = Literal["write", "read", "waiting", "reset"]


@dataclass(frozen=True, kw_only=True)
class SerialFault:
    """One fault and when it strikes.

    Attributes:
        kind: what happens. To an answer: `late` (by `amount` s), `missing`, `partial`
            (`amount` characters come), `garbled`, `echo`, `no_terminator`,
            `carriage_return` instead of the terminator, `flow_control` characters
            around it, `noise` before it. To a line: `refused` with SCPI error -222,
            or `deaf`: neither acted on nor answered (switched off, adapter alive).
            To the wire: `stuck` takes no more characters, `xoff` neither until the
            port is told to send on (the XON was lost), `unplug`.
        line: pattern that the line must match.
        after: clock time from which it may strike, s.
        skip: matching lines that pass first.
        times: how often it strikes; None for ever.
        amount: see `kind`; for `unplug`, s after which the port may be opened again
            (0: never).
        form: of an unplug: `usb` adapter gone, the same on `windows`, socket `closed`
            or `reset`, or closed by `half`: it takes lines and answers none.
        call: of pyserial's, at which an unplug strikes; `line` is the last one sent.
    """

    kind: Kind
    line: str = ""
    after: float = 0.0
    skip: int = 0
    times: int | None = 1
    amount: float = 0.0
    form: Form = "usb"
    call: Call = "write"


@dataclass
class _Pending:
    fault: SerialFault
    skip: int
    times: int | None


class FaultSchedule:
    """Which faults strike which line; counts those that did.

    Args:
        faults: in order of precedence.
    """

    def __init__(self, faults: Iterable[SerialFault] = ()) -> None:
        self.struck = 0
        self._waiting: list[_Pending] = []
        for fault in faults:
            self.add(fault)

    def add(self, fault: SerialFault) -> None:
        """One more fault from now on."""
        self._waiting.append(_Pending(fault, fault.skip, fault.times))

    def clear(self) -> None:
        """No more faults."""
        self._waiting.clear()

    def strike(
        self, line: bytes, time: float, kinds: Iterable[str], call: Call = "write"
    ) -> list[SerialFault]:
        """Faults of these kinds that strike `line` at `time` s, in that call."""
        found = []
        text = line.decode("latin-1")
        for entry in self._waiting:
            fault = entry.fault
            if fault.kind not in kinds or entry.times == 0 or time < fault.after:
                continue
            if fault.call != call:
                continue
            if re.search(fault.line, text) is None:
                continue
            if entry.skip > 0:
                entry.skip -= 1
                continue
            if entry.times is not None:
                entry.times -= 1
            self.struck += 1
            found.append(fault)
        return found


ANSWER_KINDS = (
    "late", "missing", "partial", "garbled", "echo", "no_terminator",
    "carriage_return", "flow_control", "noise",
)  # fmt: skip

REFUSAL = b'-222,"Data out of range"'


def spoilt(
    answer: bytes | None, line: bytes, end: bytes, faults: Iterable[SerialFault]
) -> tuple[float, bytes]:
    """(delay s, bytes) of an answer after `faults`; `end` is its terminator."""
    delay, out = 0.0, b"" if answer is None else answer + end
    for fault in faults:
        if fault.kind == "echo":
            out = line + end + out
        if not out:
            continue
        if fault.kind == "late":
            delay += fault.amount
        elif fault.kind == "missing":
            out = b""
        elif fault.kind == "partial":
            out = out[: int(fault.amount)]
        elif fault.kind == "garbled":
            out = bytes(c ^ 0x80 if i % 3 == 1 else c for i, c in enumerate(out))
        elif fault.kind == "no_terminator":
            out = out.removesuffix(end)
        elif fault.kind == "carriage_return":
            out = out.removesuffix(end) + b"\r"
        elif fault.kind == "flow_control":
            out = b"\x13" + out[:2] + b"\x11\x13" + out[2:] + b"\x11"
        elif fault.kind == "noise":
            out = b"\x00\xfe\x7f" + out
    return delay, out


WINDOWS_GONE = "PermissionError(13, 'The device does not recognize the command.', 22)"


@dataclass
class Unplugged:
    """A port whose far end is gone, and what each call on it then raises.

    Attributes:
        form: how it went.
        returns: clock time from which it may be opened again, s.
        writes: calls of `write` since.
    """

    form: Form
    returns: float
    writes: int = 0

    def write(self) -> None:
        """Raise as `write` does."""
        self.writes += 1
        if self.form == "usb":
            raise serial.SerialException("write failed: [Errno 5] Input/output error")
        if self.form == "windows":
            raise serial.SerialException(f"WriteFile failed ({WINDOWS_GONE})")
        if self.form == "closed" and self.writes == 1:
            return  # the first write after a FIN succeeds silently
        code = 32 if self.form == "closed" else 104
        raise serial.SerialException(f"write failed: [Errno {code}]")

    def read(self) -> None:
        """Raise as `read` does."""
        if self.form == "usb":
            raise serial.SerialException(
                "device reports readiness to read but returned no data (device "
                "disconnected or multiple access on port?)"
            )
        if self.form == "windows":
            raise serial.SerialException(f"ReadFile failed ({WINDOWS_GONE})")
        if self.form == "closed":
            raise serial.SerialException("socket disconnected")
        raise serial.SerialException("connection failed ([Errno 104])")

    def in_waiting(self) -> int:
        """Raise as `in_waiting` does, or say 1 as a dead socket does."""
        if self.form == "usb":
            raise OSError(errno.EIO, "Input/output error")
        if self.form == "windows":
            raise serial.SerialException(f"ClearCommError failed ({WINDOWS_GONE})")
        return 1

    def reset(self) -> None:
        """Raise as `reset_input_buffer` and `flush` do."""
        if self.form == "usb":
            raise TermiosError(errno.EIO, "Input/output error")
        self.read()
