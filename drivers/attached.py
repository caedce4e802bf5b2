"""What is attached to this computer, and which dialect row each instrument fits."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from serial.tools import list_ports

from drivers.coil.source import CoilSource
from drivers.picoscope.sdk import load
from drivers.picoscope.sdk_calls import LibraryCalls
from drivers.picoscope.unit import units
from drivers.serial_line.link import SerialLink
from drivers.teslameter import Teslameter
from drivers.thermometer import Thermometer
from drivers.usb_presence import present
from drivers.voltage_source import SourceMeter
from tactile_lab.bench import CoilLimits
from tactile_lab.clock import RealClock
from tactile_lab.errors import InstrumentError, NoReplyError, NotFoundError
from tactile_lab.instruments.dialects import (
    coil_dialect,
    dialect_ids,
    load_dialect,
    teslameter_dialect,
    thermometer_dialect,
    voltage_dialect,
)
from tactile_lab.instruments.port import lasting_name
from tactile_lab.instruments.serial_dialect import SerialDialect, SerialSettings
from tactile_lab.voltage_source import VoltageLimits

NO_USB = "usb"
"""Address that stands for all of USB where it cannot be looked at."""

DIALOUT = (
    "join the group that owns it: sudo usermod -aG dialout $USER, then log in anew"
)


@dataclass(frozen=True, kw_only=True)
class Found:
    """One port or device.

    Attributes:
        address: what a bench file calls it; bus and address for a USB device.
        kind: "serial" or "usb".
        title: what the system knows of it.
        identity: what it answered when asked for its name; None if it was not asked
            or did not answer.
        fits: driver and rows that fit; empty if none is known.
        problem: what stands in its way, with the remedy, or None.
        stays: another name of the port, which stays when cables are pulled; None where
            the system gives none.
    """

    address: str
    kind: str
    title: str
    identity: str | None = None
    fits: tuple[str, ...] = ()
    problem: str | None = None
    stays: str | None = None


def attached(*, ask: bool = True, ports: Iterable[str] = ()) -> list[dict[str, Any]]:
    """Serial ports and USB devices, as plain data.

    Args:
        ask: send each USB serial adapter, or each of `ports`, the harmless `*IDN?`, in
            every framing a shipped row has.
        ports: these addresses, whatever they are, instead of looking for ports.
    """
    chosen = tuple(ports)
    if chosen:
        found = [_serial(address, "named by you", ask=ask) for address in chosen]
    else:
        found = [
            replace(
                _serial(one.device, _title(one), ask=ask and one.vid is not None),
                stays=lasting_name(one.device),
            )
            for one in sorted(list_ports.comports())
        ]
        found += _usb()
    return [asdict(one) for one in found]


def try_out(
    address: str,
    dialect: str,
    *,
    baud: int | None = None,
    transcript: Path | None = None,
) -> dict[str, str]:
    """Open the instrument at `address` as a run would, read its settings, close it.

    No output is switched on; the set-point of one that is off goes to 10 mA or 10 mV
    and back. The bytes go to `transcript`.

    Returns:
        Settings and readings by name, and as `not_tried` what of the row only a run
        will show to be right.

    Raises:
        SceneError: no such row, or the transcript cannot be written.
        InstrumentError: it does not answer as the row says.
        UnsafeError: a source's output could not be verified off.
        LimitError: what a meter reads is beyond its range.
    """
    clock = RealClock()
    device: CoilSource | Teslameter | Thermometer | SourceMeter
    role = load_dialect(dialect).role
    if role == "coil":
        row = coil_dialect(dialect)
        device = CoilSource(row, address, CoilLimits(), clock, baud=baud, guarded=False)
    elif role == "voltage source":
        speaks = voltage_dialect(dialect)
        most = VoltageLimits(highest=speaks.ranges[0].full)
        device = SourceMeter("voltage", speaks, address, most, clock, baud=baud)
    elif role == "thermometer":
        warm = thermometer_dialect(dialect).at(None)
        device = Thermometer(warm, address, clock, baud=baud)
    else:
        device = Teslameter(teslameter_dialect(dialect), address, clock, baud=baud)
    if transcript is not None:
        device.record(transcript)
    try:
        device.open()
        found = device.settings()
        if isinstance(device, CoilSource | SourceMeter):
            found["not_tried"] = ", ".join(device.rehearse())
        elif isinstance(device, Teslameter):
            found["field_T"] = f"{device.read().value:.6g}"
        elif isinstance(device, Thermometer):
            found["temperature_K"] = f"{device.read().value:.6g}"
        return found
    finally:
        device.close()


def ask_name(address: str) -> tuple[str | None, str | None]:
    """(name, problem) of what answers at `address`, asked in every shipped framing."""
    tried = set()
    problem: str | None = "nothing answered *IDN? in any framing of the shipped rows"
    for row in _serial_dialects():
        if row.serial in tried or row.identify != "*IDN?":
            continue
        tried.add(row.serial)
        link = SerialLink(address, _quick(row.serial), RealClock(), what="instrument")
        try:
            link.open()
        except NoReplyError:
            continue
        except NotFoundError as reason:
            return None, str(reason)
        except InstrumentError as reason:
            problem = str(reason)
            continue
        finally:
            link.close()
        return link.identity, None
    return None, problem


def fitting(identity: str) -> tuple[str, ...]:
    """Ids of the rows for an instrument of that name; a plain one if no other fits."""
    fits = [row for row in _serial_dialects() if re.search(row.match, identity)]
    special = [row.id for row in fits if row.match != "."]
    plain = [row.id for row in fits if row.match == "." and not special]
    return tuple(special + plain)


def _serial_dialects() -> list[SerialDialect]:
    every = map(load_dialect, dialect_ids())
    return [dialect for dialect in every if isinstance(dialect, SerialDialect)]


def _quick(wire: SerialSettings) -> SerialSettings:
    return wire.model_copy(update={"timeout": 0.3})


def _serial(address: str, title: str, *, ask: bool) -> Found:
    here = address.startswith("/dev/")
    if here and os.path.exists(address) and not os.access(address, os.R_OK | os.W_OK):
        return Found(
            address=address,
            kind="serial",
            title=title,
            problem=f"{address} may not be opened by this user; {DIALOUT}",
        )
    if not ask:
        return Found(address=address, kind="serial", title=title)
    identity, problem = ask_name(address)
    fits = () if identity is None else fitting(identity)
    if identity is not None and not fits:
        problem = "no shipped row is for it; write one (docs/how-to/add-a-dialect.md)"
    return Found(
        address=address,
        kind="serial",
        title=title,
        identity=identity,
        fits=fits,
        problem=problem,
    )


def _picoscopes() -> list[Found]:
    """Those that PicoSDK knows, where it is installed; none is opened."""
    try:
        names = units(LibraryCalls(load()))
    except InstrumentError:
        return []
    return [
        Found(
            address=f"serial {name}",
            kind="usb",
            title="PicoScope, as PicoSDK tells",
            identity=name,
            fits=("ps3000a",),
        )
        for name in names
    ]


def _title(port: Any) -> str:
    named = port.description and port.description != "n/a"
    parts = [port.description if named else "serial port"]
    if port.vid is not None:
        parts.append(f"USB {port.vid:04x}:{port.pid:04x}")
    if port.serial_number:
        parts.append(f"serial number {port.serial_number}")
    return ", ".join(parts)


def _usb() -> list[Found]:
    try:
        devices = present()
    except InstrumentError as reason:
        told = "USB cannot be looked at; only USBTMC scopes need that"
        found = Found(address=NO_USB, kind="usb", title=told, problem=str(reason))
        return [found, *_picoscopes()]
    return [
        Found(
            address=f"bus {one.bus} device {one.address}",
            kind="usb",
            title=f"{one.title or 'unnamed'} {one.vendor:04x}:{one.product:04x}, "
            f"{one.link}",
            identity=one.serial or None,
            fits=("ps3000a",) if one.is_picoscope else ("usbtmc",),
            problem=one.problem,
        )
        for one in devices
        if one.is_picoscope or one.usbtmc
    ]
