"""PicoScope 3000 series (ps3000a) as a gapless streaming `Scope`."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from drivers.opened import Opened
from drivers.picoscope import status
from drivers.picoscope.generator import CAPABILITY, PicoGenerator
from drivers.picoscope.ring import StreamRing
from drivers.picoscope.sample_count import SampleCount
from drivers.picoscope.sdk import INPUTS, RANGES, TIME_UNITS
from drivers.picoscope.setup import configure, ring_samples, streaming_interval
from drivers.picoscope.unit import ScopeUnit
from tactile_lab.clock import Clock
from tactile_lab.errors import LinkLostError, RefusedError, SamplesLostError
from tactile_lab.instruments.channels import check_channels, described
from tactile_lab.scope import Block, Channel, ScopeCapability, Stream

GUARANTEED = (31.25e6, 15.625e6, 7.8125e6, 7.8125e6)
"""Streaming rate for 1 to 4 inputs that Pico guarantees on any USB port, S/s."""

_MOST_PARTS = 8


@dataclass
class _Running:
    """A stream that runs.

    Attributes:
        stream: how it is scaled.
        ring: memory the library writes into.
        count: of samples, against the clock.
        data_at: clock time of the newest samples, s.
        failure: what the next poll raises, once all samples are taken, or the stop.
        told: it was raised.
        began: clock time of a poll's first question for samples, s.
        asked: of its last one, s.
        drained: whether the library had no more to deliver then.
    """

    stream: Stream
    ring: StreamRing
    count: SampleCount
    data_at: float
    failure: BaseException | None = None
    told: bool = False
    began: float = 0.0
    asked: float = 0.0
    drained: bool = False


class PicoScope(Opened):
    """A 3000-series PicoScope through PicoSDK's ps3000a library.

    Args:
        clock: host time.
        library: the library's file or folder, a loaded library (any object with the C
            functions), or None to search the usual places.
        serial: the unit's serial number; None for the first free one.
        allow_usb2: accept a USB 3 scope on a USB 2 port, at a quarter of the rate.
        allow_usb_power: accept a missing mains adapter.
        poll_interval: how often the owner will poll, s.
        watchdog: longest time without data before the scope is pinged, s.
        ring: samples per input in the library's ring; None for 2 s worth.
        lag_tolerance: rise of the samples' lag that is not yet a loss, s; None for
            that of `SampleCount.of`.
    """

    def __init__(
        self,
        *,
        clock: Clock,
        library: str | Any | None = None,
        serial: str | None = None,
        allow_usb2: bool = False,
        allow_usb_power: bool = False,
        poll_interval: float = 0.02,
        watchdog: float = 1.0,
        ring: int | None = None,
        lag_tolerance: float | None = None,
    ) -> None:
        self._clock = clock
        self._unit = ScopeUnit(
            library, serial, allow_usb2=allow_usb2, allow_usb_power=allow_usb_power
        )
        self._poll_interval = poll_interval
        self._watchdog = watchdog
        self._ring_samples = ring
        self._lag_tolerance = lag_tolerance
        self._tolerance = math.nan
        self._ring: StreamRing | None = None
        self._stream: Stream | None = None
        self._running: _Running | None = None

    @property
    def identity(self) -> str:
        """Maker, model and serial number."""
        known = self._unit.information
        return (
            f"Pico Technology PicoScope {known.get('variant', '3000 series')} "
            f"{known.get('serial', '')}"
        ).strip()

    @property
    def capability(self) -> ScopeCapability:
        """What the scope can do; rates are those guaranteed on any USB port."""
        variant = self._unit.information.get("variant", "34")
        inputs = int(variant[1]) if variant[1:2] in ("2", "4") else len(INPUTS)
        return ScopeCapability(
            gapless=True,
            inputs=INPUTS[:inputs],
            ranges=tuple(RANGES),
            bits=16 - self._unit.shift if self._unit.full_scale else 8,
            fastest=GUARANTEED[:inputs],
            generator=CAPABILITY,
        )

    @property
    def generator(self) -> PicoGenerator:
        """The waveform generator; usable while the scope is open and its thread's."""
        return PicoGenerator(self._unit)

    @property
    def poll_interval(self) -> float:
        """How often to poll while streaming, s."""
        return self._poll_interval

    def open(self) -> None:
        """Load the library, open the unit, read who it is; idempotent.

        Raises:
            NotFoundError: no library, or no free scope.
            LimitError: it is powered or connected in a way that was not allowed.
        """
        if not self._unit.is_open:
            self._unit.open()

    def start(self, channels: Sequence[Channel], interval: float) -> Stream:
        """Configure the inputs and start streaming.

        Args:
            channels: enabled inputs, in the order of each block's rows.
            interval: wanted time between samples, s; the stream has the actual one.

        Raises:
            LimitError: an input, range, offset, rate or power state that cannot be.
            LinkLostError: unplugged.
        """
        self.stop()
        unit, capability = self._unit, self.capability
        check_channels(channels, capability)
        wanted, per_second = streaming_interval(interval)
        unit.restore_power()
        configure(unit, channels, capability.inputs)
        samples = self._ring_samples or ring_samples(interval)
        ring = self._ring_for([INPUTS.index(c.input) for c in channels], samples)
        for row, channel in enumerate(channels):
            unit.register(channel, ring.row(row))
        actual = ctypes.c_uint32(wanted)
        before = self._clock.now()
        unit.do(
            f"Streaming {len(channels)} inputs every {interval:g} s",
            "ps3000aRunStreaming", ctypes.byref(actual), TIME_UNITS[per_second],
            0, samples, 0, 1, 0, samples,
        )  # fmt: skip
        after = self._clock.now()
        self._stream = Stream(
            channels=tuple(channels),
            interval=actual.value / per_second,
            full_scale=unit.full_scale,
            shift=unit.shift,
            started=(before + after) / 2,
            uncertainty=(after - before) / 2,
        )
        count = SampleCount.of(
            self._stream, samples, self._lag_tolerance, simulated=self._clock.simulated
        )
        self._tolerance = count.tolerance
        self._running = _Running(self._stream, ring, count, after)
        return self._stream

    def poll(self) -> Block | None:
        """All samples since the last poll, or None if there are none yet.

        Samples that arrived before a failure are returned first; the failure is raised
        by the next poll.

        Raises:
            LinkLostError: unplugged, or no data for longer than the watchdog allows.
            SamplesLostError: samples are missing.
            RefusedError: not streaming, or the scope stopped because its power changed.
        """
        running = self._running
        if running is None:
            raise RefusedError("The scope is not streaming; start it first.")
        if running.failure is None:
            running.failure = self._fetch(running)
        received = self._clock.now()
        taken = running.ring.take()
        if taken is None:
            if running.failure is None:
                running.failure = self._silence(running, received)
            if running.failure is not None:
                running.told = True
                raise running.failure
            self._count(running, 0)
            return None
        codes, overrange = taken
        block = Block(running.count.received, codes, overrange, received)
        running.data_at = received
        try:
            self._count(running, block.samples)
        except SamplesLostError as error:
            running.failure = error
        return block

    def _count(self, running: _Running, samples: int) -> None:
        """Count what a poll has just brought.

        Raises:
            SamplesLostError: samples are missing.
        """
        running.count.poll(
            running.asked, samples, running.drained, self._clock.now(), running.began
        )

    def _ring_for(self, bits: list[int], samples: int) -> StreamRing:
        """Memory for a stream: the last stream's where it fits, it may be large."""
        ring = self._ring
        if ring is None or ring.bits != tuple(bits) or ring.samples != samples:
            ring = self._ring = StreamRing(bits, samples)
        ring.clear()
        return ring

    def _fetch(self, running: _Running) -> BaseException | None:
        """Have the library deliver what it has; return what went wrong."""
        running.drained, ring = False, running.ring
        running.began = self._clock.now()
        for _ in range(_MOST_PARTS):
            ring.at_end = False
            # samples are counted against the time they were asked for, because
            # delivering them takes time as well
            running.asked = self._clock.now()
            code = self._unit.call(
                "ps3000aGetStreamingLatestValues", ring.callback, None
            )
            failure = ring.failure()
            if failure is not None:
                return failure
            if code not in status.AGAIN | {status.OK}:
                return self._explain(code)
            if code != status.OK or not ring.at_end:
                running.drained = code == status.OK
                break
        return None

    def _explain(self, code: int) -> BaseException:
        doing = f"Streaming from {self.identity}"
        if code == status.STREAMING_FAILED and not self._unit.answers():
            code = status.NOT_RESPONDING
        return status.failure(code, doing)

    def _silence(self, running: _Running, now: float) -> BaseException | None:
        """What a silence means that has lasted too long."""
        silent = now - running.data_at
        if silent <= max(self._watchdog, 20 * running.stream.interval):
            return None
        if self._unit.answers():
            text = "it answers a ping but sends no data; start again"
        else:
            text = "it does not answer: unplugged or without power; check its cable"
        return LinkLostError(
            f"{self.identity} has sent nothing for {silent:.3g} s: {text}."
        )

    def stop(self) -> None:
        """Stop streaming; idempotent.

        Raises:
            SamplesLostError: samples are missing at the end of the stream.
            TactileLabError: the scope is there but did not stop, or what the last poll
                found and no poll has raised.
        """
        running, self._running = self._running, None
        if running is None:
            return
        late = None if running.failure is not None else self._late(running)
        code = self._unit.call("ps3000aStop")
        if running.failure is None:
            if code not in (status.OK, *status.DEAD):
                raise status.failure(code, "Stopping the scope")
            if late is not None:
                raise late
        elif not running.told:
            raise running.failure

    def _late(self, running: _Running) -> SamplesLostError | None:
        """What of the stream's end is missing, once all that is late has come."""
        until = self._clock.now() + running.count.window
        while True:
            try:
                running.count.finish()
                return None
            except SamplesLostError as missing:
                if self._clock.now() >= until or self._fetch(running) is not None:
                    return missing
            if (taken := running.ring.take()) is not None:
                with suppress(SamplesLostError):  # the next look tells
                    self._count(running, taken[0].shape[1])
            self._clock.sleep_until(self._clock.now() + self._poll_interval)

    def settings(self) -> dict[str, str]:
        """Settings in force, for the run's record."""
        known = dict(self._unit.information)
        known["power"] = ", ".join(self._unit.accepted) or "as wanted"
        if self._stream is not None:
            known["interval_s"] = repr(self._stream.interval)
            known["loss_seen_from_s"] = f"{self._tolerance:g}"
            known["ring_samples"] = str(self._ring.samples if self._ring else 0)
            known |= described(self._stream.channels)
        return known

    def close(self) -> None:
        """Stop and let go of the scope; idempotent.

        Raises:
            TactileLabError: the scope is there but could not be stopped or closed.
        """
        try:
            if self._unit.is_open:
                self.stop()
        finally:
            self._unit.close()
            self._ring = None
