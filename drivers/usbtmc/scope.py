"""Bench oscilloscopes over USBTMC: one record after the other, with gaps between."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from drivers.opened import Opened
from drivers.usbtmc.link import UsbtmcLink
from drivers.usbtmc.record import SHIFT, RecordReader, number, tell
from tactile_lab.clock import Clock
from tactile_lab.errors import (
    BadReplyError,
    LimitError,
    LinkLostError,
    NoReplyError,
    RefusedError,
)
from tactile_lab.instruments.channels import check_channels, described
from tactile_lab.instruments.scope_dialect import ScopeDialect
from tactile_lab.scope import Block, Channel, ScopeCapability, Stream

POLL = 0.02
"""Time between two polls, s."""
LEAST_RATE = 1e-3
"""Slowest sample rate that is one, S/s: 0 is none."""
_MOST_ERRORS = 20
_SETTLING, _PATIENCE = 0.2, 3.0


class UsbtmcScope(Opened):
    """A SCPI oscilloscope that a dialect row describes, as a block-only `Scope`.

    Between records it is blind, so `capability.gapless` is false. The index of a
    record's first sample comes from host time when the record was triggered.

    Args:
        dialect: the model's row.
        clock: host time.
        serial: serial number, where several are attached.
        backend: pyusb backend; None for libusb.
        timeout: longest wait for one transfer, s.
    """

    def __init__(
        self,
        dialect: ScopeDialect,
        *,
        clock: Clock,
        serial: str | None = None,
        backend: Any = None,
        timeout: float = 2.0,
    ) -> None:
        self._dialect = dialect
        self._clock = clock
        self._link = UsbtmcLink(
            vendor=dialect.vendor, product=dialect.product, serial=serial,
            timeout=timeout, header_once=dialect.header_once, backend=backend,
        )  # fmt: skip
        self._reader = RecordReader(self._link, dialect)
        self._identity = ""
        self._stream: Stream | None = None
        self._running = False
        self._triggered_at: float | None = None
        self._armed_at = 0.0
        self._next = 0

    @property
    def identity(self) -> str:
        """What the scope answered when asked who it is."""
        return self._identity or self._dialect.title

    @property
    def capability(self) -> ScopeCapability:
        """What the row says of the model."""
        return self._dialect.capability

    @property
    def poll_interval(self) -> float:
        """How often to poll while it runs, s."""
        return POLL

    def open(self) -> None:
        """Claim the interface and identify the scope; idempotent.

        Raises:
            NotFoundError: not attached, or no libusb.
            BadReplyError: another model answers.
        """
        if self._link.is_open:
            return
        self._link.open()
        try:
            self._identity = self._link.ask(self._dialect.commands.identify)
            if re.match(self._dialect.match, self._identity) is None:
                raise BadReplyError(
                    f"At {self._link.name} {self._identity!r} answers; scope dialect "
                    f'"{self._dialect.id}" is for {self._dialect.title}. Name the '
                    "right row in the bench file."
                )
            self._check("opening")
        except Exception:
            self._link.close()
            raise

    def start(self, channels: Sequence[Channel], interval: float) -> Stream:
        """Set the scope and arm the first record.

        Args:
            channels: enabled inputs, in the order of each block's rows.
            interval: wanted time between samples, s; the stream has the actual one,
                which is at most this.

        Raises:
            LimitError: an input, range or rate the scope does not have.
            RefusedError: the scope refused a setting.
        """
        row, say = self._dialect, self._dialect.commands
        self._refuse_impossible(channels, interval)
        by_input = {channel.input: channel for channel in channels}
        for name in row.inputs:
            channel = by_input.get(name)
            if channel is None:
                self._tell(say.input_off, input=name)
                continue
            scale = row.scales[row.ranges.index(channel.range)]
            self._tell(
                say.input_on, input=name, coupling=channel.coupling,
                scale=f"{scale:g}", offset=f"{channel.offset:g}",
            )  # fmt: skip
        self._tell(
            say.acquire, depth=row.depth[len(channels)],
            timebase=f"{row.timebase(interval, len(channels)):g}",
        )  # fmt: skip
        self._check("setting up")
        rate = number(self._link.ask(say.rate), say.rate, LEAST_RATE)
        before = self._clock.now()
        self._arm()
        after = self._clock.now()
        self._stream = Stream(
            channels=tuple(channels),
            interval=1 / rate,
            full_scale=row.divisions_high * row.codes_per_division << SHIFT,
            shift=SHIFT,
            started=(before + after) / 2,
            uncertainty=(after - before) / 2 + POLL,
            record=row.depth[len(channels)],
        )
        self._running, self._next = True, 0
        return self._stream

    def poll(self) -> Block | None:
        """The next record once it is complete, else None.

        Raises:
            LinkLostError: unplugged.
            NoReplyError: an answer or a record did not come in time.
        """
        stream = self._stream
        if not self._running or stream is None:
            raise RefusedError("The scope is not running; start it first.")
        say = self._dialect.commands
        status = self._link.ask(say.status).strip()
        length = self._dialect.depth[len(stream.channels)] * stream.interval
        waited = self._clock.now() - self._armed_at
        if status == say.waiting and self._triggered_at is None:
            self._link.write(say.force)
            self._triggered_at = self._clock.now()
        # just after arming, a scope may still report the record before as done
        fresh = self._triggered_at is not None or waited > length + _SETTLING
        if status == say.done and fresh:
            return self._record(stream)
        if waited > 3 * length + _PATIENCE:
            raise NoReplyError(
                f"{self.identity} has not finished a record of {length:.3g} s in time; "
                f"its trigger status is {status!r}. Switch it off and on."
            )
        return None

    def _record(self, stream: Stream) -> Block:
        depth, origin = self._dialect.depth[len(stream.channels)], 0.0
        codes = np.empty((len(stream.channels), depth), dtype=np.int16)
        over = []
        began = self._clock.now() - depth * stream.interval
        for row, channel in enumerate(stream.channels):
            codes[row], left, origin = self._reader.read(channel, stream, depth)
            over.append(left)
        self._check("reading")
        if self._triggered_at is not None:
            began = self._triggered_at + origin
        first = max(self._next, round((began - stream.started) / stream.interval))
        self._next = first + depth
        self._arm()
        return Block(first, codes, tuple(over), self._clock.now())

    def stop(self) -> None:
        """Stop; idempotent.

        Raises:
            InstrumentError: the scope is there but did not take the command.
        """
        if not self._running:
            return
        self._running = False
        try:
            self._tell(self._dialect.commands.stop)
        except LinkLostError:
            return  # nothing is left to stop; the loss was raised where it mattered

    def settings(self) -> dict[str, str]:
        """Settings in force, for the run's record."""
        known = {"identity": self.identity, "dialect": self._dialect.id}
        if self._link.others:
            known["others"] = ", ".join(self._link.others)
        if self._stream is not None:
            known["interval_s"] = repr(self._stream.interval)
            known["record_samples"] = str(
                self._dialect.depth[len(self._stream.channels)]
            )
            known |= described(self._stream.channels)
        return known

    def close(self) -> None:
        """Stop and let go of the scope; idempotent."""
        try:
            if self._link.is_open:
                self.stop()
        finally:
            self._link.close()

    def _arm(self) -> None:
        self._triggered_at = None
        self._tell(self._dialect.commands.arm)
        self._armed_at = self._clock.now()

    def _tell(self, lines: Sequence[str], **values: object) -> None:
        tell(self._link, lines, **values)

    def _check(self, doing: str) -> None:
        """Empty the error queue; what was in it is an error."""
        found = []
        for _ in range(_MOST_ERRORS):
            answer = self._link.ask(self._dialect.commands.error)
            if re.match(r"\s*[+-]?0\b", answer):
                break
            found.append(answer)
        if found:
            raise RefusedError(
                f"{self.identity} reported while {doing}: {'; '.join(found)}."
            )

    def _refuse_impossible(self, channels: Sequence[Channel], interval: float) -> None:
        check_channels(channels, self.capability)
        row, inputs = self._dialect, len(channels)
        shortest = 1 / row.fastest[inputs - 1]
        longest = row.timebases.longest * row.divisions_wide / row.depth[inputs]
        if not shortest * (1 - 1e-9) <= interval <= longest:
            raise LimitError(
                f"{row.title} samples {inputs} inputs every {shortest:g} s to "
                f"{longest:g} s; {interval:g} s is outside. Change record.sample_rate."
            )
