"""The window as a whole: keys, themes, sizes, names, frames."""

import gc
import math
import sys
import time
from collections.abc import Callable
from itertools import product

import pytest
from PySide6.QtCore import QEvent, QPoint, QPointF, QSize, Qt
from PySide6.QtGui import QWheelEvent
from PySide6.QtTest import QTest
from PySide6.QtWidgets import (
    QApplication,
    QComboBox,
    QLineEdit,
    QPushButton,
    QToolButton,
)

from gui.lanes.live import LiveSource
from gui.parts import IconButton
from gui.within_reach import FRAME, fit
from tactile_lab.engine.jobs import follow_run


def test_letters_are_shortcuts_only_outside_text_fields(lab) -> None:
    window = lab.window
    before = window.centre.tools.zoom.isChecked()
    window.centre.log.note.setFocus()
    QTest.keyClicks(window.centre.log.note, "zzz")
    assert window.centre.tools.zoom.isChecked() is before
    assert window.centre.log.note.text() == "zzz"
    window.centre.log.note.clear()
    window.centralWidget().setFocus()
    QTest.keyClick(window, Qt.Key.Key_Z)
    assert window.centre.tools.zoom.isChecked() is not before
    QTest.keyClick(window, Qt.Key.Key_Z)


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


def test_every_control_has_an_accessible_name(lab) -> None:
    for kind in (QPushButton, QToolButton, QLineEdit):
        for widget in lab.window.findChildren(kind):
            if widget.isVisibleTo(lab.window) and widget.objectName() != "qt_edit":
                named = widget.accessibleName() or widget.text() or widget.toolTip()
                assert named, widget


ALIKE = {"help": "about what it stands in", "star": "keeps a preset, or a run"}
"""Icons whose act depends on their place."""


def test_an_icon_stands_for_one_act(lab) -> None:
    """Reading runs anew looked like the reset of the form, a scene like a folder."""
    acts: dict[str, set[str]] = {}
    for button in lab.window.findChildren(IconButton):
        acts.setdefault(button._icon, set()).add(button.accessibleName())
    several = {icon: acts[icon] for icon in acts.keys() - ALIKE if len(acts[icon]) > 1}
    assert all(all(a.startswith("Zoom to") for a in s) for s in several.values())


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


@pytest.mark.parametrize(
    "screen",
    [(853, 480), (960, 540), (1024, 576), (1280, 720), (1366, 768), (1720, 1080)],
    ids=str,
)
def test_fits_its_screen_and_elides_no_button(lab, screen: tuple[int, int]) -> None:
    """The window counts px of its own.

    The first is 1280 x 720 at 150 %, then 1920 x 1080 at 200 % and 1280 x 720 at 125 %;
    the last is 3440 x 2160 at 200 %, too.
    """
    window, room = lab.window, QSize(*screen)
    fit(window, room)
    assert window.size() == room - FRAME, "as large as there is room for it"
    try:
        lab.until(lambda: not too_small(window), 30.0)
    finally:
        assert not too_small(window)
        stop = window.header.stop
        assert stop.width() == 228
        corner = stop.mapTo(window, stop.rect().bottomRight())
        assert window.rect().contains(corner) and stop.isVisible()
        run = window.setup.run
        assert window.rect().contains(run.mapTo(window, run.rect().bottomRight()))
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


def test_lanes_are_painted_where_something_was_told(lab) -> None:
    """One frame in five or six of a run has nothing new: it was painted as well."""
    window, session = lab.window, lab.session
    session.source = LiveSource(None, 0.2)
    window.centre.stack.show_source(session.source)
    painted: list[int] = []
    noted = window.centre.stack.scene.drawn.connect(lambda: painted.append(1))

    def at_rest() -> bool:
        painted.clear()
        for _ in range(5):
            window.frames.tick()
            lab.app.processEvents()
        return not painted

    lab.until(at_rest, 20)
    session.link.ask(lambda reply: None, follow_run, lab.folder)  # of no lab: nothing
    lab.until(lambda: painted)
    window.centre.stack.scene.drawn.disconnect(noted)
    session.source = None


def test_lanes_numbers_and_what_a_step_lays_out_take_turns(lab) -> None:
    """All in one frame, the longest was twice the usual one, and STOP waited for it."""
    window, session, frames = lab.window, lab.session, lab.window.frames
    session.source = source = LiveSource(None, 0.2)
    window.centre.stack.show_source(source)
    drawn, told = list[int](), list[int]()
    links = [
        window.centre.stack.scene.drawn.connect(lambda: drawn.append(len(drawn))),
        frames.told.connect(lambda _: told.append(len(told))),
    ]

    def lay_out(_: object) -> None:
        end = time.thread_time() + 0.05
        while time.thread_time() < end:
            pass

    def nothing(_: object) -> None:
        """Something that asks for little."""

    def painted(tell: Callable[[object], None]) -> bool:
        drawn.clear()
        frames._drawn = math.inf  # however long this computer has stood still
        session.link._inbox.put((tell, None))
        frames.tick()
        QApplication.sendPostedEvents(None, QEvent.Type.UpdateRequest)
        return bool(drawn)

    frames.stop()  # they come from here alone
    try:
        lab.until(lambda: painted(nothing))
        assert not painted(lay_out), "lanes and results in one frame"
        lab.until(lambda: painted(nothing))
        told.clear()
        frames._numbers = -math.inf
        frames.tick()
        assert not told, "numbers in the frame of the lanes"
        lab.until(lambda: told)
    finally:
        frames._timer.start(33)
        window.centre.stack.scene.drawn.disconnect(links[0])
        frames.told.disconnect(links[1])
        session.source = None


def test_frames_leave_the_processor_to_the_run(lab) -> None:
    """Only the poll was counted, not the painting, and by a clock that others slow."""
    frames, scene = lab.window.frames, lab.window.centre.stack.scene

    def paint_long() -> None:
        end = time.thread_time() + 0.06
        while time.thread_time() < end:
            pass

    noted = scene.drawn.connect(paint_long)

    def costly() -> bool:
        scene.refresh()
        return frames.interval == 100

    lab.until(costly)
    scene.drawn.disconnect(noted)
    lab.until(lambda: frames.interval < 60)


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
    wheeled = Qt.FocusPolicy.WheelFocus
    assert all(box.focusPolicy() != wheeled for box in choices), "nor the keyboard"
