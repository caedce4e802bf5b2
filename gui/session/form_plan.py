"""The plan of what the form asks for; the newest counts."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, Signal

from tactile_lab.engine.engine import Reply
from tactile_lab.engine.link import Link
from tactile_lab.engine.request import Request

if TYPE_CHECKING:
    from gui.session.expectation import Expectation


class FormPlan(QObject):
    """Has what the form asks for planned.

    Attributes:
        request: that was planned last.
        expectation: None until it is computed.
        problem: why the form cannot be run, "" if it can.
    """

    arrived = Signal()
    """The newest request was planned, or cannot be."""

    def __init__(self, planner: Callable[[], Link]) -> None:
        super().__init__()
        self._planner = planner
        self._newest: Request | None = None
        self._asked = 0.0
        self.request: Request | None = None
        self.expectation: Expectation | None = None
        self.problem = ""

    @property
    def lasts(self) -> str:
        """For how long the newest request is planned already; "" until it is 1 s."""
        waited = 0.0 if self._newest is None else time.monotonic() - self._asked
        return f"Planning, {waited:.0f} s" if waited >= 1 else ""

    def forget(self) -> None:
        """Something else is asked for: what is being planned counts no more."""
        self._newest = None

    def make(self, request: Request) -> None:
        """Have a request planned; `arrived` tells the result."""
        from gui.session.expectation import plan_request

        self._newest, self._asked = request, time.monotonic()
        link = self._planner()
        link.ask(lambda reply: self._take(request, reply), plan_request, request)

    def _take(self, request: Request, reply: Reply[Expectation]) -> None:
        if request is self._newest:
            self.request, self._newest = request, None
            self.expectation, self.problem = reply.value, reply.problem
            self.arrived.emit()
