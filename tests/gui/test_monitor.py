"""The sensor watched between runs."""

from typing import Any

from PySide6.QtGui import QCloseEvent

from gui.state import CoilKnowledge, Lamp, WindowState
from sim_backend.picoscope import sdk
from sim_backend.picoscope.faults import ScopeFault
from tactile_lab.store.run import Run


def test_monitor_shows_the_distance_to_threshold_with_the_coil_off(lab) -> None:
    window, session = lab.window, lab.session
    window.centre.tools.monitor.click()
    lab.until(lambda: session.monitor.source is not None)  # words may be of one before
    lab.until(lambda: "silent" in window.centre.monitor_bar.words)
    assert "mV" in window.centre.monitor_bar.words
    keys = [row.lane.key for row in window.centre.stack.visible_rows()]
    assert keys == ["V_C1", "V_C2", "V_K", "spikes", "rate"]
    tools = window.centre.tools
    assert tools.freeze.isEnabled() and tools.follow.isEnabled()
    assert not tools.twin.isEnabled() and not tools.residual.isEnabled()
    assert session.state is WindowState.READY
    assert window.header.stop.truth is CoilKnowledge.OFF
    session.out.mkdir(exist_ok=True)
    before = set(session.out.glob("*/"))
    window.setup.run.click()
    lab.until(lambda: session.state is WindowState.RUNNING)
    lab.until(lambda: tools.twin.isEnabled() and tools.residual.isEnabled())
    assert not session.monitor.alive, "the scope is handed over before the run"
    lab.until(lambda: session.state in (WindowState.READY, WindowState.FAULT))
    lab.until(lambda: not (tools.follow.isEnabled() or tools.freeze.isEnabled()))
    new = set(session.out.glob("*/")) - before
    assert len(new) == 1, "watching keeps nothing"


def test_record_keeps_what_the_monitor_saw(lab) -> None:
    window, session = lab.window, lab.session
    session.show_monitor(True)
    lab.until(lambda: session.monitor.sensor.held > 0.3)
    window.centre.monitor_bar.record.click()
    kept = []
    session.monitor.recorded.connect(kept.append)
    lab.until(lambda: kept)
    assert session.monitor.alive, "watching goes on"
    run = Run.load(kept[0])
    assert run.status == "complete" and "V_C1" in run.signals
    run.close()
    session.show_monitor(False)
    lab.until(lambda: not session.monitor.alive)
    lab.until(lambda: not window.centre.monitor_bar.isVisible())
    lab.until(lambda: window.centre.progress.text.startswith("Monitor: only Record"))
    assert session.name == "Monitor", "what is in the lanes is not the last run"
    noise = window.review.noise
    window.review.show_tab(0)
    assert noise.isVisible(), "nor are results of it beside them"
    lab.app.processEvents()
    right = noise.mapTo(window, noise.signals.geometry().bottomRight()).x()
    tab = window.review.help
    assert right == tab.mapTo(window, tab.rect().bottomRight()).x()


def test_what_watches_lets_go_of_a_bench_that_is_exchanged(lab) -> None:
    session = lab.session
    session.show_monitor(True)
    lab.until(lambda: session.monitor.source is not None)
    session.connect_bench("sim")
    lab.until(lambda: not session.monitor.alive)
    lab.until(lambda: session.state is WindowState.READY)
    session.show_monitor(True)
    lab.until(lambda: session.monitor.source is not None)
    session.disconnect_bench()
    lab.until(lambda: not session.monitor.alive)
    assert session.state is WindowState.DISCONNECTED


def test_the_window_stays_until_what_is_recorded_is_kept(lab) -> None:
    """The engine ends with the window, and a record was cut short by it."""
    window, session = lab.window, lab.session
    session.show_monitor(True)
    lab.until(lambda: session.monitor.sensor.held > 0.3)
    window.centre.monitor_bar.record.click()
    session.show_monitor(False)
    lab.until(lambda: not session.monitor.alive)
    session.monitor.recording = True  # it may have been quick
    closing = QCloseEvent()
    window.closeEvent(closing)
    assert not closing.isAccepted()
    window._leaving = session.monitor.recording = False


def test_a_scope_that_is_unplugged_while_it_is_watched_is_a_fault(
    lab, monkeypatch
) -> None:
    """The window stayed ready, its scope green, and a queued run would have begun."""
    window, session = lab.window, lab.session
    pulled = (ScopeFault(kind="unplug", sample=50_000),)

    class Pulled(sdk.FakePs3000a):
        def __init__(
            self, wired: Any, clock: Any, make: Any, _: Any, generator: Any
        ) -> None:
            super().__init__(wired, clock, make, pulled, generator)

    with monkeypatch.context() as once:
        once.setattr(sdk, "FakePs3000a", Pulled)
        session.show_monitor(True)
        lab.until(lambda: session.monitor.source is not None)
        lab.until(lambda: not session.monitor.alive)
    assert session.state is WindowState.FAULT
    assert "does not answer" in session.status.fault.consequence
    lamps = {one.name: one.lamp for one in session.snapshot().instruments}
    assert lamps["Oscilloscope"] is not Lamp.GOOD
    assert window.header.stop.truth is CoilKnowledge.OFF, "nothing drove the coil"
    window.banner.acknowledge.click()
    lab.until(lambda: session.state is WindowState.READY)
