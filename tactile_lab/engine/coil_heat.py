"""When a real coil counts as cold, kept where every program on this computer finds it.

One small file for each coil in the state folder, by its port: by the name that stays
where the system has one, or a coil that two bench files name differently were two. A
program that was killed while it heated the coil, or could not switch it off, leaves a
file that says so; when its guard did, the guard's log tells.
"""

from __future__ import annotations

import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from tactile_lab.acquisition import events
from tactile_lab.acquisition.ending import Ending
from tactile_lab.bench import FOUND, Bench, CoilLimits
from tactile_lab.clock import steady
from tactile_lab.errors import LimitError
from tactile_lab.instruments.guard_log import switched_off
from tactile_lab.instruments.port import kept_of_port, lasting_name
from tactile_lab.planning.heat import cool_down
from tactile_lab.quantity import show
from tactile_lab.scene.scene import Scene
from tactile_lab.store.folder import lock
from tactile_lab.whole_file import failing_as, write_text

BOOT = Path("/proc/sys/kernel/random/boot_id")
"""Where Linux tells one start of the computer from another."""


class CoilHeat:
    """How long one coil takes to cool down, over programs and restarts.

    Times are counted by the clock that nobody sets; after a restart of the computer,
    or where that cannot be told, by the wall clock, and at most as long as a coil that
    has spent its whole heat budget takes.

    Args:
        port: of its source, as the bench file writes it.
        limits: its heat budget and recovery.
    """

    def __init__(self, port: str, limits: CoilLimits) -> None:
        self._port, self._limits = port, limits
        self._longest = self.after(limits.heat)
        self._alone = self._begun = False
        self.path = kept_of_port("coils", lasting_name(port) or port)

    @classmethod
    def of(cls, scene: Scene, bench: Bench) -> CoilHeat | None:
        """Of the coil that a bench has; None of a simulated one, which is always new.

        Args:
            scene: its bench file names the coil's port and limits.
            bench: made of it.
        """
        coil = scene.bench.coil
        if bench.simulated or bench.coil is None or coil is None:
            return None
        return cls(coil.port, coil.limits)

    def after(self, heat: float) -> float:
        """Time until it counts as cold with that heat, A^2 s, in s."""
        return cool_down(heat, self._limits)

    def left(self) -> float:
        """Time until it counts as cold, s; 0 where it does.

        Where it is `lost`, the whole heat budget is counted, from now on.

        Raises:
            LimitError: the file is not one that this program writes.
        """
        if (kept := self._kept()) is None:
            return 0.0
        heating, same, until, wall = kept
        if heating:
            # who has it drives it, and has its port as well, which says more
            return self._longest if self.lost else 0.0
        left = until - steady() if same else wall - time.time()
        return min(max(left, 0.0), self._longest)

    @property
    def lost(self) -> bool:
        """Whether its current may flow still, and nobody drives it.

        A program was killed with the coil in its hands, or could not switch it off, and
        neither did its guard.

        Raises:
            LimitError: the file is not one that this program writes.
        """
        if (kept := self._kept()) is None or not kept[0]:
            return False
        with self._held() as free:
            return free

    def seen_off(self) -> None:
        """What was `lost` is off now: the whole heat budget is counted from here.

        Raises:
            LimitError: the file cannot be written.
        """
        self.keep(self._longest)

    def refuse_found(self, settings: Mapping[str, str]) -> None:
        """Refuse a coil through which much flowed when its source was opened.

        Args:
            settings: of its source, as read back when it was opened.

        Raises:
            LimitError: how warm that made it nobody knows; whoever comes next waits.
        """
        found = abs(float(settings.get(FOUND, "0")))
        if found <= (carries := self._limits.continuous):
            return
        self.seen_off()
        raise LimitError(
            f"{show(found, 'A')} flowed through the coil when its source was opened, "
            f"beyond its continuous {show(carries, 'A')}, and nobody knows for how "
            "long. It is off now; start again, and what heats it waits the "
            f"{self._longest:.0f} s until it counts as cold."
        )

    def _kept(self) -> tuple[bool, bool, float, float] | None:
        """What the file holds, if there is one.

        Returns:
            Whether it is being heated; whether since this start of the computer; from
            when on it is cold, by the steady and by the wall clock, s.

        Raises:
            LimitError: the file is not one that this program writes.
        """
        try:
            kept = json.loads(self.path.read_bytes())
            heating, boot = kept["heating"] is True, kept["boot"]
            until, wall = float(kept["cold_steady_s"]), float(kept["cold_wall_s"])
            if not math.isfinite(until + wall):
                raise ValueError("a time that is no number")
            owner = int(kept.get("owner", 0))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError, KeyError) as reason:
            raise LimitError(
                f"How warm the coil is cannot be told: {self.path} cannot be read "
                f"({type(reason).__name__}: {reason}). Once no program has driven the "
                f"coil for {self._longest:.0f} s, delete the file."
            ) from reason
        same = bool(boot) and boot == _boot()
        off = switched_off(owner, wall - self._longest) if heating else None
        if off is None:
            return heating, same, until, wall
        # by the clock that nobody sets, it did not cool for longer than since it began
        return False, same, until + off - (wall - self._longest), off + self._longest

    def check(self) -> None:
        """Refuse where how warm the coil is cannot be told, or cannot be kept later.

        Raises:
            LimitError: the file is not one that this program writes, its folder cannot
                be written, or another program drives the coil.
        """
        kept = self._kept()
        with self._held() as free:
            if not free and kept is not None and kept[0]:
                raise LimitError(
                    f"Another program on this computer drives the coil at {self._port}."
                    " Wait until it has ended, or end it there."
                )

    def begin(self) -> None:
        """The coil is switched on now: until `kept_while` ends, it counts as `lost`.

        Raises:
            LimitError: the file cannot be written.
        """
        if self._alone:  # else its port is taken, too
            self.keep(self._longest, heating=True)
            self._begun = True

    def keep(self, left: float, *, heating: bool = False) -> None:
        """Keep that it counts as cold in `left` s.

        Raises:
            LimitError: the file cannot be written.
        """
        told = {
            "heating": heating,
            "cold_steady_s": steady() + left,
            "cold_wall_s": time.time() + left,
            "boot": _boot(),
            "owner": os.getpid(),
        }
        what = f"How warm the coil is left cannot be kept in {self.path}"
        advice = "Let XDG_STATE_HOME name a folder that can be written."
        with failing_as(what, advice, LimitError):
            write_text(self.path, json.dumps(told))

    def kept_while(
        self,
        drive: Callable[[], Ending],
        left: Callable[[Ending], float],
        emit: Callable[[events.Event], None],
    ) -> Ending:
        """Drive the coil, and keep how it is left unless another program has it.

        What never began leaves it as it was, or off where it was `lost`; what could
        not switch it off leaves it `lost`.

        Args:
            drive: does it, and calls `begin` before it switches on.
            left: time until the coil counts as cold, s, after it ended so, off.
            emit: told where that cannot be kept; the coil's state comes first.

        Raises:
            LimitError: the folder cannot be written, and nothing was driven.
        """
        with self._held() as self._alone:
            kept = self._kept()
            self._begun = self._alone and kept is not None and kept[0]
            ending = drive()
            if self._begun and ending.off.verified:
                try:
                    self.keep(left(ending))
                except LimitError as reason:
                    emit(events.Message("warning", str(reason)))
            return ending

    @contextmanager
    def _held(self) -> Iterator[bool]:
        """The coil's lock; False where another program has it."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            file = self.path.with_suffix(".lock").open("a")
        except OSError as reason:
            raise LimitError(
                f"{self.path.parent}, where how warm coils are is kept, cannot be "
                f"written: {reason.strerror}. Let XDG_STATE_HOME name a folder that "
                "can."
            ) from reason
        with file:
            yield lock(file)


def _boot() -> str:
    """Which start of the computer this is; "" where it does not tell."""
    return BOOT.read_text().strip() if sys.platform == "linux" else ""
