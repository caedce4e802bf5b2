"""One watch in the engine: the sensor with the coil off, told to the window."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from gui.session.commands import RecordWatch, StartWatch
from gui.session.messages import Begun, Broken, Recorded, Refused, Told
from gui.session.sampling import tell_samples
from gui.session.task import Task
from gui.session.threads import start
from gui.state import Fault
from tactile_lab.acquisition.ending import CoilState
from tactile_lab.errors import TactileLabError

if TYPE_CHECKING:
    from tactile_lab.engine.monitor import Monitor

NO_COIL = CoilState(live=False, setpoint=None, measured=None, off=None)


class Looking(Task):
    """Watches until stopped; keeps the last minute when asked to.

    Args:
        asked: what to watch.
        tell: tells the window, from any thread.
    """

    def __init__(self, asked: StartWatch, tell: Callable[[Told], None]) -> None:
        super().__init__("watch", tell)
        self._asked = asked
        self._watching: Monitor | None = None

    def record(self, asked: RecordWatch) -> None:
        """Keep the last minute as a run, in a thread of its own."""
        watching = self._watching
        if watching is None:
            self._tell(Recorded(None, "Nothing has been seen yet."))
            return

        def work() -> None:
            try:
                folder = watching.record(asked.out, asked.notes)
            except (TactileLabError, OSError) as error:
                self._tell(Recorded(None, str(error)))
            else:
                self._tell(Recorded(folder, ""))

        start(work, "record")

    def _work(self) -> None:
        try:
            self._watch()
        except (TactileLabError, OSError) as error:
            self._tell(Refused(Fault("Watching was refused.", str(error))))
        except Exception as error:  # whatever it is, the window must be told
            title = f"Watching broke: {type(error).__name__}."
            self._tell(Broken(Fault(title, str(error)), None))

    def _watch(self) -> None:
        from tactile_lab.engine.monitor import Monitor

        scene = self._asked.request.load()
        watching = Monitor(scene, realtime=True, emit=self._tell)
        self._watching = watching
        self._stopped_by(watching)
        gain = scene.bench.magnet.newtons_per_ampere
        self._tell(Begun(None, gain, scene.circuit.critical_V_C1))
        ended = threading.Event()
        telling = start(
            lambda: tell_samples(watching.live, lambda: NO_COIL, ended, self._tell),
            "samples",
        )
        try:
            ending = watching.run()
        finally:
            ended.set()
            telling.join()
        if ending.failure is not None:
            raise ending.failure
