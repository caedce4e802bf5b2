"""Python's collector beside Qt."""

import gc
import threading
import weakref

from gui.garbage import collected_here


class Left:
    """Refers to itself, so that only the collector ends it; tells in which thread."""

    ended_in: list[threading.Thread]

    def __init__(self, ended_in: list[threading.Thread]) -> None:
        self.own, self.ended_in = self, ended_in

    def __del__(self) -> None:
        self.ended_in.append(threading.current_thread())


def objects() -> list[list[int]]:
    """Far more objects than Python's collector waits for."""
    return [[number] for number in range(10_000)]


def test_circles_end_in_the_windows_thread_alone(app):
    """Ended by whatever thread came first, Qt's objects crashed the program."""
    ended: list[threading.Thread] = []
    kept = Left(ended)
    there = weakref.ref(kept)
    automatic = gc.isenabled()
    gc.enable()
    try:
        with collected_here(every=1):
            for _ in range(3):
                Left(ended)
            beside = threading.Thread(target=objects)
            beside.start()
            beside.join()
            assert ended == [] and not gc.isenabled()
            grown = objects()
            while len(ended) < 3:
                app.processEvents()
            assert grown
        assert gc.isenabled() and there() is kept
    finally:
        gc.enable() if automatic else gc.disable()
    assert set(ended) == {threading.current_thread()}
