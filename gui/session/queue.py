"""Runs that wait for the one in progress."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from gui.session.log import Log, Severity
from tactile_lab.engine.engine import Reply
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request

if TYPE_CHECKING:
    from gui.session.expectation import Expectation


@dataclass(eq=False)
class Queued:
    """A run that waits for the one before it.

    Attributes:
        title: for people.
        request: what to run.
        expectation: its plan; None until it is computed.
        left: how it left the queue, in words; "" while it waits.
    """

    title: str
    request: Request
    expectation: Expectation | None = None
    left: str = ""


class Queue(QObject):
    """Starts the first run as soon as the bench is free and nobody holds it.

    Args:
        planner: who plans just now.
        log: says why one was taken out, or does not start.
        bench: that is connected; None where there is none.
        free: whether that is free.
        running: whether a run is in progress, which the first one follows.
        let_go: has the monitor let go of the bench, and tells whether it has; `next`
            is asked again once it has.
        start: starts a run.

    Attributes:
        items: the next one first.
        held: whether it waits to be started, as it does after a STOP and where the
            first run was put in while nothing was in progress.
    """

    changed = Signal()

    def __init__(
        self,
        planner: Callable[[], Link],
        log: Log,
        bench: Callable[[], str | None],
        free: Callable[[], bool],
        running: Callable[[], bool],
        let_go: Callable[[], bool],
        start: Callable[[Queued], None],
    ) -> None:
        super().__init__()
        self._planner, self._log, self._running = planner, log, running
        self._bench, self._free = bench, free
        self._let_go, self._start = let_go, start
        self.items: list[Queued] = []
        self.held = False

    def add(self, item: Queued) -> None:
        """Have a run follow those before it; nothing starts by it."""
        from gui.session.expectation import plan_request

        if not self.items:
            self.held = not self._running()
        self.items.append(item)
        if item.expectation is None:
            asked = item.request
            self._planner().ask(
                lambda reply: self._planned(item, asked, reply), plan_request, asked
            )
        self.changed.emit()

    def resume(self) -> None:
        """Start, or go on after a STOP or a fault."""
        self.held = False
        self.changed.emit()
        self.next()

    @property
    def going(self) -> bool:
        """Whether a run of it starts as soon as it can."""
        return bool(self.items) and not self.held

    def hold(self) -> None:
        """Wait until somebody resumes."""
        if self.items and not self.held:
            self.held = True
            self.changed.emit()

    def remove(self, item: Queued) -> None:
        """Take a waiting run out."""
        self.items.remove(item)
        item.left = "was taken out of the queue"
        self.changed.emit()

    def replace(
        self, item: Queued, title: str, request: Request, expectation: Expectation
    ) -> None:
        """Have a waiting run do something else, at its place."""
        item.title, item.request, item.expectation = title, request, expectation
        self.changed.emit()
        self.next()

    def move(self, item: Queued, by: int) -> None:
        """Move a waiting run up (-1) or down (1)."""
        number = self.items.index(item)
        to = number + by
        if 0 <= to < len(self.items):
            self.items[number], self.items[to] = self.items[to], self.items[number]
            self.changed.emit()

    def next(self) -> None:
        """Start the first run, if it is planned and its bench is connected and free."""
        planned = self.items and self.items[0].expectation is not None
        if planned and not self.held and self._free():
            if self.items[0].request.bench != self._bench():
                self._hold_for_bench(self.items[0])
                return
            if not self._let_go():
                return  # it waits here meanwhile: a STOP holds it, and drops nothing
            item = self.items.pop(0)
            item.left = "has started with the parameters it had"
            self.changed.emit()
            self._start(item)

    def _hold_for_bench(self, item: Queued) -> None:
        """Hold: what the header names would not be what is driven."""
        words = (
            f"{item.title} was queued for {item.request.bench}, which is not connected."
            " Connect that, or edit and save it for the bench that is."
        )
        self._log.tell(Severity.ERROR, "queue", words)
        self.hold()

    def _planned(self, item: Queued, asked: Request, reply: Reply[Expectation]) -> None:
        """The plan of a waiting run is there; one that cannot run is taken out."""
        if item not in self.items or item.request != asked:
            return  # it has left, or does something else by now
        item.expectation = reply.value
        if reply.value is None:
            self.items.remove(item)
            item.left = f"was taken out of the queue: {reply.problem}"
            self._log.tell(Severity.ERROR, "queue", f"{item.title} {item.left}")
        self.changed.emit()
        self.next()
