"""What was opened and is gone is freed at once, and by reference counts alone.

What only Python's collector frees ends late, and without `gui.garbage` in any thread.
"""

import gc
import weakref
from collections import Counter
from collections.abc import Callable

import shiboken6
from PySide6.QtCore import QEvent, QObject
from PySide6.QtWidgets import QApplication
from whatever_is_open import openers, shut

from gui.look.theme import Theme
from gui.session.queue import Queued
from gui.setup.queue import QueueView
from tactile_lab.engine.request import Request

REQUEST = Request("demo", (), "sim")


def settle(app: QApplication) -> None:
    """Let what was put off be done, the end of closed widgets above all."""
    for _ in range(3):
        app.processEvents()
        app.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def parts_of(window: QObject) -> Counter[str]:
    """Classes of all that belongs to a window, and of what stands beside it."""
    there = [*window.findChildren(QObject), *QApplication.topLevelWidgets()]
    return Counter(type(one).__name__ for one in there)


def in_circles(act: Callable[[], object]) -> Counter[str]:
    """Classes of Qt's objects that `act` leaves to the collector."""
    gc.collect()
    gc.freeze()  # what was there before is not looked through
    act()
    gc.set_debug(gc.DEBUG_SAVEALL)
    gc.collect()
    gc.set_debug(0)
    # not isinstance: of a weak proxy, as a compiler leaves them, that asks what is gone
    found = [one for one in gc.garbage if issubclass(type(one), shiboken6.Object)]
    gc.garbage.clear()
    return Counter(type(one).__name__ for one in found)


def test_all_that_can_be_opened_is_gone_once_it_is_shut(
    lab, tmp_path, monkeypatch
) -> None:
    """But for a card, which is made once; of menus, one more was kept each time."""
    monkeypatch.setattr(type(lab.session), "busy", True)  # else closing would close
    known = openers(lab, tmp_path)

    def open_all() -> None:
        for file, opens in known.items():
            for number, opened in enumerate(opens):
                before = parts_of(lab.window)
                opened()
                settle(lab.app)
                shut(lab.window)
                settle(lab.app)
                stay = parts_of(lab.window) - before
                assert first or not stay, f"{file}, {number}: {stay}"

    first = True
    open_all()
    first = False
    assert not in_circles(open_all)


def test_a_run_that_is_shut_leaves_nothing_to_the_collector(lab) -> None:
    (folder,), screen = lab.runs(1), lab.window.screen_

    def show() -> None:
        screen.open_run(folder)
        lab.until(lambda: screen.run is not None)
        for tab in (1, 2, 3, 0):
            lab.window.review.show_tab(tab)
            settle(lab.app)
        screen.close_run()
        settle(lab.app)

    def show_twice() -> None:  # lanes of the one before go when they are built anew
        show()
        show()

    show()
    assert not in_circles(show_twice)


def test_a_run_that_waited_leaves_nothing_to_the_collector(app) -> None:
    """Its plan stayed with it, half a MB each, until the collector came by."""
    view = QueueView(Theme("light"))

    def wait() -> None:
        view.show_queue([Queued("one", REQUEST), Queued("two", REQUEST)], held=False)
        view.show_queue([], held=False)
        settle(app)

    wait()
    assert not in_circles(wait)


def test_what_runs_leave_in_circles_is_collected_once_one_has_ended(lab) -> None:
    """It stayed for two minutes or more: 50 MB of far ends in ten minutes of runs."""

    class Circle:
        def __init__(self) -> None:
            self.own = self

    left = weakref.ref(circle := Circle())
    gc.collect()  # it is old now
    del circle
    lab.run()
    lab.session.stop()
    lab.until(lambda: left() is None)


def test_another_protocol_in_the_form_leaves_nothing_to_the_collector(lab) -> None:
    def choose() -> None:
        for scene in ("sine_sweep", str(lab.folder / "short.toml")):
            lab.window.screen_.open_scene(scene)
            settle(lab.app)

    choose()
    assert not in_circles(choose)
