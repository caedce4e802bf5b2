"""The one state machine behind the window. It decides nothing about instruments.

The engine, a process of its own, does. What it tells is put into one queue; the
window's timer calls `poll`, which takes it all and moves the state. Nothing blocks.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING

from gui.session import chips
from gui.session.commands import (
    CheckBench,
    FitSteps,
    LookAtTwin,
    MakePlan,
    MakeTwin,
    ReadField,
)
from gui.session.core import Core, Queued
from gui.session.incoming import Incoming
from gui.session.messages import Level
from gui.session.request import Request, bench_request
from gui.state import Fault, Snapshot, State
from tactile_lab.errors import TactileLabError
from tactile_lab.instruments.registry import check_scope
from tactile_lab.quantity import show
from tactile_lab.scene.load import load_bench

if TYPE_CHECKING:
    from gui.session.finding import Finding
    from gui.session.fit import Beside

__all__ = ["Core", "Queued", "Session"]


class Session(Incoming):
    """What the window asks for, and what it shows."""

    # --- what the window asks for

    def connect_bench(self, choice: str) -> None:
        """Ask the instruments of a bench ("sim" or a bench file) who they are."""
        if self.state not in (State.DISCONNECTED, State.READY) or self.manual:
            return
        self.bench_choice = choice
        try:
            self.spec = load_bench(choice)
        except (TactileLabError, OSError) as error:
            self._set_fault(Fault("The bench cannot be used.", str(error)))
            return
        self.bench_overrides = ()
        self._check_request = bench_request(choice, self.spec)
        self.coil.use(None)
        self.bench = None
        self._enter(State.CONNECTING)
        self.log(Level.INFO, "bench", f"Asking the instruments of {self.spec.name}")
        self.link.ask(CheckBench(self._check_request))

    def disconnect_bench(self) -> None:
        """Let go of the bench."""
        if self.state is State.READY and self.manual is None:
            self.bench, self.bench_choice, self.spec = None, None, None
            self.coil.use(None)
            self._enter(State.DISCONNECTED)

    def enqueue_scene(self, scene: str, title: str) -> str:
        """Have a scene follow the runs before it; why not, "" if it does."""
        request = Request(scene, self.bench_overrides, self.bench_choice)
        try:
            request.load()
        except (TactileLabError, OSError) as error:
            return str(error)
        self.enqueue(Queued(title, request))
        return ""

    def plan(self, request: Request) -> None:
        """Have `request` planned; `planned` tells the result."""
        self._serial += 1
        self.link.ask(MakePlan(self._serial, request))

    def make_twin(self, folder: Path) -> None:
        """Have the twin of a run on disk computed; `twinned` tells the result."""
        self.desk.ask(MakeTwin(folder))

    def look_at_twin(self, folder: Path, start: float, end: float, bins: int) -> None:
        """Have that twin sampled between two times, s; `twin_seen` tells the result."""
        self.desk.ask(LookAtTwin(folder, start, end, bins))

    def fit(self, serial: int, steps: tuple[Finding, ...], seen: Beside) -> None:
        """Have steps fitted and compared with the model; `fitted` tells the result."""
        self.desk.ask(FitSteps(serial, steps, seen))

    def stop(self, reason: str = "STOP in the window") -> None:
        """Coil off, now. Reaches the coil's thread directly and never waits.

        Runs that wait in the queue are held until somebody resumes it.
        """
        self._hold_queue()
        if self.manual is not None:
            self.manual.stop(reason)
            self.log(Level.WARNING, "safety", f"{reason}: coil off", safety=True)
        elif self._run is not None and self._run.alive:
            self._run.stop(reason)
            if self.state is State.RUNNING:
                self._enter(State.ABORTING)
                self.log(Level.WARNING, "safety", f"{reason}: coil off", safety=True)
        elif self.monitor.alive:
            self.monitor.stop()
            self.log(Level.INFO, "safety", "Monitor off; the coil was not in use")
        elif self.state is State.READY and self._check_request is not None:
            self.log(Level.INFO, "safety", "Coil off sent again", safety=True)
            self._enter(State.CONNECTING)
            self.link.ask(CheckBench(self._check_request))

    def acknowledge(self) -> None:
        """The user has read the fault."""
        if self.state is State.FAULT:
            self.fault = None
            known = self.bench is not None
            self._enter(State.READY if known else State.DISCONNECTED)

    def errand_done(self, answer: str = "") -> None:
        """The person has done what the run waits for, and typed `answer`."""
        if self.errand is not None:
            said = f"Done: {self.errand.text}"
            if self.errand.current is not None:
                at = show(self.errand.current, "A")
                said = f"Typed {answer.replace('-', '−')} at {at}"
            self.log(Level.INFO, "runner", said)
            self.errand = None
            if self._run is not None:
                self._run.errand_done(answer)
            self.changed.emit()

    def begin_manual(self) -> None:
        """Open the coil source to drive it by hand."""
        request = self._check_request
        if self.state is not State.READY or self.manual or request is None:
            return
        self.monitor.stop()
        self.manual = self.link.take_coil(request, self.inbox)
        self.log(Level.WARNING, "coil", "Manual control on", safety=True)
        self.changed.emit()

    def read_field(self) -> None:
        """Read the field between runs, or while the coil is driven by hand."""
        manual, request = self.manual, self._check_request
        if self.reading_field or self.state is not State.READY or request is None:
            return
        if manual is not None:
            manual.read_field(request)
        else:
            self.link.ask(ReadField(0, request))
        self.reading_field = True
        self.changed.emit()

    def set_inputs(self, channels: str) -> str:
        """Set the scope's inputs for all that follows; why not, "" if it went well.

        Args:
            channels: ``[[scope.channels]]`` of a bench file as one TOML list.
        """
        if self.state is not State.READY or not self.bench_choice or not self.spec:
            return "The scope's inputs are set between runs."
        overrides = (f"bench.scope.channels={channels}",)
        request = bench_request(self.bench_choice, self.spec, overrides)
        try:
            scene = request.load()
            assert scene.bench.scope is not None
            wired = scene.bench.scope.channels
            check_scope(scene.bench.scope, wired, scene.record.sample_rate)
        except (TactileLabError, OSError) as error:
            return str(error)
        self.spec, self.bench_overrides = scene.bench, overrides
        self._check_request = request
        words = (f"{one.signal} ±{show(one.range, 'V')}" for one in wired)
        self.log(Level.INFO, "scope", f"Inputs set: {', '.join(words)}")
        self.changed.emit()
        return ""

    def watch(self, on: bool) -> None:
        """Show the sensor live between runs, coil off; or stop that."""
        if not on:
            self.monitor.stop()
        elif self.state is State.READY and self.manual is None and self.bench_choice:
            if not self.monitor.alive:
                self.monitor.start(self.bench_choice, self.bench_overrides)

    def record(self) -> None:
        """Keep the last minute of what is watched as a run."""
        self.monitor.record(self.out, self.notes)

    def note(self, text: str) -> None:
        """A note of the user, stamped with wall-clock and run time."""
        at = f" (at {self.elapsed:.1f} s)" if self.state is State.RUNNING else ""
        self.log(Level.NOTE, "note", text + at)
        if self._run is not None and self._run.alive:
            self._run.note(text, self.elapsed)

    # --- what the window shows

    @property
    def busy(self) -> bool:
        """Whether closing needs a question first."""
        live = self._run is not None and self._run.alive
        running = self.state in (State.RUNNING, State.ABORTING)
        return live or running or self.manual is not None

    def snapshot(self) -> Snapshot:
        """Everything the header, banner and buttons are rendered from."""
        coil = self.coil_view()
        name = "No bench connected" if self.spec is None else self.spec.name
        if self.run_name and self.state is not State.DISCONNECTED:
            name = self.run_name
        return Snapshot(
            state=self.state,
            bench="" if self.spec is None else self.spec.name,
            simulated=self.spec is not None and self.spec.simulated,
            title=name,
            coil=coil,
            instruments=chips.instruments(self, coil),
            elapsed=self.elapsed,
            expected=self.expected,
            manual=self.manual is not None,
            fault=self.fault,
            problem=self.plan_problem,
        )

    def wait_for_end(self, timeout: float) -> bool:
        """Block until nothing drives the coil any more, at most `timeout` s."""
        until = time.monotonic() + timeout
        if self._run is not None:
            self._run.join(timeout)
        if self.manual is not None:
            self.manual.join(max(0.0, until - time.monotonic()))
        self.poll()
        return not self.busy

    def close(self) -> None:
        """Let go of the engine; nothing drives a coil any more."""
        self.link.close()
        self.desk.close()
