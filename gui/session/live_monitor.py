"""Monitoring the sensor between runs: coil off, nothing kept but what Record asks for.

V_GS can be trimmed by hand while V_C1, V_C2 and the rate are on screen. The engine
holds the last minute; Record makes it a run. `tactile-lab monitor` does the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from PySide6.QtCore import Signal

from gui.lanes.live import LiveSource
from gui.session.live_task import LiveTask
from gui.session.log import Log, Severity
from gui.session.status import Status
from tactile_lab.acquisition import events
from tactile_lab.acquisition.ending import Ending
from tactile_lab.engine.commands import begin_monitor
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.events import Begun, Samples, TaskEvent
from tactile_lab.engine.jobs import record
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request
from tactile_lab.engine.sensor import KEPT, LONG_PARTS, SILENT, SensorState


class LiveMonitor(LiveTask):
    """One monitor at a time.

    Attributes:
        source: what is seen; None before the first sample.
        recording: the last minute is being kept.
    """

    begun = Signal(object)
    ended = Signal()
    recorded = Signal(object)

    def __init__(self, link: Link, status: Status, log: Log) -> None:
        super().__init__(link, status, log)
        self.source: LiveSource | None = None
        self.recording = False
        self._critical = float("nan")

    def start(self, bench: str, overrides: tuple[str, ...] = ()) -> None:
        """Monitor the sensor on a bench ("sim" or a bench file)."""
        self.source, self.recording = None, False
        wanted = Request("monitor", (*LONG_PARTS, *overrides), bench)
        self._begin(begin_monitor, wanted)

    def record(self, out: Path, notes: Mapping[str, str]) -> None:
        """Keep the last minute as a run; `recorded` tells its folder."""
        if self.task is not None and not self.recording:
            self.recording = True
            number = self.task.number
            self._link.ask(self._recorded, record, number, out, dict(notes))

    def hear(self, event: TaskEvent) -> None:
        """Note what is seen."""
        source = self.source
        if isinstance(event, Begun):
            self._critical = event.critical_V_C1
            self.source = LiveSource(None, event.newtons_per_ampere)
            self.source.simulated = event.simulated
            self.source.counted = event.counted
            self.source.shortest_interval = event.shortest_interval
            self.begun.emit(self.source)
        elif source is not None and isinstance(event, Samples):
            source.add_bins(event.bins)
        elif source is not None and isinstance(event, events.SpikesSeen):
            source.add_spikes(event.times)

    def has_ended(self, ending: Ending) -> None:
        """Say why, unless somebody asked for it."""
        if self.source is not None:
            self.source.running = False
        if ending.state is events.RunState.LOST:
            self._status.lose_engine()
        elif ending.state is events.RunState.REFUSED:
            words = f"The monitor was refused. {ending.reason}"
            self._log.tell(Severity.ERROR, "monitor", words)
        elif ending.state is events.RunState.FAULTED:
            self._status.set_fault("The monitor ended.", ending.reason or "")
        self.ended.emit()

    @property
    def sensor(self) -> SensorState:
        """The sensor just now."""
        source = self.source
        if source is None:
            return SensorState(self._critical)
        spikes, rate = source.spikes, 0.0
        if spikes.size > 1 and source.reach - spikes[-1] < SILENT:
            rate = 1 / max(float(spikes[-1] - spikes[-2]), 1e-9)
        V_C1, V_C2 = source.mean("V_C1"), source.mean("V_C2")
        held = min(source.reach, KEPT)
        return SensorState(
            self._critical,
            V_C1,
            V_C2,
            rate,
            held,
            source.counted,
            source.shortest_interval,
        )

    def _recorded(self, reply: Reply[Path]) -> None:
        self.recording = False
        if reply.value is None:
            words = f"Not recorded: {reply.problem}"
            self._log.tell(Severity.ERROR, "monitor", words)
        else:
            self._log.add(Severity.GOOD, "monitor", f"Recorded to {reply.value}")
            self.recorded.emit(reply.value)
