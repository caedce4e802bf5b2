"""A screen that goes takes no window, and no STOP, along."""

from types import SimpleNamespace

import pytest
from PySide6.QtCore import QRect, Qt
from PySide6.QtWidgets import QWidget

from gui.within_reach import bring_back, framed

MAIN, SECOND = QRect(0, 0, 1366, 728), QRect(1366, 0, 1920, 1080)


@pytest.fixture
def window(app):
    made = QWidget(None, Qt.WindowType.FramelessWindowHint)
    made.setMinimumSize(400, 300)
    made.show()
    yield made
    made.close()


@pytest.mark.parametrize(
    ("place", "rooms", "then"),
    [
        (QRect(1500, 100, 800, 600), [MAIN], QRect(566, 100, 800, 600)),
        (QRect(1400, 50, 1800, 1000), [MAIN], MAIN),
        (QRect(0, 0, 1920, 1080), [MAIN], MAIN),
        (QRect(-900, -300, 800, 600), [MAIN], QRect(0, 0, 800, 600)),
        (QRect(900, 60, 1000, 600), [MAIN, SECOND], QRect(900, 60, 1000, 600)),
        (QRect(-10, -10, 800, 600), [MAIN], QRect(-10, -10, 800, 600)),
        (QRect(50, 50, 900, 700), [QRect(0, 0, 300, 200)], QRect(0, 0, 400, 300)),
    ],
    ids=[
        "its screen went", "and was larger", "its screen became smaller", "far off",
        "across two screens", "its shadow lies outside", "smaller than it can be",
    ],
)  # fmt: skip
def test_a_window_comes_back(window, place: QRect, rooms, then: QRect) -> None:
    window.setGeometry(place)
    bring_back(window, rooms)
    assert window.geometry() == then


def test_a_window_that_fills_a_screen_has_its_title_bar_on_it() -> None:
    inner = QRect(50, 60, 700, 500)
    other = SimpleNamespace(
        geometry=lambda: inner, frameGeometry=lambda: inner.adjusted(-1, -20, 2, 5)
    )
    assert framed(SECOND, other) == QRect(1367, 20, 1917, 1055)


def test_the_windows_of_the_program_are_watched(lab) -> None:
    window, screen = lab.window, lab.app.primaryScreen()
    try:
        window.move(5000, 3000)
        lab.app.screenRemoved.emit(screen)
        stop = window.header.stop
        room = screen.availableGeometry()
        lab.until(lambda: room.contains(stop.mapToGlobal(stop.rect().center())))
    finally:
        window.move(0, 0)
        window.resize(1720, 1080)
