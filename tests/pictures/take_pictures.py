"""Pictures of the window in each state: ``make screenshots``.

Drives the window on the simulated bench as a person would; offscreen unless a platform
is given. Runs take real time, so this needs about three minutes.
"""

from __future__ import annotations

import contextlib
import sys
import tempfile
from importlib import resources
from pathlib import Path

from PySide6.QtCore import Qt
from PySide6.QtTest import QTest
from stage import SIZE, Stage, instruments_attached

from gui.dialogs.connect import Connect
from gui.state import WindowState

READ_BY_A_PERSON = """
name = "read by a person"
simulated = true
[coil]
baud = 19200
[field_meter]
driver = "manual"
[scope]
driver = "ps3000a"
[[scope.channels]]
signal = "coil_current"
input = "D"
range = "200 mV"
shunt = "0.1 Ohm"
[magnet]
r = "6 mm"
"""


def main(folder: Path) -> None:
    """Make all pictures in `folder`."""
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    # the log names the runs folder: a relative one says nothing of this computer
    with tempfile.TemporaryDirectory() as home, contextlib.chdir(home):
        stage = Stage(folder, None)
        stage.until(lambda: stage.session.plan.expectation is not None)
        stage.shoot("window_first_start")
        stage.session.connect_bench("sim")
        stage.planned()
        stage.shoot("window_ready")
        for scene in (
            _film,
            _run,
            _after,
            _manual,
            _dialogs,
            _wiring,
            _compare,
            _monitor,
            _unplugged,
        ):
            scene(stage)
        stage.close()
        _calibration(folder)
        _read_by_a_person(folder)


def _film(stage: Stage) -> None:
    """A run from the click on Run to its results."""
    stage.window.setup.start()
    stage.film("run", stage.window.review.results.report.isVisible)
    stage.ended()


def _run(stage: Stage) -> None:
    window, session = stage.window, stage.session
    window.setup.start()
    stage.until(lambda: session.source is not None and session.source.reach > 11.2)
    window.setup.enqueue()
    stage.shoot("window_running_light")
    window.close()
    stage.shoot("window_close_light")
    window.closing.keep.click()
    session.queue.remove(session.queue.items[0])
    stage.theme.choose("dark")
    stage.until(lambda: session.source is not None and session.source.reach > 15.4)
    stage.shoot("window_running_dark", "dark")
    stage.theme.choose("light")
    stage.ended()


def _after(stage: Stage) -> None:
    window = stage.window
    window.page.setFocus()
    window.resize(1180, 720)
    stage.live(0.2)
    stage.shoot("window_small_dark", "dark")
    window.resize(*SIZE)
    stage.theme.choose("light")
    window.centre.view.show_all()
    window.centre.tools.widths.choose(3)
    window.centre.tools.toggle_cursors(True)
    stage.until(window.review.results.report.isVisible)
    stage.shoot("window_complete")
    window.review.show_tab(1)
    window.screen_.list_runs()
    stage.until(lambda: window.review.runs.cards)
    _old_run(stage, window.review.runs.cards[0].entry.folder)


def _old_run(stage: Stage, folder: Path) -> None:
    """A run from disk where its strongest step begins to fire."""
    window, before = stage.window, stage.window.screen_.run
    window.screen_.open_run(folder)
    stage.until(lambda: window.screen_.run not in (None, before))
    run = window.screen_.run
    assert run is not None
    stage.until(lambda: run.has_model)
    step = [one for one in run.holds if not one.pause][-1]
    first = float(run.spikes[run.spikes > step.start][0])
    window.centre.view.show_span(first - 0.15, 0.8)
    stage.live(0.6)
    stage.shoot("window_old_run")
    window.screen_.close_run()


def _manual(stage: Stage) -> None:
    """The coil at 250 mA, typed and set as a person does."""
    window, session = stage.window, stage.session
    panel = window.review.manual
    window.review.show_tab(2)
    panel.begin.click()
    stage.until(lambda: session.manual.alive and session.manual.coil is not None)
    panel.current.selectAll()
    QTest.keyClicks(panel.current, "250 mA")
    panel.set.click()
    stage.until(lambda: panel.now.text() == "250 mA")
    panel.read.click()
    stage.until(lambda: not session.bench.reading)
    stage.live(0.5)
    stage.shoot("window_manual")
    window.header.stop.click()
    stage.until(lambda: not session.manual.alive)


def _dialogs(stage: Stage) -> None:
    window = stage.window
    window.actions_.show_help()
    stage.shoot("window_help")
    stage.close_overlays()
    with instruments_attached():
        page = _connect(stage).instruments
        page.scan.click()
        stage.until(page.scan.isEnabled)
        page.test_coil.click()
        page.test_meter.click()
        stage.until(
            lambda: all(x.text().startswith("✓") for x in page.answers.values())
        )
        stage.shoot("window_connect")
    stage.close_overlays()


def _connect(stage: Stage) -> Connect:
    stage.window.actions_.connect_dialog()
    dialog = stage.window.findChild(Connect)
    assert isinstance(dialog, Connect)
    return dialog


def _wiring(stage: Stage) -> None:
    """The wiring check from its page, with its verdicts."""
    dialog = _connect(stage)
    dialog.show_page(1)
    dialog.wiring.check.click()
    stage.until(lambda: stage.session.state is WindowState.RUNNING)
    stage.ended()
    stage.until(lambda: dialog.wiring.verdicts)
    stage.shoot("window_wiring")
    stage.close_overlays()
    stage.window.screen_.open_scene(None)


def _compare(stage: Stage) -> None:
    """Two shorter runs beside the first."""
    window = stage.window
    for levels in ("80, 120, 160, 180 mN", "90, 130, 170, 200 mN"):
        window.screen_.close_run()
        window.setup.form.field("levels").put(levels)
        stage.run()
    window.setup.form.reset()
    window.screen_.list_runs()
    stage.live(0.6)
    window.review.show_tab(1)
    cards = window.review.runs.cards
    pulses = [c for c in cards if c.entry.title == "Pulses"]
    for card in [c for c in pulses if c.entry.status == "complete"][:3]:
        card.tick.setChecked(True)
    window.review.runs.compare.click()
    stage.until(window.centre.compare_bar.isVisible)
    window.centre.view.show_span(8.0, 5.0)
    window.centre.compare_bar.align.group.button(1).click()
    stage.live(0.5)
    stage.shoot("window_compare")
    window.screen_.close_run()


def _monitor(stage: Stage) -> None:
    window, session = stage.window, stage.session
    window.review.show_tab(1)
    session.show_monitor(True)
    stage.until(lambda: (seen := session.monitor.source) and seen.reach > 6.0)
    stage.shoot("window_monitor")
    session.show_monitor(False)
    stage.until(lambda: not session.monitor.alive)


def _unplugged(stage: Stage) -> None:
    """Pull the coil's plug in a run: the fault, and a coil nobody knows about."""
    demo = (resources.files("protocols") / "scenes" / "demo.toml").read_text()
    Path("demo.toml").write_text(f'{demo}\n[simulated]\ncoil_unplugged = "7 s"\n')
    stage.window.review.show_tab(0)
    stage.window.screen_.open_scene("demo.toml")
    stage.planned()
    stage.window.setup.start()
    stage.until(lambda: stage.session.state is WindowState.FAULT)
    stage.live(0.3)
    results, screen = stage.window.review.results, stage.window.screen_
    stage.until(lambda: screen.run is not None and screen.run.has_model)
    stage.until(lambda: results.mark.text().endswith("2 steps"))
    stage.live(0.5)
    stage.until(lambda: not results.cards.old)
    stage.shoot("window_fault_dark", "dark")
    stage.shoot("window_fault_light")


def _calibration(folder: Path) -> None:
    """The field calibration from its page; as fast as it computes."""
    stage = Stage(folder, "sim", realtime=False)
    stage.until(lambda: stage.session.state is WindowState.READY)
    stage.planned()
    dialog = _connect(stage)
    dialog.show_page(2)
    dialog.calibration.field.click()
    stage.until(lambda: stage.session.state is WindowState.RUNNING)
    stage.ended()
    stage.until(dialog.calibration.use.isVisible)
    stage.live(0.3)
    stage.shoot("window_calibration")
    stage.close()


def _read_by_a_person(folder: Path) -> None:
    """The run asks for the field; as fast as it computes, for it takes a minute."""
    Path("bench.toml").write_text(READ_BY_A_PERSON)
    stage = Stage(folder, "bench.toml", "calibrate_field", realtime=False)
    session, card = stage.session, stage.window.question
    stage.until(lambda: session.state is WindowState.READY)
    stage.planned()
    stage.window.setup.start()
    for field in ("10.83", "9.75", "8.66"):
        stage.until(lambda: card.isVisible() and card.heeds_keys)
        QTest.keyClicks(card.entry, field)
        if field != "8.66":
            QTest.keyClick(card.entry, Qt.Key.Key_Return)
            stage.until(lambda: session.run.asked is not None)
    stage.shoot("window_field")
    card.stop.click()
    stage.until(lambda: not session.busy)
    stage.close()


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path("docs/pictures"))
