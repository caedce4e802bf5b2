"""The connect dialog: discovery through the real look-up, a bench file that loads."""

import tomllib
from pathlib import Path

import pytest

from gui.dialogs.bench_text import bench_text, save_bench, start_choice
from gui.dialogs.connect import Connect
from gui.dialogs.instruments import rows_of
from gui.state import State
from tactile_lab.errors import SceneError


def test_bench_file_reads_back_as_chosen(tmp_path: Path) -> None:
    choice = start_choice()
    choice.name, choice.coil_port = "lab 3", "/dev/ttyUSB0"
    choice.meter_port = "/dev/ttyUSB1"
    spec = save_bench(choice, tmp_path / "bench.toml")
    assert not spec.simulated and spec.name == "lab 3"
    assert spec.coil is not None and spec.coil.port == "/dev/ttyUSB0"
    assert spec.field_meter is not None and spec.field_meter.port == "/dev/ttyUSB1"
    assert [c.signal for c in spec.scope.channels] == [
        "V_C1",
        "V_C2",
        "V_K",
        "coil_current",
    ]
    assert spec.scope.channels[3].scale == 10.0


def test_unused_instruments_are_left_out() -> None:
    choice = start_choice()
    choice.scope = ""
    data = tomllib.loads(bench_text(choice))
    assert not {"coil", "field_meter", "scope"} & set(data)


def test_wrong_range_is_refused_and_leaves_no_file(tmp_path: Path) -> None:
    choice = start_choice()
    choice.coil_port = "/dev/ttyUSB0"
    where, signal, _, offset, shunt = choice.channels[0]
    choice.channels[0] = (where, signal, "2 mN", offset, shunt)
    with pytest.raises(SceneError, match="mN"):
        save_bench(choice, tmp_path / "bench.toml")
    assert list(tmp_path.iterdir()) == []


def test_rows_are_offered_by_role() -> None:
    assert "kepco-bop" in rows_of("coil") and "lakeshore-425" in rows_of("meter")
    assert not set(rows_of("coil")) & set(rows_of("meter"))


def test_look_does_not_block_and_tells_what_it_found(lab) -> None:
    window = lab.window
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    assert isinstance(dialog, Connect) and dialog.isVisible()
    dialog.instruments.scan.click()
    assert not dialog.instruments.scan.isEnabled()
    lab.until(lambda: dialog.instruments.scan.isEnabled())
    assert dialog.instruments.listing.text() != "Looking …"
    dialog.wiring.check.click()
    assert not dialog.isVisible()
    assert window.setup.kind_name == "wiring_check"


def test_absent_source_is_a_fault_and_then_no_bench(lab) -> None:
    window, session = lab.window, lab.session
    window.actions_.connect_dialog()
    dialog = window.findChild(Connect)
    assert isinstance(dialog, Connect)
    dialog.instruments.coil_port.setCurrentText("/dev/not-there")
    assert dialog.save_to(lab.folder / "absent.toml")
    lab.until(lambda: session.state is State.FAULT)
    assert "not-there" in session.fault.consequence
    window.banner.acknowledge.click()
    assert session.state is State.DISCONNECTED
    assert window.centre.empty.isVisible()
