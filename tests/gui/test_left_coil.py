"""A coil that was left unknown stays told while another bench is connected."""

from collections.abc import Callable
from pathlib import Path

import pytest
from served_source import Source

from gui.session.coil import CoilWatch
from gui.state import CoilKnowledge, Lamp, WindowState
from sim_backend.serial_line import wires as serial_wires
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.bench import CoilLimits, OffReport

OFF = OffReport(True, 0.0, "Off, 0 mA read back.")

OTHER = """
name = "other"
simulated = true
[coil]
baud = 19200
port = "sim://coil-2"
[magnet]
r = "6 mm"
"""


def leave_unknown(lab, bench: Path, lose: Callable[[], object]) -> None:
    """Drive a coil by hand, lose its source, and take the built-in simulated bench."""
    session = lab.session
    session.connect_bench(str(bench))
    lab.until(lambda: session.state is WindowState.READY)
    session.begin_manual()
    lab.until(lambda: session.manual.opened)
    session.manual.hold(0.1)
    lab.until(lambda: (coil := session.coil_view()) is not None and coil.output)
    lose()
    bench.write_text("broken")  # nor can it be asked again
    lab.until(lambda: session.state is WindowState.FAULT and not session.busy)
    while session.state is WindowState.FAULT:
        session.acknowledge()
        lab.until(lambda: session.state is not WindowState.CONNECTING)
    assert lab.window.header.stop.truth is CoilKnowledge.UNKNOWN
    lab.window.centre.empty.simulated_asked.emit()
    lab.until(lambda: session.state is WindowState.READY)


def test_a_coil_left_unknown_is_told_beside_another_bench(lab, source: Source) -> None:
    leave_unknown(lab, source.bench, source.served.close)
    window, session, port = lab.window, lab.session, source.served.addresses["coil"]
    stop, banner = window.header.stop, window.banner
    assert stop.truth is CoilKnowledge.UNKNOWN
    assert stop.words.title == "COIL STATE UNKNOWN"
    assert "at the source" in stop.words.detail
    assert banner.isVisible() and port in banner.accessibleName()
    assert "Switch it off at the source" in banner.accessibleName()
    chip = window.header.chips[0]
    assert chip.lamp is Lamp.BAD and port in chip.toolTip()

    lab.run()
    assert stop.truth is CoilKnowledge.LIVE, "in a run STOP tells what it would stop"
    assert banner.isVisible() and window.header.chips[0].lamp is Lamp.BAD
    session.stop()
    lab.until(lambda: not session.busy)
    assert stop.truth is CoilKnowledge.UNKNOWN, "no run has asked that source"

    banner.is_off.click()
    assert stop.truth is CoilKnowledge.OFF and not banner.isVisible()
    assert session.state is WindowState.READY, "nothing of this bench is asked for it"
    assert port in [line.text for line in session.log.lines if line.safety][-1]


def test_a_coil_that_is_only_simulated_drives_nothing_and_is_not_told(lab) -> None:
    def unplug() -> None:
        ends = serial_wires._far_ends
        far = [far for name, far in ends.items() if "coil" in name][-1]
        far.faults.add(SerialFault(kind="unplug", times=None))

    bench = lab.folder / "other.toml"
    bench.write_text(OTHER)
    leave_unknown(lab, bench, unplug)
    stop, chips = lab.window.header.stop, lab.window.header.chips
    assert stop.truth is CoilKnowledge.OFF and not lab.window.banner.isVisible()
    assert all("unknown" not in chip.toolTip() for chip in chips)


def test_a_coil_is_known_again_once_it_has_answered() -> None:
    coil = CoilWatch()
    coil.use(CoilLimits(), "COM3")
    coil.left(OffReport(False, None, "No answer."))
    coil.use(CoilLimits(), "COM4")
    coil.left(OFF)
    assert coil.left_unknown == ("COM3",)
    coil.use(CoilLimits(), "COM3")
    assert coil.left_unknown == () and coil.doubtful, "it is this one that is asked"
    coil.use(None, "")
    assert coil.left_unknown == ("COM3",), "it has not answered"
    coil.use(CoilLimits(), "COM3")
    coil.left(OFF)
    coil.use(None, "")
    assert coil.left_unknown == ()


@pytest.mark.parametrize("left", [("COM3",), ("COM3", "COM4")])
def test_the_banner_tells_a_fault_first(lab, left: tuple[str, ...]) -> None:
    """Acknowledging a fault says nothing of a coil that it does not name."""
    session, banner = lab.session, lab.window.banner
    session.status.coil.left_unknown = left
    session.status.set_fault("Something else.", "It went wrong.")
    assert "Something else" in banner.accessibleName()
    banner.acknowledge.click()
    lab.until(lambda: session.state is WindowState.READY)
    assert " and ".join(left) in banner.accessibleName()
    banner.is_off.click()
    assert session.status.coil.left_unknown == ()
