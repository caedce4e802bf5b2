"""A run told live by Lab Streaming Layer: its spikes, envelopes and events.

Off unless asked for. A thread of its own does all the telling: a subscriber that is
slow, gone or never there holds up neither the run nor its record. What liblsl cannot
deliver is lost to that subscriber alone, and the running number of each spike tells it.

LSL's time stamps are those of the samples: run time 0 is set against `local_clock()`
when the record begins, and a line `clock` each second tells how both go on. On the
simulated clock, which runs as fast as it can, stamps follow the experiment's time.
"""

from __future__ import annotations

import json
import math
import os
import time
from collections.abc import Callable
from functools import cache
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from tactile_lab.acquisition import events
from tactile_lab.arrays import FloatArray
from tactile_lab.engine.threads import start
from tactile_lab.errors import SceneError

if TYPE_CHECKING:
    from tactile_lab.engine.execution import Execution

SIGNALS = ("V_C1", "V_C2", "V_K")
"""Those whose envelopes are told."""

EVERY = 0.02
"""Time between two looks at the newest samples, s."""

READS = 5
"""Times the two clocks are read; the pair that was read fastest counts."""

CLOCK_EVERY = 1.0
"""Time between two lines that tell how the clocks stand, s."""

LINGER = 0.5
"""How long streams stay open after a run for those who listen, s."""

CONFIG = "[multicast]\nResolveScope = machine\n[log]\nlevel = -2\n"
"""Found from this computer only; LSL's own words kept from the terminal."""

TIME_STAMPS = (
    "LSL's local_clock() of this computer as the record began, plus run time counted "
    "in the scope's samples; lines `clock` of tactile-lab events tell how both go on"
)

Line = dict[str, Any]

EVENTS = (("JSON", ""),)
SPIKES = (("number", ""), ("time", "s"), ("amplitude", "V"))
ENVELOPES = tuple(
    (f"{signal} {kind}", "V") for signal in SIGNALS for kind in ("min", "mean", "max")
)


class FollowedRun:
    """Where the telling of one run stands.

    Attributes:
        zero: LSL's time of run time 0, s; NaN before the record begins.
        uncertainty: of that, s.
        spikes: told so far.
    """

    def __init__(self, execution: Execution) -> None:
        self._live, self._clock = execution.live, execution.bench.clock
        self.zero = self.uncertainty = math.nan
        self.spikes = 0
        self._seen = 0
        self._origin = 0.0
        self._late = math.inf
        self._next_clocks = 0.0

    def set_clocks(
        self, local_clock: Callable[[], float], begun: events.RecordBegun
    ) -> None:
        """Set LSL's time against run time as the record begins."""
        reads = []
        for _ in range(READS):
            before = local_clock()
            now = self._clock.now()
            after = local_clock()
            reads.append(((after - before) / 2, (before + after) / 2 - now))
        read_within, offset = min(reads)
        self.uncertainty = read_within + begun.uncertainty
        self._origin, self.zero = begun.origin, offset + begun.origin

    def fresh(self) -> tuple[FloatArray, NDArray[np.float32]]:
        """Milliseconds not told yet: LSL's times, shape (n,), s; rows (n, 9), V."""
        self._seen, bins = self._live.fresh(self._seen)
        if not bins:
            return np.empty(0), np.empty((0, len(ENVELOPES)), np.float32)
        time = next(iter(bins.values())).time
        rows = np.full((time.size, len(ENVELOPES)), np.nan, np.float32)
        for number, signal in enumerate(SIGNALS):
            if signal in bins:
                trace = bins[signal]
                for column, values in enumerate((trace.low, trace.mean, trace.high)):
                    rows[:, 3 * number + column] = values
        return self.zero + time, rows

    def clocks(self, local: float) -> dict[str, Any] | None:
        """How the clocks stand at LSL's time `local`, s, if that is to be told now."""
        if self._clock.simulated:
            behind = 0.0
        else:
            behind = self._clock.now() - self._origin - self._live.reach
        self._late = min(self._late, behind)
        if local < self._next_clocks:
            return None
        late, self._late = self._late, math.inf
        self._next_clocks = local + CLOCK_EVERY
        return {
            "event": "clock",
            "lsl_s": local,
            "run_zero_lsl_s": self.zero,
            "uncertainty_s": self.uncertainty,
            "reached_s": self._live.reach,
            "least_behind_s": late,
            "spikes": self.spikes,
            "simulated_time": self._clock.simulated,
        }


class LslStreams:
    """Three streams of one program, for one run or one after the other.

    `tactile-lab spikes` (type Spikes) holds of each spike its running number in the
    run, its run time, s, and its amplitude, V; `tactile-lab envelopes` (type
    Envelopes) least, mean and largest value of each millisecond of V_C1, V_C2 and V_K,
    V, NaN where one is not measured, stamped with the millisecond's begin; `tactile-lab
    events` (type Markers) the JSON lines of `--status` and `clock`.

    Args:
        warn: told, once, why nothing more can be published.

    Attributes:
        warn: the same; may be another for each run.
        source: LSL's `source_id` of each of the three begins so.

    Raises:
        SceneError: pylsl is not installed, or the streams cannot be opened.
    """

    def __init__(self, warn: Callable[[str], None]) -> None:
        try:
            import pylsl
        except (ImportError, RuntimeError) as error:
            raise SceneError(
                "To publish live by LSL needs pylsl, which could not be loaded "
                f"({error}). `pip install pylsl`, or do not publish."
            ) from error
        self._lsl = pylsl
        self.source = f"tactile-lab-{os.getpid()}-{time.time_ns() // 1_000_000}"
        self.warn = warn
        self._closed = False
        try:
            if "LSLAPICFG" not in os.environ:
                pylsl.set_config_content(CONFIG)
            self._spikes = self._open("Spikes", SPIKES, pylsl.cf_double64)
            self._envelopes = self._open("Envelopes", ENVELOPES, pylsl.cf_float32)
            self._events = self._open("Markers", EVENTS, pylsl.cf_string)
        except (RuntimeError, NotImplementedError) as error:
            raise SceneError(
                f"LSL's streams cannot be opened ({error}). Update pylsl, or do not "
                "publish live."
            ) from error
        self._run: FollowedRun | None = None
        self._waiting: SimpleQueue[FollowedRun | events.Event | Line | None] = (
            SimpleQueue()
        )
        self._thread = start(self._tell_all, "lsl")

    def begin(self, execution: Execution) -> None:
        """This is about to run."""
        self._run = FollowedRun(execution)
        self._waiting.put(self._run)
        self._waiting.put(execution.documented)

    def __call__(self, event: events.Event) -> None:
        """Tell an event of the run, from any thread; never waits."""
        if isinstance(event, events.RecordBegun) and self._run is not None:
            self._run.set_clocks(self._lsl.local_clock, event)
        if self._thread.is_alive():
            self._waiting.put(event)

    def end(self, result: Line) -> None:
        """Tell how it ended, as ``--json`` prints it."""
        self._waiting.put({"event": "result", **result})

    def close(self) -> None:
        """Tell what is left to tell and close the streams; idempotent."""
        if self._closed:
            return
        self._closed = True
        self._waiting.put(None)
        self._thread.join()
        streams = (self._spikes, self._envelopes, self._events)
        if any(stream.have_consumers() for stream in streams):
            time.sleep(LINGER)  # liblsl drops what is under way when a stream closes
        del self._spikes, self._envelopes, self._events

    def _open(self, kind: str, channels: tuple[tuple[str, str], ...], form: int) -> Any:
        """An outlet with its channels and its time described."""
        name = "events" if kind == "Markers" else kind.lower()
        info = self._lsl.StreamInfo(
            f"tactile-lab {name}",
            kind,
            len(channels),
            self._lsl.IRREGULAR_RATE,
            form,
            f"{self.source}-{name}",
        )
        about = info.desc()
        described = about.append_child("channels")
        for label, unit in channels:
            channel = described.append_child("channel")
            channel.append_child_value("label", label)
            channel.append_child_value("unit", unit)
        about.append_child_value("time_stamps", TIME_STAMPS)
        return self._lsl.StreamOutlet(info)

    def _tell_all(self) -> None:
        """Tell what waits and the newest samples, until told to leave."""
        run: FollowedRun | None = None
        try:
            while True:
                try:
                    told = self._waiting.get(timeout=EVERY)
                except Empty:
                    self._tell_samples(run)
                    continue
                if told is None:
                    return
                if isinstance(told, FollowedRun):
                    run = told
                elif isinstance(told, events.SpikesSeen) and run is not None:
                    self._tell_spikes(told, run)
                else:
                    self._tell_event(told, run)
        except Exception as error:  # whatever LSL raises, the run goes on
            reason = f"{type(error).__name__}: {error}"
            self.warn(f"nothing more is published live ({reason}); the run goes on.")

    def _tell_spikes(self, seen: events.SpikesSeen, run: FollowedRun) -> None:
        for at, amplitude in zip(seen.times, seen.amplitudes, strict=True):
            run.spikes += 1
            self._spikes.push_sample([run.spikes, at, amplitude], run.zero + at)

    def _tell_event(self, told: events.Event | Line, run: FollowedRun | None) -> None:
        line = told if isinstance(told, dict) else events.documented(told)
        if line is None:
            return
        if line["event"] in ("progress", "result"):  # events may leave no pause
            self._tell_samples(run)
        self._tell_line(line)

    def _tell_samples(self, run: FollowedRun | None) -> None:
        """Tell the newest milliseconds, and now and then how the clocks stand."""
        if run is None or math.isnan(run.zero):
            return
        times, rows = run.fresh()
        if times.size:
            self._envelopes.push_chunk(rows, times.tolist())
        clocks = run.clocks(self._lsl.local_clock())
        if clocks is not None:
            self._tell_line(clocks)

    def _tell_line(self, line: Line) -> None:
        self._events.push_sample([json.dumps(line, allow_nan=False)])


@cache
def kept_open() -> LslStreams:
    """The streams of this process, opened when first asked for; its end closes them.

    Raises:
        SceneError: pylsl is not installed, or the streams cannot be opened.
    """
    return LslStreams(lambda text: None)
