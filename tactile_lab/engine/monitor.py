"""Monitoring the sensor with the coil off: nothing is kept but what is asked for.

from tactile_lab.engine.monitor import Monitor

monitor = Monitor(load("monitor"))       # opens nothing
Thread(target=monitor.run).start()       # until monitor.stop("...")
folder = monitor.record("runs")          # the last 60 s as a run
"""

from __future__ import annotations

import threading
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tactile_lab.acquisition import events
from tactile_lab.acquisition.ending import Ending
from tactile_lab.acquisition.instruments import NO_COIL
from tactile_lab.acquisition.program import Program
from tactile_lab.acquisition.ring import Ring, RingContents
from tactile_lab.acquisition.runner import Runner
from tactile_lab.acquisition.search import SpikeSearch
from tactile_lab.analysis.noise import Noise, noise
from tactile_lab.bench import Bench
from tactile_lab.drive import Drive
from tactile_lab.engine.bench import open_bench
from tactile_lab.engine.memory import give_back
from tactile_lab.engine.provenance import keep_scene, layout, origin, temperature
from tactile_lab.engine.sensor import KEPT, SILENT, SensorState
from tactile_lab.engine.task import Task
from tactile_lab.errors import RecordingError, SceneError
from tactile_lab.planning.plan import plan
from tactile_lab.planning.warn import misses_spikes
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.scope import Block
from tactile_lab.store.certificate import write_certificate
from tactile_lab.store.folder import RunFolder
from tactile_lab.store.recorder import Recorder
from tactile_lab.trial import Outcome, Trial, Trials
from tactile_lab.voltage_source import SETTLED
from tactile_lab.waveform import Waveform

MOST = 1_000_000_000
"""Bytes that may be held."""
HEARD = 4.0
"""Length of the record that the noise is told from, s."""
LOOK = 0.5
"""Length of the record that the sensor's state is told from, s."""


class Monitor(Task[Ending]):
    """A scene without force, run until stopped; making one opens nothing.

    Args:
        scene: such as the one that ships as `monitor`.
        bench: instruments made elsewhere; those of the scene's bench unless given.
        realtime: pace a simulated bench by the wall clock.
        emit: told of everything that happens, from the deciding thread.
        keep: how much is held, s.
        endless: begin the protocol anew when it has ended, until stopped.

    Raises:
        SceneError, LimitError: the scene cannot be run on its bench, asks for a force,
            or a minute of it is too much for the memory.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        bench: Bench | None = None,
        realtime: bool = False,
        emit: events.Emit = events.ignore,
        keep: float = KEPT,
        endless: bool = False,
    ) -> None:
        self.plan = plan(scene, preview=False)
        needed = self.plan.needs
        if needed.coil:
            raise SceneError(
                f"{scene.name} asks for a force: run it. The monitor leaves the coil "
                "off."
            )
        size = 2 * len(needed.channels) * scene.record.sample_rate * keep
        if size > MOST:
            raise SceneError(
                f"Holding {show(keep, 's')} takes {size / 1e9:.1f} GB of memory; "
                f"{MOST / 1e9:g} GB is the limit. Lower record.sample_rate."
            )
        used = bench or open_bench(scene, needed, realtime=realtime)
        super().__init__(scene, used, emit)
        self._ring = Ring(keep)
        self._search = SpikeSearch.of(scene, needed.detect_on)
        self.counted = not misses_spikes(scene, needed)
        self._last = (float("-inf"), 0.0)
        self._shortest_interval = 0.0
        if self._search is not None:
            from tactile_lab.model.equations import shortest_interval

            self._shortest_interval = shortest_interval(scene.circuit)
        self._recording = threading.Lock()
        self._runner = Runner(
            Program(
                trials=self._rounds if endless else scene.protocol.trials,
                fault=scene.protocol.fault,
                channels=needed.channels,
                interval=1.0 / scene.record.sample_rate,
                search=self._search,
                drive_for=_no_drive,
                expected=None,
                doubts=lambda _: (),
                voltages=needed.voltages,
                settling=SETTLED * scene.circuit.tau_L,
            ),
            self.bench,
            lambda stream: self._ring,
            self.stop,
            self.live,
            self._note_spikes,
        )

    def run(self) -> Ending:
        """Monitor until `stop`, or until the protocol ends where that ends it."""
        return self._runner.run()

    def _rounds(self) -> Trials:
        while True:
            yield from self.scene.protocol.trials()

    @property
    def sensor(self) -> SensorState:
        """The sensor just now."""
        reach = self.live.reach
        levels = self.live.levels(reach - LOOK, reach + 1.0)
        when, rate = self._last
        return SensorState(
            self.scene.circuit.critical_V_C1,
            levels.get("V_C1"),
            levels.get("V_C2"),
            rate if reach - when < SILENT else 0.0,
            min(reach, self._ring.length),
            self.counted,
            self._shortest_interval,
        )

    def record(self, out: Path | str, notes: Mapping[str, str] | None = None) -> Path:
        """Keep what is held as a complete run, from any thread; its folder.

        Args:
            out: folder that run folders are put into; made if missing.
            notes: kept with the run, beside those of the scene.

        Raises:
            RecordingError: nothing has been streamed yet, or the disk refuses.
        """
        held = self._ring.held()
        all_notes = {**self.scene.conditions.notes, **(notes or {})}
        with self._recording:
            about = origin(self.plan, self.bench, all_notes)
            about["planned_s"] = held.length
            folder = RunFolder.create(Path(out), self.scene.name, about)
            keep_scene(folder, self.scene)
            self._write(folder, held)
            write_certificate(folder.path)
        del held
        give_back()  # or each record leaves the heap larger by some MB
        return folder.path

    def noise(self, signal: str) -> Noise:
        """The noise of a channel in the last seconds, from any thread.

        Of a scope with gaps between its records: in the last record.

        Raises:
            RecordingError: nothing has been streamed yet, or the channel is not.
            NotIdentifiableError: it was too short.
        """
        held = self._ring.held()
        stream = held.stream
        names = [channel.signal for channel in stream.channels]
        if signal not in names:
            raise RecordingError(f"{signal} is not monitored; {', '.join(names)} are.")
        row, most = names.index(signal), round(HEARD / stream.interval)
        parts: list[Block] = []
        for block in reversed(held.blocks):
            whole = not parts or block.first + block.samples == parts[-1].first
            if not whole or sum(part.samples for part in parts) >= most:
                break
            parts.append(block)
        codes = np.concatenate([part.codes[row] for part in reversed(parts)])[-most:]
        gain, offset = stream.volts_per_code(row)
        return noise(gain * codes + offset, stream.interval)

    def _write(self, folder: RunFolder, held: RingContents) -> None:
        folder.begin(self.bench.clock.now() - held.begun)
        recorder = Recorder(
            folder, layout(self.plan, self.bench, folder, self._search, held.stream)
        )
        held.replay(recorder)
        recorder.outcome(_watched(held.length))
        settings = self._runner.instruments.settings
        over = [
            channel.signal
            for row, channel in enumerate(held.stream.channels)
            if any(block.overrange[row] for block in held.blocks)
        ]
        recorder.close(
            "complete",
            held.samples,
            reason=None,
            coil=NO_COIL.text,
            coil_verified_off=NO_COIL.verified,
            duration_s=held.length,
            took_s=held.length,
            temperature=temperature(self.scene, settings),
            instruments=settings,
            accuracy=self.bench.accuracy() if self.bench.accuracy else "",
            overrange=sorted(over),
        )

    def _note_spikes(self, event: events.Event) -> None:
        if isinstance(event, events.SpikesSeen):
            self._last = event.times[-1], event.rates[-1]
        self._emit(event)


def _watched(length: float) -> Outcome:
    """What is kept, as the one trial of its run; `length` s."""
    trial = Trial(
        force=Waveform.constant(0.0), duration=length, label="watched", level=0.0
    )
    none = np.empty(0)
    return Outcome(trial=trial, index=0, start=0.0, spike_times=none, current=none)


def _no_drive(trial: Trial, update_interval: float, before: float) -> Drive:
    raise SceneError(f'Trial "{trial.label}" asks for a current; a monitor has none.')
