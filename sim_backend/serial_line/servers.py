"""Simulated serial instruments for other programs: pseudo-terminal and TCP.

Each server lives in its own thread on the real clock. The drivers open them by
`/dev/pts/N` or `socket://127.0.0.1:PORT`, through the same pyserial code as hardware.
"""

from __future__ import annotations

import heapq
import os
import select
import socket
import struct
import threading
import time
import tty
from abc import ABC, abstractmethod
from collections import deque
from typing import ClassVar

from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.wires import FarEnd

XOFF = b"\x13"

POLL = 0.05
"""Longest wait before a server looks whether it should end, s."""

RETIRED = 64
"""Terminals whose numbers stay taken after their servers ended."""


class SerialServer(ABC):
    """Brings bytes to a far end and back.

    Args:
        far_end: the instrument, on a real clock.
        paced: let bytes take the time the baud rate gives them, and the instrument
            want its rest between lines.
    """

    def __init__(self, far_end: FarEnd, *, paced: bool = False) -> None:
        self.far_end = far_end
        if not paced:
            far_end.gap = 0.0
        self._each = far_end.wire.character_time if paced else 0.0
        self._due: list[tuple[float, int, bytes]] = []
        self._order = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(
            target=self._serve, name=f"serve {far_end.name}", daemon=True
        )

    @property
    @abstractmethod
    def url(self) -> str:
        """Address for pyserial."""

    def start(self) -> None:
        """Serve from now on."""
        self._thread.start()

    def close(self) -> None:
        """End and let go of the address."""
        self._ending.set()
        if self._thread.ident is not None:
            self._thread.join(2.0)
        self._release()

    def _serve(self) -> None:
        while not self._ending.is_set():
            wait = POLL
            if self._due:
                wait = min(wait, max(0.0, self._due[0][0] - time.monotonic()))
            data = self._receive(wait)
            if data:
                self._take(data)
            while self._due and self._due[0][0] <= time.monotonic():
                self._send(heapq.heappop(self._due)[2])

    def _take(self, data: bytes) -> None:
        began = self.far_end.clock.now()
        if self._each:
            time.sleep(len(data) * self._each)
        struck = self.far_end.faults.strike(
            data, self.far_end.clock.now(), ("unplug", "stuck", "xoff")
        )
        for fault in struck:
            if fault.kind != "xoff":
                self._break(fault)
                return
            self._send(XOFF)
        for answer in self.far_end.take(data, began):
            self._order += 1
            due = time.monotonic() + answer.delay + len(answer.data) * self._each
            heapq.heappush(self._due, (due, self._order, answer.data))

    @abstractmethod
    def _receive(self, wait: float) -> bytes:
        """Bytes that came within `wait` s; empty for none."""

    @abstractmethod
    def _send(self, data: bytes) -> None:
        """Bytes to the client, if there is one."""

    @abstractmethod
    def _break(self, fault: SerialFault) -> None:
        """Have the wire fail."""

    @abstractmethod
    def _release(self) -> None:
        """Let go of everything held."""


class PtyServer(SerialServer):
    """A pseudo-terminal: the POSIX code path of pyserial.

    The slave's descriptor stays open here, else the master could not be read before
    and after each client. It outlives the server: a guard tries an address that is gone
    for a minute, and would lock and switch off whatever got the same number.
    """

    _retired: ClassVar[deque[int]] = deque()

    def __init__(self, far_end: FarEnd, *, paced: bool = False) -> None:
        super().__init__(far_end, paced=paced)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self._path = os.ttyname(self._slave)
        self._lock = threading.Lock()

    @property
    def url(self) -> str:
        """Path of the terminal."""
        return self._path

    def _receive(self, wait: float) -> bytes:
        with self._lock:
            master = self._master
        if master < 0:
            time.sleep(wait)
            return b""
        ready, _, _ = select.select([master], [], [], wait)
        return os.read(master, 4096) if ready else b""

    def _send(self, data: bytes) -> None:
        if self._master >= 0:
            os.write(self._master, data)

    def _break(self, fault: SerialFault) -> None:
        if fault.kind == "stuck":
            self._ending.wait(fault.amount or 5.0)
        else:
            self._release()

    def _release(self) -> None:
        with self._lock:
            if self._master < 0:
                return
            os.close(self._master)
            self._retired.append(self._slave)
            self._master = self._slave = -1
            while len(self._retired) > RETIRED:
                os.close(self._retired.popleft())


class TcpServer(SerialServer):
    """A TCP port on the loopback interface, one client at a time.

    Args:
        far_end: the instrument.
        port: number, 0 for any free one.
        paced: let bytes take the time the baud rate gives them.
    """

    def __init__(self, far_end: FarEnd, port: int = 0, *, paced: bool = False) -> None:
        super().__init__(far_end, paced=paced)
        self._listener = socket.create_server(("127.0.0.1", port))
        self._client: socket.socket | None = None
        self._half_closed = False

    @property
    def url(self) -> str:
        """Address of the port."""
        return f"socket://127.0.0.1:{self._listener.getsockname()[1]}"

    def _receive(self, wait: float) -> bytes:
        waiting_for = self._client or self._listener
        ready, _, _ = select.select([waiting_for], [], [], wait)
        if not ready:
            return b""
        if self._client is None:
            self._client, _ = self._listener.accept()
            self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            return b""
        try:
            data = self._client.recv(4096)
        except ConnectionError:
            data = b""
        if not data:
            self._hang_up()
        return data

    def _send(self, data: bytes) -> None:
        if self._client is not None and not self._half_closed:
            try:
                self._client.sendall(data)
            except ConnectionError:
                self._hang_up()

    def _break(self, fault: SerialFault) -> None:
        if fault.kind == "stuck":
            self._ending.wait(fault.amount or 5.0)
            return
        if self._client is not None and fault.form == "half":
            self._client.shutdown(socket.SHUT_WR)
            self._half_closed = True
            return
        if self._client is not None and fault.form == "reset":
            linger = struct.pack("ii", 1, 0)
            self._client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        self._hang_up()

    def _hang_up(self) -> None:
        self._half_closed = False
        if self._client is not None:
            self._client.close()
            self._client = None
        self._due.clear()

    def _release(self) -> None:
        self._hang_up()
        self._listener.close()
