"""The log: whole rows, the newest in sight, long messages readable in full."""

from datetime import datetime

import pytest
from PySide6.QtCore import Qt
from PySide6.QtGui import QGuiApplication
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from gui.look.theme import Theme
from gui.record.log import LogView
from gui.record.log_table import MESSAGE, ROW
from gui.session.log import LogLine, Severity

LONG = "The coil source does not answer within 0.3 s. " * 9


def filled(app: QApplication, height: int, count: int = 40) -> LogView:
    log = LogView(Theme("light"))
    log.resize(800, height)
    for number in range(count):
        level = Severity.ERROR if number == 30 else Severity.INFO
        text = LONG if number == 30 else f"Step {number} started"
        log.add(LogLine(datetime.now(), level, "runner", text))
    log.show()
    app.processEvents()
    return log


def shown(log: LogView) -> list[int]:
    """Rows that are seen, whole or in part."""
    table = log.table
    low = table.viewport().height()
    rows = range(table.model().rowCount())
    tops = {row: table.rowViewportPosition(row) for row in rows}
    return [row for row, top in tops.items() if -table.rowHeight(row) < top < low]


@pytest.mark.parametrize("height", [110, 123, 137, 160, 240])
def test_only_whole_rows_are_shown_and_the_newest_last(
    app: QApplication, height: int
) -> None:
    log = filled(app, height)
    table = log.table
    assert table.viewport().height() % ROW == 0
    assert shown(log)[-1] == 39
    for row in shown(log):
        top = table.rowViewportPosition(row)
        assert 0 <= top <= table.viewport().height() - ROW
    log.add(LogLine(datetime.now(), Severity.INFO, "runner", "one more"))
    app.processEvents()
    assert shown(log)[-1] == 40
    log.resize(800, height + 31)
    app.processEvents()
    assert shown(log)[-1] == 40 and table.viewport().height() % ROW == 0
    log.close()


def test_who_looks_further_up_is_left_there(app: QApplication) -> None:
    log = filled(app, 200)
    log.table.scrollToTop()
    log.add(LogLine(datetime.now(), Severity.INFO, "runner", "one more"))
    app.processEvents()
    assert shown(log)[0] == 0
    log.close()


def test_long_message_opens_with_the_keyboard_and_is_copied(app: QApplication) -> None:
    log = filled(app, 260)
    table = log.table
    table.setFocus()
    table.setCurrentIndex(table.model().index(31, MESSAGE))
    assert table.rowHeight(31) == ROW
    QTest.keyClick(table, Qt.Key.Key_Up)
    app.processEvents()
    assert table.rowHeight(30) >= 3 * ROW and table.rowHeight(30) % ROW == 0
    top = table.rowViewportPosition(30)
    assert 0 <= top <= table.viewport().height() - table.rowHeight(30)
    QTest.keyClick(table, Qt.Key.Key_C, Qt.KeyboardModifier.ControlModifier)
    assert QGuiApplication.clipboard().text().endswith(LONG)
    QTest.keyClick(table, Qt.Key.Key_Down)
    assert table.rowHeight(30) == ROW
    log.close()
