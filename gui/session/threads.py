"""The threads behind the window. Each ends by putting what it found into the queue."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING

from gui.session.messages import (
    Begun,
    Broken,
    Checked,
    Ended,
    Errand,
    FieldByHand,
    Identified,
    Planned,
    Refused,
    Reported,
    Told,
)
from gui.session.request import Request
from gui.state import Fault
from tactile_lab.bench import Bench, OffReport
from tactile_lab.errors import TactileLabError
from tactile_lab.plugins import open_bench
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene

if TYPE_CHECKING:
    from tactile_lab.acquisition.execution import Execution

Inbox = SimpleQueue[Told]


def start(work: Callable[[], None], name: str) -> threading.Thread:
    """Start a background thread."""
    thread = threading.Thread(target=work, name=name, daemon=True)
    thread.start()
    return thread


class RunThread:
    """Executes one request; STOP reaches it from any thread without waiting.

    Args:
        request: what to run.
        out: folder for run folders.
        inbox: where everything that happens is put.
        notes: kept with the run.
        report: whether the report is written at its end.
    """

    def __init__(
        self,
        request: Request,
        out: Path,
        inbox: Inbox,
        notes: dict[str, str],
        *,
        report: bool = True,
    ) -> None:
        self.request = request
        self._wants_report = report
        self.execution: Execution | None = None
        self._out, self._inbox, self._notes = out, inbox, notes
        self._stop_asked: str | None = None
        self._lock = threading.Lock()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Start the run."""
        self._thread = start(self._main, "run")

    def stop(self, reason: str) -> None:
        """Switch the coil off and end the run; returns at once."""
        with self._lock:
            self._stop_asked = self._stop_asked or reason
            execution = self.execution
        if execution is not None:
            execution.stop(reason)

    @property
    def alive(self) -> bool:
        """Whether the run has not ended yet."""
        return self._thread is not None and self._thread.is_alive()

    def join(self, timeout: float) -> bool:
        """Wait for the end, at most `timeout` s; whether it came."""
        if self._thread is not None:
            self._thread.join(timeout)
        return not self.alive

    def _main(self) -> None:
        from tactile_lab.acquisition.execution import Execution

        try:
            execution = Execution(
                self.request.load(),
                self._out,
                realtime=True,
                emit=self._inbox.put,
                notes=self._notes,
                ask=self._ask,
            )
        except (TactileLabError, OSError) as error:
            self._inbox.put(Refused(Fault("The run was refused.", str(error))))
            return
        except Exception as error:  # a protocol of the user's own may raise anything
            text = f"{type(error).__name__}: {error}"
            self._inbox.put(Refused(Fault("The run broke before it began.", text)))
            return
        with self._lock:
            self.execution = execution
            reason = self._stop_asked
        if reason is not None:
            execution.stop(reason)
        self._inbox.put(Begun(execution))
        try:
            done = execution.run()
        except BaseException as error:
            off = execution.coil_state.off
            title = f"The run broke: {type(error).__name__}."
            self._inbox.put(Broken(Fault(title, str(error)), off))
            return
        self._inbox.put(Ended(done))
        if self._wants_report:
            start(lambda: self._report(done.folder), "report")

    def _ask(self, text: str) -> None:
        """Have the window ask a person; returns when it is done, or nobody cares."""
        done = threading.Event()
        self._inbox.put(Errand(text, done))
        while self.alive and not done.wait(0.2):
            pass

    def _report(self, folder: Path) -> None:
        from gui.session.reports import write_report

        try:
            write_report(folder)
        except (TactileLabError, OSError, ValueError) as error:
            self._inbox.put(Reported(folder, str(error)))
        else:
            self._inbox.put(Reported(folder, ""))


def plan_in_background(serial: int, request: Request, inbox: Inbox) -> None:
    """Plan `request` in a thread of its own."""

    def work() -> None:
        from gui.session.expect import expect

        found = None
        try:
            found, problem = expect(request.load()), ""
        except (TactileLabError, OSError) as error:
            problem = str(error)
        except Exception as error:  # a protocol of the user's own may raise anything
            problem = f"The plan broke: {type(error).__name__}: {error}"
        inbox.put(Planned(serial, request, found, problem))

    start(work, "plan")


def check_in_background(request: Request, inbox: Inbox) -> None:
    """Ask every instrument of the bench who it is; make the coil safe."""

    def work() -> None:
        try:
            scene = request.load()
            inbox.put(check(scene, open_bench(scene, realtime=True)))
        except (TactileLabError, OSError) as error:
            inbox.put(Refused(Fault("The bench cannot be used.", str(error))))
        except Exception as error:  # a driver of the user's own may raise anything
            text = f"{type(error).__name__}: {error}"
            inbox.put(Refused(Fault("Asking the instruments broke.", text)))

    start(work, "check")


def read_field_in_background(bench: Bench, inbox: Inbox) -> None:
    """Read the field a few times."""

    def work() -> None:
        from tactile_lab.acquisition.by_hand import read_field

        try:
            found = read_field(bench)
        except (TactileLabError, OSError) as error:
            inbox.put(FieldByHand(None, f"The field was not read: {error}"))
        else:
            text = f"{show(found.mean, 'T', 4)} ± {show(found.spread, 'T', 2)}"
            inbox.put(FieldByHand(found.mean, f"Field {text}"))

    start(work, "read field")


def check(scene: Scene, bench: Bench) -> Checked:
    """Open, identify and close each instrument; the coil is verified off on the way."""
    found: list[Identified] = []
    off: OffReport | None = None
    with bench.clock.taking_part("check"):
        coil = bench.coil
        if coil is not None:
            try:
                coil.open()
                found.append(Identified("coil", coil.identity, ""))
            except (TactileLabError, OSError) as error:
                found.append(Identified("coil", "", str(error)))
            else:
                off = coil.safe_off()
                coil.close()
        for role, instrument in (("scope", bench.scope), ("meter", bench.field_meter)):
            if instrument is None:
                continue
            try:
                instrument.open()
                found.append(Identified(role, instrument.identity, ""))
                instrument.close()
            except (TactileLabError, OSError) as error:
                found.append(Identified(role, "", str(error)))
    return Checked(scene.bench.name, scene.bench.simulated, tuple(found), off)
