"""A click on a step goes there: in the bar, in the table, in the log."""

import shutil

from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest

from gui.lanes.live import LiveSource
from gui.session.steps import of_run
from gui.state import WindowState
from sim_backend.bench import open_bench
from sim_backend.serial_line.faults import SerialFault
from tactile_lab.engine import execution

LEFT = Qt.MouseButton.LeftButton


def opened(lab):
    (folder,) = lab.runs(1)
    window = lab.window
    window.screen_.open_run(folder)
    lab.until(lambda: window.session.opened == (folder.name,))
    window.centre.view.show_all()
    return window, [one for one in window.screen_.run.holds if not one.pause]


def shows(view, step) -> bool:
    length = step.end - step.start
    inside = view.start <= step.start and step.end <= view.end
    return inside and view.width < 1.2 * length


def test_a_click_in_the_bar_shows_that_step(lab) -> None:
    window, steps = opened(lab)
    blocks, view = window.centre.progress.blocks, window.centre.view
    middle = (steps[1].start + steps[1].end) / 2
    at = QPoint(round(middle / window.screen_.run.length * blocks.width()), 6)
    QTest.mouseClick(blocks, LEFT, Qt.KeyboardModifier.NoModifier, at)
    assert shows(view, steps[1])


def test_a_row_of_the_table_shows_that_step_by_mouse_and_by_key(lab) -> None:
    window, steps = opened(lab)
    window.actions_._tab(0)
    results, view = window.review.results, window.centre.view
    lab.until(lambda: results.table.rowCount() == len(steps))
    at = results.table.visualItemRect(results.table.item(1, 0)).center()
    QTest.mouseClick(results.table.viewport(), LEFT, Qt.KeyboardModifier.NoModifier, at)
    assert shows(view, steps[1])
    results.table.setCurrentCell(0, 0)
    QTest.keyClick(results.table, Qt.Key.Key_Return)
    assert shows(view, steps[0])
    results.copy_table()
    copied = QGuiApplication.clipboard().text().split("\n")
    assert len(copied) == 1 + len(steps)
    assert copied[1].split("\t")[0] == "80 mN"


def test_a_line_of_the_log_on_a_step_shows_it(lab) -> None:
    folder = lab.complete_run()
    window, log = lab.window, lab.window.centre.log
    lab.until(lambda: getattr(window.screen_.run, "path", None) == folder)
    steps = [one for one in window.screen_.run.holds if not one.pause]
    view = window.centre.view
    view.show_all()
    rows = [
        row
        for row, line in enumerate(log.model.lines)
        if line.source == "runner" and "120 mN started" in line.text
    ]
    line = log.filter.mapFromSource(log.model.index(rows[-1], 3))
    log.table.activated.emit(line)
    assert shows(view, steps[1])
    other = shutil.copytree(folder, folder.with_name("another"))
    window.screen_.open_run(other)
    lab.until(lambda: getattr(window.screen_.run, "path", None) == other)
    view.show_all()
    seen = view.start, view.end
    log.table.activated.emit(line)
    assert (view.start, view.end) == seen, "the step of another run"
    assert folder.name in window.centre.notice.text()
    live = LiveSource(None, 1.0, other)
    window.centre.stack.show_source(live)
    log.table.activated.emit(line)
    assert (view.start, view.end) == seen, "a time of the run in progress"
    live.folder = folder
    live.begin_trial(1, steps[1])
    log.table.activated.emit(line)
    assert shows(view, steps[1]), "that of the run in progress itself"


def test_a_run_that_ended_tells_the_times_of_its_record(lab) -> None:
    """Live ones are by another clock: 290 ms stood where the report told 296 ms."""
    folder, screen = lab.complete_run(), lab.window.screen_
    lab.until(lambda: getattr(screen.run, "path", None) == folder)
    told = [step.response.latency for step in screen.results.steps]
    assert told == [step.response.latency for step in of_run(screen.run)]


def test_a_step_that_stop_cut_short_has_its_results(lab) -> None:
    lab.run()
    window, session = lab.window, lab.session
    lab.until(lambda: session.source.reach > 2.0)
    session.stop("enough")
    lab.until(lambda: session.state is WindowState.READY)
    folder = session.run.folder
    lab.until(lambda: getattr(window.screen_.run, "path", None) == folder)
    table = window.review.results.table
    assert table.rowCount() == 1
    assert table.item(0, 0).text() == "120 mN, cut short"
    seen = window.screen_.run.spikes.size
    assert table.item(0, 1).text() == f"{seen}†", "at 20 kS/s most are missed"
    assert "partial" in window.review.results.mark.text()


def test_a_step_whose_set_points_came_too_late_says_so(lab, monkeypatch) -> None:
    """The run was complete, and only the log told that a step was not as asked."""

    def late(scene, needed, *, realtime):
        fault = SerialFault(kind="late", amount=0.25, line=r"^CURR 0\.[1-9]")
        return open_bench(scene, needed, coil_faults=[fault])

    monkeypatch.setattr(execution, "open_bench", late)
    folder = lab.complete_run()
    lab.complete.remove(folder)  # as others are wanted
    screen, table = lab.window.screen_, lab.window.review.results.table
    live = [step.name for step in screen.results.steps]
    lab.until(lambda: getattr(screen.run, "path", None) == folder)
    assert [step.name for step in screen.results.steps] == live
    assert "set-point" in live[0] and "skipped" in live[0] and live[1] == "120 mN"
    assert table.item(0, 0).text() == live[0] == table.item(0, 0).toolTip()
