"""A link and a dialect together: questions, verified commands, one careful retry."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Generic, TypeVar

from drivers.serial_line import failures
from drivers.serial_line.link import SerialLink
from tactile_lab.errors import (
    BadReplyError,
    HaltedError,
    InstrumentError,
    LinkLostError,
    NoReplyError,
    RefusedError,
)
from tactile_lab.instruments.serial_dialect import SerialDialect

D = TypeVar("D", bound=SerialDialect)

RETRY = 0.1
"""Time between two attempts to open a lost port again, s."""

EXCHANGED = 5.0
"""How long to try a port at which another of our instruments is looked for, s."""

TRIES = 3
"""Attempts to have an instrument say its name when it is opened."""

ROUNDED = 1e-3
"""Part by which a number that is read back may differ from the one that was set."""

MOST_ERRORS = 25
"""Answers of an error queue to read before giving up on emptying it."""


class Conversation(Generic[D]):
    """Lines in one dialect over one link.

    A question whose answer failed is asked once more after the link has resynchronised
    (questions and set-points may be repeated without harm).

    Attributes:
        halted: asked last thing before a line that changes state, and before a question
            is asked again; once it is true there is neither.
        acted: when the last command is taken to have been acted on, clock time, s: as
            what came after it on the wire, its answer, set out.
    """

    def __init__(self, link: SerialLink, dialect: D) -> None:
        self.link = link
        self.dialect = dialect
        self.halted: Callable[[], bool] = lambda: False
        self.acted = -math.inf

    def connect(self) -> None:
        """Open the link and have the instrument listen.

        Raises:
            NotFoundError, NoReplyError, LinkLostError: the port or what is behind it.
            BadReplyError: another instrument answers, or none that can be understood.
        """
        self.meet()
        self._empty_errors(self.query)
        self.offer(self.dialect.optional)

    def meet(self) -> None:
        """Open the link, with more than one try; the instrument only says its name.

        Where it is not at its port, it is looked for at the name that its adapter
        keeps.

        Raises:
            NotFoundError, NoReplyError, LinkLostError: the port or what is behind it.
            BadReplyError: another instrument answers, or none that can be understood.
        """
        link = self.link
        link.port = link.names.named
        try:
            self._meet()
        except InstrumentError:
            if not self._met_elsewhere():
                raise
        link.names.learn(link.port, link.identity or "")

    def _met_elsewhere(self) -> bool:
        """Whether the same instrument as before answers at its adapter's own name."""
        link = self.link
        link.close()
        if link.names.elsewhere is None:
            return False
        link.identity = link.names.identity
        if self.reconnected([], EXCHANGED):
            return True
        link.identity = None
        return False

    def _meet(self) -> None:
        for left in reversed(range(TRIES)):
            try:
                self.link.open()
                if left < TRIES - 1:
                    self.link.resynchronise()  # an earlier answer may come late
                self.recognise()
                break
            except (NoReplyError, BadReplyError):
                self.link.close()
                if not left:
                    raise

    def set_up(self, danger: str) -> None:
        """Send the row's settings and read back that they were taken.

        Args:
            danger: what would follow if they were not, for the message.

        Raises:
            BadReplyError: they are not taken.
            RefusedError: the instrument reports an error.
        """
        self._send_settings()
        if self.not_taken():  # a line may have been lost on the way
            self._send_settings()
            if wrong := self.not_taken():
                raise BadReplyError(
                    f"The {self.dialect.role} does not take its settings: "
                    f"{', '.join(wrong)} after {', '.join(self.dialect.init)}, so "
                    f"{danger}. Unlock its front panel, check cable and baud rate, "
                    "try again."
                )

    def recognise(self) -> None:
        """Refuse an instrument that is not of this row.

        Raises:
            BadReplyError: the name it gives does not match.
        """
        name = self.link.identity or ""
        if re.search(self.dialect.match, name) is None:
            raise BadReplyError(
                f"At {self.link.port} {name!r} answers; the dialect "
                f'"{self.dialect.id}" is for {self.dialect.title}. Name the right row '
                "or port in the bench file."
            )
        if (wanted := self.dialect.serial_number) not in name:
            raise BadReplyError(
                f"At {self.link.port} {name!r} answers, not the {self.dialect.role} "
                f'with serial = "{wanted}" of the bench file: another of its kind. '
                "Ports change their names when cables are pulled; correct port or "
                "serial (`tactile-lab devices` says who is where)."
            )

    def query(self, line: str, *, blank: bool = False) -> str:
        """The answer to `line`, asked again once if it was lost or garbled.

        Args:
            line: without terminator.
            blank: an empty line is an answer.
        """
        try:
            return self.link.query(line, blank=blank)
        except (NoReplyError, BadReplyError):
            if self.halted():
                raise
            self.link.resynchronise()
            reported = self._empty_errors(self.link.query)
            if self.halted():
                raise
        try:
            return self.link.query(line, blank=blank)
        except NoReplyError as reason:
            if self.link.half_sent:
                raise
            link, wait = self.link, self.link.wire.timeout
            told = failures.unanswered(link.what, link.port, line, wait, reported)
            raise NoReplyError(told) from reason

    def number(self, line: str, pattern: str | None = None) -> float:
        """The numeric answer to `line`; see `number_in`."""
        return self.number_in(line, pattern)[0]

    def number_in(self, line: str, pattern: str | None = None) -> tuple[float, str]:
        """The number in the answer to `line`, and that answer.

        The number is group 1 of `pattern`, or of the row's.

        Raises:
            BadReplyError: no finite number, twice.
        """
        answer = self.query(line)
        value = self.parsed(answer, pattern)
        if value is None:
            self.link.resynchronise()
            answer = self.link.query(line)
            value = self.parsed(answer, pattern)
        if value is None:
            raise BadReplyError(
                f"The {self.link.what} at {self.link.port} answered {answer!r} to "
                f'{line!r}, twice: no number in its dialect "{self.dialect.id}". Look '
                "at its display, and compare the dialect with its manual."
            )
        return value, answer

    def command(self, line: str) -> None:
        """Send a line that changes state and check that it was taken.

        Raises:
            RefusedError: the instrument reports an error.
            HaltedError: it was not sent.
        """
        self._command(line, self.query)

    def command_once(self, line: str) -> None:
        """The same, of a line that must not be repeated where its answer is lost.

        Raises:
            RefusedError: the instrument reports an error.
            HaltedError: it was not sent.
            NoReplyError, BadReplyError: the answer is lost; the line may have come.
                The link is in step again if it can be.
        """
        try:
            self._command(line, self.link.query)
        except (NoReplyError, BadReplyError):
            with suppress(NoReplyError, BadReplyError):
                self.link.resynchronise()
                self._empty_errors(self.link.query)
            raise

    def _command(self, line: str, query: Callable[[str], str]) -> None:
        self.link.settle()
        if self.halted():
            raise HaltedError(f"A stop came before {line!r}, which was not sent.")
        asked = self.link.now
        if self.dialect.error is None:
            self.link.write(line)
            self.acted = self.link.now
            return
        *first, last = self.dialect.verified(line)
        for one in first:
            self.link.write(one)
        answer = query(last)
        wire = self.link.wire
        later = len(answer) + len(wire.reply_end)
        later += len(last) + len(wire.send_end) if first else 0
        # where the baud rate is a mere number, as over a network, it may be less
        self.acted = max(asked, self.link.now - later * wire.character_time)
        if re.search(self.dialect.error_ok, answer) is None:
            what, port = self.link.what, self.link.port
            raise RefusedError(failures.refused(what, port, line, answer))

    def offer(self, lines: Iterable[str]) -> None:
        """Send lines whose refusal is accepted."""
        for line in lines:
            try:
                self.command(line)
            except InstrumentError:
                if not self.link.is_open:
                    return

    def insist(self, lines: Iterable[str], trouble: list[str]) -> bool:
        """Send each line whatever happens; whether all were confirmed.

        What went wrong is added to `trouble`.
        """
        before = len(trouble)
        for line in lines:
            if self._is_lost_by(line, trouble):
                self.link.close()
                if self.reconnected(trouble):
                    self._is_lost_by(line, trouble)
        return len(trouble) == before

    def _send_settings(self) -> None:
        for line in self.dialect.init:
            self.command(line)

    def not_taken(self) -> list[str]:
        """Questions whose answer is not what the row wants, and that answer."""
        asked = {line: self.query(line) for line in self.dialect.confirm}
        return [
            f"{line} answers {answer!r}"
            for line, answer in asked.items()
            if not self._is_as_wanted(answer, self.dialect.confirm[line])
        ]

    def _is_as_wanted(self, answer: str, wanted: str | tuple[float, ...]) -> bool:
        if isinstance(wanted, str):
            return re.search(wanted, answer) is not None
        value = self.parsed(answer)
        return value is not None and any(
            math.isclose(value, one, rel_tol=ROUNDED) for one in wanted
        )

    def _empty_errors(self, ask: Callable[[str], str]) -> list[str]:
        """Read the error queue until it is empty; what it held."""
        found: list[str] = []
        if self.dialect.error is None:
            return found
        for _ in range(MOST_ERRORS):
            answer = ask(self.dialect.error)
            if re.search(self.dialect.error_ok, answer):
                return found
            found.append(answer)
        raise RefusedError(
            f"The instrument at {self.link.port} has no end of errors; switch it off "
            "and on."
        )

    def reconnected(self, trouble: list[str], patience: float = 0.0) -> bool:
        """Whether the link is open, after trying to open it for `patience` s."""
        if self.link.is_open:
            return True
        link = self.link
        known, until = link.identity, link.now + patience
        while True:
            failed = []
            for name in (link.names.named, link.names.elsewhere):
                if name is None:
                    continue
                link.port = name
                try:
                    link.open()
                    self.recognise()
                    self._same_as(known)
                    return True
                except InstrumentError as reason:
                    link.close()  # a stranger is not to be told anything
                    link.identity = known
                    failed.append(f"reconnect: {reason}")
            link.port = link.names.named
            if link.now + RETRY > until:
                trouble += failed
                return False
            link.pause(RETRY)

    def _same_as(self, known: str | None) -> None:
        if known is not None and known != (found := self.link.identity):
            raise BadReplyError(
                f"At {self.link.port} {found!r} answers now, not {known!r} as before. "
                "Connect the same instrument again."
            )

    def _is_lost_by(self, line: str, trouble: list[str]) -> bool:
        """Send a line, blindly where it is not confirmed; whether the link is lost."""
        lost = False
        try:
            self.command(line)
            return False
        except InstrumentError as reason:
            trouble.append(f"{line}: {reason}")
            lost = isinstance(reason, LinkLostError)
        try:  # a half-closed socket still takes lines, though it answers none
            self.link.send_blindly(line)
        except LinkLostError:
            return True
        except InstrumentError as reason:
            trouble.append(f"{line}, sent blindly: {reason}")
        return lost

    def parsed(self, answer: str, pattern: str | None = None) -> float | None:
        """The number in `answer`, or None."""
        match = re.search(pattern or self.dialect.number, answer)
        if match is None:
            return None
        try:
            value = float(match.group(1))
        except (TypeError, ValueError):  # a row's own pattern may let 1..5 pass
            return None
        return value if math.isfinite(value) and abs(value) < 1e30 else None
