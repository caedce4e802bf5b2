"""One serial wire: lines out, lines in, and every way it fails told in our words.

Any address pyserial opens will do: `/dev/ttyUSB0`, `COM3`, `socket://host:port`,
`spy://...`, and the simulated bench's `sim://`.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import serial

from drivers.serial_line import failures
from drivers.serial_line.port import PORT_ERRORS, open_port, release, send_on
from drivers.serial_line.port_names import PortNames
from drivers.serial_line.transcript import Transcript
from tactile_lab.clock import Clock
from tactile_lab.errors import (
    BadReplyError,
    InstrumentError,
    LinkLostError,
    NoReplyError,
)
from tactile_lab.instruments.serial_dialect import SerialSettings

QUIET = 0.05
"""Silence that ends a drain, s."""

GAP_MARGIN = 0.005
"""How much later than the one after it a line may leave its port, s."""

LONGEST_LATE = 4096
"""Bytes without an end that are still taken once the time for an answer is over."""

LATEST = 1.0
"""How late an answer may come and the link still be brought in step, s: for as long the
guard lets a program be silent, too."""

LONGEST_DRAIN = 1.0
"""Longest time a far end may keep talking while the line is drained, s."""

Spy = Callable[[str, bytes, float], None]
"""Told of each (direction ">" or "<", bytes, clock time s)."""


def _with_the_rest(port: serial.Serial, line: bytes, end: bytes) -> bytes:
    """`line` and what has come of it: a busy computer reads late what came in time.

    pyserial takes a single byte once its time is over, and leaves the others.
    """
    while not line.endswith(end) and len(line) < LONGEST_LATE and port.in_waiting:
        line += port.read(1)
    return line


class SerialLink:
    """Lines to and from one instrument, for one thread.

    After an answer that came late, broken or not at all the next query first drains
    the line and compares the answer to `identify`, so that no late answer is ever
    taken for another question's.

    Args:
        port: address, as pyserial's `serial_for_url` takes it.
        wire: settings and framing.
        clock: time that gaps and drains are waited for in.
        what: the instrument's role, for messages.
        identify: harmless query whose answer never changes.
        spy: told of every byte, or None.
        beat: called while talking and waiting: the thread is alive.

    Attributes:
        port: where it is, or is looked for next.
        what: the instrument's role, for messages.
        half_sent: it took no more characters in the midst of a line.
        names: by which it may be found.
    """

    def __init__(
        self,
        port: str,
        wire: SerialSettings,
        clock: Clock,
        *,
        what: str,
        identify: str = "*IDN?",
        spy: Spy | None = None,
        beat: Callable[[], None] = lambda: None,
    ) -> None:
        self.port = port
        self.names = PortNames(port)
        self.wire = wire
        self.identity: str | None = None
        self._clock = clock
        self.what = what
        self._identify = identify
        self.spy = spy
        self._beat = beat
        self._transcript: Transcript | None = None
        self._serial: serial.Serial | None = None
        self._sent = 0.0
        self._free_at = 0.0
        self._doubtful = False
        self.half_sent = False
        self._names_due = 0
        self._asked = identify
        self._patient = True
        """No late answer was waited for since the last one in time."""
        self._echoes: list[str] = []
        """Lines without an answer whose echo comes before the next answer."""

    @property
    def is_open(self) -> bool:
        """Whether the port is held."""
        return self._serial is not None

    def open(self) -> None:
        """Take the port and identify the instrument.

        Raises:
            NotFoundError: no such port, or no right to use it.
            InstrumentError: another program holds it.
            NoReplyError: nothing answers there.
            BadReplyError: it echoes, or talks nonsense.
        """
        if self._serial is not None:
            return
        self._serial = open_port(self.port, self.wire, self.what)
        try:
            self._echoes.clear()
            with self._mapped():
                self._serial.reset_input_buffer()
            self._rest_from(self._clock.now())  # whoever spoke to it before
            self._send_preamble()
            answer = self._ask_name()
            self._has_said_its_name()
            if answer != self.identity:
                self._ask_again(answer)
        except BaseException:
            self.close()
            raise
        self.identity = answer

    @property
    def moved(self) -> str:
        """That it is at another name than the bench file's, and what to write there."""
        if self.port == self.names.named:
            return ""
        return (
            f"The {self.what} is at {os.path.realpath(self.port)} now, no longer at "
            f'{self.names.named}: cables were pulled. Write port = "{self.port}" into '
            "the bench file, a name that stays."
        )

    def close(self) -> None:
        """Let go of the port; idempotent, also after the link was lost."""
        held, self._serial = self._serial, None
        if held is not None:
            release(held, unsent=self._doubtful)

    def end_record(self) -> None:
        """Close the transcript, if there is one; idempotent."""
        if self._transcript is not None:
            self._transcript.close()
            self.spy = self._transcript = None

    def write(self, line: str) -> None:
        """Send a line that has no answer.

        Raises:
            LinkLostError: unplugged.
            NoReplyError: the far end takes nothing.
        """
        self.settle()
        self._send(line)
        if self.wire.echo:
            self._echoes.append(line)

    def query(self, line: str, *, blank: bool = False) -> str:
        """Send `line` and return its answer without terminator and flow control.

        Args:
            line: without terminator.
            blank: an empty line is an answer, not one of those passed over.

        Raises:
            LinkLostError: unplugged.
            NoReplyError: no complete answer in time.
            BadReplyError: bytes that are no text.
        """
        self.settle()
        self._asked = line
        answer = self._exchange(line, blank)
        self._patient = True
        return answer

    def record(self, path: Path) -> None:
        """Write every byte from now on to a transcript at `path`, until closed.

        Raises:
            SceneError: the file cannot be written.
        """
        self.spy = self._transcript = Transcript(path, about=self.what)

    def send_blindly(self, line: str) -> None:
        """Send `line` behind a terminator that ends a half-sent one; expect nothing.

        Raises:
            LinkLostError: unplugged.
            NoReplyError: the far end takes nothing.
        """
        self._doubtful = True
        self._resume()
        self._send("")
        self._send(line)

    @property
    def now(self) -> float:
        """Clock time, s."""
        return self._clock.now()

    def sleep_until(self, time: float) -> None:
        """Let time pass until the clock says `time`, s."""
        self._clock.sleep_until(time)

    def pause(self, seconds: float) -> None:
        """Let time pass, alive."""
        self._clock.sleep_until(self._clock.now() + seconds)
        self._beat()

    def resynchronise(self) -> None:
        """Drain the line and have the instrument say its name again.

        It is asked until an answer would be `LATEST` s late, but once where nothing
        came in time since that was last done.

        Raises:
            LinkLostError: unplugged.
            NoReplyError: it does not answer.
            BadReplyError: it keeps talking, or answers with another name.
        """
        self._resume()
        self._echoes.clear()
        self.drain()
        self._send_preamble()
        answer = ""
        begun = self._clock.now()
        patience, self._patient = LATEST if self._patient else 0.0, False
        for _ in range(3):
            try:
                answer = self._name_since(begun, patience)
            except BadReplyError as reason:
                answer = str(reason)
            if answer == self.identity:
                self._has_said_its_name()
                return
            self._doubtful = True
            self.drain()
        raise BadReplyError(
            f"The {self.what} at {self.port} answers {answer!r} to {self._identify}, "
            f"not {self.identity!r} as before. Check what is connected there."
        )

    def _ask_name(self) -> str:
        self._names_due += 1
        return self._exchange(self._identify)

    def _name_since(self, begun: float, patience: float) -> str:
        """Its name, asked for since `begun` s, for as long as `patience`, s."""
        while True:
            try:
                return self._ask_name()
            except NoReplyError as reason:
                if self.half_sent:
                    raise
                if self._clock.now() - begun >= patience:
                    asked, name = self._asked, self._identify
                    raise NoReplyError(
                        failures.silence(self.what, self.port, asked, name, patience)
                    ) from reason

    def _ask_again(self, name: str) -> None:
        """Have it say a name that was not known twice: a digit may be wrong in one.

        Raises:
            BadReplyError: it says another.
        """
        if (again := self._ask_name()) != name:
            raise BadReplyError(
                f"The {self.what} at {self.port} answers {self._identify} with "
                f"{name!r} and then with {again!r}. Check baud rate and cable."
            )
        self._names_due = 0

    def _has_said_its_name(self) -> None:
        """Let no second answer come later, where it was asked more than once."""
        if self._names_due > 1:
            self.drain(self.wire.timeout)
        self._names_due = 0

    def drain(self, quiet: float = QUIET) -> None:
        """Read and drop until the line has been `quiet` for so long, s.

        Raises:
            LinkLostError: unplugged.
            BadReplyError: it does not fall quiet.
        """
        quiet = max(quiet, 2 * self.wire.character_time)
        give_up = self._clock.now() + LONGEST_DRAIN + quiet
        quiet_since = self._clock.now()
        while self._clock.now() - quiet_since < quiet:
            dropped = b""
            with self._mapped() as port:
                while waiting := port.in_waiting:
                    dropped += port.read(waiting)
                    if self._clock.now() > give_up:
                        break
            self._beat()
            now = self._clock.now()
            if dropped:
                self._tell("<", dropped)
                quiet_since = now
            if now > give_up:
                raise BadReplyError(
                    f"The {self.what} at {self.port} does not stop talking; its "
                    "baud rate or its model is probably not the one expected."
                )
            self._clock.sleep_until(now + quiet / 4)

    def _resume(self) -> None:
        """Send on, though the far end said XOFF: the XON after it may be lost."""
        if self.wire.xonxoff:
            with self._mapped() as port:
                send_on(port)

    def settle(self) -> None:
        """Do all that the next line has to wait for.

        Raises:
            LinkLostError, NoReplyError, BadReplyError: as `resynchronise`.
        """
        if self._doubtful:
            self.resynchronise()
        self._clock.sleep_until(self._free_at)

    def _exchange(self, line: str, blank: bool = False) -> str:
        self._doubtful = True
        self._drop_unasked()
        self._send(line)
        for sent in (*self._echoes, line) if self.wire.echo else ():
            repeated = self._receive(sent)
            if repeated != sent:
                raise BadReplyError(
                    f"The {self.what} at {self.port} answered {repeated!r} where it "
                    f"was to repeat {sent!r}. Leave echo out of its dialect row if it "
                    "has none or it is switched off; else check baud rate and cable."
                )
        self._echoes.clear()
        answer = self._receive(line, blank)
        if answer == line:
            raise BadReplyError(
                f"The {self.what} at {self.port} echoes what it is sent. Switch its "
                "echo off, or set echo = true in its dialect row."
            )
        self._doubtful = False
        return answer

    def _drop_unasked(self) -> None:
        """What came before a line is sent, as an answer twice, does not answer it."""
        if self._echoes:  # of lines that had no answer: they are read with the next
            return
        with self._mapped() as port:
            for _ in range(LONGEST_LATE):
                if not (waiting := port.in_waiting):
                    break
                self._tell("<", port.read(waiting))

    def _send_preamble(self) -> None:
        if self.wire.preamble or self.half_sent:
            self._send(self.wire.preamble)
            if self.wire.echo:
                self.drain()

    def _send(self, line: str) -> None:
        data = (line + self.wire.send_end).encode("ascii")
        if len(data) > self.wire.max_line:
            raise InstrumentError(
                f"{line!r} has {len(data)} characters; the {self.what} takes "
                f"{self.wire.max_line} a line."
            )
        self._clock.sleep_until(self._free_at)
        self._beat()
        self._tell(">", data)
        self.half_sent = True
        begun = self._clock.now()
        with self._mapped() as port:
            port.write(data)
        self.half_sent = False
        # a port takes all characters at once and sends them one by one
        sent = begun + len(data) * self.wire.character_time
        self._sent = max(sent, self._clock.now())
        self._rest_from(self._sent)

    def _rest_from(self, time: float) -> None:
        """Send nothing for a while after clock time `time` s, if it wants that."""
        if self.wire.min_gap:
            self._free_at = time + self.wire.min_gap + GAP_MARGIN

    def _receive(self, asked: str, blank: bool = False) -> str:
        """One line; blank ones, which flow control leaves behind, are passed over.

        With `blank` they are not.
        """
        end = self.wire.reply_end.encode("ascii")
        while True:
            line = b""
            # a long line may take most of that time to get out
            due = max(self._sent, self._clock.now()) + self.wire.timeout
            with self._mapped() as port:
                while not line.endswith(end):
                    line += port.read_until(end)
                    self._beat()
                    if self._clock.now() >= due:
                        line = _with_the_rest(port, line, end)
                        break
            self._rest_from(self._clock.now())
            if line:
                self._tell("<", line)
            if not line.endswith(end):
                raise NoReplyError(
                    failures.no_answer(
                        self.what, self.port, asked, line, self.wire.timeout
                    )
                )
            text = line.translate(None, self.wire.strip.encode("ascii")).rstrip(b"\r\n")
            if not text and not blank:
                continue
            if not all(0x20 <= byte < 0x7F for byte in text):
                self._doubtful = True
                raise BadReplyError(failures.no_text(self.what, self.port, asked, line))
            return text.decode("ascii").strip()

    @contextmanager
    def _mapped(self) -> Iterator[serial.Serial]:
        """The open port, with what pyserial raises told as our errors."""
        if self._serial is None:
            raise LinkLostError(f"The {self.what} at {self.port} is not connected.")
        try:
            yield self._serial
        except serial.SerialTimeoutException as reason:
            self._doubtful = True
            raise NoReplyError(
                f"The {self.what} at {self.port} takes no more characters; it hangs, "
                "or holds the line by flow control."
            ) from reason
        except PORT_ERRORS as reason:
            self._doubtful = True
            raise LinkLostError(failures.lost(self.what, self.port, reason)) from reason

    def _tell(self, direction: str, data: bytes) -> None:
        if self.spy is not None:
            self.spy(direction, data, self._clock.now())
