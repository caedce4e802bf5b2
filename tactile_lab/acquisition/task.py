"""What the deciding loop is given, and how it ends."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from tactile_lab.acquisition.asked_field import AskedField
from tactile_lab.acquisition.drift import Drift
from tactile_lab.acquisition.events import RunState
from tactile_lab.acquisition.person import Ask
from tactile_lab.acquisition.search import SpikeSearch
from tactile_lab.bench import Channel, OffReport
from tactile_lab.errors import TactileLabError
from tactile_lab.trial import Trial, Trials
from tactile_lab.waveform import Waveform


@dataclass(frozen=True)
class Task:
    """All the loop must know of a scene.

    Attributes:
        trials: the protocol's generator, not started yet.
        channels: scope channels to enable, in row order.
        interval: sample interval asked for, s.
        search: how spikes are searched; None where they are not.
        current_for: coil current, A(t), that gives a trial's force within all limits,
            told the time between two set-points, s, and the last set-point, A.
        ask: asks a person to put the probes elsewhere; None where nobody is there.
        expected: run time expected, s; None if it depends on outcomes.
        doubts: told the opened instruments' settings, says what a person should know
            before the coil is switched on, or raises to prevent it.
        drift: judges V_C1 at rest before each trial; None where no trial pushes.
        asked_field: has a person read the field; None where a meter does, or nobody.
    """

    trials: Callable[[], Trials]
    channels: tuple[Channel, ...]
    interval: float
    search: SpikeSearch | None
    current_for: Callable[[Trial, float, float], Waveform]
    expected: float | None
    doubts: Callable[[Mapping[str, Mapping[str, str]]], tuple[str, ...]]
    drift: Drift | None = None
    ask: Ask | None = None
    asked_field: AskedField | None = None


@dataclass(frozen=True)
class Ending:
    """How a run ended.

    Attributes:
        state: complete, aborted or faulted.
        off: how the coil was left.
        reason: why it ended early; None if complete.
        failure: the error behind a fault.
        signal: POSIX signal that asked for the end, if one did.
    """

    state: RunState
    off: OffReport
    reason: str | None = None
    failure: BaseException | None = None
    signal: int | None = None

    def faulted_by(self, failure: TactileLabError) -> Ending:
        """The same end where something failed after it; an earlier fault stays."""
        if self.state is RunState.FAULTED:
            return self
        return replace(
            self, state=RunState.FAULTED, reason=str(failure), failure=failure
        )

    @property
    def exit_code(self) -> int:
        """0 complete, 3 faulted, 4 safe state not verified, 128 + signal."""
        if not self.off.verified:
            return 4
        if self.state is RunState.COMPLETE:
            return 0
        if self.signal is not None:
            return 128 + self.signal
        return 130 if self.state is RunState.ABORTED else 3
