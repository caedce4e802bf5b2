"""A bench file from what was chosen in the connect dialog. No Qt here."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from typing import Any

from tactile_lab.scene.bench_file import BenchSpec
from tactile_lab.scene.load import load_bench
from tactile_lab.scene.toml_text import to_toml


@dataclass
class Choice:
    """What the user chose; texts as they stand in a bench file, "" for not used.

    Attributes:
        name: of the bench.
        coil_port, coil_dialect: the current source.
        meter_port, meter_dialect: the teslameter.
        scope: driver of the oscilloscope, "" for none.
        scope_serial, scope_library: which one, and where the vendor's library lies.
        channels: (input, signal, range, offset, shunt) of each wired input.
        magnet: r, A1, A2, B1 and B2_per_ampere.
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
    magnet: dict[str, str] = field(default_factory=dict)


def start_choice() -> Choice:
    """The built-in bench's wiring and geometry, with no instrument chosen."""
    data = _built_in()
    channels = [
        (
            str(one["input"]),
            str(one["signal"]),
            str(one["range"]),
            str(one.get("offset", "0 V")),
            str(one.get("shunt", "")),
        )
        for one in data["scope"]["channels"]
    ]
    return Choice(
        channels=channels, magnet={k: str(v) for k, v in data["magnet"].items()}
    )


def bench_text(choice: Choice) -> str:
    """The bench file; limits are the built-in ones and can be narrowed by hand."""
    data: dict[str, Any] = {"name": choice.name, "simulated": False}
    if choice.coil_port:
        data["coil"] = {
            "dialect": choice.coil_dialect,
            "port": choice.coil_port,
            "limits": _built_in()["coil"]["limits"],
        }
    if choice.scope:
        scope: dict[str, Any] = {"driver": choice.scope}
        for key, value in (
            ("serial", choice.scope_serial),
            ("library", choice.scope_library),
        ):
            if value:
                scope[key] = value
        scope["channels"] = [_channel(row) for row in choice.channels if row[1]]
        data["scope"] = scope
    if choice.meter_port:
        data["field_meter"] = {
            "dialect": choice.meter_dialect,
            "port": choice.meter_port,
        }
    data["magnet"] = {key: value for key, value in choice.magnet.items() if value}
    return to_toml(data)


def save_bench(choice: Choice, path: Path) -> BenchSpec:
    """Write the bench file and read it back.

    Raises:
        SceneError: what was chosen is no usable bench; nothing is left at `path`.
        OSError: `path` cannot be written.
    """
    trial = path.with_suffix(".new.toml")
    trial.write_text(bench_text(choice), encoding="utf-8")
    try:
        spec = load_bench(trial)
    except ValueError:
        trial.unlink()
        raise
    trial.replace(path)
    return spec


def _channel(row: tuple[str, str, str, str, str]) -> dict[str, str]:
    where, signal, full, offset, shunt = row
    made = {"signal": signal, "input": where, "range": full}
    if offset and offset != "0 V":
        made["offset"] = offset
    if shunt:
        made["shunt"] = shunt
    return made


def _built_in() -> dict[str, Any]:
    text = resources.files("tactile_lab.scene") / "simulated_bench.toml"
    return tomllib.loads(text.read_text(encoding="utf-8"))
