"""Watching the sensor between runs: coil off, nothing kept but what Record asks for.

V_GS can be trimmed by hand while V_C1, V_C2 and the rate are on screen. The engine
holds the last minute; Record makes it a run. `tactile-lab monitor` does the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from queue import Empty, SimpleQueue

from gui.lanes.source import LiveSource
from gui.session.link import Link, RunAfar
from gui.session.messages import Begun, Broken, Recorded, Refused, Samples, Told
from gui.session.request import Request
from tactile_lab.acquisition import events

ENDLESS = ('protocol.duration="86400 s"', 'protocol.part="600 s"')
KEPT = 60.0
"""Time that Record keeps at most, s; the engine holds no more."""
SILENT = 2.0
"""Seconds without a spike after which the rate counts as 0."""


@dataclass(frozen=True)
class Standing:
    """Where the sensor stands now; None before the first sample.

    Attributes:
        V_C1, V_C2: V.
        critical: V_C1 below which the sensor fires, V.
        rate: Hz.
        held: how much Record would keep, s.
    """

    V_C1: float | None
    V_C2: float | None
    critical: float
    rate: float
    held: float

    @property
    def distance(self) -> float | None:
        """V_C1 less the critical one, V; above 0 the sensor is silent."""
        return None if self.V_C1 is None else self.V_C1 - self.critical


class Monitor:
    """One watch at a time.

    Attributes:
        source: what is seen; None before the first sample.
        problem: why watching ended by itself, "" if it did not.
        recorded: what became of the last Record; None before any.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self.source: LiveSource | None = None
        self.problem = ""
        self.recorded: Recorded | None = None
        self.recording = False
        self._run: RunAfar | None = None
        self._inbox: SimpleQueue[Told] = SimpleQueue()
        self._critical = float("nan")

    @property
    def alive(self) -> bool:
        """Whether instruments may still be open."""
        return self._run is not None and self._run.alive

    def start(self, bench: str, overrides: tuple[str, ...] = ()) -> None:
        """Watch the sensor on a bench ("sim" or a bench file)."""
        self.source, self.problem = None, ""
        self.recorded, self.recording = None, False
        request = Request("monitor", (*ENDLESS, *overrides), bench)
        self._inbox = SimpleQueue()
        self._run = self._link.watch(request, self._inbox)

    def stop(self) -> None:
        """Let go of the instruments; returns at once."""
        if self._run is not None:
            self._run.stop("monitor off")

    def record(self, out: Path, notes: Mapping[str, str]) -> None:
        """Keep the last minute as a run; `recorded` tells the result."""
        if self._run is not None and not self.recording:
            self.recording = True
            self._run.record(out, notes)

    def poll(self) -> LiveSource | None:
        """Take what is new; the source if it has just begun."""
        begun = None
        while True:
            try:
                told = self._inbox.get_nowait()
            except Empty:
                break
            match told:
                case Begun(newtons_per_ampere=gain, critical_V_C1=critical):
                    self._critical = critical
                    begun = self.source = LiveSource(None, gain)
                case Samples(bins=bins):
                    if self.source is not None:
                        self.source.add_bins(bins)
                case events.SpikesSeen(times=times):
                    if self.source is not None:
                        self.source.add_spikes(times)
                case Recorded():
                    self.recorded, self.recording = told, False
                case Refused(fault=fault) | Broken(fault=fault):
                    self.problem = f"{fault.title} {fault.consequence}"
        if self._run is not None and not self._run.alive:
            if self.source is not None:
                self.source.running = False
            self._run = None
        return begun

    @property
    def standing(self) -> Standing:
        """Where the sensor stands now."""
        source = self.source
        if source is None:
            return Standing(None, None, self._critical, 0.0, 0.0)
        spikes, rate = source.spikes, 0.0
        if spikes.size > 1 and source.reach - spikes[-1] < SILENT:
            rate = 1 / max(float(spikes[-1] - spikes[-2]), 1e-9)
        return Standing(
            source.mean("V_C1"),
            source.mean("V_C2"),
            self._critical,
            rate,
            min(source.reach, KEPT),
        )
