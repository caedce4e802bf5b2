"""The window on the simulated bench, driven as a person would."""

import gc
import sys
import threading
from itertools import product

import numpy as np
import pytest
from PySide6.QtCore import QMimeData, QPoint, QPointF, QSize, Qt, QUrl
from PySide6.QtGui import QDropEvent, QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QAbstractButton,
    QComboBox,
    QLineEdit,
    QPushButton,
    QToolButton,
)

from gui.dialogs.help import Help
from gui.dialogs.saving import table
from gui.lanes.source import PlanSource
from gui.session.queue import Queued
from gui.state import CoilKnowledge, WindowState
from sim_backend.serial_line import wires as serial_wires
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.store.run import Run


def newest_coil() -> serial_wires.FarEnd:
    """Far end of the coil wire plugged in last."""
    return [far for name, far in serial_wires._far_ends.items() if "coil" in name][-1]


def red_share(button: QAbstractButton) -> float:
    image = button.grab().toImage()
    red = 0
    for x in range(0, image.width(), 4):
        for y in range(0, image.height(), 4):
            colour = image.pixelColor(x, y)
            red += colour.red() > 150 and colour.green() < 90 and colour.blue() < 110
    return red / ((image.width() // 4) * (image.height() // 4))


def test_ready_offers_run_and_shows_the_plan(lab) -> None:
    window = lab.window
    window.screen_.leave_run()
    lab.session.source = None  # a run that another test left on screen
    window.setup.plan_now()
    lab.until(lambda: isinstance(window.centre.stack.source, PlanSource))
    assert window.setup.run.isEnabled()
    assert window.header.stop.truth is CoilKnowledge.OFF
    assert window.header.badge.isVisible()
    keys = [row.lane.key for row in window.centre.stack.visible_rows()]
    assert keys == ["force", "V_C1", "residual", "V_C2", "V_K", "spikes", "rate"]
    assert window.centre.stack.source.twin_spikes.size > 0


def test_a_run_in_progress_shows_the_coil_live(lab) -> None:
    window = lab.window
    lab.run()
    assert not window.setup.run.isEnabled()
    lab.until(lambda: window.header.stop.truth is CoilKnowledge.LIVE)
    assert red_share(window.header.stop) > 0.5


def test_run_moves_lanes_and_gives_results(lab) -> None:
    window, session = lab.window, lab.session
    lab.complete_run()
    source = session.source
    assert source is not None and source.reach > 1.0
    assert not source.trace("V_C1", 0.0, 2.0, 500).empty
    assert [f.label for f in window.screen_.results.steps] == ["80 mN", "120 mN"]
    assert window.review.results.mark.text().startswith("final")
    lab.until(lambda: window.header.stop.truth is CoilKnowledge.OFF)


@pytest.mark.parametrize("how", ["click", "Esc", "F12"])
def test_stop_ends_the_run_with_the_coil_off(lab, how: str) -> None:
    window, session = lab.window, lab.session
    lab.run()
    assert window.header.stop.isEnabled()
    if how == "click":
        QTest.mouseClick(window.header.stop, Qt.MouseButton.LeftButton)
    else:
        window.activateWindow()
        lab.until(window.isActiveWindow)
        key = {"Esc": Qt.Key.Key_Escape, "F12": Qt.Key.Key_F12}[how]
        QTest.keyClick(window, key)
    assert session.state is WindowState.ABORTING
    lab.until(lambda: session.state is WindowState.READY)
    coil = session.coil_view()
    assert coil is not None and coil.output is False and coil.verified_off
    assert window.screen_.ending.startswith("Aborted")


def test_stop_is_enabled_in_every_state(lab) -> None:
    for state in WindowState:
        lab.session.status.state = state
        lab.window.render_state()
        assert lab.window.header.stop.isEnabled()
        assert lab.window.header.stop.isVisible()
    lab.session.status.state = WindowState.READY
    lab.window.render_state()


def test_closing_while_running_asks_and_keeps_running_by_default(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    assert not window.close()
    assert window.closing.isVisible() and window.closing.keep.isDefault()
    QTest.keyClick(window, Qt.Key.Key_Escape)
    assert not window.closing.isVisible()
    assert session.state is WindowState.RUNNING, "Esc in the question is not STOP"
    assert window.isVisible()


def test_unplugged_coil_becomes_a_fault_that_says_what_to_do(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    newest_coil().faults.add(SerialFault(kind="unplug", times=None))
    lab.until(lambda: session.state is WindowState.FAULT)
    assert window.banner.isVisible()
    assert window.header.stop.truth is CoilKnowledge.UNKNOWN
    assert window.header.stop.words.title == "COIL STATE UNKNOWN"
    assert not window.setup.run.isEnabled()
    window.banner.acknowledge.click()
    assert session.state is not WindowState.FAULT
    assert window.header.stop.truth is CoilKnowledge.UNKNOWN, (
        "reading a fault verifies nothing"
    )
    assert not window.setup.run.isEnabled(), "and nothing runs beside it"
    lab.until(lambda: session.state is WindowState.READY)
    assert window.header.stop.truth is CoilKnowledge.OFF, "the instruments were asked"


def test_reconnecting_makes_the_coil_known_again(lab) -> None:
    session = lab.session
    session.connect_bench("sim")
    assert session.state is WindowState.CONNECTING
    lab.until(lambda: session.state is WindowState.READY)
    assert lab.window.header.stop.truth is CoilKnowledge.OFF


def test_queue_can_be_edited_while_running(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    for name in ("one", "two", "three"):
        session.queue.add(Queued(name, window.setup.request()))
    session.queue.move(session.queue.items[2], -1)
    session.queue.remove(session.queue.items[0])
    assert [item.title for item in session.queue.items] == ["three", "two"]
    assert window.setup.queue.isVisible()
    session.queue.remove(session.queue.items[1])
    first = session.run.folder
    assert session.state is WindowState.RUNNING, "a queued run waits"
    session.stop("the next one shall not follow")
    lab.until(lambda: session.state is WindowState.READY)
    assert [item.title for item in session.queue.items] == [
        "three"
    ] and not session.busy
    session.queue.add(Queued("four", window.setup.request()))
    assert session.state is WindowState.READY, "nothing starts by being queued"
    session.queue.resume()
    lab.until(lambda: session.queue.items == [] and session.state is WindowState.READY)
    assert session.run.folder != first


def test_invalid_value_forbids_run_and_says_why(lab) -> None:
    window = lab.window
    window.setup.form.field("hold").put("−1 s")
    window.setup.form.changed.emit()
    assert not window.setup.run.isEnabled()
    assert "Hold" in window.setup.run.toolTip()


def test_force_beyond_the_coil_forbids_run_with_the_plans_words(lab) -> None:
    window, session = lab.window, lab.session
    window.setup.form.field("levels").put("900 mN")
    window.setup.plan_now()
    lab.until(lambda: session.plan.problem)
    assert "reachable" in session.plan.problem
    assert not window.setup.run.isEnabled()
    window.setup.form.reset()


def test_manual_control_shows_live_and_stop_ends_it(lab) -> None:
    window, session = lab.window, lab.session
    session.begin_manual()
    lab.until(lambda: session.manual.coil is not None)
    window.review.manual.current.setText("5 A")
    window.review.manual.set.click()
    assert session.coil_view().output is not True, "beyond the limit nothing is sent"
    window.review.manual.current.setText("100 mA")
    window.review.manual.set.click()
    lab.until(lambda: abs((session.coil_view().current or 0) - 0.1) < 2e-3)
    lab.until(lambda: window.header.stop.truth is CoilKnowledge.LIVE)
    assert not window.setup.run.isEnabled()
    session.run.expected = 10.0  # of the run before
    assert not window.close(), "the coil is live: closing asks"
    assert "100 mA" in window.closing.now.text()
    assert "remaining" not in window.closing.now.text(), "that was the run's"
    window.closing.keep.click()
    window.header.stop.click()
    lab.until(lambda: not session.manual.alive)
    assert session.coil_view().verified_off


def test_old_run_opens_in_the_same_lanes(lab) -> None:
    window, session = lab.window, lab.session
    folder = lab.complete_run()
    live_spikes = session.source.spikes.copy()
    lab.until(lambda: window.screen_.run is not None)  # its record, by itself
    record = window.screen_.run
    window.screen_.open_run(folder)
    lab.until(lambda: window.screen_.run not in (None, record))
    run = window.screen_.run
    assert np.allclose(run.spikes, live_spikes, atol=1e-3)
    lab.until(lambda: run.model is not None)
    window.centre.view.show_span(0.2, 0.001)
    lab.until(lambda: run.twin("V_C2", 0.2, 0.201, 1000).time.size > 500)
    run.trace("V_C2", 0.2, 0.201, 1000)
    lab.until(lambda: run.trace("V_C2", 0.2, 0.201, 1000).time.size > 150)
    moved = run.trace("V_C2", 0.2004, 0.2014, 1000)
    closer = run.trace("V_C2", 0.2003, 0.2007, 1000)
    assert moved.time.size > 150 and closer.time.size > 60, "read around what is seen"


def test_a_run_that_has_ended_is_looked_at_from_its_record(lab) -> None:
    window, screen = lab.window, lab.window.screen_
    folder = lab.complete_run()
    lab.until(lambda: screen.run is not None)
    assert screen.run.path == folder
    assert window.session.name == folder.name
    assert window.centre.stack.source is screen.run
    assert screen.run.model is not None, "the model does not blink"
    live = window.session.source
    window.centre.view.show_span(0.2, 0.001)
    lab.until(lambda: screen.run.trace("V_C2", 0.2, 0.201, 1000).time.size > 150)
    assert live.trace("V_C2", 0.2, 0.201, 1000).time.size < 10, "seen live: bins"


def test_card_of_a_stored_run_has_what_is_at_the_right_edge(lab) -> None:
    window = lab.window
    folder = lab.runs(1)[0]
    window.screen_.open_run(folder)
    lab.until(lambda: window.session.opened == f"Looking at {folder.name}")
    run, stack, view = window.screen_.run, window.centre.stack, window.centre.view
    begin, _ = run.holds[-1].held
    run.spikes = np.array([begin - 0.5, begin + 0.05, begin + 0.15, begin + 0.29])
    view.show_span(begin, 0.25)

    def says(key: str) -> str:
        return stack.row(key).card.text

    lab.until(lambda: says("spikes") == "2" and says("force") == "120.0")
    lab.until(lambda: says("rate") == "10.00")
    assert stack.row("spikes").card.more in ("", "of 4 · last ISI 100.0 ms")
    shown = run.trace("V_C1", begin, begin + 0.25, 500)
    assert abs(float(says("V_C1")) - shown.at(begin + 0.25)) < 0.02
    view.show_span(0.0, run.holds[0].start)
    lab.until(lambda: says("spikes") == "0" and says("rate") == "0.00")
    view.show_all()
    lab.until(lambda: says("spikes") == "4" and says("force") == "0.0")


def test_a_run_stopped_before_its_first_sample_is_no_new_problem(lab) -> None:
    window, session = lab.window, lab.session
    window.setup.start()
    session.stop("at once")
    lab.until(lambda: not session.busy and session.state is not WindowState.ABORTING)
    lab.until(lambda: not any(t.name == "open run" for t in threading.enumerate()))
    lab.app.processEvents()
    assert not window.centre.notice.isVisible(), window.centre.notice.text()
    session.acknowledge()


def test_dropped_scene_is_loaded_and_dropped_run_is_opened(lab) -> None:
    window = lab.window
    file = lab.folder / "dropped.toml"
    file.write_text('[protocol]\nname = "pulses"\nlevels = ["70 mN"]\n')
    data = QMimeData()
    data.setUrls([QUrl.fromLocalFile(str(file))])
    event = QDropEvent(
        QPointF(50, 200), Qt.DropAction.CopyAction, data,
        Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier,
    )  # fmt: skip
    window.dropEvent(event)
    assert window.setup.form.field("levels").text == "70 mN"
    bad = lab.folder / "bad.toml"
    bad.write_text('[protocol]\nname = "pulses"\nlevel = ["70 mN"]\n')
    window.screen_.open_path(bad)
    assert window.centre.notice.isVisible()
    assert "levels" in window.centre.notice.text()
    assert window.setup.form.field("levels").text == "70 mN"


def test_letters_are_shortcuts_only_outside_text_fields(lab) -> None:
    window = lab.window
    before = window.centre.tools.twin.isChecked()
    window.centre.log.note.setFocus()
    QTest.keyClicks(window.centre.log.note, "mmm")
    assert window.centre.tools.twin.isChecked() is before
    assert window.centre.log.note.text() == "mmm"
    window.centre.log.note.clear()
    window.centralWidget().setFocus()
    QTest.keyClick(window, Qt.Key.Key_M)
    assert window.centre.tools.twin.isChecked() is not before
    QTest.keyClick(window, Qt.Key.Key_M)


def test_cursors_are_readable_as_text(lab) -> None:
    window = lab.window
    window.centre.tools.toggle_cursors(True)
    window.centre.view.place_cursors(0.2, 0.7)
    assert "500 ms" in window.centre.tools.readout.text()
    window.centre.tools.toggle_cursors(False)
    assert window.centre.tools.readout.text() == ""


def test_width_buttons_mark_what_is_seen(lab) -> None:
    view, tools = lab.window.centre.view, lab.window.centre.tools
    view.set_now(20.0, 20.0)
    tools.widths.group.button(0).click()
    assert view.width == 1.0 and tools.widths.chosen == 0
    view.zoom(1.5)
    assert tools.widths.chosen == -1
    tools.fit.click()
    assert tools.widths.chosen == 3


def test_view_is_exported(lab) -> None:
    from gui.dialogs.saving import write_scene, write_view

    window, folder = lab.window, lab.folder
    for name in ("view.png", "view.svg", "view.csv"):
        write_view(window.panels, None, folder / name)
        assert (folder / name).stat().st_size > 100
    header = (folder / "view.csv").read_text().splitlines()[1]
    assert "V_C1_time_s" in header and "force_mean_N" in header
    write_scene(window.panels, folder / "saved.toml")
    assert 'name = "pulses"' in (folder / "saved.toml").read_text()


def test_every_control_has_an_accessible_name(lab) -> None:
    for kind in (QPushButton, QToolButton, QLineEdit):
        for widget in lab.window.findChildren(kind):
            if widget.isVisibleTo(lab.window) and widget.objectName() != "qt_edit":
                named = widget.accessibleName() or widget.text() or widget.toolTip()
                assert named, widget


def too_small(window) -> list[str]:
    """What does not fit."""
    hint = window.page.minimumSizeHint()
    found = [f"{window.width()} x {window.height()} shows {hint}"]
    if hint.width() <= window.width() and hint.height() <= window.height():
        found = []
    for button in window.findChildren(QPushButton):
        if button.isVisible() and button.width() < button.sizeHint().width() - 1:
            found.append(f"{button.text()}: {button.width()}")
    return found


def test_fits_the_smallest_screen_and_elides_no_button(lab) -> None:
    window = lab.window
    window.resize(1180, 720)
    assert window.size() == QSize(1180, 720)
    try:
        lab.until(lambda: not too_small(window), 30.0)
    finally:
        assert not too_small(window)
        assert window.header.stop.width() == 228
        window.resize(1720, 1080)


def test_themes_repaint_everything(lab) -> None:
    theme = lab.window.theme

    def dark() -> bool:
        image = lab.window.centre.stack.scene.grab().toImage()
        return image.pixelColor(image.width() - 3, 3).lightness() < 80

    theme.choose("dark")
    lab.until(dark)
    theme.choose("light")
    lab.until(lambda: not dark())


def test_frames_lose_no_references(lab) -> None:
    def frames(count: int) -> int:
        for _ in range(count):
            lab.window.frames.tick()
            lab.window.centre.stack.refresh()
            lab.app.processEvents()
        gc.collect()  # what former tests left behind is no loss of these frames
        return sys.getrefcount(None)

    before, after = frames(20), frames(80)
    assert after > before - 500


def test_two_runs_are_compared_in_the_same_lanes(lab) -> None:
    window, session = lab.window, lab.session
    lab.runs(1)
    lab.complete_run()
    window.screen_.list_runs()
    lab.until(lambda: len(window.review.runs.cards) >= 2)
    complete = [c for c in window.review.runs.cards if c.entry.status == "complete"]
    for card in complete[:2]:
        card.tick.setChecked(True)
    assert window.review.runs.compare.isEnabled()
    window.review.runs.compare.click()
    lab.until(lambda: window.centre.compare_bar.isVisible())
    comparison = window.screen_.run
    keys = [row.lane.key for row in window.centre.stack.visible_rows()]
    assert "residual" not in keys, "the model is not compared"
    window.centre.compare_bar.align.group.button(1).click()
    starts = [m.source.holds[0].start + m.shift for m in comparison.members]
    assert abs(starts[0] - starts[1]) < 1e-9
    stack = window.centre.stack
    lab.until(lambda: stack.row("V_C1").card.text.count("\n") == 2)
    assert stack.row("spikes").card.text.startswith("Spikes in view")
    window.centre.tools.toggle_cursors(True)
    lab.until(lambda: "Δ" in stack.row("V_C1").card.text)
    at_cursor = window.centre.compare_bar.align.group.button(2)
    window.centre.view.place_cursors(starts[0] + 0.02, 1.0)
    at_cursor.click()
    assert window.centre.view.cursors[0] == comparison.members[0].source.holds[0].start
    window.centre.tools.toggle_cursors(False)
    assert not at_cursor.isEnabled(), "there is no cursor to align at"
    window.centre.compare_bar.layout_.group.button(2).click()
    lab.until(lambda: "less ●" in stack.row("V_C1").card.text)
    view = window.centre.view
    view.show_span(0.0, 1.0)
    said = table(stack, "Comparing 2 runs").splitlines()[1]
    assert "run2_less_run1_force_mean_N" in said and ",run1_force" not in said
    window.centre.compare_bar.layout_.group.button(0).click()
    lines = table(stack, "Comparing 2 runs").splitlines()
    assert lines[0].count("run1 ") == lines[0].count("run2 ") == 1
    header = lines[1].split(",")
    for run, member in zip(("run1", "run2"), comparison.members, strict=True):
        time = float(lines[2].split(",")[header.index(f"{run}_force_time_s")])
        known = member.source.trace("force", 0.0, 1.0, 100)
        assert abs(time - known.time[0] - member.shift) < 1e-6
    window.screen_.close_run()
    assert not window.centre.compare_bar.isVisible()
    assert stack.source is session.source, "back to the last run"
    lab.until(lambda: stack.source is window.screen_.run, 30.0)
    assert window.screen_.run.path == session.run.folder, "and then to its record"
    lab.until(lambda: "●" not in stack.row("V_C1").card.text)


def test_monitor_shows_the_distance_to_threshold_with_the_coil_off(lab) -> None:
    window, session = lab.window, lab.session
    window.centre.tools.monitor.click()
    lab.until(lambda: "silent" in window.centre.monitor_bar.words)
    assert "mV" in window.centre.monitor_bar.words
    keys = [row.lane.key for row in window.centre.stack.visible_rows()]
    assert keys == ["V_C1", "V_C2", "V_K", "spikes", "rate"]
    assert session.state is WindowState.READY
    assert window.header.stop.truth is CoilKnowledge.OFF
    session.out.mkdir(exist_ok=True)
    before = set(session.out.iterdir())
    window.setup.run.click()
    lab.until(lambda: session.state is WindowState.RUNNING)
    assert not session.monitor.alive, "the scope is handed over before the run"
    lab.until(lambda: session.state in (WindowState.READY, WindowState.FAULT))
    new = set(session.out.iterdir()) - before
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


def test_freeze_holds_the_lanes_while_acquisition_goes_on(lab) -> None:
    window, session = lab.window, lab.session
    lab.run()
    view = window.centre.view
    lab.until(lambda: view.now > 0)
    window.page.setFocus()
    QTest.keyClick(window, Qt.Key.Key_Space)
    seen = view.now
    lab.until(lambda: session.source.reach > seen + 1.0)
    assert view.now == seen
    window.centre.tools.freeze.click()
    lab.until(lambda: view.now > seen + 1.0)


def test_another_run_is_not_frozen(lab) -> None:
    window = lab.window
    window.centre.tools.freeze.setChecked(True)
    lab.run()
    lab.until(lambda: window.centre.view.now > 0)
    assert not window.centre.tools.freeze.isChecked()


def test_the_wheel_changes_no_choice(lab) -> None:
    window = lab.window
    window.actions_.connect_dialog()
    choices = [box for box in window.findChildren(QComboBox) if box.count() > 1]
    assert len(choices) >= 4
    before = [box.currentText() for box in choices]
    for box, way in product(choices, (-120, 120)):
        turned = QWheelEvent(
            QPointF(5, 5), QPointF(box.mapToGlobal(QPoint(5, 5))), QPoint(),
            QPoint(0, way), Qt.MouseButton.NoButton,
            Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
        )  # fmt: skip
        lab.app.sendEvent(box, turned)
        assert not turned.isAccepted(), "the page scrolls"
    assert [box.currentText() for box in choices] == before


def test_esc_closes_a_card_between_runs_and_is_stop_in_one(lab) -> None:
    window, session = lab.window, lab.session
    window.actions_.show_help()
    card = window.findChild(Help)
    QTest.keyClick(card.close_button, Qt.Key.Key_Escape)
    assert not card.isVisible() and session.state is WindowState.READY
    lab.run()
    window.actions_.show_help()
    QTest.keyClick(card.close_button, Qt.Key.Key_Escape)
    assert session.state is WindowState.ABORTING
    card.hide()
