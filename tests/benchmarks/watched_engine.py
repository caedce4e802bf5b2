"""The engine of the window that `window_session.py` drives; its source is the witness.

It is the engine itself, in a process of its own as in life, and a thread beside it.
That has the newest simulated source write a line of JSON to the file `source.jsonl` in
the working folder whenever its output goes on or off, and fail as the file `fault`
there says.
"""

from __future__ import annotations

import json
import time
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from typing import cast

from sim_backend.coil.panel import PanelChange
from sim_backend.coil.source import SimCoilSource
from sim_backend.serial_line import wires
from sim_backend.serial_line.faults import Kind, SerialFault
from tactile_lab.engine import engine
from tactile_lab.engine.threads import start

LOOK = 0.05
"""Time between two looks at which sources there are, and at the fault, s."""

SOURCE, FAULT = Path("source.jsonl"), Path("fault")
"""What it did; what it is to fail by, empty for nothing."""

AMOUNTS = {"late": 1.0, "unplug": 2.0}
"""Of faults that have one, s."""


def number(far: wires.FarEnd) -> int:
    """The how many-th far end it is: they are numbered as they are plugged in."""
    return int(far.name.rpartition("-")[2])


class Witness:
    """Follows the newest source: a bench connected anew has its own.

    One that was unplugged stays as it was, and may outlive the one after it.
    """

    def __init__(self) -> None:
        self._newest, self._fault = 0, ""
        self._told: object = None

    def watch(self) -> None:
        """Look again and again."""
        while True:
            coils = [f for name, f in [*wires._far_ends.items()] if "coil" in name]
            for far in sorted(coils, key=number):
                if number(far) > self._newest:
                    self._follow(far)
            if coils and self._newest == max(map(number, coils)):
                self._fail(max(coils, key=number))
            del coils
            time.sleep(LOOK)

    def _follow(self, far: wires.FarEnd) -> None:
        self._newest = number(far)
        source = far.instrument
        assert isinstance(source, SimCoilSource)
        source.on_change = partial(self._changed, far.name)
        self._tell(far.name, source.output_on)

    def _changed(self, name: str, change: PanelChange) -> None:
        if change.what == "output" and name.endswith(f"-{self._newest}"):
            self._tell(name, bool(change.value))

    def _tell(self, name: str, on: bool) -> None:
        if (name, on) != self._told:
            self._told = name, on
            line = json.dumps({"at": time.monotonic(), "on": on, "name": name})
            with SOURCE.open("a") as told:
                told.write(f"{line}\n")

    def _fail(self, far: wires.FarEnd) -> None:
        """One that comes after it does not fail by the same word."""
        wanted = FAULT.read_text() if FAULT.exists() else ""
        if wanted == self._fault:
            return
        self._fault = wanted
        far.faults.clear()
        if wanted:
            kind, amount = cast(Kind, wanted), AMOUNTS.get(wanted, 0.0)
            far.faults.add(SerialFault(kind=kind, times=None, amount=amount))


def main(pipe: Connection, realtime: bool = True) -> None:
    """Serve as the engine does, beside a witness."""
    start(Witness().watch, "witness")
    engine.main(pipe, realtime)
