"""A bench file from what was chosen in the connect dialog. No Qt here."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from importlib import resources
from typing import Any

import tomli_w

from tactile_lab.quantity import exact, parse
from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.table import dumped

BY_PERSON = "read by a person"
"""In place of a teslameter's dialect: it has no output that could be read."""

PRINTED = {"-": "−", "Ohm": "Ω", "^2": "²"}
"""What files are typed with, and what is shown for it."""


@dataclass
class BenchChoice:
    """What the user chose; texts as they stand in a bench file, "" for not used.

    Attributes:
        name: of the bench.
        coil_port, coil_dialect: the current source.
        meter_port, meter_dialect: the teslameter; `BY_PERSON` needs no port.
        scope: driver of the oscilloscope, "" for none.
        scope_serial, scope_library: which one, and where the vendor's library lies.
        channels: (input, signal, range, offset, shunt) of each wired input.
        magnet: r, A1, A2, B1 and B2_per_ampere, and the calibration if there is one.
        base: the bench that the choice started from; what the dialog does not show
            (limits, hand-set voltages, couplings) is taken over from it.
    """

    name: str = "my bench"
    coil_port: str = ""
    coil_dialect: str = "kepco-bop"
    meter_port: str = ""
    meter_dialect: str = "lakeshore-425"
    scope: str = "ps3000a"
    scope_serial: str = ""
    scope_library: str = ""
    channels: list[tuple[str, str, str, str, str]] = field(default_factory=list)
    magnet: dict[str, Any] = field(default_factory=dict)
    base: dict[str, Any] = field(default_factory=dict)


def start_choice() -> BenchChoice:
    """The built-in bench's wiring and geometry, with no instrument chosen."""
    choice = BenchChoice()
    _take_over(choice, _built_in())
    return choice


def show_bench(choice: BenchChoice, spec: BenchSpec) -> None:
    """Let `choice` start from a bench; a simulated one gives no name and no port."""
    if not spec.simulated:
        choice.name = spec.name
    _take_over(choice, dumped(spec))


def bench_text(choice: BenchChoice) -> str:
    """The bench file that `choice` describes."""
    base = choice.base
    kept = ("notes", "hand_set")
    data: dict[str, Any] = {"name": choice.name, "simulated": False}
    data |= {key: base[key] for key in kept if base.get(key)}
    sources = {  # those that are simulated stay behind
        name: one
        for name, one in base.get("voltage_source", {}).items()
        if not one.get("port", "sim:").startswith("sim:")
    }
    if sources:
        data["voltage_source"] = sources
    if not base.get("thermometer", {"port": "sim:"})["port"].startswith("sim:"):
        data["thermometer"] = base["thermometer"]
    if choice.coil_port:
        same = base.get("coil", {}).get("dialect") == choice.coil_dialect
        data["coil"] = {
            **(base["coil"] if same else {}),
            "dialect": choice.coil_dialect,
            "port": choice.coil_port,
            "limits": base.get("coil", _built_in()["coil"])["limits"],
        }
    if choice.scope:
        scope = dict(base.get("scope", {}))
        if scope.get("driver") != choice.scope:
            scope = {}
        scope |= {
            "driver": choice.scope,
            "serial": choice.scope_serial,
            "library": choice.scope_library,
            "channels": [_channel(choice, row) for row in choice.channels if row[1]],
        }
        data["scope"] = {key: value for key, value in scope.items() if value != ""}
    if choice.meter_dialect == BY_PERSON:
        data["field_meter"] = {"driver": "manual"}
    elif choice.meter_port:
        meter = base.get("field_meter", {})
        data["field_meter"] = {
            **(meter if meter.get("dialect") == choice.meter_dialect else {}),
            "dialect": choice.meter_dialect,
            "port": choice.meter_port,
        }
    data["magnet"] = {k: _typed(v) for k, v in choice.magnet.items() if v != ""}
    return tomli_w.dumps(data)


def _take_over(choice: BenchChoice, data: dict[str, Any]) -> None:
    choice.base = data
    scope = data.get("scope", {})
    choice.channels = [
        (
            str(one["input"]),
            str(one["signal"]),
            _short(one["range"], "V"),
            _short(one.get("offset", "0 V"), "V"),
            _short(one.get("shunt", ""), "Ohm"),
        )
        for one in scope.get("channels", ())
    ]
    units = {"r": "m", "A1": "m^2", "A2": "m^2", "B1": "T", "B2_per_ampere": "T/A"}
    choice.magnet = {
        key: _short(value, units[key]) if key in units else value
        for key, value in data["magnet"].items()
    }
    choice.scope = str(scope.get("driver", ""))
    choice.scope_serial = str(scope.get("serial", ""))
    choice.scope_library = str(scope.get("library", ""))
    for role, name in (("coil", "coil"), ("field_meter", "meter")):
        found = data.get(role, {})
        port = str(found.get("port", ""))
        setattr(choice, f"{name}_port", "" if port.startswith("sim:") else port)
        if "dialect" in found:
            setattr(choice, f"{name}_dialect", str(found["dialect"]))
    if data.get("field_meter", {}).get("driver") == "manual":
        choice.meter_dialect = BY_PERSON


def _short(text: str, symbol: str) -> str:
    """The same quantity with the prefix that makes it shortest."""
    if not text:
        return ""
    shown = exact(parse(text, symbol), symbol)
    for typed, printed in PRINTED.items():
        shown = shown.replace(typed, printed)
    return shown


def _typed(text: Any) -> Any:
    """A text as people type it into a file: with what a keyboard has."""
    if not isinstance(text, str):
        return text
    for typed, printed in PRINTED.items():
        text = text.replace(printed, typed)
    return text


def _channel(
    choice: BenchChoice, row: tuple[str, str, str, str, str]
) -> dict[str, Any]:
    where, signal, full, offset, shunt = map(_typed, row)
    known = choice.base.get("scope", {}).get("channels", ())
    base = next((dict(one) for one in known if one["signal"] == signal), {})
    made = {**base, "signal": signal, "input": where, "range": full}
    made["offset"] = offset or "0 V"
    if shunt or made.pop("shunt", None):
        made.pop("scale", None)  # it follows from the shunt
    return made | ({"shunt": shunt} if shunt else {})


def _built_in() -> dict[str, Any]:
    text = resources.files("tactile_lab.scene") / "simulated_bench.toml"
    return tomllib.loads(text.read_text(encoding="utf-8"))
