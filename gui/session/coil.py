"""Keeps what is known about the coil, from read-backs and their age."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING

from gui.state import STALE, CoilView
from tactile_lab.bench import CoilLimits, OffReport

if TYPE_CHECKING:
    from gui.session.heard import Heard
    from tactile_lab.acquisition.ending import CoilState


NEVER = float("-inf")
"""When the output was read back that is not on."""


class CoilWatch:
    """Turns what the coil's thread shows into a `CoilView`.

    Attributes:
        limits: in force; None without a coil.
        left_unknown: ports of other coils, which may still be driven: nobody could
            verify them off before another bench was connected.
    """

    def __init__(self) -> None:
        self.limits: CoilLimits | None = None
        self.left_unknown: tuple[str, ...] = ()
        self._port = ""
        self._off: OffReport | None = None
        self._off_since = time.monotonic()
        self._since = time.monotonic()
        self._sign = time.monotonic()
        self._read: float | None = NEVER
        self._under: float | None = None

    @property
    def doubtful(self) -> bool:
        """Whether there is a coil of which nobody could verify that it is off."""
        left = self._off
        return self.limits is not None and (left is None or not left.verified)

    def use(self, limits: CoilLimits | None, port: str = "") -> None:
        """Another bench, or none: nothing is known of its coil yet.

        Args:
            limits: of its coil; None without one.
            port: where that is; "" without one, and of one that is only simulated: it
                drives nothing once it is left.
        """
        left = {*self.left_unknown, *([self._port] if self.doubtful else [])}
        self.left_unknown = tuple(sorted(left - {port, ""}))
        self.limits, self._port = limits, port
        self._off = None

    def left(self, off: OffReport | None) -> None:
        """The coil was switched off with this result."""
        if off is not None:
            self._off, self._off_since = off, time.monotonic()

    def sign_of_life(self) -> None:
        """The source acknowledged a set-point or was read back just now."""
        self._sign = time.monotonic()

    def view(
        self, state: CoilState | None, heard: Heard | None = None
    ) -> CoilView | None:
        """What may be shown.

        Args:
            state: of the coil, as told last; None while nobody drives it.
            heard: of whoever may switch it on; None while nobody may.
        """
        if self.limits is None:
            return None
        limit, now = self.limits.current, time.monotonic()
        if state is None or not state.live:
            self._read = NEVER
            off = None if state is None else state.off
            if off is not None and off is not self._off:
                self.left(off)
            if off is None and (heard is None or heard.silent <= STALE):
                off = self._off  # nothing was switched on: as it was left before
            if off is None:
                return CoilView(None, limit=limit)
            return CoilView(
                False,
                off.current,
                0.0,
                # nobody else can switch on one that is only simulated
                read_age=now - self._off_since if self._port else 0.0,
                verified_off=off.verified,
                limit=limit,
            )
        if state.read != self._read:
            self._read, self._since, self._sign = state.read, now, now
            self._under = state.setpoint
        return CoilView(
            True,
            state.measured,
            state.setpoint,
            age=now - self._sign,
            read_age=now - self._since,
            under=self._under,
            limit=limit,
        )
