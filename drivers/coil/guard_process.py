"""The guard process: switches a coil source off when its owner dies or hangs.

Run by path with its settings as one JSON line on standard input, then single bytes:
arm, beat, disarm, quit, take over. It knows pyserial and the standard library only, so
that it starts fast and nothing else can stop it.
"""

from __future__ import annotations

import contextlib
import json
import os
import re
import select
import signal
import sys
import threading
import time
from pathlib import Path
from typing import Any

import serial

ARM, BEAT, DISARM, QUIT, TAKE_OVER = b"a", b".", b"d", b"q", b"t"

PATIENCE = 60.0
"""Time for which a port that cannot be opened or verified is tried again, s."""

TERMINAL = 2.0
"""Time for which it speaks on the owner's terminal, s; a pipe is then let go of."""

RETRY = 0.001
"""Pause between two attempts to open the port, s."""

MOST_LINES = 12
"""Lines to read for an answer; echoes and late answers may come before it."""

UNKNOWN = "OUTPUT STATE UNKNOWN: switch the coil source off at the instrument"

FIRST = -15
"""Niceness it asks for: a busy computer then runs it first, if it is allowed that."""

LOOK = 0.02
"""Shortest wait between two looks at what the owner said, s."""

STALL = 0.2
"""Lateness of the guard's own waking that excuses one silence, s."""


class OwnerPipe:
    """Listens to the owner's bytes in a thread of its own."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.armed = False
        self.last = time.monotonic()
        self.leave = False
        self.take_over = False
        self.ended = False

    def listen(self) -> None:
        """Read until the pipe ends."""
        while data := os.read(0, 4096):
            with self.changed:
                self.last = time.monotonic()
                for i in range(len(data)):
                    self._heard(data[i : i + 1])
                self.changed.notify()
        with self.changed:
            self.ended = True
            self.changed.notify()

    @property
    def waiting(self) -> bool:
        """Whether there is something that this busy process has not come to read."""
        return os.name == "posix" and bool(select.select([0], [], [], 0)[0])

    def _heard(self, word: bytes) -> None:
        if word in (ARM, DISARM):
            self.armed = word == ARM
        elif word == QUIT:
            self.leave = True
        elif word == TAKE_OVER:
            self.take_over = True


def wait_for_danger(owner: OwnerPipe, silence: float) -> str | None:
    """Why the output must be switched off, or None when the owner left in peace."""
    with owner.changed:
        while True:
            if owner.take_over:
                return "the owner could not verify the output off and let go of it"
            if owner.leave:
                return None
            if owner.ended:
                return "the owner died" if owner.armed else None
            left = owner.last + silence - time.monotonic()
            if owner.armed and left <= 0 and not owner.waiting:
                return f"the owner was silent for {silence:g} s"
            asked = time.monotonic()
            timeout = max(left, LOOK) if owner.armed else None
            owner.changed.wait(timeout)
            if timeout is not None and time.monotonic() - asked > timeout + STALL:
                owner.last = time.monotonic()  # it was this process that slept


def kill_hung(owner: int) -> bool:
    """Kill a hung owner: while it lives it holds the port's lock."""
    if os.name == "posix" and os.getppid() != owner:
        return False  # gone already; its number may be another's by now
    try:
        os.kill(owner, getattr(signal, "SIGKILL", signal.SIGTERM))
    except OSError:
        return False
    return True


def node(port: str) -> list[int] | None:
    """Which device a port's name stands for now; None for an address of a network.

    A cable that is pulled and put back is another device, also under its old name.
    """
    try:
        now = os.stat(port)
    except (OSError, ValueError):
        return None
    return [now.st_dev, now.st_ino, now.st_rdev]


def prepared(told: dict[str, Any]) -> list[serial.SerialBase]:
    """The source's port by all its names, not opened.

    What opening needs is imported by then.
    """
    return [
        serial.serial_for_url(name, do_not_open=True, **told["settings"])
        for name in told["ports"]
    ]


def send_on(port: serial.SerialBase) -> None:
    """Send, though the source said XOFF and its XON may be lost."""
    switch = getattr(port, "set_output_flow_control", None)
    if switch is not None:
        switch(False)  # Linux resumes only what it has stopped itself
        switch(True)


def send(port: serial.SerialBase, told: dict[str, Any], lines: list[str]) -> None:
    """Send lines, with the rest before each without which the source hears none."""
    for line in lines:
        if told["rest"]:
            time.sleep(told["rest"])
        port.write(line.encode("ascii"))


def switch_off(
    told: dict[str, Any],
    ports: list[serial.SerialBase],
    log: GuardLog,
    state: str = UNKNOWN,
) -> str | None:
    """Send and verify output-off, again and again while patience lasts.

    Where the port is another device than the owner had, or has another name, whoever
    answers there is asked for its name first: a stranger is told nothing.

    Args:
        told: the owner's settings.
        ports: of the source.
        log: is told how it goes.
        state: of the output while it is not verified, for the terminal.

    Returns:
        Port at which the output was verified off, None if at none.
    """
    begun = time.monotonic()
    reasons: set[str] = set()
    lines = "send"
    while (spent := time.monotonic() - begun) < PATIENCE:
        if spent > TERMINAL:
            log.leave_terminal(f"{state}; it is tried for {PATIENCE:g} s")
        for name, port in zip(told["ports"], ports, strict=True):
            if port is not ports[0] and node(name) == node(told["ports"][0]):
                continue  # it has not moved
            try:
                with port:
                    send_on(port)
                    if told["identity"] is not None and node(name) != told["node"]:
                        send(port, told, told["ask_name"])
                        wanted = re.escape(told["identity"])
                        _heard(port, told, f"^{wanted}$", "another instrument")
                    send(port, told, told[lines])
                    send(port, told, [told["query"]])
                    text = _heard(port, told, told["off_match"], "not verified off")
                    log.write(f"output verified off ({text!r}) at {name}")
                    return str(name)
            except Exception as reason:  # whatever it is, the output may still be on
                if str(reason) not in reasons:
                    reasons.add(str(reason))
                    log.write(f"trying again: {reason}")
        lines = "again"
        for port in ports:  # its answers may be late; the lines were sent at once
            port.timeout = told["latest"]
        time.sleep(RETRY)
    log.write(UNKNOWN)
    return None


def _heard(
    port: serial.SerialBase, told: dict[str, Any], pattern: str, otherwise: str
) -> str:
    """The first answer that matches `pattern`.

    Raises:
        OSError: none does.
    """
    answers = []
    for _ in range(MOST_LINES):
        answer = port.read_until(told["reply_end"].encode("ascii"))
        if not answer:
            break
        text = answer.decode("ascii", "replace").strip("\r\n\x11\x13\x00 ")
        if re.search(pattern, text):
            return text
        answers.append(text)
    raise OSError(f"{otherwise}, it answers {answers} at {port.port}")


class GuardLog:
    """Appends lines to a file and repeats them on standard error, as long as it has it.

    Args:
        path: of the file; its folder is made.
    """

    def __init__(self, path: str) -> None:
        self._path = Path(path)
        self._terminal = True

    def write(self, text: str) -> None:
        """One line, with date and this process's id."""
        line = f"{time.strftime('%Y-%m-%dT%H:%M:%S%z')} guard {os.getpid()}: {text}\n"
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            with self._path.open("a", encoding="utf-8") as file:
                file.write(line)
        except OSError as reason:
            line += f"(this could not be logged: {reason})\n"
        if not self._terminal:
            return
        try:
            sys.stderr.write(line)
            sys.stderr.flush()
        except OSError:
            self._terminal = False  # it is gone; there is nobody left to tell

    def leave_terminal(self, last: str) -> None:
        """Write one more line and let go of standard error: a pipe may wait for it."""
        if self._terminal:
            self.write(f"{last}; see {self._path}")
            self._terminal = False
            nothing = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nothing, 2)
            os.close(nothing)


def main() -> int:
    """Guard until the owner leaves; 0 when the output is known to be off."""
    for name in ("SIGINT", "SIGHUP", "SIGTERM"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    if hasattr(os, "nice"):
        with contextlib.suppress(OSError):
            os.nice(FIRST)
    told = json.loads(_first_line())
    log = GuardLog(told["log"])
    ports = prepared(told)
    owner = OwnerPipe()
    threading.Thread(target=owner.listen, daemon=True).start()
    os.write(1, b"ready\n")
    reason = wait_for_danger(owner, told["silence"])
    if reason is None:
        return 0
    begun = time.monotonic()
    killed = "silent" in reason and kill_hung(told["owner"])
    # an owner that let go has said it already
    state = "still not verified off" if owner.take_over else UNKNOWN
    off = switch_off(told, ports, log, state)
    log.write(
        f"{reason}{'; it was killed' if killed else ''}; "
        f"owner {told['owner']}, port {off or told['ports'][0]}, "
        f"{'off' if off else 'NOT verified off'} after {time.monotonic() - begun:.3f} s"
    )
    return 0 if off else 1


def _first_line() -> bytes:
    line = b""
    while not line.endswith(b"\n"):
        more = os.read(0, 1)
        if not more:
            sys.exit(0)
        line += more
    return line


if __name__ == "__main__":
    sys.exit(main())
