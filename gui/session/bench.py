"""The bench that the window is connected to."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.session.log import Log, Severity
from gui.session.status import UNKNOWN, Status
from gui.state import HOLDS, WindowState
from tactile_lab.bench import OffReport
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.jobs import (
    Checked,
    InstrumentAnswer,
    check_bench,
    look_at_bench,
    read_field,
)
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request, bench_request
from tactile_lab.errors import TactileLabError
from tactile_lab.instruments.registry import check_scope
from tactile_lab.quantity import show
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scene.load import load_bench
from tactile_lab.voltage_source import SOURCED

if TYPE_CHECKING:
    from tactile_lab.engine.manual import FieldReading

WATCH = HOLDS / 2
"""Age of an answer, s, at which it is asked for anew while nothing uses the bench."""

SILENT, UNUSABLE = "what did not answer", "what the log says of it"

ROLES = {
    "coil": "Coil source",
    "scope": "Oscilloscope",
    "meter": "Teslameter",
    "thermometer": "Thermometer",
    **{name: f"Source of {name}" for name in SOURCED},
}


class ConnectedBench(QObject):
    """Its file, who answered on it, and what was changed since.

    Attributes:
        choice: "sim" or a bench file; None while there is none.
        spec: what the file says, with what was changed.
        found: who answered; None before, and where somebody did not, or the coil
            was not verified off.
        answers: of each instrument that was asked last.
        see_to: what keeps a bench that is not connected from being so, in words.
        overrides: ``bench.key=value`` texts that change the file.
        request: a run that needs every instrument.
        field: as read on request since the instruments were last asked or used, T.
        reading: the field is being read.
    """

    ready = Signal()

    def __init__(
        self, link: Link, status: Status, log: Log, free: Callable[[], bool]
    ) -> None:
        super().__init__()
        self._link, self._status, self._log, self._free = link, status, log, free
        self._answered: float | None = None
        self._looking = self._switching = False
        status.faulted.connect(self._doubt)
        self.choice: str | None = None
        self._unusable = ""
        self.spec: BenchSpec | None = None
        self.found: Checked | None = None
        self.answers: tuple[InstrumentAnswer, ...] = ()
        self.see_to = SILENT
        self.overrides: tuple[str, ...] = ()
        self.request: Request | None = None
        self.field: float | None = None
        self.reading = False

    def connect_to(self, choice: str) -> None:
        """Ask the instruments of a bench who they are."""
        try:
            self.spec = load_bench(choice)
        except (TactileLabError, OSError) as error:
            if self.spec is None:
                self._unusable, self.see_to = choice, UNUSABLE
            self._status.set_fault("The bench cannot be used.", str(error))
            return
        self.choice, self._unusable = choice, ""
        self.overrides, self.found = (), None
        self.request = bench_request(choice, self.spec)
        if not self._status.coil.doubtful:  # else that stands until somebody answered
            self._use(self.spec)
        self._log.add(
            Severity.INFO, "bench", f"Asking the instruments of {self.spec.name}"
        )
        self.check()

    def check(self) -> None:
        """Ask the instruments who they are, and have the coil verified off."""
        if self.request is not None:
            self._looking, self.field = False, None
            self._status.enter(WindowState.CONNECTING)
            self._link.ask(self._checked, check_bench, self.request)

    def switch_off(self) -> None:
        """Have the coil switched off where no state waits for it, as at a fault.

        Asked again before it has answered, once is enough.
        """
        asked = self.request
        if asked is not None and not self._switching:
            self._switching = True
            self._link.ask(
                lambda reply: self._switched_off(reply, asked), check_bench, asked
            )

    def look(self) -> None:
        """Ask who is still there, between runs; what is gone becomes a fault.

        Nothing is set: an output that was switched on by hand stays on, and is told.
        A simulated bench is there as long as the program is.
        """
        real = self.spec is not None and not self.spec.simulated
        if real and self.request is not None and self._free() and not self._looking:
            self._looking = True
            self._link.ask(self._looked, look_at_bench, self.request)

    @property
    def age(self) -> float | None:
        """Seconds since all instruments answered; None: not since the last fault."""
        if self._answered is None:
            return None
        simulated = self.spec is not None and self.spec.simulated
        return 0.0 if simulated else time.monotonic() - self._answered

    @property
    def known(self) -> bool:
        """Whether the last answer still says that the instruments are there."""
        return self.age is not None and self.age < HOLDS

    @property
    def refused(self) -> str:
        """Name of a real bench that was chosen and is not connected; "" for none.

        That of its file where nothing else could be read.
        """
        if self._unusable:
            return Path(self._unusable).name
        spec = self.spec if self.found is None else None
        return "" if spec is None or spec.simulated else spec.name

    @property
    def wanted(self) -> str | None:
        """The bench that was chosen last, though it may not be usable."""
        return self._unusable or self.choice

    def let_go(self) -> None:
        """No bench any more."""
        self.choice = self.spec = self.found = None
        self._unusable = ""
        self._status.coil.use(None)

    def set_inputs(self, channels: str) -> str:
        """Set the scope's inputs for all that follows; why not, "" if it went well.

        Args:
            channels: ``[[scope.channels]]`` of a bench file as one TOML list.
        """
        if not self.choice or not self.spec:
            return "No bench is connected."
        overrides = (f"bench.scope.channels={channels}",)
        request = bench_request(self.choice, self.spec, overrides)
        try:
            scene = request.load()
            scope = scene.bench.scope
            if scope is None:
                return "This bench has no oscilloscope."
            check_scope(scope, scope.channels, scene.record.sample_rate)
        except (TactileLabError, OSError) as error:
            return str(error)
        self.spec, self.overrides, self.request = scene.bench, overrides, request
        words = (f"{one.signal} ±{show(one.range, 'V')}" for one in scope.channels)
        self._log.add(Severity.INFO, "scope", f"Inputs set: {', '.join(words)}")
        self._status.changed.emit()
        return ""

    def read_field(self, task: int = 0) -> None:
        """Read the field; `task`: manual control that has the bench, if any."""
        if self.request is not None and not self.reading:
            self.reading = True
            self._link.ask(self._field_read, read_field, self.request, task)
            self._status.changed.emit()

    def _field_read(self, reply: Reply[FieldReading]) -> None:
        self.reading, found = False, reply.value
        if found is None:
            words = f"The field was not read: {reply.problem}"
            self._log.tell(Severity.ERROR, "meter", words)
        else:
            self.field = found.mean
            mean, spread = show(found.mean, "T", 4), show(found.spread, "T", 2)
            self._log.add(Severity.INFO, "meter", f"Field {mean} ± {spread}")
            self._log.told.emit("")
        self._status.changed.emit()

    def confirm(self) -> None:
        """A run has used the instruments to its end: they are there."""
        self._answered, self.field = time.monotonic(), None

    def watch(self) -> None:
        """Look at who is still there where the last answer has become old."""
        if self.age is not None and self.age > WATCH:
            self.look()

    def _doubt(self) -> None:
        """What answered before a fault need not be there any more."""
        self._answered = None

    def _looked(self, reply: Reply[Checked]) -> None:
        """Whoever uses the bench by now finds out by itself."""
        wanted, self._looking = self._looking, False
        if not wanted or not self._free():
            return
        if reply.value is None or not reply.value.sound:
            self._checked(reply)
            return
        self._take(reply.value)
        self._status.changed.emit()

    def _use(self, spec: BenchSpec | None) -> None:
        """Have the coil of a bench watched, of which nothing is known yet; or none."""
        coil = None if spec is None else spec.coil
        if spec is None or coil is None:
            self._status.coil.use(None)
        else:
            self._status.coil.use(coil.limits, "" if spec.simulated else coil.port)

    def _take(self, found: Checked) -> None:
        self.answers, self._answered = found.found, time.monotonic()
        self.found = found if found.sound else None
        self._status.coil.left(found.off)

    def _switched_off(self, reply: Reply[Checked], asked: Request) -> None:
        """Take what is now known of the coil alone: others are asked by `check`."""
        self._switching = False
        if reply.lost:
            self._status.lose_engine()
        elif asked is self.request:
            found, why = reply.value, [reply.problem]
            if found is not None:
                why = [one.problem for one in found.found if one.role == "coil"]
            off = found.off if found is not None else None
            off = off or OffReport(False, None, " ".join(("Not verified off.", *why)))
            level = Severity.GOOD if off.verified else Severity.ERROR
            self._status.coil.left(off)
            self._log.add(level, "safety", f"Coil: {off.text}", safety=True)
            self._status.changed.emit()

    def _checked(self, reply: Reply[Checked]) -> None:
        status, found = self._status, reply.value
        if reply.lost:
            status.lose_engine()
            return
        if found is None:
            self.see_to = SILENT
            if self.found is None:
                if self.spec is not None and not self.spec.simulated:
                    self._unusable, self.see_to = self.choice or "", UNUSABLE
                self.spec = self.choice = None
            self.found = None
            status.coil.left(UNKNOWN)  # nobody looked, and somebody may be using it
            status.set_fault("The bench cannot be used.", reply.problem)
            return
        broken = [one for one in found.found if one.problem]
        if any(one.role == "coil" for one in found.found):
            self._use(self.spec)
            status.coil.left(UNKNOWN)  # unless the answer below tells more
        else:
            self._use(None)
        self._take(found)
        for one in found.found:
            if one.problem:
                self._log.add(Severity.ERROR, one.role, one.problem)
            else:
                self._log.add(Severity.GOOD, one.role, one.identity)
        self.see_to = SILENT
        if found.on and found.off is not None:
            self.see_to = "its coil, whose output was found on"
            status.set_fault("The coil's output is on.", found.off.text)
        elif found.off is not None and not found.off.verified:
            self.see_to = "its coil, which was not verified off"
            status.set_fault("The coil's state is unknown.", found.off.text)
        elif broken:
            names = " and ".join(ROLES[one.role].lower() for one in broken)
            text = "; ".join(one.problem for one in broken)
            status.set_fault(f"No answer from the {names}.", text)
        else:
            status.enter(WindowState.READY)
            self.ready.emit()
            return
        self._take(found)  # a fault puts in doubt what answered before it
        status.changed.emit()
