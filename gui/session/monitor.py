"""Watching the sensor between runs: coil off, nothing kept.

The `monitor` protocol runs like any other, but into a temporary folder, so that V_GS
can be trimmed by hand while V_C1, V_C2 and the rate are on screen.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from queue import Empty, SimpleQueue

from gui.lanes.source import LiveSource
from gui.session.link import Link, RunAfar
from gui.session.messages import Begun, Broken, Refused, Samples, Told
from gui.session.request import Request
from tactile_lab.acquisition import events
from tactile_lab.quantity import show

LONGEST = "600 s"


class Monitor:
    """One watch at a time.

    Attributes:
        source: what is seen; None before the first sample.
        problem: why watching ended by itself, "" if it did not.
    """

    def __init__(self, link: Link) -> None:
        self._link = link
        self.source: LiveSource | None = None
        self.problem = ""
        self._run: RunAfar | None = None
        self._inbox: SimpleQueue[Told] = SimpleQueue()
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self._critical = float("nan")

    @property
    def alive(self) -> bool:
        """Whether instruments may still be open."""
        return self._run is not None and self._run.alive

    def start(self, bench: str, overrides: tuple[str, ...] = ()) -> None:
        """Watch the sensor on a bench ("sim" or a bench file)."""
        self.source, self.problem = None, ""
        self._folder = tempfile.TemporaryDirectory(prefix="tactile-lab-monitor-")
        request = Request(
            "monitor", (f'protocol.duration="{LONGEST}"', *overrides), bench
        )
        self._inbox = SimpleQueue()
        out = Path(self._folder.name)
        self._run = self._link.run(request, out, self._inbox, report=False)

    def stop(self) -> None:
        """Let go of the instruments; returns at once."""
        if self._run is not None:
            self._run.stop("monitor off")

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
                case Refused(fault=fault) | Broken(fault=fault):
                    self.problem = f"{fault.title} {fault.consequence}"
        if self._run is not None and not self._run.alive:
            if self.source is not None:
                self.source.running = False
            if self._folder is not None:
                self._folder.cleanup()
                self._folder = None
            self._run = None
        return begun

    def words(self) -> str:
        """V_C1, its distance to the threshold and the rate, for a person."""
        V_C1 = None if self.source is None else self.source.mean("V_C1")
        if V_C1 is None or self.source is None:
            return "Monitor: opening the oscilloscope …"
        distance = V_C1 - self._critical
        side = "above the threshold: silent" if distance > 0 else "below it: fires"
        spikes = self.source.spikes
        rate = 0.0
        if spikes.size > 1 and self.source.reach - spikes[-1] < 2.0:
            rate = 1 / max(float(spikes[-1] - spikes[-2]), 1e-9)
        return (
            f"<b>Monitor</b> · coil off, nothing kept · V_C1 {V_C1:.3f} V, "
            f"<b>{show(abs(distance), 'V', 3)}</b> {side} "
            f"(fires under {self._critical:.3f} V) · {rate:.2f} Hz"
        )
