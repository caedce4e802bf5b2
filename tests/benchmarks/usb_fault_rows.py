"""Faults of USB transfers, injected into sessions with a USBTMC scope."""

from __future__ import annotations

import random
import sys
from pathlib import Path
from typing import Any

import numpy as np
from fault_rows import Row  # beside this file

sys.path.append(str(Path(__file__).parents[1] / "support"))
from voltages import Voltages

from drivers.usbtmc.scope import UsbtmcScope
from sim_backend.usbtmc.bus import SimulatedBus
from sim_backend.usbtmc.device import SimulatedDevice
from sim_backend.usbtmc.faults import UsbFault
from sim_backend.usbtmc.function import INTERFACE, UsbtmcFunction
from sim_backend.usbtmc.rigol_ds1000z import SimulatedDs1000z
from tactile_lab.clock import SimulatedClock
from tactile_lab.errors import InstrumentError
from tactile_lab.instruments.dialects import scope_dialect
from tactile_lab.scope import Channel

RECORDS = 6
WIRED = (Channel(signal="V_K", input="1", range=4.0),)


def _at(**fault: Any) -> Any:
    def cause(chance: random.Random) -> UsbFault:
        first = fault["call"] in ("open", "claim")
        return UsbFault(**{"nth": 1 if first else chance.randint(1, 40), **fault})

    return cause


ROWS = [
    Row("USB: gone at any transfer (`ENODEV`)",
        [_at(kind="unplug", call=c) for c in ("open", "claim", "write", "read")]),
    Row("USB: a transfer times out, once or for ever (`ETIMEDOUT`)",
        [_at(kind="timeout", call="write"), _at(kind="timeout", call="read"),
         _at(kind="timeout", call="read", times=500)]),
    Row("USB: an endpoint halts (`EPIPE`)",
        [_at(kind="stall", call="write"), _at(kind="stall", call="read")]),
    Row("USB: a transfer fails (`EIO`)",
        [_at(kind="io", call="write"), _at(kind="io", call="read")]),
    Row("USB: short packet, wrong bTag, garbled header",
        [_at(kind="short", call="read", amount=8), _at(kind="wrong_tag", call="write"),
         _at(kind="garbled", call="write")]),
    Row("USB: no answer, or none any more",
        [_at(kind="silent", call="write"), _at(kind="hang", call="write")]),
    Row("USB: in use, or no permission (`EBUSY`, `EACCES`)",
        [_at(kind="busy", call="claim"), _at(kind="access", call="open")]),
]  # fmt: skip


def session(cause: Any, seed: str) -> tuple[str, str]:
    """What became of a session of some records, and what was said."""
    clock = SimulatedClock()
    rigol = SimulatedDs1000z(
        Voltages({"1": lambda t: np.sin(2 * np.pi * 40 * t)}), clock
    )
    fault: UsbFault = cause(random.Random(seed))
    device = SimulatedDevice(
        vendor=0x1AB1, product=0x04CE, serial="DS1ZSIM0001", maker="Rigol",
        title="DS1000Z Series", function=UsbtmcFunction(rigol), interface=INTERFACE,
        packet=64, faults=(fault,),
    )  # fmt: skip
    scope = UsbtmcScope(
        scope_dialect("rigol-ds1000z"),
        clock=clock,
        backend=SimulatedBus([device], clock),
    )
    told, taken = "", 0
    with clock.taking_part("session"):
        try:
            scope.open()
            scope.start(WIRED, 1e-5)
            while taken < RECORDS:
                clock.sleep_until(clock.now() + scope.poll_interval)
                taken += scope.poll() is not None
            scope.close()
        except InstrumentError as reason:
            told = str(reason)
        except Exception as broken:  # what our errors should have been
            return "wrong", f"{type(broken).__name__}: {broken}"
    if device._calls.get(fault.call, 0) < fault.nth:
        return "did not strike", ""
    return ("ended", told) if told else ("went on", "")
