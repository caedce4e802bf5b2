"""Every row of the tables of observed faults, as things to inject into a run.

One row is what a person at the bench would see; each of its causes is injected by its
own means: into the bytes of a serial wire, into the C functions of the scope's library,
into the USB transfers, or into what is plugged in.
"""

from __future__ import annotations

import ctypes
import random
import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from drivers.picoscope.scope import PicoScope
from sim_backend.coil.list_mode import ListFault
from sim_backend.coil.source import SimCoilSource
from sim_backend.picoscope.faults import ScopeFault
from sim_backend.picoscope.scope import UnitModel
from sim_backend.picoscope.sdk import FakePs3000a
from sim_backend.serial_line.faults import SerialFault
from sim_backend.serial_line.wires import FarEnd
from sim_backend.teslameter import SimTeslameter
from tactile_lab.bench import Bench

LINES = ("", "CURR", "^CURR 0\\.[1-9]", "MEAS", "OUTP", "VOLT", "IDN")
SAMPLES = (20_000, 150_000)
"""First and last sample of a run at which the scope fails."""


@dataclass(frozen=True)
class Injection:
    """What goes wrong in one run, and what is done to the bench before."""

    coil: tuple[SerialFault | ListFault, ...] = ()
    scope: tuple[ScopeFault, ...] = ()
    meter: tuple[SerialFault, ...] = ()
    make: UnitModel | None = None
    prepare: Callable[[Bench], Bench] | None = None
    bug: bool = False
    """It stands for a mistake in this program: the traceback is kept, not explained."""


Cause = Callable[[random.Random], Injection]


@dataclass(frozen=True)
class Row:
    """One observed fault and all its causes, in runs whose force goes by a way."""

    title: str
    causes: list[Cause] = field(default_factory=list)
    way: str = "set-points"


def coil_end(bench: Bench) -> FarEnd:
    """The simulated source behind the bench's coil."""
    source: Any = bench.coil
    end: FarEnd = source._wire.link.port.far_end
    return end


def _serial(where: str = "coil", **fault: Any) -> Cause:
    """A serial fault at a random line."""

    def cause(chance: random.Random) -> Injection:
        line = "" if where == "meter" else chance.choice(LINES)
        chosen = {"line": line, "skip": chance.randrange(6), **fault}
        made = (SerialFault(**chosen),)
        return Injection(coil=made) if where == "coil" else Injection(meter=made)

    return cause


def _both(**fault: Any) -> list[Cause]:
    return [_serial("coil", **fault), _serial("meter", **fault)]


def _scope(**fault: Any) -> Cause:
    """A fault of the scope at a random sample, unless at a call."""

    def cause(chance: random.Random) -> Injection:
        when: dict[str, Any] = (
            {} if "call" in fault else {"sample": chance.randint(*SAMPLES)}
        )
        return Injection(scope=(ScopeFault(**when, **fault),))

    return cause


def _made(**make: Any) -> Cause:
    return lambda chance: Injection(make=UnitModel(**make))


def _prepared(prepare: Callable[[Bench], Bench]) -> Cause:
    return lambda chance: Injection(prepare=prepare)


def _drained(form: str, call: str) -> Cause:
    """An answer that does not come, then the unplugging as the line is drained."""

    def cause(chance: random.Random) -> Injection:
        skip, line = chance.randrange(6), LINES[2]
        return Injection(
            coil=(
                SerialFault(kind="missing", line=line, skip=skip),
                SerialFault(
                    kind="unplug",
                    form=form,  # type: ignore[arg-type]
                    call=call,  # type: ignore[arg-type]
                    line=line,
                    skip=skip,
                ),
            )
        )

    return cause


def _gone_again(form: str) -> Cause:
    """Unplugged, back, and gone again in the moment it is reopened."""

    def cause(chance: random.Random) -> Injection:
        away = SerialFault(
            kind="unplug", line=LINES[2], skip=chance.randrange(6), amount=0.1
        )
        again = SerialFault(
            kind="unplug", form=form, call="reset", skip=1,  # type: ignore[arg-type]
        )  # fmt: skip
        return Injection(coil=(away, again))

    return cause


def _already_on(bench: Bench) -> Bench:
    source: Any = coil_end(bench).instrument
    source.set_current(0.4)
    source.switch(True)
    return bench


def _held(bench: Bench) -> Bench:
    coil_end(bench).held = True
    return bench


def _teslameter_there(bench: Bench) -> Bench:
    end = coil_end(bench)
    source: Any = end.instrument
    end.instrument = SimTeslameter(source._plant, "lakeshore-425", bench.clock)
    return bench


def _other_model_there(bench: Bench) -> Bench:
    end = coil_end(bench)
    source: Any = end.instrument
    end.instrument = SimCoilSource(source._plant, "keithley-2400", bench.clock)
    return bench


def _library(bench: Bench, library: Any) -> Bench:
    return replace(bench, scope=PicoScope(clock=bench.clock, library=library))


def _no_library(bench: Bench) -> Bench:
    return _library(bench, "/nonexistent/libps3000a.so.2")


def _other_bitness(bench: Bench) -> Bench:
    # an ELF header for 32 bits where this is a program of 64, or the other way round
    kind = 1 if ctypes.sizeof(ctypes.c_void_p) == 8 else 2
    file = Path(tempfile.mkdtemp()) / "libps3000a.so.2"
    file.write_bytes(b"\x7fELF" + struct.pack("<BBB", kind, 1, 1) + bytes(1000))
    return _library(bench, str(file))


def _missing_symbol(bench: Bench) -> Bench:
    class Old:
        """A library of another series."""

    return _library(bench, Old())


def _broken(bench: Bench) -> Bench:
    """A library whose callback meets an exception, once."""
    scope: Any = bench.scope
    library: FakePs3000a = scope._unit._library
    source = library.device.source

    class Broken:
        calls = 0

        def render(self, *asked: Any) -> Any:
            self.calls += 1
            if self.calls == 9:
                raise ZeroDivisionError("in the callback")
            return source.render(*asked)

    library.device.source = Broken()
    return bench


UNPLUGGED = ("usb", "windows", "closed", "reset")

SERIAL = [
    Row("serial: unplugged, `write` fails",
        [_serial(kind="unplug", form=f) for f in UNPLUGGED]),
    Row("serial: unplugged, `read` fails or wakes",
        [_serial(kind="unplug", form=f, call="read") for f in UNPLUGGED]),
    Row("serial: unplugged, `in_waiting` fails (`OSError`)",
        [_drained(f, "waiting") for f in UNPLUGGED]),
    Row("serial: gone again at `reset_input_buffer` (`termios.error`)",
        [_gone_again(f) for f in UNPLUGGED]),
    Row("serial: unplugged and back, on every form",
        [_serial(kind="unplug", form=f, amount=0.5) for f in UNPLUGGED]),
    Row("serial: held by flow control, its XON lost",
        [_serial(kind="xoff"), _serial(kind="xoff", times=2)]),
    Row("teslameter: unplugged",
        [_serial("meter", kind="unplug", form=f) for f in UNPLUGGED]),
    Row("instrument off, adapter alive (only silence)",
        [*_both(kind="deaf", times=None), *_both(kind="deaf")]),
    Row("answer later than the timeout (the next answer is the previous one's)",
        [*_both(kind="late", amount=0.3), _serial(kind="late", amount=1.5)]),
    Row("no answer", [*_both(kind="missing"), _serial(kind="missing", times=None)]),
    Row("part of an answer",
        [c for n in (1, 3, 7) for c in _both(kind="partial", amount=n)]),
    Row("no terminator, or the wrong one",
        [*_both(kind="no_terminator"), *_both(kind="carriage_return"),
         _serial(kind="no_terminator", times=None)]),
    Row("garbled answer (wrong baud rate or parity)",
        [*_both(kind="garbled"), _serial(kind="garbled", times=None)]),
    Row("noise, NUL before an answer", _both(kind="noise")),
    Row("XON/XOFF around and inside answers",
        [_serial(kind="flow_control", times=None)]),
    Row("echo", [*_both(kind="echo"), _serial(kind="echo", times=None, line="")]),
    Row("stuck peer: `write` never returns",
        [*_both(kind="stuck"), _serial(kind="stuck", times=None)]),
    Row("the source reports an error (-222)",
        [_serial(kind="refused"), _serial(kind="refused", line="VOLT"),
         _serial(kind="refused", line="OUTP", times=None)]),
    Row("the output is already on at connect", [_prepared(_already_on)]),
    Row("another program holds the port", [_prepared(_held)]),
    Row("another instrument at the port",
        [_prepared(_teslameter_there), _prepared(_other_model_there)]),
]  # fmt: skip
"""Rows of serial instruments."""

SCOPE = [
    Row("scope: unplugged before streaming",
        [_scope(kind="unplug", call=c) for c in
         ("OpenUnit", "GetUnitInfo", "SetChannel", "SetDataBuffer", "RunStreaming")]),
    Row("scope: unplugged while streaming (0x07, silence, 0x14, a call of 5 s)",
        [_scope(kind="unplug"), _scope(kind="silent"), _scope(kind="stream_fails"),
         _scope(kind="hang", duration=5.0)]),
    Row("scope: unplugged while stopping",
        [_scope(kind="unplug", call="Stop"), _scope(kind="unplug", call="CloseUnit")]),
    Row("host starved: samples missing without a word, or 0x1C",
        [_scope(kind="gap", samples=700), _scope(kind="gap", samples=20_000),
         _scope(kind="stall"), _made(fifo=1_000)]),
    Row("over-range", [_scope(kind="overrange", duration=0.05, inputs=("C",))]),
    Row("USB 2 port", [_made(usb="2.0", powers=(0x11E,))]),
    Row("mains adapter missing, or two power states in a row",
        [_made(powers=(0x11A,)), _made(powers=(0x11A, 0x11C)),
         _made(powers=(0x11A, 0x11E))]),
    Row("mains adapter pulled, plugged in, too little power, mid-run",
        [_scope(kind="supply_lost"), _scope(kind="supply_connected"),
         _scope(kind="undervoltage")]),
    Row("inputs C and D off on USB power",
        [_made(powers=(0x11A,), usb_powered_inputs="AB")]),
    Row("busy, overlapping calls (0x27, 0x43)",
        [_scope(kind="status", call="GetStreamingLatestValues", nth=9, code=0x27,
                times=5),
         _scope(kind="status", call="GetStreamingLatestValues", nth=9, code=0x43,
                times=2),
         _scope(kind="status", call="GetStreamingLatestValues", nth=9, code=0x27,
                times=100_000)]),
    Row("power failed, unknown status",
        [_scope(kind="status", call="GetStreamingLatestValues", nth=9, code=0x4C),
         _scope(kind="status", call="GetStreamingLatestValues", nth=9, code=0x999)]),
    Row("no library, other bitness, missing symbol",
        [_prepared(_no_library), _prepared(_other_bitness),
         _prepared(_missing_symbol)]),
    Row("exception in the callback",
        [lambda chance: Injection(prepare=_broken, bug=True)]),
    Row("another program has the scope", [_made(taken=True)]),
    Row("tiny and empty callbacks, ring wrap",
        [_made(parts=8, longest_part=4099, empty_callbacks=True)]),
    Row("suspend or hub reset", [_scope(kind="reset")]),
]  # fmt: skip
"""Rows of the scope."""


def _loading(**fault: Any) -> Cause:
    """A serial fault at a line that loads, starts or ends a list."""

    def cause(chance: random.Random) -> Injection:
        line = chance.choice(("LIST:CURR ", "LIST:DWEL ", "LIST:COUN", "CURR:MODE"))
        skip = chance.randrange(20) if line.endswith(" ") else 0
        return Injection(coil=(SerialFault(line=line, skip=skip, **fault),))

    return cause


def _list(**fault: Any) -> Cause:
    return lambda chance: Injection(coil=(ListFault(**fault),))


PLAYED = [
    Row("list: unplugged, silent or answering late, in part or with an error, as it is "
        "loaded, started or ended",
        [_loading(kind="unplug"), _loading(kind="deaf"), _loading(kind="missing"),
         _loading(kind="late", amount=0.3), _loading(kind="partial", amount=3),
         _loading(kind="garbled"), _loading(kind="refused"),
         _loading(kind="deaf", times=None)], "list"),
    Row("list: does not start, is cut short, does not fit, is played at other times",
        [_list(trigger_lost=True), _list(cut_after=0.25), _list(memory=200),
         _list(dwell_grid=2e-3)], "list"),
    Row("generator: its scope unplugged, silent or failing as it plays",
        [_scope(kind="unplug"), _scope(kind="silent"), _scope(kind="stream_fails"),
         _scope(kind="supply_lost")], "generator"),
    Row("generator: refuses to be set, loaded or started (0x27, 0x2E, 0x07)",
        [_scope(kind="status", call=f"{call}", code=code)
         for call in ("SetSigGenBuiltIn", "SetSigGenArbitrary",
                      "SigGenFrequencyToPhase", "SigGenSoftwareControl")
         for code in (0x27, 0x2E, 0x07)], "generator"),
    Row("generator: the source unplugged, silent or late as it follows",
        [_serial(kind="unplug"), _serial(kind="deaf", times=None),
         _serial(kind="late", amount=0.3), _serial(kind="refused")], "generator"),
]  # fmt: skip
"""Rows of forces that source or generator plays by its own clock."""
