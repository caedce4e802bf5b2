"""The owner's side of the guard: a small process that outlives a dead or hung program.

The guard (`drivers.coil.guard_process`) holds the other end of a pipe. While armed it
takes silence, or the pipe's end, for danger: it kills a hung owner, opens the port
and switches the output off.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

from drivers.coil import guard_process
from drivers.serial_line.link import GAP_MARGIN, LATEST
from drivers.serial_line.port import port_settings
from tactile_lab.errors import InstrumentError
from tactile_lab.instruments.guard_log import default_log
from tactile_lab.instruments.serial_dialect import CoilDialect, SerialSettings

SILENCE = 1.0
"""Time without heartbeat after which an armed guard acts, s.

A program that hangs keeps the current it had, within the coil's limits: half a second
more of it costs nothing, where a busy computer that stood still for 0.5 s cost the run.
"""

READY = 10.0
"""Longest wait for the guard process to be ready, s."""


def in_process(port: str) -> bool:
    """Whether what answers at `port` dies with this process and needs no guard."""
    return port.startswith(("sim://", "loop://"))


class Guard:
    """Starts and speaks to one guard process.

    Args:
        port: address of the source.
        row: its dialect.
        wire: its serial settings in force.
        log: file the guard appends to; None for the user's state folder.
    """

    def __init__(
        self, port: str, row: CoilDialect, wire: SerialSettings, log: Path | None = None
    ) -> None:
        self._log = log or default_log()
        self._told = port, row, wire
        self._process: subprocess.Popen[bytes] | None = None
        self._armed = False
        self._lost: str | None = None

    @property
    def pid(self) -> int | None:
        """Process id of the guard, None before `start`."""
        return None if self._process is None else self._process.pid

    @property
    def lost(self) -> str | None:
        """Why the guard no longer guards, or None."""
        if self._lost is None and self._process is not None:
            if _is_stopped(self._process.pid):
                self._lost = "it was stopped by a signal"
            code = self._process.poll()
            if code is not None:
                self._lost = f"it ended with code {code}; see {self._log}"
        return self._lost

    def start(self, ports: tuple[str, ...] = (), identity: str | None = None) -> None:
        """Start the process and wait until it is ready.

        Args:
            ports: where the source is, and other names that it may get; as it was
                named unless given.
            identity: what it answered there; under another name, or at another port of
                the same, nothing is switched that answers otherwise.

        Raises:
            InstrumentError: it does not start.
        """
        if self._process is not None:
            if self.lost is None:
                return
            self._process.kill()  # a stopped one would act on its own once it goes on
        self._lost = None
        flags = getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0)
        self._process = subprocess.Popen(
            [sys.executable, "-P", str(Path(guard_process.__file__))],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            creationflags=flags,
            bufsize=0,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        port, row, wire = self._told
        settings = guard_settings(ports or (port,), identity, row, wire, self._log)
        self._process.stdin.write(json.dumps(settings).encode() + b"\n")
        answer = self._process.stdout.readline()
        if answer.strip() != b"ready":
            self._process.kill()
            raise InstrumentError(
                f"The guard process that switches the output off when this program "
                f"dies did not start; see {self._log}."
            )
        try:
            os.set_blocking(self._process.stdin.fileno(), False)
        except (AttributeError, OSError):
            return  # Windows before Python 3.12: a hung guard could block us

    def arm(self) -> None:
        """From now on silence means danger."""
        self._armed = True
        self._say(guard_process.ARM)

    def beat(self) -> None:
        """The thread that owns the source is alive."""
        if self._armed:
            self._say(guard_process.BEAT)

    def disarm(self) -> None:
        """The output is verified off; silence is fine again."""
        if self._armed:
            self._say(guard_process.DISARM)
        self._armed = False

    def stop(self) -> None:
        """Leave when disarmed; while armed, hand the released port to the guard.

        Idempotent.
        """
        process, self._process = self._process, None
        if process is None:
            return
        assert process.stdin is not None and process.stdout is not None
        word = guard_process.TAKE_OVER if self._armed else guard_process.QUIT
        self._armed = False
        try:
            process.stdin.write(word)
        except OSError as reason:
            self._lost = str(reason)
        process.stdin.close()
        process.stdout.close()
        try:
            process.wait(0.0 if word == guard_process.TAKE_OVER else 2.0)
        except subprocess.TimeoutExpired:
            # it works on by itself; nobody is left to wait for it
            process.returncode = 0

    def _say(self, word: bytes) -> None:
        if self._process is None or self._process.stdin is None:
            self._lost = "it was never started"
            return
        try:
            if self._process.stdin.write(word) is None:
                self._lost = "it no longer listens"
        except OSError as reason:
            self._lost = str(reason)


def _is_stopped(pid: int) -> bool:
    """Whether a child of this process was stopped and would not act; POSIX only."""
    if not hasattr(os, "waitid"):
        return False
    try:
        how = os.WSTOPPED | os.WNOHANG | os.WNOWAIT
        return os.waitid(os.P_PID, pid, how) is not None
    except ChildProcessError:
        return False


def guard_settings(
    ports: tuple[str, ...],
    identity: str | None,
    row: CoilDialect,
    wire: SerialSettings,
    log: Path,
) -> dict[str, object]:
    """Everything the guard process needs to know, as plain data."""
    end = wire.send_end
    lines = [*row.stop_lines, row.set_line(0.0), *row.off]
    # somebody may have put the source under its front panel's control
    again = [*row.optional, *lines]
    said = [line + end for line in (wire.preamble, *lines)]
    rest = 0.0
    if wire.min_gap:  # a port takes a line at once and sends it character by character
        longest = max(map(len, (*said, row.identify))) * wire.character_time
        rest = wire.min_gap + GAP_MARGIN + longest
    return {
        "owner": os.getpid(),
        "silence": SILENCE,
        "ports": ports,
        "node": guard_process.node(ports[0]),
        "settings": port_settings(ports[0], wire),
        "ask_name": [line + end for line in (wire.preamble, row.identify)],
        "identity": identity,
        "send": said,
        "again": [line + end for line in (wire.preamble, *again)],
        "rest": rest,
        "latest": wire.timeout + LATEST,
        "query": row.on_query + end,
        "reply_end": wire.reply_end,
        "off_match": row.off_match,
        "log": str(log),
    }
