"""What a window, a script or a notebook asks of tasks, but STOP; done in the engine.

`Link.begin` takes the functions that make a task, `RemoteTask.say` those that do
something to one. A new one is a function here, or wherever it belongs: it need only be
importable in the engine, and its arguments be pickled.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tactile_lab.acquisition.events import Message
from tactile_lab.engine.engine import ServedTask
from tactile_lab.engine.request import Request
from tactile_lab.errors import LimitError

if TYPE_CHECKING:
    from tactile_lab.engine.execution import Execution
    from tactile_lab.engine.lsl import LslStreams
    from tactile_lab.engine.manual import ManualControl
    from tactile_lab.engine.monitor import Monitor

MODELLED = frozenset({"V_C1", "V_C2", "V_K", "spikes"})
"""Signals beside which the model runs."""


def begin_run(
    served: ServedTask,
    request: Request,
    out: Path,
    notes: Mapping[str, str],
    *,
    publish: bool = False,
) -> Execution:
    """Run a request into a folder in `out`; the model follows it."""
    from tactile_lab.acquisition.asked_field import AskedField
    from tactile_lab.engine.execution import Execution

    scene = request.load()
    streams = _lsl(served) if publish else None
    magnet = scene.bench.magnet
    if scene.record.compare and MODELLED & set(scene.record.signals):
        from tactile_lab.acquisition.live_model import LiveModel

        served.model = LiveModel.of(scene)
    execution = Execution(
        scene,
        out,
        realtime=served.realtime,
        emit=served.emit,
        others=() if streams is None else (streams,),
        notes=notes,
        ask=served.ask,
        asked_field=AskedField(
            served.ask_field, lambda current: float(magnet.field(current))
        ),
    )
    if streams is not None:
        streams.begin(execution)
    return execution


def _lsl(served: ServedTask) -> LslStreams:
    """The streams that tell a run by LSL; what becomes of them is told with the run."""
    from tactile_lab.engine.lsl import kept_open

    def say(level: str, text: str) -> None:
        served.emit(Message(level, text))

    streams = kept_open()
    streams.warn = partial(say, "warning")
    say("info", f"published live by LSL: {streams.source}")
    return streams


def begin_monitor(served: ServedTask, request: Request) -> Monitor:
    """Monitor a request that asks for no force; only `jobs.record` keeps anything."""
    from tactile_lab.engine.monitor import Monitor

    return Monitor(request.load(), realtime=True, emit=served.emit, endless=True)


def begin_manual(served: ServedTask, request: Request) -> ManualControl:
    """Open the coil source of a request's bench to drive it by hand; it stays off."""
    from tactile_lab.engine.manual import ManualControl

    return ManualControl(request.load(), realtime=True, emit=served.emit)


def note(served: ServedTask, text: str, time: float | None) -> None:
    """Keep a note of the user with a run, at a time of it, s, or on it as a whole."""
    served.to_task(lambda run: run.note(text, time))


def answer(served: ServedTask, text: str) -> None:
    """The person has done what a run waits for; `text` is what was typed."""
    served.answers.put(text)


def hold(served: ServedTask, current: float) -> None:
    """Have the coil driven by hand go to `current`, A, and stay, or say why not."""

    def go(control: ManualControl) -> None:
        try:
            control.hold(current)
        except LimitError as reason:
            served.emit(Message("warning", str(reason)))

    served.to_task(go)


def renew(served: ServedTask) -> None:
    """Whoever drives the coil by hand lives: it may stay on for another 2 s."""
    served.to_task(lambda control: control.renew())
