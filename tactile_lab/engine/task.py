"""What uses a bench: a run, a monitor or manual control, all with one life cycle."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic, TypeVar

from tactile_lab.acquisition import events
from tactile_lab.acquisition.ending import CoilState, Ending
from tactile_lab.acquisition.live import LiveBins
from tactile_lab.acquisition.stop import StopRequest
from tactile_lab.bench import Bench
from tactile_lab.scene.scene import Scene

Ended = TypeVar("Ended", bound=Ending, covariant=True)


class Task(ABC, Generic[Ended]):
    """One use of a bench, from opening its instruments to the coil verified off.

    Making one opens nothing. `run` does it and returns when it has ended, however that
    came; what goes wrong on the way is told by the ending it returns. `stop(reason)`
    ends it from any thread, also before it has begun.

    Args:
        scene: what is done, and on which bench.
        bench: that bench; nothing of it is open.
        emit: told of everything that happens, from the thread that calls `run`.

    Attributes:
        stop: asks for the end; a second time without ramp.
        live: the newest samples, decimated.
        counted: whether all spikes are seen: none falls between two samples.
    """

    counted = True

    def __init__(self, scene: Scene, bench: Bench, emit: events.Emit) -> None:
        self.scene, self.bench = scene, bench
        self.stop = StopRequest(bench.clock)
        self.live = LiveBins()
        self._emit = emit

    @abstractmethod
    def run(self) -> Ended:
        """Do it to the end; the coil is safe when this returns."""

    @property
    def coil_state(self) -> CoilState:
        """What is known of the coil now."""
        return CoilState()
