"""One run in the engine: executed, watched, and told to the window."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING

from gui.session.commands import StartRun
from gui.session.messages import (
    Begun,
    Broken,
    Ended,
    Errand,
    Refused,
    Reported,
    Told,
    Twinned,
)
from gui.session.sampling import tell_samples
from gui.session.task import Task
from gui.session.threads import start
from gui.state import Fault
from tactile_lab.acquisition import events
from tactile_lab.errors import RefusedError, TactileLabError

if TYPE_CHECKING:
    from gui.session.twin import LiveTwin
    from tactile_lab.acquisition.ending import Executed
    from tactile_lab.engine.execution import Execution

TWINNED = frozenset({"V_C1", "V_C2", "V_K", "spikes"})
"""Signals beside which the twin runs."""


class Running(Task):
    """Executes one request; STOP reaches it from any thread without waiting.

    Args:
        asked: what to run.
        tell: tells the window, from any thread.
        realtime: pace a simulated bench by the wall clock.
    """

    def __init__(
        self, asked: StartRun, tell: Callable[[Told], None], *, realtime: bool = True
    ) -> None:
        super().__init__("run", tell)
        self._asked, self._realtime = asked, realtime
        self._execution: Execution | None = None
        self._twin: LiveTwin | None = None
        self._answers: SimpleQueue[str] = SimpleQueue()

    def note(self, text: str, at: float) -> None:
        """Put a note into the run's log, stamped with its time, s."""
        if self._execution is not None and self.alive:
            self._execution.folder.log("note", text, time_s=at)

    def errand_done(self, answer: str) -> None:
        """The person has done what the run waits for, and typed `answer`."""
        self._answers.put(answer)

    def _work(self) -> None:
        execution = self._prepare()
        if execution is not None:
            self._run(execution)

    def _prepare(self) -> Execution | None:
        from tactile_lab.acquisition.asked_field import AskedField
        from tactile_lab.engine.execution import Execution

        try:
            scene = self._asked.request.load()
            magnet = scene.bench.magnet
            execution = Execution(
                scene,
                self._asked.out,
                realtime=self._realtime,
                emit=self._emit,
                notes=self._asked.notes,
                ask=lambda text: self._ask(Errand(text)),
                asked_field=AskedField(
                    self._ask_field, lambda current: float(magnet.field(current))
                ),
            )
        except (TactileLabError, OSError) as error:
            self._tell(Refused(Fault("The run was refused.", str(error))))
            return None
        except Exception as error:  # a protocol of the user's own may raise anything
            text = f"{type(error).__name__}: {error}"
            self._tell(Refused(Fault("The run broke before it began.", text)))
            return None
        self._execution = execution
        self._stopped_by(execution)
        return execution

    def _run(self, execution: Execution) -> None:
        scene, coil = execution.scene, execution.bench.coil
        if TWINNED & set(scene.record.signals):
            from gui.session.twin import LiveTwin

            self._twin = LiveTwin(scene)
        self._tell(
            Begun(
                limits=None if coil is None else coil.limits,
                newtons_per_ampere=scene.bench.magnet.newtons_per_ampere,
                critical_V_C1=scene.circuit.critical_V_C1,
            )
        )
        ended = threading.Event()
        watching = [
            start(
                lambda: tell_samples(
                    execution.live, lambda: execution.coil_state, ended, self._tell
                ),
                "samples",
            )
        ]
        if self._twin is not None:
            twin = self._twin
            watching.append(start(lambda: self._follow(twin, execution, ended), "twin"))
        try:
            done: Executed | BaseException = execution.run()
        except BaseException as error:
            done = error
        ended.set()
        for thread in watching:
            thread.join()
        if isinstance(done, BaseException):
            title = f"The run broke: {type(done).__name__}."
            off = execution.coil_state.off
            self._tell(Broken(Fault(title, str(done)), off))
            return
        # an error may hold anything; its words are in the ending's reason
        self._tell(Ended(replace(done, failure=None)))
        if self._asked.report:
            start(lambda: self._report(done.folder), "report")

    def _emit(self, event: events.Event) -> None:
        if self._twin is not None and isinstance(event, events.CoilCurrent):
            sent = event.setpoint if event.measured is None else event.measured
            self._twin.add(event.time, sent)
        self._tell(event)

    def _ask(self, errand: Errand) -> str:
        """Have the window ask a person; what was typed.

        Raises:
            RefusedError: the run ended meanwhile.
        """
        self._tell(errand)
        while self.alive:
            try:
                return self._answers.get(timeout=0.2)
            except Empty:
                pass
        raise RefusedError("The run has ended; nobody needs to answer.")

    def _ask_field(self, text: str) -> str:
        """Have a person read the teslameter at the current that flows."""
        doubt, _, question = text.rpartition("\n")
        assert self._execution is not None
        current = self._execution.coil_state.setpoint
        return self._ask(Errand(question, current or 0.0, doubt))

    def _follow(
        self, twin: LiveTwin, execution: Execution, ended: threading.Event
    ) -> None:
        """Advance the twin behind the samples, slice by slice, and to their end."""
        from gui.session.twin import BEHIND, EVERY

        over = False
        while not over:
            over = ended.wait(EVERY)
            part = twin.until(execution.live.reach - (0.0 if over else BEHIND))
            if part is not None:
                self._tell(Twinned(part))

    def _report(self, folder: Path) -> None:
        from gui.session.reports import write_report

        try:
            write_report(folder)
        except (TactileLabError, OSError, ValueError) as error:
            self._tell(Reported(folder, str(error)))
        else:
            self._tell(Reported(folder, ""))
