"""The bench that the window is connected to."""

from __future__ import annotations

from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.session.log import Log, Severity
from gui.session.status import Status
from gui.state import WindowState
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.jobs import Checked, check_bench, read_field
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request, bench_request
from tactile_lab.errors import TactileLabError
from tactile_lab.instruments.registry import check_scope
from tactile_lab.quantity import show
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scene.load import load_bench

if TYPE_CHECKING:
    from tactile_lab.engine.manual import FieldReading

ROLES = {"coil": "Coil source", "scope": "Oscilloscope", "meter": "Teslameter"}


class ConnectedBench(QObject):
    """Its file, who answered on it, and what was changed since.

    Attributes:
        choice: "sim" or a bench file; None while there is none.
        spec: what the file says, with what was changed.
        found: who answered; None before, and where somebody did not, or the coil
            was not verified off.
        overrides: ``bench.key=value`` texts that change the file.
        request: a run that needs every instrument.
        field: as read last, T.
        reading: the field is being read.
    """

    ready = Signal()

    def __init__(self, link: Link, status: Status, log: Log) -> None:
        super().__init__()
        self._link, self._status, self._log = link, status, log
        self.choice: str | None = None
        self.spec: BenchSpec | None = None
        self.found: Checked | None = None
        self.overrides: tuple[str, ...] = ()
        self.request: Request | None = None
        self.field: float | None = None
        self.reading = False

    def connect_to(self, choice: str) -> None:
        """Ask the instruments of a bench who they are."""
        try:
            self.spec = load_bench(choice)
        except (TactileLabError, OSError) as error:
            self._status.set_fault("The bench cannot be used.", str(error))
            return
        self.choice = choice
        self.overrides, self.found = (), None
        self.request = bench_request(choice, self.spec)
        self._status.coil.use(None)
        self._log.add(
            Severity.INFO, "bench", f"Asking the instruments of {self.spec.name}"
        )
        self.check()

    def check(self) -> None:
        """Ask the instruments who they are, and have the coil verified off."""
        if self.request is not None:
            self._status.enter(WindowState.CONNECTING)
            self._link.ask(self._checked, check_bench, self.request)

    def let_go(self) -> None:
        """No bench any more."""
        self.choice = self.spec = self.found = None
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

    def note_field(self, field: float) -> None:
        """The field was read, T."""
        self.field = field

    def _field_read(self, reply: Reply[FieldReading]) -> None:
        self.reading, found = False, reply.value
        if found is None:
            words = f"The field was not read: {reply.problem}"
            self._log.add(Severity.ERROR, "meter", words)
        else:
            self.field = found.mean
            mean, spread = show(found.mean, "T", 4), show(found.spread, "T", 2)
            self._log.add(Severity.INFO, "meter", f"Field {mean} ± {spread}")
        self._status.changed.emit()

    def _checked(self, reply: Reply[Checked]) -> None:
        status, found = self._status, reply.value
        if reply.lost:
            status.lose_engine()
            return
        if found is None:
            words = ("The bench cannot be used.", reply.problem)
            self._log.add(Severity.ERROR, "bench", " ".join(words))
            if self.found is None:
                self.spec = self.choice = None
            self.found = None
            status.set_fault(*words)
            return
        broken = [one for one in found.found if one.problem]
        unknown = found.off is not None and not found.off.verified
        self.found = None if broken or unknown else found
        coil = self.spec.coil if self.spec is not None else None
        has_coil = coil is not None and any(one.role == "coil" for one in found.found)
        status.coil.use(coil.limits if has_coil and coil is not None else None)
        status.coil.left(found.off)
        for one in found.found:
            if one.problem:
                self._log.add(Severity.ERROR, one.role, one.problem)
            else:
                self._log.add(Severity.GOOD, one.role, one.identity)
        if found.off is not None and unknown:
            status.set_fault("The coil's state is unknown.", found.off.text)
        elif broken:
            names = " and ".join(ROLES[one.role].lower() for one in broken)
            text = "; ".join(one.problem for one in broken)
            status.set_fault(f"No answer from the {names}.", text)
        else:
            status.enter(WindowState.READY)
            self.ready.emit()
