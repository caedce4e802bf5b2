"""The how-to page on adding a driver: its code runs as printed."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.usbtmc.scope import UsbtmcScope
from sim_backend.plant.scope_source import Voltages
from sim_backend.usbtmc.bus import SimulatedBus
from sim_backend.usbtmc.device import SimulatedDevice
from sim_backend.usbtmc.function import INTERFACE, UsbtmcFunction
from sim_backend.usbtmc.rigol_ds1000z import SimulatedDs1000z
from tactile_lab.bench import Channel
from tactile_lab.clock import SimulatedClock
from tactile_lab.instruments.dialects import scope_dialect

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "add-a-driver.md"


def blocks(language: str) -> list[str]:
    text = PAGE.read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, re.DOTALL | re.MULTILINE)


def example() -> dict[str, Any]:
    names: dict[str, Any] = {}
    for number, code in enumerate(blocks("python"), start=1):
        exec(compile(code, f"{PAGE.name}, block {number}", "exec"), names)
    return names


@pytest.mark.parametrize("name", [n for n in example() if n.startswith("test_")])
def test_the_example(name: str) -> None:
    example()[name]()


def test_the_example_has_tests() -> None:
    assert len([n for n in example() if n.startswith("test_")]) == 3


def test_the_row(tmp_path: Path) -> None:
    (row,) = blocks("toml")
    file = tmp_path / "acme-200.toml"
    file.write_text(row, encoding="utf-8")
    clock = SimulatedClock()
    far_end = SimulatedDs1000z(Voltages({"2": lambda t: np.full(t.shape, 0.48)}), clock)
    far_end.identity = "ACME,A204,1,1"
    device = SimulatedDevice(
        vendor=0x1AB1, product=0x04CE, function=UsbtmcFunction(far_end),
        interface=INTERFACE,
    )  # fmt: skip
    scope = UsbtmcScope(
        scope_dialect(str(file)), clock=clock, backend=SimulatedBus([device])
    )
    with clock.taking_part("scope"), scope:
        stream = scope.start([Channel(signal="V_K", input="2", range=4.0)], 1e-6)
        block = None
        while block is None:
            clock.sleep_until(clock.now() + 0.02)
            block = scope.poll()
    gain, offset = stream.volts_per_code(0)
    assert block.samples == 12_000
    assert np.max(np.abs(gain * block.codes + offset - 0.48)) < 1e-9


def test_files_the_page_names_exist() -> None:
    text = PAGE.read_text(encoding="utf-8")
    root = PAGE.parents[2]
    for path in re.findall(
        r"`((?:drivers|sim_backend|tests|tactile_lab)/[\w/.-]+)`", text
    ):
        assert (root / path).exists(), path
