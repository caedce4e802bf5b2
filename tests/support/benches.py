"""Bench files that tests of several rooms use."""

from importlib import resources
from pathlib import Path


def generator_bench(folder: Path, lines: str = "") -> Path:
    """The built-in bench with its scope's generator wired to the source.

    Args:
        folder: for the file.
        lines: of `[coil.generator]`.
    """
    built_in = resources.files("tactile_lab.scene").joinpath("simulated_bench.toml")
    file = folder / "generator.toml"
    text = built_in.read_text(encoding="utf-8")
    file.write_text(f"{text}\n[coil.generator]\n{lines}\n", encoding="utf-8")
    return file


SERVED = """
name = "served"
simulated = false
[coil]
dialect = "patient.toml"
port = "{port}"
[magnet]
r = "6 mm"
"""
"""A current source behind a port, its row in `patient.toml` beside it."""

READ_BY_HAND = """
name = "read by hand"
simulated = true
[coil]
baud = 19200
[field_meter]
driver = "manual"
[magnet]
r = "6 mm"
"""
"""A simulated bench whose teslameter a person reads."""

WITH_GAPS = """
name = "bench scope"
simulated = true
[coil]
baud = 19200
[scope]
driver = "usbtmc"
[[scope.channels]]
signal = "V_C1"
input = "1"
range = "4 V"
offset = "-2.5 V"
[[scope.channels]]
signal = "V_K"
input = "2"
range = "8 V"
[[scope.channels]]
signal = "coil_current"
input = "3"
range = "200 mV"
shunt = "0.1 Ohm"
[magnet]
r = "6 mm"
"""
"""A simulated bench whose oscilloscope polls: one record, then blind until the next."""

WITH_A_SOURCE_METER = """
name = "with a source meter"
simulated = true
[coil]
baud = 19200
[scope]
driver = "ps3000a"
[[scope.channels]]
signal = "V_C1"
input = "A"
range = "2 V"
offset = "-2.5 V"
auto_range = true
[[scope.channels]]
signal = "V_K"
input = "C"
range = "5 V"
[magnet]
r = "6 mm"
[voltage_source.V_GS.limits]
lowest = "1 V"
highest = "2 V"
[voltage_source.V_th.limits]
highest = "5 V"
"""
"""A simulated bench with source meters on V_GS and V_th."""
