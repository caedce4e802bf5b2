"""How a run goes, for other programs: JSON lines over TCP, and their stop taken.

Off unless asked for. Each line out is one object with a key `event` (docs/json.md);
one line in is heeded, ``{"do": "stop"}``. A program that does not read, or never stops
talking, is let go of, and only so many may watch: none can hold up the run or take its
files. Events wait in a thread of this server's own.
"""

from __future__ import annotations

import asyncio
import ipaddress
import json
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any
from urllib.parse import urlsplit

from tactile_lab.acquisition import events
from tactile_lab.errors import SceneError

if TYPE_CHECKING:
    from tactile_lab.engine.execution import Execution

NEWEST = ("begun", "state", "progress", "trial_started", "result")
"""Events of which a program that comes late hears the newest."""

UNREAD = 1 << 20
"""Bytes that may wait for a program before it is let go of."""

MOST_PROGRAMS = 16
"""Programs that may watch at once; one more is refused."""

MOST_LINES = 100
"""Lines that one program may send before it is let go of."""

LONGEST_LINE = 4096
"""Bytes of a line in; a program that sends a longer one is let go of."""

PROGRESS_EVERY = 0.2
"""Least time between two lines of progress, s."""

LAST_WORDS = 2.0
"""Longest wait at the end for programs that are slow to read, s."""


class StatusServer:
    """Serves one run, or one after the other.

    Args:
        address: such as "tcp://127.0.0.1:5025"; port 0 takes a free one.
        stop: ends the run, or what is about to begin one; takes the reason.

    Attributes:
        address: with the port that was taken.
        local: whether only programs on this computer reach it.

    Raises:
        SceneError: the address is none, or cannot be listened at.
    """

    def __init__(self, address: str, stop: Callable[[str], None]) -> None:
        host, port = _parsed(address)
        self._stop = stop
        self._clients: set[asyncio.StreamWriter] = set()
        self._newest: dict[str, dict[str, Any]] = {}
        self._told_progress = float("-inf")
        self._loop = asyncio.new_event_loop()
        try:
            self._server = self._loop.run_until_complete(
                asyncio.start_server(
                    self._serve, host, port, limit=LONGEST_LINE, backlog=MOST_PROGRAMS
                )
            )
        except OSError as reason:
            self._loop.close()
            raise SceneError(
                f"--status {address} cannot be listened at: {reason.strerror}. Name "
                "another port, or 0 for a free one."
            ) from reason
        taken = self._server.sockets[0].getsockname()[1]
        self.address = f"tcp://{f'[{host}]' if ':' in host else host}:{taken}"
        self.local = _is_loopback(host)
        self._thread = threading.Thread(
            target=self._loop.run_forever, name="status", daemon=True
        )
        self._thread.start()

    def __call__(self, event: events.Event) -> None:
        """Tell an event of the run, from any thread; never waits."""
        if isinstance(event, events.Progress):
            now = time.monotonic()
            if now - self._told_progress < PROGRESS_EVERY:
                return
            self._told_progress = now
        line = events.documented(event)
        if line is not None:
            self._tell(line)

    def begin(self, execution: Execution) -> None:
        """This is about to run."""
        self._tell(execution.documented)

    def end(self, result: dict[str, Any]) -> None:
        """Tell what came of it, as ``--json`` prints it."""
        self._tell({"event": "result", **result})

    def _tell(self, line: dict[str, Any]) -> None:
        """Tell every program that listens; one that comes later hears the newest."""
        with suppress(RuntimeError):  # closed
            self._loop.call_soon_threadsafe(self._send, line)

    def close(self) -> None:
        """Say what is left to say and let go of all; idempotent."""
        if not self._loop.is_running():
            return
        leaving = asyncio.run_coroutine_threadsafe(self._leave(), self._loop)
        with suppress(TimeoutError):
            leaving.result(LAST_WORDS + 1)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def _send(self, told: dict[str, Any]) -> None:
        if told["event"] == "begun":
            self._newest.clear()  # of the run before
        if told["event"] in NEWEST:
            self._newest[told["event"]] = told
        line = _line(told)
        for client in tuple(self._clients):
            client.write(line)
            if client.transport.get_write_buffer_size() > UNREAD:
                self._clients.discard(client)
                client.transport.abort()

    async def _serve(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        if len(self._clients) >= MOST_PROGRAMS:
            text = f"{MOST_PROGRAMS} programs watch already"
            writer.write(_line({"event": "refused", "text": text}))
            writer.close()
            return
        for told in self._newest.values():
            writer.write(_line(told))
        self._clients.add(writer)
        try:
            for _ in range(MOST_LINES):
                line = await reader.readline()
                if not line or writer.transport.is_closing():
                    break
                writer.write(_line(self._answered(line)))
        except (ValueError, OSError):  # too long a line, or gone
            pass
        except asyncio.CancelledError:
            return
        finally:
            self._clients.discard(writer)
        writer.close()

    def _answered(self, line: bytes) -> dict[str, Any]:
        """Do what a line says, and say what was done."""
        try:
            asked = json.loads(line)
            what = asked.get("do") if isinstance(asked, dict) else None
        except (ValueError, RecursionError):
            what = None
        if what != "stop":
            text = 'not understood; send {"do": "stop"}'
            return {"event": "refused", "text": text}
        self._stop("stopped by another program")
        text = "a run in progress ends with the coil made safe; no other begins"
        return {"event": "stopping", "text": text}

    async def _leave(self) -> None:
        self._server.close()
        clients, self._clients = tuple(self._clients), set()
        for client in clients:
            with suppress(OSError, TimeoutError):
                await asyncio.wait_for(client.drain(), LAST_WORDS / len(clients))
            client.close()
        await asyncio.sleep(0)
        others = asyncio.all_tasks() - {asyncio.current_task()}
        for task in others:
            task.cancel()
        await asyncio.gather(*others, return_exceptions=True)


def _line(told: dict[str, Any]) -> bytes:
    return json.dumps(told, allow_nan=False).encode() + b"\n"


def _parsed(address: str) -> tuple[str, int]:
    try:
        parts = urlsplit(address)
        port = parts.port
    except ValueError:
        parts, port = urlsplit(""), None
    if parts.scheme != "tcp" or not parts.hostname or port is None or parts.path:
        raise SceneError(
            f"--status {address}: write tcp://HOST:PORT, such as tcp://127.0.0.1:5025."
        )
    return parts.hostname, port


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
